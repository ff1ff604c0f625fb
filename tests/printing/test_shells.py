"""Walls thinner than the samples of a check, and gaps between such: what is in one piece is said to be so,
and what is loose to be loose.
"""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.checks.problems import Limits
from fracslice.checks.solid_checks import SolidReport, check_object
from fracslice.formulas import Node, box, difference, julia, shell, sphere, transform, union
from fracslice.printing.thin_features import resolve_connectivity, sampled_object
from fracslice.printing.walls import components_of
from fracslice.volume import plan
from fracslice.work import Work

pytestmark = pytest.mark.once

SIZE = 20.0
VOXEL = 2.1 / 96
"""Of objects two units large, about, in their units."""


def checked(root: Node) -> SolidReport:
    """A check as coarse as may be."""
    planned = plan(root, 96)
    scale = SIZE / max(planned.box.size)
    limit = 4 * max(planned.outer.size) * scale / 96
    return check_object(planned.root, planned.outer, scale, Limits(wall=limit, floor=limit))


def volumes(root: Node) -> tuple[list[float], list[float]]:
    """Bodies and cavities of at least 27 samples on what resolves their connectivity, mm3."""
    planned = plan(root, 96)
    longest = max(planned.outer.size)
    coarse = sampled_object(planned.root, planned.outer, longest, 96, Work())
    loose = len(components_of(coarse).bodies) > 1
    scale = SIZE / max(planned.box.size)
    found = components_of(resolve_connectivity(planned.root, coarse, scale**-2, loose, Work()))
    sample = (found.solid.voxel * scale) ** 3
    bodies, cavities = (found.count[which] * sample for which in (found.bodies, found.cavities))
    speck = 27 * (coarse.voxel * scale) ** 3
    return bodies[bodies >= speck].tolist(), cavities[cavities >= speck].tolist()


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


def tilted(node: Node) -> Node:
    return transform(node, rotate=(1, 0.3, 0.2, 31))


def plate(voxels: float, z: float = 0.0) -> Node:
    return at(box(size=(2, 2, voxels * VOXEL)), 0, 0, z * VOXEL)


@pytest.mark.parametrize("voxels", [0.3, 0.5, 1.0])
def test_a_closed_shell_is_one_body_around_a_cavity(voxels: float) -> None:
    bodies, cavities = volumes(shell(sphere(), thickness=voxels * VOXEL))
    whole, hollow = (4 / 3 * np.pi * (r * SIZE / 2) ** 3 for r in (1, 1 - voxels * VOXEL))
    assert bodies == [pytest.approx(whole - hollow, rel=0.05)]
    assert cavities == [pytest.approx(hollow, rel=0.01)]


@pytest.mark.parametrize("voxels", [0.3, 1.0])
def test_an_open_shell_is_one_body_without(voxels: float) -> None:
    root = difference(shell(sphere(), thickness=voxels * VOXEL), at(box(size=(1, 1, 1)), 0, 0, 1.2))
    bodies, cavities = volumes(root)
    assert (len(bodies), cavities) == (1, [])


def test_the_edges_of_a_box_hold_its_sides() -> None:
    thin = shell(box(size=(1.6, 1.4, 1.2)), thickness=0.4 * VOXEL)
    bodies, cavities = volumes(transform(thin, rotate=(1, 2, 3, 37)))
    assert (len(bodies), len(cavities)) == (1, 1)


@pytest.mark.parametrize("voxels", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("way", [tilted, lambda node: node], ids=["tilted", "level"])
def test_a_plate_is_one_body(voxels: float, way: object) -> None:
    root: Node = way(plate(voxels, 0.2))  # type: ignore[operator]
    bodies, cavities = volumes(root)
    assert (len(bodies), cavities) == (1, [])
    report = checked(root)
    assert report.walls and report.thin_walls > 0


@pytest.mark.parametrize(
    ("voxels", "gap"), [(0.3, 0.4), (0.5, 0.5), (0.5, 1.0), (0.5, 2.5), (2, 0.4), (2.6, 0.4), (4, 0.4)]
)
def test_loose_plates_stay_loose_and_their_gap_is_measured(voxels: float, gap: float) -> None:
    z = (voxels + gap) / 2
    planned = plan(tilted(union(plate(voxels, z), plate(voxels, -z))), 96)
    root: Node = planned.root  # type: ignore[assignment]
    (larger, smaller), cavities = volumes(root)
    assert smaller == pytest.approx(larger, rel=0.02) and not cavities
    report, scale = checked(root), SIZE / max(planned.box.size)
    assert report.gaps and report.gaps.median == pytest.approx(gap * VOXEL * scale, rel=0.02)
    assert sum(report.gaps.counts) == pytest.approx(2 * 4 * scale**2, rel=0.15)


def test_every_gap_of_a_stack_is_measured_once() -> None:
    stack = tilted(union(*(plate(0.5, z) for z in (-1.2, 0.0, 1.2))))
    report = checked(stack)
    one = checked(tilted(union(*(plate(0.5, z) for z in (0.0, 1.2)))))
    assert len(volumes(stack)[0]) == 3 and report.gaps and one.gaps
    assert sum(report.gaps.counts) == pytest.approx(2 * sum(one.gaps.counts), rel=0.1)


def test_a_fin_thinner_than_the_samples_is_no_loose_body() -> None:
    fin = at(box(size=(1.4, 0.4 * VOXEL, 1.5)), 0, 0.003, 0.75)
    bodies, cavities = volumes(union(box(size=(2, 2, 0.5)), fin))
    assert (len(bodies), cavities) == (1, [])


def test_a_fractals_thin_shell_is_looked_at_again() -> None:
    assert len(volumes(shell(julia(iterations=6), thickness=0.01))[0]) == 1
