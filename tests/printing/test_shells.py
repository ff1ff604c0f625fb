"""Walls thinner than the samples of a check, and gaps between such: what is in one piece is said to be so,
and what is loose to be loose.
"""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.checks.problems import Limits
from fracslice.checks.solid_checks import SolidReport, check_object
from fracslice.formulas import Node, box, difference, julia, shell, sphere, transform, union
from fracslice.volume import plan

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


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


def tilted(node: Node) -> Node:
    return transform(node, rotate=(1, 0.3, 0.2, 31))


def plate(voxels: float, z: float = 0.0) -> Node:
    return at(box(size=(2, 2, voxels * VOXEL)), 0, 0, z * VOXEL)


@pytest.mark.parametrize("voxels", [0.3, 0.5, 1.0])
def test_a_closed_shell_is_one_body_around_a_cavity(voxels: float) -> None:
    report, thick = checked(shell(sphere(), thickness=voxels * VOXEL)), voxels * VOXEL
    whole, hollow = (4 / 3 * np.pi * (r * SIZE / 2) ** 3 for r in (1, 1 - thick))
    assert report.bodies == [pytest.approx(whole - hollow, rel=0.05)]
    assert report.cavities == [pytest.approx(hollow, rel=0.01)]


@pytest.mark.parametrize("voxels", [0.3, 1.0])
def test_an_open_shell_is_one_body_without(voxels: float) -> None:
    report = checked(
        difference(shell(sphere(), thickness=voxels * VOXEL), at(box(size=(1, 1, 1)), 0, 0, 1.2))
    )
    assert (len(report.bodies), report.cavities) == (1, [])


def test_the_edges_of_a_box_hold_its_sides() -> None:
    thin = shell(box(size=(1.6, 1.4, 1.2)), thickness=0.4 * VOXEL)
    report = checked(transform(thin, rotate=(1, 2, 3, 37)))
    assert (len(report.bodies), len(report.cavities)) == (1, 1)


@pytest.mark.parametrize("voxels", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("way", [tilted, lambda node: node], ids=["tilted", "level"])
def test_a_plate_is_one_body(voxels: float, way: object) -> None:
    report = checked(way(plate(voxels, 0.2)))  # type: ignore[operator]
    assert (len(report.bodies), report.cavities) == (1, [])
    assert report.walls and report.thin_walls > 0


@pytest.mark.parametrize(
    ("voxels", "gap"), [(0.3, 0.4), (0.5, 0.5), (0.5, 1.0), (0.5, 2.5), (2, 0.4), (2.6, 0.4), (4, 0.4)]
)
def test_loose_plates_stay_loose_and_their_gap_is_measured(voxels: float, gap: float) -> None:
    z = (voxels + gap) / 2
    planned = plan(tilted(union(plate(voxels, z), plate(voxels, -z))), 96)
    report = checked(planned.root)  # type: ignore[arg-type]
    scale = SIZE / max(planned.box.size)
    assert len(report.bodies) == 2 and not report.cavities
    assert report.bodies[1] == pytest.approx(report.bodies[0], rel=0.02)
    assert report.gaps and report.gaps.median == pytest.approx(gap * VOXEL * scale, rel=0.02)
    assert sum(report.gaps.counts) == pytest.approx(2 * 4 * scale**2, rel=0.15)


def test_every_gap_of_a_stack_is_measured_once() -> None:
    report = checked(tilted(union(*(plate(0.5, z) for z in (-1.2, 0.0, 1.2)))))
    one = checked(tilted(union(*(plate(0.5, z) for z in (0.0, 1.2)))))
    assert len(report.bodies) == 3 and report.gaps and one.gaps
    assert sum(report.gaps.counts) == pytest.approx(2 * sum(one.gaps.counts), rel=0.1)


def test_a_fin_thinner_than_the_samples_is_no_loose_body() -> None:
    fin = at(box(size=(1.4, 0.4 * VOXEL, 1.5)), 0, 0.003, 0.75)
    report = checked(union(box(size=(2, 2, 0.5)), fin))
    assert (len(report.bodies), report.cavities) == (1, [])


def test_a_fractals_thin_shell_is_looked_at_again() -> None:
    assert len(checked(shell(julia(iterations=6), thickness=0.01)).bodies) == 1
