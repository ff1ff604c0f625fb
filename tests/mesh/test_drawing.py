"""Pictures of meshes against what is known of a box."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from fracslice import Mesh
from fracslice._native import foremost
from fracslice.mesh.clusters import Clusters
from fracslice.mesh.drawing import BEHIND, SECTION, MeshView, Plane, Projection, clip
from fracslice.scene.view import Camera

pytestmark = pytest.mark.once

SIZE = 240, 160
CAMERA = Camera(eye=(0.0, -10.0, 0.0), target=(0.0, 0.0, 0.0), fov=40)


def box(*sides: float) -> Mesh:
    made = trimesh.creation.box(sides)
    return Mesh(np.array(made.vertices, np.float64), np.array(made.faces, np.int32))


def covered(pixels: np.ndarray) -> int:
    return int((pixels != BEHIND).any(2).sum())


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_a_box_covers_the_pixels_of_its_front(kind: str) -> None:
    camera, half = replace(CAMERA, kind=kind), 1.0
    drawn = MeshView(box(2, 2, 2)).draw(camera, SIZE)
    away = 9.0 if kind == "perspective" else 10.0
    side = half * SIZE[1] / 2 / np.tan(np.radians(20)) / away * 2
    assert covered(drawn.pixels) ** 0.5 == pytest.approx(side, abs=1)
    spot = drawn.at(SIZE[0] / 2, SIZE[1] / 2)
    assert spot is not None and spot.corners is not None
    start, along = Projection.of(camera, SIZE).ray(SIZE[0] / 2 + 0.5, SIZE[1] / 2 + 0.5)
    np.testing.assert_allclose(spot.point, start + (-1 - start[1]) / along[1] * along, atol=1e-9)
    assert min(spot.weights) >= -1e-9 and sum(spot.weights) == pytest.approx(1)
    assert drawn.at(0, 0) is None and drawn.at(-1, 900) is None


def test_a_coarse_copy_is_near_its_mesh_in_its_colours() -> None:
    ball = trimesh.creation.icosphere(5)
    shade = (255 * (ball.vertices[:, 2] > 0)).astype(np.uint8)
    fine = Mesh(np.array(ball.vertices), np.array(ball.faces, np.int32), np.stack([shade] * 3, 1))
    clusters = Clusters.within(fine, 0.1)
    coarse = clusters.mesh(fine)
    assert len(coarse.triangles) < len(fine.triangles) / 5
    distances = np.linalg.norm(coarse.vertices, axis=1)
    assert distances.min() > 1 - 0.1**2 and distances.max() <= 1
    assert coarse.volume == pytest.approx(fine.volume, rel=0.01)
    assert coarse.colours is not None
    assert (coarse.colours[coarse.vertices[:, 2] > 0.1] == 255).all()
    assert (coarse.colours[coarse.vertices[:, 2] < -0.1] == 0).all()
    (together,) = Clusters.within(fine, 10.0).means(fine.vertices)
    np.testing.assert_allclose(together, 0, atol=1e-9)


def test_what_is_seen_through_a_cut_is_the_section() -> None:
    hollow = trimesh.boolean.difference([trimesh.creation.box((2, 2, 2)), trimesh.creation.box((1, 1, 1))])
    mesh = Mesh(np.array(hollow.vertices, np.float64), np.array(hollow.faces, np.int32))
    drawn = MeshView(mesh, cut=Plane((0.0, -1.0, 0.0), 0.0)).draw(replace(CAMERA, kind="orthographic"), SIZE)
    section = (drawn.pixels == SECTION).all(2)
    assert section.sum() / covered(drawn.pixels) == pytest.approx(3 / 4, abs=0.02)
    middle, wall = drawn.at(120, 80), drawn.at(120, 80 - 17)
    assert middle is not None and middle.point[1] == pytest.approx(0.5) and middle.corners is not None
    assert wall is not None and wall.point[1] == pytest.approx(0.0) and wall.corners is None


def test_clipped_triangles_have_the_area_behind_the_plane() -> None:
    mesh = box(2, 3, 4)
    plane = Plane((0.3, -0.5, 0.8), 0.4)
    part = clip(mesh.triangles, plane.heights(mesh.vertices))
    made = Mesh(part.values(mesh.vertices), part.triangles)
    capped = trimesh.Trimesh(mesh.vertices, mesh.triangles).slice_plane(
        np.array(plane.normal) * plane.offset / np.dot(plane.normal, plane.normal), -np.array(plane.normal)
    )
    assert made.area == pytest.approx(capped.area)
    assert plane.heights(made.vertices[np.unique(made.triangles)]).max() < 1e-12
    assert set(part.of) <= set(range(len(mesh.triangles)))


def test_nothing_behind_the_eye_is_drawn() -> None:
    inside = replace(CAMERA, eye=(0.0, 0.0, 0.0), target=(0.0, 1.0, 0.0))
    drawn = MeshView(box(2, 2, 2)).draw(inside, SIZE)
    assert covered(drawn.pixels) == SIZE[0] * SIZE[1]
    spot = drawn.at(120, 80)
    assert spot is not None and spot.point[1] == pytest.approx(1.0)


def test_colours_are_those_of_the_corners() -> None:
    mesh = box(2, 2, 2)
    red = replace(mesh, colours=np.uint8(np.where(mesh.vertices[:, :1] > 0, [255, 0, 0], [0, 0, 255])))
    pixels = MeshView(red).draw(CAMERA, SIZE).pixels.astype(int)
    left, right = pixels[80, 100], pixels[80, 140]
    assert left[2] > 2 * left[0] and right[0] > 2 * right[2]
    edged = MeshView(red, edges=True).draw(CAMERA, SIZE).pixels.astype(int)
    assert (edged <= pixels).all() and (edged < pixels).any()


def test_the_foremost_triangle_is_that_of_all_at_each_pixel() -> None:
    rng = np.random.default_rng(7)
    points = np.concatenate([rng.uniform(-4, 24, (60, 3)), rng.integers(-2, 44, (60, 3)) / 2.0])
    triangles = rng.integers(0, len(points), (80, 3)).astype(np.int32)
    y, x = (axis.astype(float) + 0.5 for axis in np.mgrid[0:16, 0:20])
    best, front = np.full(x.shape, -np.inf), np.full(x.shape, -1)
    for number, (a, b, c) in enumerate(points[triangles]):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
        w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
        z = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
        nearer = (v >= 0) & (w >= 0) & (v + w <= 1) & (z > best)
        best[nearer], front[nearer] = z[nearer], number
    np.testing.assert_array_equal(foremost(points, triangles, (16, 20)), front)
    far = np.concatenate([points, [[1e12, -1e12, 0.0], [-1e12, 3e12, 0.0], [-1e12, -1e12, 0.0]]])
    whole = np.array([[120, 121, 122]], np.int32)
    assert (foremost(far, whole, (16, 20)) == 0).all()
