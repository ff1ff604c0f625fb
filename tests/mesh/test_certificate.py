"""What is proved of a mesh need not be searched, and what is not proved is: no self-intersection gets by."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fracslice.formulas import Node, box, difference, mandelbulb, menger, shell, sphere, transform
from fracslice.mesh import Mesh
from fracslice.mesh.certificate import Certificate
from fracslice.mesh.check import MeshReport, check_mesh, check_quantised
from fracslice.mesh.clean import cleaned
from fracslice.mesh.extract import contour
from fracslice.volume import plan, sample_scene

SOLIDS: dict[str, Node] = {
    "fractal": mandelbulb(iterations=6),
    "edges": menger(level=2),
    "turned": transform(difference(box(), sphere(radius=0.6)), rotate=(1, 2, 3, 40)),
    "thin": shell(sphere(), thickness=0.1),
}


@cache
def made(name: str) -> tuple[Mesh, Certificate]:
    planned = plan(SOLIDS[name], 40)
    bricks = sample_scene(planned)
    mesh = contour(planned.root, bricks)
    return mesh, Certificate.of(bricks, len(mesh.triangles))


def both(mesh: Mesh, known: Certificate, threads: int = 2) -> tuple[MeshReport, MeshReport]:
    """The report on a cleaned mesh by what is proved, and by a search of all of it."""
    found = cleaned(mesh, known, threads=threads)
    return check_quantised(found.mesh, found.proved, threads), check_mesh(found.mesh)


@pytest.mark.parametrize("name", SOLIDS)
def test_a_mesh_as_it_was_contoured_is_proved(name: str) -> None:
    report, whole = both(*made(name))
    assert report.searched_triangles <= 12
    assert replace(report, searched_triangles=whole.searched_triangles) == whole
    assert whole.searched_triangles == whole.triangles and whole.problems == ()


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("voxels", [2**16, 2**19, 2**21, 2**24])
def test_what_quantising_displaces_is_searched(name: str, voxels: int) -> None:
    """So far from the origin that a voxel has ever fewer steps of float32."""
    mesh, known = made(name)
    offset = np.full(3, voxels * np.diff(known.planes[:2, 0])[0])
    report, whole = both(mesh.translated(offset), known.translated(offset))
    assert replace(report, searched_triangles=whole.searched_triangles) == whole
    assert whole.self_intersections > 0 or (name, voxels) != ("fractal", 2**19)
    assert report.searched_triangles == whole.searched_triangles or voxels < 2**24


@pytest.mark.parametrize("name", SOLIDS)
def test_a_sown_self_intersection_is_found(name: str) -> None:
    """Vertices pushed through the object, as a wrong step between contouring and the file would."""
    mesh, known = made(name)
    for seed in range(3):
        pushed, vertices = (
            np.random.default_rng(seed).integers(len(mesh.vertices), size=5),
            mesh.vertices.copy(),
        )
        vertices[pushed] *= -0.7
        holds = ~np.isin(mesh.triangles, pushed).any(axis=1)
        report, whole = both(Mesh(vertices, mesh.triangles), replace(known, holds=holds))
        assert replace(report, searched_triangles=whole.searched_triangles) == whole
        assert report.self_intersections > 0 and report.searched_triangles < 200


def test_no_certificate_proves_nothing() -> None:
    mesh, known = made("edges")
    report, whole = both(mesh, Certificate.none(len(mesh.triangles)))
    assert report == whole and report.searched_triangles == len(mesh.triangles)
    collapsed = Certificate(known.planes * 1e-9, known.holds)  # planes that are one in float32
    assert not cleaned(mesh, replace(collapsed, planes=collapsed.planes + 1)).proved.any()


def test_equal_for_any_number_of_threads() -> None:
    reports = [both(*made("fractal"), threads) for threads in (1, 2, 5)]
    assert reports[0] == reports[1] == reports[2]
