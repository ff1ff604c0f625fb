"""Layers against dense sampling and closed forms: every sign, every area, every vertex."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice.errors import Cancelled, SceneError, SliceError
from fracslice.fields.field import Bounds
from fracslice.formulas import (
    Node,
    box,
    cylinder,
    difference,
    julia,
    mandelbox,
    mandelbulb,
    menger,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.scene import scene
from fracslice.slicing import Layer, SliceJob, Slicer, Stack, plan_stack
from fracslice.slicing.layers import FieldSampler, Sampler, layers_amount
from fracslice.work import Work
from tests.examples import EXAMPLES, stamped

pytestmark = pytest.mark.once

FINITE = [name for name, root in EXAMPLES.items() if root.bounds.box.finite]


def stack_of(root: Node, pixels: int = 96, layer: float = 0.8, **job: Any) -> Stack:
    return plan_stack(root, SliceJob(size=0.2 * pixels, layer=layer, pixel=(0.2, 0.2), **job))


def all_of(stack: Stack, make: Callable[[Layer], Any], threads: int = 2) -> list[Any]:
    return list(Slicer(stack, Work(threads=threads)).map(make))


def sampler_of(stack: Stack, bounds: Bounds | None = None) -> Sampler:
    shape = (stack.shape[0] + 1, stack.shape[1] + 1)
    return FieldSampler(stack.root.kernel(), stack.root, bounds or stack.root.bounds, stack.frame, shape)


def signs(sampler: Sampler, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inside and known, bool [layers, y, x], of all samples."""
    slab, result = sampler.slab(z), []
    for layer in range(len(z)):
        sampler.sample(slab, layer)
        result.append(slab.signs())
    inside, known = (np.stack(signs) > 0 for signs in zip(*result, strict=True))
    return inside, known


def dense(stack: Stack, z: np.ndarray, like: np.ndarray) -> np.ndarray:
    x0, y0, dx, dy = stack.frame
    y, x = np.mgrid[: like.shape[1], : like.shape[2]]
    kernel = stack.root.kernel()
    return np.stack([kernel.points(x0 + dx * x, y0 + dy * y, np.full(x.shape, at)) < 0 for at in z])


def open_edges(inside: np.ndarray, known: np.ndarray) -> int:
    across = (inside[:, :, 1:] != inside[:, :, :-1]) & ~(known[:, :, 1:] & known[:, :, :-1])
    along = (inside[:, 1:] != inside[:, :-1]) & ~(known[:, 1:] & known[:, :-1])
    return int(across.sum() + along.sum())


def test_an_object_far_from_the_origin_is_exact_or_refused() -> None:
    def made(x: float) -> float:
        ball = transform(sphere(), translate=(x, -x, x))
        layers = Slicer(plan_stack(ball, SliceJob(size=20, layer=1, pixel=0.1)))
        return sum(layers.map(lambda layer: layer.area))

    assert made(1000) == pytest.approx(made(0), rel=1e-3)
    with pytest.raises(SliceError, match=r"too fine for float32 .* 1e\+05 scene units"):
        made(1e5)


@pytest.mark.parametrize("name", stamped(FINITE))
def test_closed_and_equal_to_dense_sampling(name: str) -> None:
    stack = stack_of(EXAMPLES[name])
    z = stack.z[len(stack.z) // 3 :][:8]
    inside, known = signs(sampler_of(stack), z)
    assert open_edges(inside, known) == 0
    differing = int((inside != dense(stack, z, inside)).sum())
    # What differs can only be specks of a fractal, smaller than what its layers are probed for.
    assert differing == 0 or (stack.root.bounds.exterior_only and differing < 0.02 * known.sum())


@pytest.mark.parametrize("root", [mandelbulb(), julia(), mandelbulb(iterations=4)])
def test_what_fractals_cost_and_what_is_lost(root: Node) -> None:
    """Little more than three evaluations per pixel that the contour cuts (under three where pictures are
    larger: `tests.benchmarks slices.peer`); samples of the wrong sign make up less than 0.1 % of the area.
    """
    stack = stack_of(root, 512, 0.4)
    layers = range(len(stack.z) // 8 * 4, len(stack.z) // 8 * 4 + 8)
    spent = list(Slicer(stack).map(lambda layer: (layer.evaluations, layer.boundary), layers))
    evaluations, boundary = np.sum(spent, axis=0)
    assert evaluations < 3.8 * boundary
    inside, _ = signs(sampler_of(stack), stack.z[layers])
    truth = dense(stack, stack.z[layers], inside)
    assert (inside != truth).sum() < 1e-3 * truth.sum()


@pytest.mark.parametrize("mixed", [False, True])
def test_small_holes_of_a_mandelbox_stay_open(mixed: bool) -> None:
    """Values inside are near to the distance, other than in a potential: a smaller bound closes holes."""
    whole = mandelbox(iterations=8)
    root = difference(whole, box(size=(9, 9, 9))) if mixed else whole
    stack = stack_of(root)
    z = stack.z[len(stack.z) // 3 :][:2]
    inside, _ = signs(sampler_of(stack), z)
    truth = dense(stack, z, inside)
    assert (inside != truth).sum() < 1e-3 * truth.sum()


@pytest.mark.parametrize("root", [julia(iterations=10), mandelbulb(iterations=3), mandelbulb(power=2)])
def test_coverage_of_fractals_has_no_bias(root: Node) -> None:
    """The area of all pixels against counting 8 x 8 signs in each: within 0.2 %."""
    stack = stack_of(root, 256, 3.2)
    x0, y0, dx, dy = stack.frame
    y, x = ((np.arange(8 * n) + 0.5) / 8 for n in stack.shape)
    kernel = stack.root.kernel()
    truth = 0.0
    for z in stack.z:
        at = np.meshgrid(x0 + dx * x, y0 + dy * y)
        truth += float((kernel.points(*at, np.full(at[0].shape, z)) < 0).mean())
    area = sum(all_of(stack, lambda layer: layer.coverage.sum() / 255 / layer.coverage.size))
    assert area == pytest.approx(truth, rel=2e-3)


@pytest.mark.parametrize(
    "root", stamped([julia(iterations=8), mandelbulb(iterations=3), torus()], [julia(iterations=8)])
)
def test_layers_fill_what_the_mesh_encloses(root: Node) -> None:
    """Areas times heights against the mesh's volume: within 0.2 %.

    The mesh is scaled so that it is 25.6 mm itself, without the tips that no voxel holds; its voxels tell how
    much.
    """
    stack = plan_stack(root, SliceJob(size=25.6, layer=0.1, pixel=(0.1, 0.1)))
    areas = np.array(all_of(stack, lambda layer: (layer.area, layer.contours.area)))
    made = make_mesh(scene(root, size="25.6mm"), MeshJob(resolution=256))
    volume = made.mesh.volume / (made.report.voxel_mm / 0.1) ** 3
    np.testing.assert_allclose(stack.heights @ areas, volume, rtol=2e-3)


def test_a_bound_that_lies_leaves_no_open_contour() -> None:
    root = union(sphere(radius=0.7), box(size=(2.0, 0.2, 0.2)))
    stack = stack_of(root)
    z = stack.z[8:16]
    inside, known = signs(sampler_of(stack, Bounds(root.bounds.box, 1 / 3, False)), z)
    assert open_edges(inside, known) == 0


@pytest.mark.parametrize("name", ["mandelbulb", "menger", "twist"])
def test_threads_and_the_choice_of_layers_do_not_matter(name: str) -> None:
    stack = stack_of(EXAMPLES[name])
    first = all_of(stack, lambda layer: (layer.coverage.tobytes(), layer.contours.points.tobytes()), 1)
    assert (
        all_of(stack, lambda layer: (layer.coverage.tobytes(), layer.contours.points.tobytes()), 5) == first
    )
    some = list(Slicer(stack).map(lambda layer: layer.contours.points.tobytes(), [3, 9, 11]))
    assert some == [first[k][1] for k in (3, 9, 11)]


@pytest.mark.parametrize("name", stamped(FINITE))
def test_runs_are_those_of_the_pixels(name: str) -> None:
    stack = stack_of(EXAMPLES[name], 61)

    def both(layer: Layer) -> tuple[list[tuple[int, int, int]], list[tuple[int, int, int]]]:
        rows, columns = np.nonzero(np.diff(layer.coverage >= 128, axis=1, prepend=False, append=False))
        runs, area = layer.runs, layer.area
        assert area == pytest.approx(layer.coverage.sum() / 255 * 0.04, rel=1e-2, abs=0.05)
        row = np.repeat(np.arange(runs.height), np.diff(runs.rows))
        result = zip(row.tolist(), runs.begin.tolist(), runs.end.tolist(), strict=True)
        ends = zip(rows[::2].tolist(), columns[::2].tolist(), columns[1::2].tolist(), strict=True)
        return list(result), list(ends)

    for result, expected in all_of(stack, both):
        assert result == expected


def disc(stack: Stack) -> np.ndarray:
    return math.pi * (1 - stack.z**2) * stack.scale**2


def ring(stack: Stack) -> np.ndarray:
    values = torus().values
    return 4 * math.pi * values["radius"] * np.sqrt(values["tube"] ** 2 - stack.z**2) * stack.scale**2


def sponge(stack: Stack, level: int = 3) -> np.ndarray:
    grid = np.ones((1, 1, 1), bool)
    block = (np.indices((3, 3, 3)) == 1).sum(0) < 2
    for _ in range(level):
        grid = np.kron(grid, block)
    row = ((stack.z + 1) / 2 * len(grid)).astype(int)
    return grid.sum((0, 1))[row] * (2 * stack.scale / len(grid)) ** 2


@pytest.mark.parametrize(("root", "area"), [(sphere(), disc), (torus(), ring), (menger(level=3), sponge)])
def test_areas_of_every_layer(root: Node, area: Callable[[Stack], np.ndarray]) -> None:
    """Contours, pixels and pictures: within 0.05 % of the closed form at 1024 pixels."""
    stack = stack_of(root, 1024, 8.3)
    pixel = stack.pixel[0] * stack.pixel[1]
    result = all_of(
        stack, lambda layer: (layer.contours.area, layer.area, layer.coverage.sum() / 255 * pixel)
    )
    np.testing.assert_allclose(np.transpose(result), [area(stack)] * 3, rtol=5e-4)


@pytest.mark.parametrize("pixels", [128, 256])
def test_corners_are_sharp(pixels: int) -> None:
    """A turned Menger sponge: areas within 0.05 % though its holes are few pixels wide, and every vertex, its
    corners too, within 0.01 pixels of the surface. Its pixels know the corners, too.
    """
    stack = stack_of(transform(menger(level=3), rotate=(0, 0, 1, 17.3)), pixels, 1.3)
    layers, raster = zip(*all_of(stack, lambda layer: (layer.contours, layer.area)), strict=True)
    np.testing.assert_allclose([layer.area for layer in layers], sponge(stack), rtol=5e-4)
    np.testing.assert_allclose(raster, sponge(stack), rtol=2e-5)
    exact, middle = stack.root.kernel("cpu", "float64"), np.array(stack.shape[::-1]) / 2
    for layer, z in zip(layers, stack.z, strict=True):
        x, y = stack.frame[:2, None] + stack.frame[2:, None] * (layer.points / stack.pixel + middle).T
        assert abs(exact.points(x, y, np.full(len(x), z))).max() < 0.01 * stack.frame[2]


def test_pixels_just_below_a_horizontal_face() -> None:
    """There the field tells of the face, not of the outline: linear between samples it is 5 % wrong."""
    stack = stack_of(transform(menger(level=2), rotate=(0, 0, 1, 17.3)), 128, 1.3)
    z = -1 + 2 / 9 * np.arange(1, 9) - 0.02 * stack.frame[2]
    near = replace(stack, z=z)
    np.testing.assert_allclose(all_of(near, lambda layer: layer.area), sponge(near, 2), rtol=1e-4)


@pytest.mark.parametrize(
    "root",
    [
        transform(box(), rotate=(0, 0, 1, 31)),
        transform(
            difference(box(), transform(box(size=(2, 2, 3)), translate=(0.6, 0.6, 0))), rotate=(0, 0, 1, 31)
        ),
    ],
    ids=["outwards", "inwards"],
)
def test_each_pixel_of_a_corner(root: Node) -> None:
    """Coverage against 64 x 64 signs in each pixel: within 2 %, corners of both kinds included."""
    stack = stack_of(root, 40)
    middle = len(stack.z) // 2
    coverage = next(Slicer(stack).map(lambda layer: layer.coverage, [middle]))
    x0, y0, dx, dy = stack.frame
    y, x = ((np.arange(64 * n) + 0.5) / 64 for n in stack.shape)
    at = np.meshgrid(x0 + dx * x, y0 + dy * y)
    inside = stack.root.kernel().points(*at, np.full(at[0].shape, stack.z[middle])) < 0
    truth = inside.reshape(stack.shape[0], 64, stack.shape[1], 64).mean((1, 3))
    assert abs(coverage / 255 - truth).max() < 0.02


def test_vertices_lie_on_the_surface() -> None:
    """Within 0.01 pixels; the contour of a Mandelbulb by its own field, the sphere's by its equation."""
    stack = stack_of(sphere(), 200)
    for contours, z in zip(all_of(stack, lambda layer: layer.contours), stack.z, strict=True):
        radius = math.sqrt(1 - z * z) * stack.scale
        assert abs(np.hypot(*contours.points.T) - radius).max() < 0.01 * 0.2
    stack = stack_of(mandelbulb(iterations=4), 200)
    exact = stack.root.kernel("cpu", "float64")
    of = range(10, len(stack.z), 10)
    for index, points in zip(of, Slicer(stack).map(lambda layer: layer.contours.points, of), strict=True):
        x, y = (
            points / stack.scale + np.array(stack.corner) + stack.frame[2:] * np.array(stack.shape[::-1]) / 2
        ).T
        z = np.full(len(x), stack.z[index])
        step = 0.01 * stack.frame[2]
        lattice = [(x - step, y), (x + step, y), (x, y - step), (x, y + step)]
        signs = np.array([exact.points(*at, z) < 0 for at in lattice])
        assert (signs.any(0) & ~signs.all(0)).mean() > 0.999


def test_coverage_is_the_area_of_the_contours() -> None:
    stack = stack_of(sphere(), 256)
    for coverage, area, exact in all_of(
        stack, lambda layer: (layer.coverage, layer.area, layer.contours.area)
    )[2:-2]:
        assert abs(area / exact - 1) < 5e-4
        assert abs(coverage.sum() / 255 * 0.04 / exact - 1) < 2e-3


def test_each_pixel_of_a_disc() -> None:
    """Coverage against the disc sampled 64 x 64 times a pixel: within 2 %."""
    stack = stack_of(sphere(), 64)
    middle = len(stack.z) // 2
    coverage = next(Slicer(stack).map(lambda layer: layer.coverage, [middle]))
    ny, nx = stack.shape
    radius = math.sqrt(1 - stack.z[middle] ** 2) * stack.scale / 0.2
    y, x = ((np.arange(n * 64) + 0.5) / 64 - n / 2 for n in (ny, nx))
    truth = (np.hypot(*np.meshgrid(x, y)) < radius).reshape(ny, 64, nx, 64).mean((1, 3))
    assert abs(coverage / 255 - truth).max() < 0.02


def test_contours_are_nested_and_oriented() -> None:
    """A ball in a ring-shaped hole of a box, itself with a hole."""
    holed = difference(sphere(radius=0.5), sphere(radius=0.2))
    stack = stack_of(union(difference(box(size=(2, 2, 2)), sphere(radius=0.8)), holed), 100)
    contours = all_of(stack, lambda layer: layer.contours)[len(stack.z) // 2]
    order = np.argsort(-abs(contours.areas))
    assert (np.sign(contours.areas[order]) == [1, -1, 1, -1]).all()
    assert [contours.parent[i] for i in order] == [-1, order[0], order[1], order[2]]


def test_contours_of_a_fractal_are_sound() -> None:
    """Every contour turns the right way round for its depth, and lies in its parent; no point comes twice
    in a row.
    """
    stack = stack_of(mandelbulb(iterations=6), 256)
    for contours in all_of(stack, lambda layer: layer.contours)[::7]:
        depth = np.zeros(len(contours), int)
        for i, parent in enumerate(contours.parent):
            assert parent < i
            depth[i] = depth[parent] + 1 if parent >= 0 else 0
            if parent >= 0:
                low, high = contours[parent].min(0), contours[parent].max(0)
                assert (contours[i] >= low).all()
                assert (contours[i] <= high).all()
            assert (np.diff(contours[i], axis=0, append=contours[i][:1]) != 0).any(1).all()
        assert (np.sign(contours.areas) == 1 - 2 * (depth % 2)).all()


def test_cost_grows_with_the_boundary() -> None:
    """Twice the resolution in all directions: four to five times the evaluations, not eight."""
    small, large = (
        sum(all_of(stack_of(menger(level=2), n, 0.2), lambda layer: layer.evaluations)) for n in (48, 96)
    )
    assert large < 6 * small


def test_volume_of_all_layers() -> None:
    stack = stack_of(sphere(), 200, 0.2)
    volume = float(np.dot(all_of(stack, lambda layer: layer.contours.area), stack.heights))
    assert abs(volume / (4 / 3 * math.pi * stack.scale**3) - 1) < 2e-4


def test_any_direction_can_be_up() -> None:
    bar = transform(box(size=(2, 0.5, 0.5)), translate=(0.3, 0, 0))
    stack = stack_of(bar, up=(1, 0, 0))
    assert stack.size[2] == pytest.approx(19.2, rel=1e-2)
    areas = np.array(all_of(stack, lambda layer: layer.contours.area))
    np.testing.assert_allclose(areas, 0.25 * stack.scale**2, rtol=5e-3)
    assert stack_of(bar, up=(-2, 0, 0)).size[2] == pytest.approx(stack.size[2])
    assert stack_of(bar, up=(0, 0, -1)).size == pytest.approx(stack_of(bar).size)


@pytest.mark.parametrize(
    ("job", "message"),
    [
        ({"layer": 0.0}, "layer=0.0: expected a length"),
        ({"layer": 50.0}, "as high as the object"),
        ({"pixel": (50.0, 0.1)}, "as large as the object"),
        ({"pixel": (0.0, 0.1)}, r"pixel=\(0.0, 0.1\): expected two lengths"),
        ({"size": math.inf}, "size=inf: expected"),
        ({"up": (0, 0, 0)}, r"up=\(0, 0, 0\): expected 3 numbers, not all zero"),
    ],
)
def test_impossible_jobs(job: dict[str, Any], message: str) -> None:
    with pytest.raises((SceneError, SliceError), match=message):
        plan_stack(sphere(), SliceJob(**{"size": 20.0, **job}))


def test_too_many_layers_or_pixels() -> None:
    with pytest.raises(SliceError, match="layers: at most"):
        plan_stack(sphere(), SliceJob(size=20, layer=1e-4))
    with pytest.raises(SliceError, match="at most 65536 along a side; expected larger pixels"):
        plan_stack(sphere(), SliceJob(size=20, pixel=(2e-4, 2e-4)))


def test_cancelled() -> None:
    work = Work(cancel=threading.Event())
    layers = Slicer(stack_of(sphere()), work).map(lambda layer: layer.area)
    next(layers)
    work.cancel.set()
    with pytest.raises(Cancelled):
        list(layers)


def test_an_error_in_a_worker_comes_out() -> None:
    def fail(layer: Layer) -> None:
        raise SliceError("no")

    with pytest.raises(SliceError, match="no"):
        all_of(stack_of(sphere()), fail)


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("bailout", [2.0, 65_242.0])
def test_a_large_bailout_takes_nothing_off_the_outline(bailout: float, mixed: bool) -> None:
    """Its values inside are 1e4 times smaller than outside; up to half a pixel was lost all around."""
    ball = julia(c=(0, 0, 0, 0), iterations=6, bailout=bailout)
    radius = bailout ** (1 / 64)
    stack = stack_of(union(ball, sphere(radius=radius / 2)) if mixed else ball, pixels=48)
    away = (stack.z - stack.z.mean()) * stack.scale
    truth = math.pi * ((radius * stack.scale) ** 2 - away**2).clip(0)
    areas = np.array(all_of(stack, lambda layer: layer.area))
    assert areas.sum() == pytest.approx(truth.sum(), rel=0.005)


def test_whole_layers_of_another_height_are_reported() -> None:
    """A cylinder 17.4 layers high is cut into 17, and that is 2 % of it."""
    of = cylinder(radius=0.75, height=0.5431)
    low, fine = (plan_stack(of, SliceJob(size=50, layer=layer, pixel=(0.5, 0.5))) for layer in (1.04, 0.01))
    assert low.notes == ("whole layers are 17.68 mm high, the object 18.1 mm; expected lower layers",)
    assert fine.notes == ()


def test_layers_that_were_written_are_not_sampled_again_for_their_volume(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slicer = Slicer(stack_of(sphere(), layer=0.4), Work(2))
    fresh = layers_amount(Slicer(slicer.stack, Work(2)), Work(2))
    assert len(list(slicer.map(lambda layer: layer.coverage.any()))) == len(slicer.areas)
    monkeypatch.setattr(Sampler, "sample", None)
    assert layers_amount(slicer, Work(2)) == fresh
