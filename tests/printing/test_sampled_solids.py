"""What is computed on sampled solids, against the same on arrays of all samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import ndimage
from scipy.sparse import coo_array, csgraph

from fracslice import _native
from fracslice.errors import VolumeError
from fracslice.fields.cpu import compile_scene
from fracslice.formulas import Node, box, mandelbulb, shell, sphere, transform, union
from fracslice.printing.bridging import capsules, nearer
from fracslice.printing.thin_features import thin_features
from fracslice.printing.walls import (
    Measure,
    Samples,
    components_of,
    edge_crossings,
    project_faces,
    sign_samples,
    together,
    walls_of,
)
from fracslice.volume import Bricks, Lattice, sample
from fracslice.volume.bricks import INSIDE, OUTSIDE
from fracslice.work import Work

pytestmark = pytest.mark.once

RNG = np.random.default_rng(11)


def sampled(root: Node, voxels: float) -> Bricks:
    return sample(compile_scene(root), root.bounds, Lattice.around(root.bounds.box, 2 / voxels))


def noise() -> Bricks:
    """Random samples in random bricks, and random sides of the others: closed nowhere."""
    index = np.where(RNG.random((3, 4, 3)) < 0.5, INSIDE, OUTSIDE).astype(np.int32)
    some = RNG.random(index.shape) < 0.6
    index[some] = np.arange(some.sum())
    values = RNG.normal(size=(some.sum(), 512)).astype(np.float32)
    return Bricks(
        (-0.7, 0.2, 1.1), 0.13, np.ascontiguousarray(8 * np.argwhere(some), np.int32), values, index
    )


SOLIDS = [
    noise(),
    sampled(sphere(), 30),
    sampled(shell(sphere(), thickness=0.1), 40),
    sampled(mandelbulb(iterations=8), 40),
    sampled(union(transform(sphere(), translate=(1.3, 0, 0)), box(size=(1, 1, 1))), 30),
]


def dense(solid: Bricks, beyond: float = 1.0) -> np.ndarray:
    """All samples, with `beyond` and its opposite in unsampled bricks."""
    index = solid.index
    full = np.where(index == INSIDE, -beyond, beyond)[..., None].repeat(512, -1).astype(np.float32)
    full[index >= 0] = solid.values[index[index >= 0]]
    nx, ny, nz = index.shape
    cube = full.reshape(nx, ny, nz, 8, 8, 8)
    return np.asarray(cube.transpose(0, 3, 1, 4, 2, 5).reshape(8 * nx, 8 * ny, 8 * nz))


def bounds(solid: Bricks) -> np.ndarray:
    """Bound of the distance in each brick, by chessboard distances."""
    away = ndimage.distance_transform_cdt(solid.index < 0, metric="chessboard")
    far = np.maximum((away - 1) * 8, 1.5) * solid.voxel
    return np.where(solid.index == INSIDE, -far, far).astype(np.float32)


def bounded(solid: Bricks) -> np.ndarray:
    """All samples, with bounds in unsampled bricks and in two bricks around all."""
    full = dense(solid)
    flat = bounds(solid).repeat(8, 0).repeat(8, 1).repeat(8, 2)
    unsampled = (solid.index < 0).repeat(8, 0).repeat(8, 1).repeat(8, 2)
    full[unsampled] = flat[unsampled]
    padded = np.pad(full.astype(float), 16)
    steps = [np.maximum(np.maximum(16 - np.arange(n), np.arange(n) - n + 17), 0) for n in padded.shape]
    beyond = np.maximum.reduce(np.meshgrid(*steps, indexing="ij"))
    return np.where(beyond > 0, solid.voxel * (1.5 + beyond - 1), padded)


def places(solid: Bricks, count: int) -> np.ndarray:
    """Random points in and around the bricks, voxels from the first, [n, 3]."""
    return RNG.uniform(-9, 8 * np.array(solid.index.shape) + 8, (count, 3))


def naive_value(full: np.ndarray, solid: Bricks, place: np.ndarray) -> float:
    """Trilinear interpolation, or the bound in the middle of an unsampled brick."""
    low = np.floor(place).astype(int)
    brick = low >> 3
    if np.all((brick >= 0) & (brick < solid.index.shape)) and solid.index[tuple(brick)] < 0:
        bound = float(bounds(solid)[tuple(brick)])
        if (low & 7).max() < 7 or abs(bound) > 4 * solid.voxel:
            return bound
    share = place - low
    total = 0.0
    for corner in product((0, 1), repeat=3):
        weight = np.prod(np.where(corner, share, 1 - share))
        total += weight * full[tuple(low + corner + 16)]
    return total


@pytest.mark.parametrize("solid", SOLIDS)
def test_values_between_samples(solid: Bricks) -> None:
    full, points = bounded(solid), places(solid, 400)
    found = Samples(solid).points(*(np.array(solid.origin)[:, None] + solid.voxel * points.T))
    expected = [naive_value(full, solid, place) for place in points]
    np.testing.assert_allclose(found, expected, atol=1e-6 * solid.voxel)


def beside(solid: Bricks) -> np.ndarray:
    """Samples with the opposite sign among the 26 around them; beyond, the sign of the own brick goes on."""
    inside = np.pad(bounded(solid)[16:-16, 16:-16, 16:-16] < 0, 1, mode="edge")
    low, high = ndimage.minimum_filter(inside, 3), ndimage.maximum_filter(inside, 3)
    return np.asarray((low != high)[1:-1, 1:-1, 1:-1])


def test_rays_to_the_surface() -> None:
    """Step by step, of half a voxel."""
    solid = SOLIDS[3]
    full, near, count = bounded(solid), beside(solid), 60
    start, directions = places(solid, count), RNG.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]

    def is_near(place: np.ndarray) -> bool:
        i = np.floor(place + 0.5).astype(int)
        known = np.all((i >= 0) & (i < near.shape)) and solid.index[tuple(i >> 3)] >= 0
        return bool(known and near[tuple(i)])

    def is_mixed(place: np.ndarray) -> bool:
        i = np.floor(place).astype(int) + 16
        cell = full[i[0] : i[0] + 2, i[1] : i[1] + 2, i[2] : i[2] + 2] < 0
        return bool(cell.any() and not cell.all())

    points, limit = np.array(solid.origin) + solid.voxel * start, 14 * solid.voxel
    free = Samples(solid).free(points, directions, np.full(count, limit))
    through = Samples(solid).native.through(points, directions, limit, -1.0)
    for n in range(count):
        steps = np.arange(0, 14, 0.5)
        hits = [s for s in steps if is_near(p := start[n] + s * directions[n]) and is_mixed(p)]
        assert free[n] == pytest.approx(solid.voxel * min([*hits, 14.0]), rel=1e-6)
        before, expected = 0.0, 2 * limit
        for s in np.arange(0.1, 15, 0.5):
            place = start[n] + s * directions[n]
            f = -naive_value(full, solid, place) if is_near(place) else -1.0
            if f >= 0:
                expected = solid.voxel * (s - (0.5 * f / (f - before) if before < 0 else 0))
                break
            before = f
        assert through[n] == pytest.approx(expected, rel=1e-4)
    assert (free < limit).any() and (through < limit).any()


@pytest.mark.parametrize("solid", SOLIDS[1:])
def test_crossings_are_the_edges_between_signs(solid: Bricks) -> None:
    points, normals, area = edge_crossings(Samples(solid), np.arange(len(solid)))
    inside = dense(solid) < 0
    edges = sum(int(np.diff(inside, axis=axis).sum()) for axis in range(3))
    assert len(points) <= edges
    values = Samples(solid).points(*points.T)
    np.testing.assert_allclose(values, 0, atol=1e-5 * solid.voxel)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    step = np.array(Samples(solid).points(*(points + 0.1 * solid.voxel * normals).T))
    assert (step > 0).mean() > 0.9
    grid = (points - solid.origin) / solid.voxel
    along = np.abs(grid - np.round(grid)).argmax(1)
    steep = np.abs(normals[np.arange(len(normals)), along])
    off = np.abs(grid - np.round(grid)).max(1) > 1e-6  # else the axis of the edge is not to be seen
    np.testing.assert_allclose((area * steep)[off], solid.voxel**2)


@pytest.mark.parametrize("solid", SOLIDS)
def test_components_are_those_of_all_samples(solid: Bricks) -> None:
    """A sampled array with a frame of empty samples, which connects all that is outside."""
    found, inside = components_of(solid), np.pad(dense(solid) < 0, 1)
    full = dense(replace(solid, values=found.labels.astype(np.float32)), 0.0)
    tiles = np.where(solid.index < 0, found.tiles, 0).repeat(8, 0).repeat(8, 1).repeat(8, 2)
    sampled = (solid.index >= 0).repeat(8, 0).repeat(8, 1).repeat(8, 2)
    labels = np.pad(np.where(sampled, full, tiles), 1).astype(int)
    empty, count = ndimage.label(~inside)
    solids, more = ndimage.label(inside)
    expected = np.where(inside, solids + count, empty)
    pairs = np.unique(np.stack([labels.ravel(), expected.ravel()], 1), axis=0)
    assert len(pairs) == len(np.unique(labels)) == count + more == len(found.count)
    for label, _ in pairs:
        here = labels == label
        size = int(here.sum()) - (int(here.size - here[1:-1, 1:-1, 1:-1].size) if label == 0 else 0)
        assert found.count[label] == size
        assert found.inside[label] == inside[here].any()
    crossings = np.zeros(len(found.count), int)
    sampled = np.pad(sampled, 1)
    for axis in range(3):
        a, b = (np.moveaxis(array, axis, 0) for array in (inside, sampled))
        number = np.moveaxis(labels, axis, 0)
        cut = (a[1:] != a[:-1]) & b[1:] & b[:-1]
        np.add.at(crossings, np.where(a[1:], number[1:], number[:-1])[cut], 1)
    np.testing.assert_array_equal(found.crossings, crossings)


def test_signs_alone_tell_the_same_components() -> None:
    for solid in SOLIDS[1:]:
        assert components_of(sign_samples(solid.signs)).thin_share == components_of(solid).thin_share


def test_components_of_a_graph() -> None:
    for edges in (0, 10, 40, 200):
        ends = RNG.integers(0, 60, (2, edges))
        expected, count = csgraph.connected_components(coo_array((np.ones(edges), ends), (60, 60)), False)[
            ::-1
        ]
        found, number = _native.graph_components(60, *ends)
        np.testing.assert_array_equal(found, expected)
        assert number == count
    with pytest.raises(ValueError, match="no node"):
        _native.graph_components(3, np.array([1]), np.array([3]))


def test_the_least_of_two_solids() -> None:
    one, other = (sampled(transform(sphere(), translate=(x, 0, 0)), 30) for x in (0.0, 0.9))
    moved = replace(other, origin=tuple(np.array(one.origin) + 8 * one.voxel * np.array((1, 0, -1))))
    both = together(one, moved)
    for solid in (one, moved):
        at = np.array(solid.origin) + solid.voxel * (solid.ijk + 3)
        row = tuple(((at - both.origin) / both.voxel + 1e-3).astype(int).T >> 3)
        known = both.index[row] >= 0
        assert (both.values[both.index[row][known]] <= solid.values[known]).all()
    inside = Samples(both).points(*np.zeros((3, 1)))
    assert inside < 0


def test_steps_between_components() -> None:
    """Breadth first, as repeated dilation within the sampled bricks."""
    solid = SOLIDS[0]
    seeds = RNG.random(solid.values.shape) < 0.002
    steps = _native.steps_to(solid.ijk, solid.index, seeds)
    free = (solid.index >= 0).repeat(8, 0).repeat(8, 1).repeat(8, 2)
    reached = dense(replace(solid, values=seeds.astype(np.float32)), 0.0) > 0
    expected = np.where(reached, 0, 255)
    for step in range(1, 255):
        grown = ndimage.binary_dilation(reached) & free
        expected[grown & ~reached] = step
        reached = grown
    np.testing.assert_array_equal(
        dense(replace(solid, values=steps.astype(np.float32)), 255.0)[free], expected[free]
    )
    components = components_of(SOLIDS[4])
    assert np.isfinite(nearer(components, components.bodies[:1], components.bodies[1:]).bricks.values).all()


def test_squares_near_capsules_are_the_least() -> None:
    like = SOLIDS[1]
    start, end = RNG.uniform(-0.5, 0.5, (2, 6, 3))
    end[0] = start[0]
    made = capsules(start, end, 0.1, like).bricks
    inner = np.indices((8, 8, 8)).reshape(3, -1).T
    points = np.array(made.origin) + made.voxel * (made.ijk[:, None] + inner)
    away = np.full(made.values.shape, np.inf)
    for a, b in zip(start, end, strict=True):
        along = b - a
        share = np.clip((points - a) @ along / max(along @ along, 1e-30), 0, 1)
        away = np.minimum(away, np.linalg.norm(points - a - share[..., None] * along, axis=2))
    expected = np.minimum(away - 0.1, 2 * made.voxel)
    np.testing.assert_allclose(made.values, expected, atol=1e-5)


@pytest.mark.parametrize(("half", "deep"), [(0.2, False), (0.95, True), (1.4, True), (4.0, True)])
def test_no_point_is_deep_where_samples_say_so(half: float, deep: bool) -> None:
    """Plates of so many voxels to either side of their middle, wherever that lies between samples."""
    voxel, told = 0.05, []
    for shift in np.linspace(0, 1, 9):
        plate = transform(box(size=(1, 1, 2 * half * voxel)), translate=(0, 0, float(shift) * voxel))
        for turned in (plate, transform(plate, rotate=(1, 0, 0, 20)), transform(plate, rotate=(1, 1, 0, 45))):
            lattice = Lattice.around(turned.bounds.box.grown(0.1), voxel)
            try:
                solid = sample(compile_scene(turned), turned.bounds, lattice)
            except VolumeError:  # between all samples
                continue
            told.append(Samples(solid).native.may_be_deep(0.9, 1.0))
    assert set(told) == {deep}


def test_walls_that_projection_cannot_widen_enough_are_left_out() -> None:
    """What is narrower than `least` on samples, `beside` would drop with the projected faces."""
    root, work = union(shell(sphere(), thickness=0.05), shell(sphere(radius=0.6), thickness=0.2)), Work()
    solid = sampled(root, 50)
    thin, _ = thin_features(root, Samples(solid), work)
    kinds = Measure(), Measure(least=thin.least(solid.voxel))
    found, lasting = walls_of(Samples(solid), 1.0, work, kinds)
    both = [thin.beside(project_faces(root, w, solid.voxel, work), 1.0) for w in (found, lasting)]
    assert 0 < len(lasting.width) < len(found.width)
    np.testing.assert_array_equal(both[0].width, both[1].width)
