"""A closed mesh as a field: distances and signs of the solid that it bounds."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from fracslice.formulas import box, sphere
from fracslice.mesh import Mesh
from fracslice.mesh.model import Nearest
from fracslice.mesh.models import MeshField
from fracslice.volume import plan
from tests.examples import stamped

pytestmark = pytest.mark.once


def field_of(*parts: trimesh.Trimesh) -> MeshField:
    whole = trimesh.util.concatenate(parts)
    return MeshField(Mesh(np.asarray(whole.vertices, np.float64), np.asarray(whole.faces, np.int32)))


def moved(part: trimesh.Trimesh, *by: float) -> trimesh.Trimesh:
    part.apply_translation(by)
    return part


def test_distances_and_signs_of_a_box_at_points_that_lie_on_its_edges_in_projection() -> None:
    field = field_of(trimesh.creation.box((2, 2, 2)))
    points = np.stack(np.meshgrid(*[np.linspace(-1.5, 1.5, 13)] * 3), 0).reshape(3, -1)
    exact = box(size=(2, 2, 2)).kernel("cpu", "float64").points(*points)
    assert field.kernel("cpu", "float64").points(*points) == pytest.approx(exact, abs=1e-12)


def test_bodies_that_overlap_are_united_and_shells_inside_are_cavities() -> None:
    hole = trimesh.creation.box((1, 1, 1))
    hole.invert()
    solid = trimesh.creation.box((2, 2, 2)), moved(trimesh.creation.box((2, 2, 2)), 1, 0.3, 0.2)
    values = field_of(*solid, hole).kernel().points(np.array([0.8, -0.2, 1.9, 2.2]), *np.zeros((2, 4)))
    assert (values < 0).tolist() == [True, False, True, False]


def test_a_mesh_is_planned_like_a_formula_and_its_key_is_its_triangles() -> None:
    field = field_of(trimesh.creation.icosphere(4, 1.0))
    result, exact = plan(field, 64), plan(sphere(radius=1.0), 64)
    assert result.box.size == pytest.approx(exact.box.size, abs=1e-5)
    assert field.key != field_of(trimesh.creation.icosphere(3, 1.0)).key
    assert np.isnan(field.kernel().points(np.array([np.nan]), np.zeros(1), np.zeros(1))).all()


def test_runs_of_points_far_near_and_scattered_have_the_distances_of_single_points() -> None:
    field = field_of(trimesh.creation.icosphere(3, 5.0), trimesh.creation.box((3, 4, 14)))
    line = np.linspace(-9, 9, 70)
    spread = np.random.default_rng(0).uniform(-9, 9, (3, 200))
    points = np.ascontiguousarray(np.concatenate([np.stack([line, line / 3, 0 * line + 1], 1), spread.T]))
    nearest = Nearest(field.mesh)
    result = nearest.points(points)
    alone = np.array([nearest.points(p[None])[0] for p in points])
    exact = trimesh.proximity.closest_point_naive(field.mesh.to_trimesh(), points)[1]
    assert result == pytest.approx(alone, abs=1e-12) and result == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("away", stamped([0.0, 1e4], [1e4]))
def test_bricks_have_the_least_of_the_distances_of_all_triangles(away: float) -> None:
    corners_of = [[0, 0, 0], [9, 1e-9, 0], [4, 0, 0], [2, 3, 1]]
    needles = trimesh.Trimesh(corners_of, [[0, 1, 2], [0, 1, 3], [3, 3, 3]])
    parts = trimesh.creation.icosphere(2, 5.0), trimesh.creation.box((3, 4, 14)), needles
    field = field_of(*(moved(part, away, away / 2, 0) for part in parts))
    corners = 8 * np.indices((4, 4, 4)).reshape(3, -1).T.astype(np.int32)[::5].copy()
    kernel, origin, voxel = field.kernel("cpu", "float64"), (away - 9.0, away / 2 - 8.9, -8.8), 0.57
    values = np.empty((len(corners), 512))
    kernel.bricks(corners, origin, voxel, values)
    inner = np.indices((8, 8, 8)).reshape(3, 512)
    points = np.array([origin[k] + voxel * (corners[:, k, None] + inner[k]) for k in range(3)]).reshape(3, -1)
    assert (kernel.points(*points) == values.ravel()).all()
    some = np.ascontiguousarray(points.T[::97])
    ones = [Nearest(Mesh(field.mesh.vertices, one[None])).points(some) for one in field.mesh.triangles]
    assert (np.abs(values.ravel()[::97]) == np.min(ones, axis=0)).all()


def test_points_above_each_other_share_the_crossings_of_their_line() -> None:
    plates = [trimesh.creation.box((10, 10, 1)) for _ in range(20)]
    for k, plate in enumerate(plates):
        plate.apply_translation((0, 0, 2 * k))
    z = np.linspace(-1, 39, 410)
    values = field_of(*plates).kernel().points(0 * z + 0.3, 0 * z + 0.2, z)
    assert ((values < 0) == (np.abs((z + 1) % 2 - 1) < 0.5)).all()


@pytest.mark.parametrize("sides", [(20, 0.05, 20), (3, 4, 5), (1e-4, 9, 9), (0.01, 0.01, 30)])
def test_few_triangles_are_compared_one_by_one_to_the_last_bit(sides: tuple[float, float, float]) -> None:
    field = field_of(moved(trimesh.creation.box(sides), 0.1, -0.2, 0.3))
    rng = np.random.default_rng(2)
    some = rng.uniform(-1, 1, (2000, 3)) * np.array(sides) * rng.choice([0.4, 0.5, 0.51, 0.8], (2000, 1))
    points = np.ascontiguousarray(some + [0.1, -0.2, 0.3])
    nearest = Nearest(field.mesh)
    alone = np.array([nearest.points(p[None])[0] for p in points])
    np.testing.assert_array_equal(np.abs(field.kernel("cpu", "float64").points(*points.T)), alone)


def test_bricks_have_the_values_of_their_points() -> None:
    field = field_of(trimesh.creation.box((20, 0.05, 20)), moved(trimesh.creation.icosphere(2, 3.0), 4, 1, 0))
    corners = np.array([(-8, -8, 0), (0, -8, 8), (40, 0, -16), (-96, 0, 96)], np.int32)
    origin, inner = (0.03, -0.01, 0.02), np.indices((8, 8, 8)).reshape(3, 512)
    for kernel in (field.kernel(), field.kernel("cpu", "float64")):
        out = np.empty((len(corners), 512), kernel.dtype)
        kernel.bricks(corners, origin, 0.1, out)
        grid = [origin[k] + 0.1 * (corners[:, k, None] + inner[k]) for k in range(3)]
        np.testing.assert_array_equal(out, kernel.points(*grid))
