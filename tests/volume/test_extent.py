"""How large an object is: nothing thicker than a voxel is left out, wherever it stands."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice._native import Sides
from fracslice.errors import Cancelled, SceneError
from fracslice.fields.box import Box
from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import ArrayField
from fracslice.fields.field import Bounds, Device, Kernel, Precision
from fracslice.formulas import (
    Node,
    box,
    capsule,
    cone,
    cylinder,
    difference,
    mandelbulb,
    octahedron,
    offset,
    plane,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.scene import Print, scene
from fracslice.slicing import SliceJob, plan_stack
from fracslice.volume import extent, plan
from fracslice.volume.extent import LITTLE, PROVEN, _kept
from fracslice.work import Work

pytestmark = pytest.mark.once

PLATE = box(size=(60, 40, 2))
VOXELS = 256
VOXEL = 60 / VOXELS


def thing(seed: int) -> Node:
    """A plate and a wall, a rod or a second plate of 1 to 10 voxels, turned and moved at random."""
    rng = np.random.default_rng(seed)
    thick, *sides = VOXEL * rng.uniform(1, 10), *rng.uniform(5, 40, 2).tolist()
    shapes = box(size=(thick, *sides)), cylinder(radius=thick / 2, height=sides[0]), box(size=(*sides, thick))
    axis, angle = rng.normal(size=3), rng.choice([0, 90, rng.uniform(0, 180)])
    turn = (*(axis / np.linalg.norm(axis)).tolist(), float(angle))
    return union(PLATE, transform(shapes[seed % 3], rotate=turn, translate=tuple(rng.uniform(-20, 20, 3))))


@pytest.fixture(autouse=True)
def nothing_kept() -> None:
    _kept.clear()


def errors(result: Box, true: Box) -> np.ndarray:
    return np.abs(np.subtract([result.lo, result.hi], [true.lo, true.hi]))


@pytest.mark.parametrize("seed", range(12))
def test_walls_rods_and_plates_at_random_places(seed: int) -> None:
    root = thing(seed)
    result = extent(root)
    longest = max(result.box.size)
    if seed % 3 != 1:  # of boxes, the box that formulas promise is exact, however they are turned
        assert errors(result.box, root.bounds.box).max() < 2e-5 * longest
    assert (np.array(result.outer.lo) <= result.box.lo).all() and (
        np.array(result.outer.hi) >= result.box.hi
    ).all()
    assert errors(result.outer, result.box).max() < 0.5 * longest / VOXELS
    assert (compile_scene(root, "float64").points(*result.tips) < 1e-4).all()


@pytest.mark.parametrize("x", [0.0, 13.0, 29.0])
@pytest.mark.parametrize("thick", [0.2, 0.1, 0.01])
def test_a_wall_on_a_plate_has_its_height(x: float, thick: float) -> None:
    root = union(PLATE, transform(box(size=(thick, 30, 20)), translate=(x, 0, 10)))
    assert errors(extent(root).box, Box((-30, -20, -1), (30, 20, 20))).max() < 1e-4


def test_a_wall_is_sliced_to_its_top() -> None:
    root = union(PLATE, transform(box(size=(0.2, 30, 20)), translate=(0, 0, 10)))
    stack = plan_stack(root, SliceJob(size=60, layer=0.4, pixel=(0.05, 0.05)))
    assert len(stack.z) == 52 and stack.size == pytest.approx((60, 40, 21), rel=1e-6)


def test_what_is_thinner_than_can_be_found_is_within_the_outer_box() -> None:
    root = union(PLATE, transform(box(size=(1e-5, 30, 20)), translate=(0, 0, 10)))
    assert extent(root).outer.hi[2] >= 20


@pytest.mark.parametrize("root", [octahedron(radius=3), cone(radius=2, height=5)], ids=["octahedron", "cone"])
@pytest.mark.parametrize("turn", [0.0, 31.0])
def test_tips_are_found_exactly(root: Node, turn: float) -> None:
    turned = transform(root, rotate=(1, 2, 0.5, turn))
    result, field = extent(turned), compile_scene(turned, "float64")
    assert errors(result.outer, result.box).max() < 1e-3
    assert (np.abs(field.points(*result.tips)) < 2e-5).all()
    if not turn:
        assert errors(result.box, root.bounds.box).max() < 1e-5


def test_an_offset_of_a_fractal_is_found_beyond_the_box_that_is_promised() -> None:
    root = offset(mandelbulb(iterations=4), distance=0.2)
    result, points = extent(root), np.random.default_rng(0).uniform(-2, 2, (3, 200_000))
    inside = points[:, compile_scene(root).points(*points.astype(np.float32)) < 0]
    assert (inside.min(1) >= result.box.lo).all() and (inside.max(1) <= result.box.hi).all()


def test_what_is_much_smaller_than_promised_is_as_exact() -> None:
    """A corner of a large box: the tolerance is the corner's own."""
    root = difference(box(size=(200, 200, 200)), plane(normal=(1, 1, 1), offset=172))
    result = extent(root)
    assert max(result.box.size) < 5
    assert errors(result.outer, result.box).max() < 0.5 * max(result.box.size) / VOXELS


def test_an_object_that_ends_nowhere_says_so() -> None:
    with pytest.raises(SceneError, match="<plane> has no end along x, y and z; put <bounds> around it"):
        extent(union(sphere(), plane()))


@pytest.mark.parametrize("seed", [0, 1, 2, 4])
def test_walls_are_meshed_and_sliced_alike(seed: int) -> None:
    """Both have the size of the field, and both have the wall."""
    root = thing(seed)
    own, voxel = extent(root).box, 0.4
    size = max(own.size)
    mesh = make_mesh(scene(root, size=f"{size}mm"), MeshJob(voxel=voxel)).mesh
    assert np.abs(mesh.size - own.size).max() < 2 * voxel
    stack = plan_stack(root, SliceJob(size=size, layer=voxel, pixel=(voxel, voxel)))
    assert stack.scale == pytest.approx(1, rel=1e-5) and stack.size == pytest.approx(own.size, rel=1e-4)


@pytest.mark.parametrize("resolution", [64, 100])
def test_an_octahedron_is_no_larger_for_its_tips_being_cut_off(resolution: int) -> None:
    result = make_mesh(scene(octahedron(), size="100mm"), MeshJob(resolution=resolution))
    assert result.place.scale == pytest.approx(50, rel=1e-6)
    assert result.report.mesh.volume_mm3 == pytest.approx(1e6 / 6, rel=2e-4)


def test_the_size_is_that_of_the_field_of_what_stays() -> None:
    """A ball reaches farther than the octahedron, which is kept; its tips are those of the field."""
    ball = transform(sphere(radius=0.2), translate=(2, 0, 0))
    what = scene(union(octahedron(), ball), size="100mm", printing=Print(keep="largest"))
    result = make_mesh(what, MeshJob(resolution=80))
    assert result.report.mesh.components == 1
    assert result.place.scale == pytest.approx(50, rel=1e-5)
    assert np.abs(np.array(result.place.offset)[:2]).max() < 1e-3


def test_a_base_is_cut_from_the_tip_of_the_field() -> None:
    result = make_mesh(scene(octahedron(), size="100mm", printing=Print(base=10)), MeshJob(resolution=64))
    assert result.mesh.size[2] == pytest.approx(90, abs=100 / 64)
    flat = result.mesh.vertices[result.mesh.vertices[:, 2] == 0]
    assert np.ptp(flat[:, 0]) == pytest.approx(20, abs=1e-3)


@pytest.mark.usefixtures("only_samples")
def test_a_tip_that_was_lost_is_reported() -> None:
    """A wire of half a voxel on a ball: no sample is in it, and no tetrahedra take their place."""
    wire = capsule(**{"from": (0, 0, 0), "to": (0, 0, 2), "radius": 0.002})
    lost = make_mesh(scene(union(sphere(radius=0.5), wire), size="100mm"), MeshJob(resolution=64)).report
    assert lost.surface_error_mm.max < 1e-3
    assert lost.surface_to_mesh_mm.max == pytest.approx(60.06, abs=0.2) and lost.surface_to_mesh_mm.mean > 5
    whole = make_mesh(scene(sphere(radius=0.5), size="100mm"), MeshJob(resolution=64)).report
    assert whole.surface_to_mesh_mm.max < 0.02 and whole.surface_to_mesh_mm.points > 200


def test_a_plate_that_coarse_samples_miss_has_its_size() -> None:
    root = union(box(size=(210, 210, 1)), transform(box(size=(9, 9, 40)), translate=(0, 0, 20)))
    assert plan(root, 64).box.size == pytest.approx((210, 210, 40.5), rel=1e-5)


@dataclass(frozen=True, eq=False)
class Interpreted(ArrayField):
    """A field without machine code, as edited ones are."""

    root: Node

    @property
    def bounds(self) -> Bounds:
        return self.root.bounds

    @property
    def key(self) -> str:
        return "interpreted"

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        return _Interpreted(self.root.kernel(device, precision))


class _Interpreted(Kernel):
    def __init__(self, kernel: Kernel) -> None:
        self.dtype, self.points = kernel.dtype, kernel.points  # type: ignore[method-assign]


@pytest.mark.parametrize("root", [mandelbulb(iterations=3), thing(1)], ids=["exterior only", "distances"])
def test_the_extent_is_the_same_for_any_threads_and_without_machine_code(root: Node) -> None:
    alone = extent(root, Work(threads=1))
    _kept.clear()
    many = extent(root, Work(threads=6))
    interpreted = extent(Interpreted(root), Work(threads=2))
    for other in (many, interpreted):
        assert (other.box, other.outer) == (alone.box, alone.outer)
        assert np.array_equal(other.tips, alone.tips)


def test_planning_stops_when_it_is_cancelled() -> None:
    work = Work(threads=2)
    work.cancel.set()
    with pytest.raises(Cancelled):
        extent(thing(0), work)


@pytest.mark.parametrize("root", [sphere(), torus()], ids=["sphere", "torus"])
def test_a_smooth_tip_is_proven_by_few_columns(root: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    searched: list[Sides] = []

    def kept(*given: Any) -> Sides:
        searched.append(Sides(*given))
        return searched[-1]

    monkeypatch.setattr(sys.modules["fracslice.volume.extent"], "Sides", kept)
    found = extent(root, Work(1))
    assert max(sides.spent.max() for sides in searched) < LITTLE
    assert max(found.outer.hi) - max(found.box.hi) < 2 * PROVEN * max(found.box.size)
