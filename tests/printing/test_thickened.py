"""What thickening makes of its surroundings: nothing loose, nothing sealed, and as thick as asked."""

from __future__ import annotations

import re
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fracslice.formulas import Node, box, cylinder, difference, julia, shell, sphere, transform, union
from fracslice.printing import preparation, printable
from fracslice.printing.bridging import contacts
from fracslice.printing.walls import Samples, SolidComponents, components_of, together, walls
from fracslice.scene import Print
from fracslice.volume import Plan, plan, sample_scene
from fracslice.volume.amount import Sizing
from fracslice.work import Work

pytestmark = pytest.mark.once

SIZE = 20.0


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


def made(root: Node, **printing: float | str) -> Plan:
    """Of 20 mm, on 0.2 mm samples."""
    return printable(plan(root, 100), Sizing(SIZE), Print(**printing))[0]  # type: ignore[arg-type]


def connected(planned: Plan) -> SolidComponents:
    return components_of(sample_scene(planned))


CHAMBER = box(size=(0.5, 0.5, 0.5))
PORE = cylinder(radius=0.04, height=0.3)
POROUS = difference(
    box(size=(2, 2, 2)), at(CHAMBER, 0, 0, 0.7), at(PORE, 0, 0, 1), at(sphere(radius=0.2), 0, 0, -0.5)
)
"""A chamber below a lid of half a millimetre with a pore in it, and a cavity that is closed."""


def test_pores_that_thickening_seals_are_filled() -> None:
    """And only they: what nothing reached before stays as it is."""
    assert len(connected(plan(POROUS, 100)).cavities) == 1
    after = connected(made(POROUS, thickness=1.5))
    assert len(after.cavities) == 1
    assert after.count[after.cavities[0]] == pytest.approx(4 / 3 * np.pi * 10**3, rel=0.05)


def test_crumbs_that_thickening_shows_are_joined() -> None:
    """Of 0.1 mm, smaller than the samples that tell what is loose; one in the air, one on the way to it."""
    crumbs = union(
        box(size=(2, 2, 2)), at(sphere(radius=0.005), 0, 0, 1.2), at(sphere(radius=0.005), 1.3, 0, 0)
    )
    after = connected(made(crumbs, thickness=1.5, bridge=1.0))
    assert len(after.bodies) == 1


def test_a_strut_is_no_thinner_than_the_least_thickness() -> None:
    planned = made(union(box(size=(2, 2, 2)), at(sphere(radius=0.3), 0, 0, 1.8)), thickness=1.6, bridge=0.8)
    across = np.linspace(-1, 1, 2001) * 0.3
    result = sample_points(planned, across, 0 * across, 1.25 + 0 * across) < 0
    assert result.sum() * 0.3e-3 * SIZE / 3.1 == pytest.approx(1.6, abs=0.1)


def sample_points(planned: Plan, *points: np.ndarray) -> np.ndarray:
    return np.asarray(planned.root.kernel(precision="float64").points(*points))


@pytest.mark.parametrize(
    ("root", "thickness", "across"),
    [
        (box(size=(2, 1.4, 0.06)), 1.2, (0.9, 0.6, 0)),
        (transform(box(size=(2, 1.4, 0.06)), rotate=(1, 2, 0.5, 37)), 1.2, (0.9, 0.6, 0)),
        (cylinder(radius=0.015, height=2), 1.0, (0, 0, 0.9)),
    ],
    ids=["plate", "turned plate", "rod"],
)
def test_the_thickness_is_the_least_one(
    root: Node, thickness: float, across: tuple[float, float, float]
) -> None:
    """Along rays through the middle. A plate of 1.2 mm was 1.165 mm thick in places, a rod of 1 mm 0.873."""
    planned, scale = printable(plan(root, 100), Sizing(SIZE), Print(thickness=thickness))
    assert planned.notes == ()
    axis, angle = root.values.get("rotate", (1, 0, 0, 0))[:3], root.values.get("rotate", (0, 0, 0, 0))[3]
    turn = Rotation.from_rotvec(np.radians(angle) * np.array(axis) / np.linalg.norm(axis))
    middle = turn.apply(np.random.default_rng(0).uniform(-1, 1, (200, 3)) * across)
    ray = turn.apply([0, 0, 1] if across[0] else [1, 0, 0])
    along = np.linspace(0, thickness / scale, 1001)
    for way in (ray, -ray):
        points = middle[:, :, None] + way[:, None] * along
        inside = sample_points(planned, *points.transpose(1, 0, 2).reshape(3, -1)).reshape(200, -1) < 0
        assert inside.all(0).sum() * scale * along[1] > 0.99 * thickness / 2


RODS = union(*(at(cylinder(radius=0.015, height=2), x, 0, 0) for x in (-0.049, 0.049)))
"""Two rods that overlap by less than a tenth once they are 1 mm thick: by a neck of 0.4 mm."""


def test_necks_between_thickened_walls_are_thickened() -> None:
    planned = made(RODS, thickness=1.0)
    along = np.linspace(-0.1, 0.1, 1001)
    for z in np.linspace(-0.9, 0.9, 19).tolist():
        inside = sample_points(planned, 0 * along, along, np.full(1001, z)) < 0
        assert inside.sum() * SIZE * 1e-4 > 0.99
    assert planned.notes == ()


def test_what_stays_thinner_than_the_thickness_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """With its place in the object as it stands, after its base was cut off."""
    monkeypatch.setattr(preparation, "ROUNDS", 0)
    (note,) = made(RODS, thickness=1.0, base=15.0).notes
    count, least, x, y, z = re.findall(r"-?[\d.]+", note.replace("of 1 mm", ""))
    assert "thinner than the thickness of 1 mm" in note
    assert int(count) == 1
    assert 0.3 < float(least) < 0.99
    assert (float(x), float(y)) == pytest.approx((0, 0), abs=0.5)
    assert 0 < float(z) < 6


def test_every_contact_is_thickened() -> None:
    """Four balls touch in six points, of which three join them."""
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / 8**0.5
    root = union(*(at(sphere(radius=1), *(2 * corner).tolist()) for corner in corners))
    components = components_of(sample_scene(plan(root, 48)))
    middle = np.mean(contacts(components, components.bodies, root.kernel(), Work()), axis=0)
    expected = np.array([a + b for a, b in combinations(corners, 2)])
    away = np.linalg.norm(expected[:, None] - middle, axis=2).min(1)
    assert away.max() < 2 * components.solid.voxel


def test_pores_that_only_a_coarse_mesh_seals_are_filled() -> None:
    """A chamber whose pore is wide enough for the samples of thickening, not for those of the mesh."""
    planned = plan(POROUS, 24)
    thick = union(planned.root, at(box(size=(0.05, 0.4, 0.4)), 1, 0, 0))
    coarse = plan(thick, 24)
    after, _ = printable(coarse, Sizing(SIZE), Print(thickness=0.6))
    assert len(connected(after).cavities) == 1


def test_thin_walls_of_a_fractal_are_found_by_coarse_samples_as_by_fine_ones() -> None:
    """By swept distances a sixth of them was lost."""
    root, areas = julia(iterations=6), []
    limit = 3 * plan(root, 48).voxel
    for resolution in (96, 192):
        result = walls(Samples(sample_scene(plan(root, resolution))), limit, Work())
        areas.append(result.area.sum())
    assert areas[0] == pytest.approx(areas[1], rel=0.08)


def test_walls_of_a_fractal_become_as_thick_as_asked() -> None:
    root = shell(julia(iterations=6), thickness=0.03)
    after, scale = printable(plan(root, 100), Sizing(SIZE), Print(thickness=1.2))
    result = walls(Samples(sample_scene(after)), 3 / scale, Work())
    order = np.argsort(result.width)
    share = np.cumsum(result.area[order]) / result.area.sum()
    assert result.width[order][np.searchsorted(share, 0.05)] * scale > 1.2 - 0.2


def test_samples_of_a_union_are_those_of_both() -> None:
    small, large = (sample_scene(plan(sphere(radius=r), 2 * r / 0.05)) for r in (0.4, 1.0))
    moved = type(small)(
        tuple(np.array(large.origin) - 8 * large.voxel), large.voxel, small.ijk, small.values, small.index
    )
    both = together(large, moved)
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 2000))
    parts = [Samples(bricks).points(*points) < 0 for bricks in (large, moved)]
    assert (Samples(both).points(*points) < 0).sum() == pytest.approx((parts[0] | parts[1]).sum(), abs=20)
