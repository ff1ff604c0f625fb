"""Small meshes, good and bad, for the tests of meshes, files and pictures."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fracslice.common.arrays import concatenate
from fracslice.mesh import Mesh

CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
CUBE_SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def cube(size: float = 10.0, at: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    triangles = [t for a, b, c, d in CUBE_SIDES for t in ((a, b, c), (a, c, d))]
    return Mesh(np.array(CUBE, float) * size + at, np.array(triangles, np.int32))


def sphere(radius: float = 10.0, at: tuple[float, float, float] = (0, 0, 0), level: int = 3) -> Mesh:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=level, radius=radius)
    return Mesh(np.array(ball.vertices, float) + at, np.array(ball.faces, np.int32))


def torus(major: float = 10.0, minor: float = 3.0, at: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    import trimesh

    ring = trimesh.creation.torus(major, minor, major_sections=48, minor_sections=24)
    return Mesh(np.array(ring.vertices, float) + at, np.array(ring.faces, np.int32))


def inverted(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, np.ascontiguousarray(mesh.triangles[:, ::-1]))


def without(mesh: Mesh, triangle: int) -> Mesh:
    return mesh.selected(np.arange(len(mesh.triangles)) != triangle)


def with_triangle(mesh: Mesh, *corners: int) -> Mesh:
    return Mesh(mesh.vertices, np.vstack([mesh.triangles, np.array([corners], np.int32)]))


def with_fin(mesh: Mesh) -> Mesh:
    a, b, _ = mesh.triangles[0].tolist()
    vertices = np.vstack([mesh.vertices, [[15, 15, 60]]])
    return Mesh(vertices, np.vstack([mesh.triangles, np.array([[a, b, len(vertices) - 1]], np.int32)]))


def with_flipped(mesh: Mesh, triangle: int) -> Mesh:
    triangles = mesh.triangles.copy()
    triangles[triangle] = triangles[triangle, ::-1]
    return Mesh(mesh.vertices, triangles)


def with_moved(mesh: Mesh, vertex: int, to: tuple[float, float, float]) -> Mesh:
    vertices = mesh.vertices.copy()
    vertices[vertex] = to
    return Mesh(vertices, mesh.triangles)


def split_on_one_side(mesh: Mesh) -> Mesh:
    a, b, c = mesh.triangles[0].tolist()
    middle = len(mesh.vertices)
    vertices = np.vstack([mesh.vertices, (mesh.vertices[a] + mesh.vertices[b]) / 2])
    return Mesh(vertices, np.vstack([mesh.triangles[1:], [[a, middle, c], [middle, b, c]]]).astype(np.int32))


def cracked(mesh: Mesh) -> Mesh:
    triangles = mesh.triangles.copy()
    moved = mesh.vertices[triangles[5, 0]] + (1e-3, 0, 0)
    triangles[5, 0] = len(mesh.vertices)
    return Mesh(np.vstack([mesh.vertices, moved]), triangles)


def standing_tip() -> Mesh:
    corners = np.array([[3, 2, 16], [8, 3, 17], [5, 8, 18], [5, 5, 10]], float)
    return Mesh(corners, np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], np.int32))


GOOD: dict[str, Callable[[], Mesh]] = {
    "sphere": sphere,
    "cube": cube,
    "torus": torus,
    "hollow": lambda: concatenate([sphere(), inverted(sphere(8))]),
    "body in a cavity": lambda: concatenate([sphere(), inverted(sphere(8)), sphere(3)]),
    "two apart": lambda: concatenate([sphere(), sphere(at=(30, 0, 0))]),
}

BAD: dict[str, tuple[Callable[[], Mesh], str]] = {
    "hole": (lambda: without(sphere(), 400), "open edges"),
    "flipped triangle": (lambda: with_flipped(sphere(), 400), "opposite orientation"),
    "inside out": (lambda: inverted(sphere()), "inside out"),
    "overlapping": (lambda: concatenate([sphere(), sphere(at=(8, 0, 0))]), "cut or touch"),
    "spike through": (lambda: with_moved(sphere(), 0, (0, 0, -30)), "cut or touch"),
    "nested, both outward": (lambda: concatenate([sphere(), sphere(5)]), "inside another body"),
    "cavity in nothing": (lambda: concatenate([sphere(), inverted(sphere(5, at=(30, 0, 0)))]), "inside out"),
    "shared edge": (lambda: concatenate([cube(), cube(at=(10, 10, 0))]), "more than two"),
    "shared vertex": (lambda: concatenate([cube(), cube(at=(10, 10, 10))]), "touches itself"),
    "shared wall": (lambda: concatenate([cube(), cube(at=(10, 0, 0))]), "more than two"),
    "coplanar overlap": (lambda: concatenate([cube(), cube(at=(5, 0, 0))]), "cut or touch"),
    "partly touching walls": (lambda: concatenate([cube(), cube(at=(10, 5, 5))]), "cut or touch"),
    "tip on a wall": (lambda: concatenate([cube(), standing_tip()]), "cut or touch"),
    "fin": (lambda: with_fin(sphere()), "more than two"),
    "repeated triangle": (lambda: with_triangle(cube(), 0, 1, 3), "that repeats another"),
    "needle": (lambda: with_triangle(sphere(), 0, 0, 1), "without area"),
    "split on one side": (lambda: split_on_one_side(sphere()), "open edges"),
    "crack of a micrometre": (lambda: cracked(sphere()), "open edges"),
}
