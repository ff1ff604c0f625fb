"""Supports and directions up: known objects, oracles of islands, distances and ways."""

from __future__ import annotations

import math
import zlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.ndimage import distance_transform_edt, label

from fracslice import MeshJob, make_mesh, slice_layers
from fracslice._slices import Encoding
from fracslice.checks.layer_checks import check_layers
from fracslice.common.messages import place
from fracslice.errors import SceneError
from fracslice.formulas import (
    Node,
    box,
    capsule,
    cone,
    cylinder,
    difference,
    mandelbulb,
    sphere,
    transform,
    union,
)
from fracslice.jobs.mesh import make_apart, make_implicit
from fracslice.jobs.plates import write_bodies
from fracslice.printing.pillars import STRENGTHS, Exits, Forest, Object, Room, steps_from
from fracslice.scene import Print, scene
from fracslice.slicing import SliceJob, Slicer, Stack, plan_stack
from fracslice.slicing.layers import Layer, ScreenView
from fracslice.slicing.orientation import _runs, orientations
from fracslice.slicing.stack import plan_object
from fracslice.slicing.supports import _Growth, layers_with_room
from fracslice.volume.amount import Sizing
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once

STEP = 0.2


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


LEGS = [at(box(size=(2, 2, 10)), x, y, -5.5) for x in (-9, 9) for y in (-6, 6)]
TABLE = union(box(size=(20, 14, 1.5)), *LEGS)
MUSHROOM = union(cylinder(radius=2, height=10), at(cylinder(radius=7, height=2), 0, 0, 5))
BRIDGE = difference(box(size=(20, 6, 8)), at(box(size=(16, 8, 8)), 0, 0, -2))
BALL = union(box(size=(14, 14, 2)), at(sphere(radius=3), 0, 0, 8))
CAVITY = union(
    difference(box(size=(14, 14, 14)), sphere(radius=5)), at(cylinder(radius=0.6, height=4), 0, 0, 3.5)
)


def supported(root: Node, supports: str = "medium", size: float | None = None, **how: float) -> Stack:
    side = size or max(root.bounds.box.size)
    printing = Print(supports=supports, **how)  # type: ignore[arg-type]
    return plan_stack(root, SliceJob(size=side, layer=STEP, pixel=STEP, printing=printing), Work(threads=1))


def pictures(stack: Stack) -> list[np.ndarray]:
    return list(Slicer(stack, Work(threads=1)).map(lambda layer: layer.coverage >= 128))


def islands(layers: list[np.ndarray]) -> int:
    """Components of layers with nothing below them, but on the plate and of less than 8 pixels."""
    found = 0
    for below, now in pairwise(layers):
        labels, count = label(now, np.ones((3, 3)))
        sizes = np.bincount(labels.ravel(), minlength=count + 1)
        held = np.isin(np.arange(1, count + 1), labels[below & now])
        found += int((~held & (sizes[1:] >= 8)).sum())
    return found


@pytest.mark.parametrize(
    "root", stamped([TABLE, MUSHROOM, BRIDGE, BALL, sphere(radius=8)], [MUSHROOM, BALL]), ids=str
)
def test_nothing_begins_or_hangs_in_the_air(root: Node) -> None:
    stack = supported(root)
    report = check_layers(stack, None, None, Work(threads=1))
    assert islands(pictures(stack)) == 0
    assert {problem.kind for problem in report.problems} <= {"thin"}
    assert report.overhang is None and len(report.bodies) <= 1
    assert stack.supports is not None and not len(stack.supports.bare)
    assert str(stack.supports) == report.supports


def test_every_point_under_a_ceiling_is_near_a_tip() -> None:
    stack = supported(TABLE)
    assert stack.supports is not None
    touched = next(
        iter(pictures_at(stack, 9.9))
    )  # just below the table's top, which begins 10 mm above its feet
    bare = np.zeros_like(touched)
    top = next(iter(pictures_at(stack, 10.3)))
    bare[top] = True
    away = distance_transform_edt(~touched, sampling=STEP)
    assert float(away[bare].max()) < 3.0 + 2 * STEP


def pictures_at(stack: Stack, height: float) -> list[np.ndarray]:
    """The layer at a height in mm above the lowest point of the object, which is lifted."""
    lift = float(stack.tops[-1]) - 11.25
    index = int(np.searchsorted(stack.tops, height + lift))
    return list(Slicer(stack, Work(threads=1)).map(lambda layer: layer.coverage >= 128, [index]))


def test_a_tip_without_a_way_stands_on_the_object() -> None:
    held = supported(BALL).supports
    assert held is not None and held.tips > 4


def test_a_cone_on_its_tip_is_held_beside_it() -> None:
    stack = supported(transform(cone(radius=10, height=20), rotate=(1, 0, 0, 180)))
    report = check_layers(stack, None, None, Work(threads=1))
    assert not [problem for problem in report.problems if problem.kind == "necks"]
    assert stack.supports is not None and 4 <= stack.supports.tips <= 60


def test_a_mesh_has_the_size_of_object_and_supports() -> None:
    made = make_mesh(MUSHROOM, resolution=64, supports="medium", threads=1)
    report, high = made.report, made.vertices[:, 2] > 10.0
    assert not [note for note in report.notes if "finer than the samples" in note] and report.problems == ()
    colours = made.shown.colours
    assert colours is not None and made.colours is None
    assert (
        len(np.unique(colours[high], axis=0)) == 2
        and len(np.unique(colours[made.vertices[:, 2] < 1], axis=0)) == 1
    )


def test_what_hangs_in_a_cavity_has_no_support() -> None:
    stack = supported(CAVITY)
    held = stack.supports
    assert held is not None and held.inner == 0 and len(held.bare) == 1
    report = check_layers(stack, None, None, Work(threads=1))
    (island,) = [problem for problem in report.problems if problem.kind == "islands"]
    assert island.at is not None and island.mend == (("cavities", "fill"),)
    assert held.bare[0] == pytest.approx(island.at, abs=2 * STEP)
    where = f"the lowest at {place(held.bare[0])} mm (--cavities fill, or --up)"
    assert str(held).endswith(f"; 1 place has none, in holes without exit, {where}")
    filled = supported(CAVITY, cavities="fill").supports  # type: ignore[arg-type]
    assert filled is not None and not len(filled.bare)


@pytest.mark.parametrize(("hole", "bare"), [(1.2, 0), (0.3, 0), (0.15, 1)])
def test_what_comes_out_of_a_hole_is_supported(hole: float, bare: int) -> None:
    room = difference(
        CAVITY, transform(cylinder(radius=hole / 2, height=8), rotate=(0, 1, 0, 90), translate=(5, 0, 0))
    )
    held = supported(room).supports
    assert held is not None and held.inner == 1 - bare and len(held.bare) == bare


def test_a_ball_comes_out_of_a_hole_as_wide() -> None:
    wall = difference(box(size=(6, 6, 6)), box(size=(4, 4, 4)))
    full = np.pad(np.ones((6, 6, 6), bool), 3)
    full[4:8, 4:8, 4:8] = False
    dense = full & ~np.pad(np.ones((4, 4, 4), bool), 4)
    room = Room.around(full, np.zeros_like(full), np.full(3, -6.0), -6.0, np.ones(3), 3.0)
    shut = Room.around(full, dense, np.full(3, -6.0), -6.0, np.ones(3), 3.0)
    for hole, out in ((0.5, True), (0.39, False)):
        tunnel = transform(cylinder(radius=hole, height=2), rotate=(0, 1, 0, 90), translate=(2.5, 0, 0))
        of = Object(difference(wall, tunnel), 1.0, np.ones(1), 0.1, Work(threads=1))
        top = np.array([1.0, 0.0, 0.0])
        assert Exits(of, room).lead_out(0.4, top, -2.0) == out
        assert not Exits(of, shut).lead_out(0.4, top, -2.0)


def test_a_strut_stands_on_what_is_as_wide() -> None:
    rod, floor = cylinder(radius=0.1, height=4), at(box(size=(4, 4, 1)), 0, 0, -3)
    of = Object(union(rod, floor), 1.0, np.ones(1), 0.1, Work(threads=1))
    start = np.array([[0.0, 0.0, 4.0], [0.0, 1.0, 4.0]])
    assert of.first_below(start, -9.0, 0.1, np.full(2, 0.08))[0] == pytest.approx(2, abs=0.2)
    assert of.first_below(start, -9.0, 0.1, np.full(2, 0.2)) == pytest.approx(-2.5, abs=0.11)


def test_pictures_show_what_either_layer_covers() -> None:
    stack = supported(BALL)
    view = ScreenView(stack.shape, False, False, (0, 0), stack.shape, bytes(range(256)))

    def shown(layer: Layer) -> tuple[np.ndarray, np.ndarray, float, float]:
        data = zlib.decompress(layer.encoded(view, Encoding.PNG))
        area = layer.area
        image = np.frombuffer(data, np.uint8).reshape(stack.shape[0], -1)[::-1, 1:]
        return image, layer.coverage, area, int(layer.coverage.sum()) / 255 * STEP**2

    for image, coverage, area, covered in Slicer(stack, Work(threads=1)).map(shown):
        assert (image == coverage).all()
        assert area == pytest.approx(covered, rel=0.02, abs=0.1)


def test_more_carries_more() -> None:
    light, heavy = (supported(sphere(radius=8), strength).supports for strength in ("light", "heavy"))
    assert light is not None and heavy is not None
    assert light.tip < heavy.tip and light.scars < heavy.scars and light.tips > heavy.tips


def test_contacts_carry_the_largest_layer() -> None:
    stack = supported(box(size=(20, 20, 4)))
    assert stack.supports is not None
    assert stack.supports.scars > 400 / 60  # cones are wider just below


def test_a_raft_is_narrower_below() -> None:
    stack = supported(MUSHROOM, raft=1.0)
    layers = [int(picture.sum()) * STEP**2 for picture in pictures(stack)[:7]]
    assert layers == sorted(layers[:5]) + layers[5:]  # up to its top, 1 mm above the plate
    assert layers[4] - layers[0] > 10
    assert layers[5] < layers[4] / 2


def test_mesh_is_one_solid() -> None:
    job = MeshJob(voxel=0.2, printing=Print(supports="medium"))
    bare, made = (make_mesh(scene(MUSHROOM, unit=1), j, Work(threads=1)) for j in (MeshJob(voxel=0.2), job))
    report = made.report.mesh
    assert report.watertight and report.manifold and report.components == 1
    (line,) = (note for note in made.report.notes if note.startswith("supports: "))
    stated = float(line.partition("; ")[2].split()[0])
    assert stated == pytest.approx(report.volume_mm3 - bare.report.mesh.volume_mm3, rel=0.15)
    coarse = make_mesh(scene(MUSHROOM, unit=1), MeshJob(voxel=0.4, printing=job.printing), Work(threads=1))
    assert any("tips of 0.8 mm" in note for note in coarse.report.notes)  # two voxels
    assert coarse.report.mesh.components == 1


def test_a_body_of_its_own_stands_where_it_belongs(tmp_path: Path) -> None:
    solid, job = scene(MUSHROOM, unit=1), MeshJob(voxel=0.4, printing=Print(supports="heavy"))
    made = make_apart(solid, job, Work(threads=1))
    whole = make_mesh(solid, job, Work(threads=1)).mesh
    assert [note.startswith("supports: ") for one in made for note in one.report.notes[:1]] == [True]
    (file,) = write_bodies(made, ("object", "supports"), tmp_path / "o.3mf", {}, Work(threads=1))
    bodies = trimesh.load(file)
    assert list(bodies.geometry) == ["object", "supports"]
    parts = bodies.dump()
    assert all(part.is_watertight for part in parts)
    joined = trimesh.boolean.union(parts, engine="manifold")
    assert joined.volume == pytest.approx(whole.volume, rel=2e-3)
    assert joined.bounds[:, 2] == pytest.approx(whole.bounds[:, 2], abs=1e-3)
    assert len(write_bodies(made, ("object", "supports"), tmp_path / "o.stl", {}, Work(threads=1))) == 2
    with pytest.raises(SceneError, match="expected supports"):
        make_apart(solid, MeshJob(voxel=0.4), Work(threads=1))


def test_the_same_with_any_number_of_threads() -> None:
    job = SliceJob(size=20, layer=STEP, pixel=STEP, printing=Print(supports="medium"))
    one, two = (plan_stack(mandelbulb(), job, Work(threads=n)) for n in (1, 2))
    assert one.root.key == two.root.key


def test_layers_of_a_fractal_show_the_specks_that_supports_were_made_for() -> None:
    job, size = SliceJob(size=20, layer=STEP, pixel=STEP), Sizing.of(20)
    bare = layers_with_room(*plan_object(mandelbulb(), job, size), job, size)
    stack = supported(mandelbulb(), size=20)
    assert stack.supports is not None
    own, held = pictures(bare), pictures(stack)
    lift = len(held) - len(own)
    aside = [(len(held[0]) - len(own[0])) // 2, (held[0].shape[1] - own[0].shape[1]) // 2]
    for picture, other in zip(own, held[lift:], strict=True):
        part = other[aside[0] : aside[0] + len(picture), aside[1] : aside[1] + picture.shape[1]]
        assert (part >= picture).all()
    assert islands(held) == 0 < islands(own)
    layers = Slicer(stack, Work(threads=1)).map(
        lambda layer: (layer.area, int(layer.runs.end.sum() - layer.runs.begin.sum()))
    )
    for area, pixels in layers:
        assert area == pytest.approx(pixels * STEP**2, rel=0.2, abs=1)


def test_runs_of_either_layer() -> None:
    rng = np.random.default_rng(0)
    for shares in ((0.1, 0.8), (0, 0.5), (1, 0.3), (0.5, 0)):
        one, other = ((rng.random((20, 31)) < share).astype(np.uint8) for share in shares)
        both, expected = _runs(one) | _runs(other), _runs(one | other)
        for name in ("rows", "begin", "end"):
            assert (getattr(both, name) == getattr(expected, name)).all()


def test_steps_are_at_most_distances() -> None:
    rng = np.random.default_rng(1)
    full = rng.random((30, 31, 32)) < 0.001
    away, distance = steps_from(full, 6), distance_transform_edt(~full)
    for steps in range(1, 6):
        assert (distance[away > steps] > steps).all()
        assert (away[distance > 2 * steps] > steps).all()


@pytest.mark.parametrize("share", [0.0, 0.001, 0.1])
def test_what_bare_cells_use_is_the_way_to_the_nearest_one_that_is_carried(share: float) -> None:
    """Cells are no squares; a step of 0.3 mm is free. Without any that is carried, all is beyond reach."""
    rng = np.random.default_rng(2)
    carried = rng.random((60, 70)) < share
    growth = _Growth(carried[None], carried[None], np.array([0.2, 0.25, 0.3]), 3.0)
    rows, columns = np.nonzero(~carried & (rng.random(carried.shape) < 0.5))
    found = growth._grown(np.where(carried, np.float32(0), np.float32(np.inf)), rows, columns)
    away = distance_transform_edt(~carried, sampling=(0.25, 0.2))[rows, columns]
    expected = np.maximum(away - 0.3, 0) if share else np.full(len(rows), 1e6)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


def test_ways_go_around() -> None:
    full = np.zeros((40, 40, 40), bool)
    full[20, 8:32, 8:32] = True  # a plate
    room = Room.around(full, full, np.zeros(3), 0.0, np.ones(3), 3.0)
    start = np.array([20.5, 20.5, 36.5])
    assert math.isinf(room.cost[room.at(start - [0, 0, 15])])  # inside the plate's surroundings
    assert room.cost[room.at(np.array([2.5, 2.5, 36.5]))] == pytest.approx(36)
    tips = np.array([[11.5, 20.5, 39.5]])
    forest = Forest(room, STRENGTHS["medium"], tips, np.array([0.2]))
    assert forest.down == [*range(1, len(forest.place)), -1] and forest.trunks == [len(forest.place) - 1]
    way = [*forest.place, forest.place[-1] * (1, 1, 0)]
    assert len(way) > 2
    for one, other in pairwise(way):
        assert room.is_free(one, other, room.wide)
        assert math.dist(one[:2], other[:2]) <= 1.001 * (one[2] - other[2])
    assert way[-1][0] < 8


@pytest.mark.parametrize(("first", "last"), [(0.4, 0.1), (0.1, 0.5), (0.3, 0.3), (0.1, 2.0)])
def test_round_cones_are_exact(first: float, last: float) -> None:
    points = np.random.default_rng(2).uniform(-2, 2, (3, 2000))
    start, end, share = np.zeros(3), np.array([1.0, 1.0, 0.3]), np.linspace(0, 1, 2001)[:, None, None]
    axis = start + share[..., 0] * (end - start)
    balls = [
        np.linalg.norm(points.T - c, axis=1) - (first + t * (last - first))
        for c, t in zip(axis, share[:, 0, 0], strict=True)
    ]
    field = capsule(tuple(start), tuple(end), first, last)
    assert field.kernel("cpu", "float64").points(*points) == pytest.approx(np.min(balls, 0), abs=1e-5)


def test_best_direction_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fracslice.slicing.orientation.SAMPLES", 24)
    best = orientations(MUSHROOM, Sizing(20.0), Work(threads=1))
    assert best[0].up == (0, 0, -1) and best[0].supports == 0  # on its hat
    assert len(best) == 5
    for k, one in enumerate(best):
        assert all(np.dot(one.up, other.up) < math.cos(math.radians(14.9)) for other in best[:k])
    slices = slice_layers(MUSHROOM, layer=1, pixel=1, up="auto")
    assert slices[0].sum(dtype=int) > 4 * slices[-1].sum(dtype=int)
    turned = orientations(transform(MUSHROOM, rotate=(1, 0, 0, 30)), Sizing(20.0), Work(threads=1))[0]
    assert turned.supports < 5  # the side of its hat is one of the hull


def test_formulas_refuse_them() -> None:
    with pytest.raises(SceneError, match="supports: needs samples of the field"):
        make_implicit(scene(MUSHROOM, unit=1), MeshJob(printing=Print(supports="light")), "x.3mf")
