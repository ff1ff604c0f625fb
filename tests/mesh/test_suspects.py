"""What is proved of a mesh need not be searched, and what is not proved is: no self-intersection gets by."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from fracslice.formulas import Node, box, difference, mandelbulb, menger, shell, sphere, transform
from fracslice.mesh import Mesh
from fracslice.mesh.checks import MeshReport, Tally, check_mesh
from fracslice.mesh.cleaning import Finished, clean, grid_planes
from fracslice.mesh.contouring import contour
from fracslice.volume import plan, sample_scene
from tests.examples import stamped

pytestmark = pytest.mark.once

SOLIDS: dict[str, Node] = {
    "fractal": mandelbulb(iterations=6),
    "edges": menger(level=2),
    "turned": transform(difference(box(), sphere(radius=0.6)), rotate=(1, 2, 3, 40)),
    "thin": shell(sphere(), thickness=0.1),
}


@cache
def made(name: str) -> tuple[Mesh, np.ndarray]:
    """A mesh as it was contoured, and the planes of its grid."""
    planned = plan(SOLIDS[name], 24)
    bricks = sample_scene(planned)
    return contour(planned.root, bricks), grid_planes(bricks.signs)


NOTHING = np.empty(0, np.int64)


def both(
    mesh: Mesh, planes: np.ndarray, fresh: np.ndarray = NOTHING, threads: int = 2
) -> tuple[MeshReport, MeshReport]:
    """The report on a cleaned mesh by a search of its suspects, and by a search of all of it."""
    result = clean(mesh, np.ones(len(mesh.vertices), bool), fresh, planes=planes, threads=threads)
    whole, tally = check_mesh(result.mesh), Tally(threads)
    tally.add(Finished.whole(result.mesh, result.suspects))
    report = tally.report(whole.components, whole.cavities, whole.misplaced_shells)
    assert (report.volume_mm3, report.area_mm2) == pytest.approx((whole.volume_mm3, whole.area_mm2), rel=1e-3)
    return replace(report, volume_mm3=whole.volume_mm3, area_mm2=whole.area_mm2), whole


@pytest.mark.parametrize("name", SOLIDS)
def test_a_mesh_as_it_was_contoured_is_proved(name: str) -> None:
    report, whole = both(*made(name))
    assert report.searched_triangles <= 12
    assert replace(report, searched_triangles=whole.searched_triangles) == whole
    assert whole.searched_triangles == whole.triangles and whole.problems == ()


@pytest.mark.parametrize(
    ("name", "voxels"),
    stamped(
        product(SOLIDS, (2**16, 2**19, 2**21, 2**24)),
        [("edges", 2**16), ("thin", 2**19), ("turned", 2**21), ("fractal", 2**24)],
    ),
)
def test_what_quantising_displaces_is_searched(name: str, voxels: int) -> None:
    """So far from the origin that a voxel has ever fewer steps of float32."""
    mesh, planes = made(name)
    offset = np.full(3, voxels * np.diff(planes[:2, 0])[0])
    report, whole = both(mesh.translated(offset), planes + offset)
    assert replace(report, searched_triangles=whole.searched_triangles) == whole
    assert whole.self_intersections > 0 or (name, voxels) != ("fractal", 2**19)
    assert report.searched_triangles == whole.triangles or voxels < 2**24


@pytest.mark.parametrize("name", SOLIDS)
def test_a_sown_self_intersection_is_found(name: str) -> None:
    """Vertices pushed through the object, as a wrong step between contouring and the file would."""
    mesh, planes = made(name)
    for seed in range(3):
        pushed, vertices = (
            np.random.default_rng(seed).integers(len(mesh.vertices), size=5),
            mesh.vertices.copy(),
        )
        vertices[pushed] *= -0.7
        fresh = np.flatnonzero(np.isin(mesh.triangles, pushed).any(axis=1))
        report, whole = both(Mesh(vertices, mesh.triangles), planes, fresh)
        assert replace(report, searched_triangles=whole.searched_triangles) == whole
        assert report.self_intersections > 0 and report.searched_triangles < 400


def test_without_a_grid_all_is_searched() -> None:
    mesh, planes = made("edges")
    collapsed = planes * 1e-9 + 1  # planes that are one in float32
    for nothing in (planes[:0], collapsed):
        report, whole = both(mesh, nothing)
        assert report == whole and report.searched_triangles == len(mesh.triangles)


def test_equal_for_any_number_of_threads() -> None:
    reports = [both(*made("fractal"), threads=threads) for threads in (1, 2, 5)]
    assert reports[0] == reports[1] == reports[2]


def test_what_the_bed_moves_through_a_plane_is_searched() -> None:
    mesh, planes = made("edges")
    low, voxel = mesh.bounds[0, 2], planes[1, 2] - planes[0, 2]
    keep = np.ones(len(mesh.vertices), bool)

    def suspects(height: float, bed: float) -> int:
        """By the height of the lowest vertices above a plane of the grid that is at z = 0."""
        down = planes[np.searchsorted(planes[:, 2], low) - 1, 2] - low + height
        frame = (1.0, (0.0, 0.0, float(down)), bed)
        return len(clean(mesh, keep, planes=planes + [0, 0, down], frame=frame).suspects)

    assert suspects(0.3 * voxel, -np.inf) <= 12 < suspects(0.3 * voxel, 0.5 * voxel)
