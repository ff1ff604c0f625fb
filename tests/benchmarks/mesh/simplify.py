"""Triangles left within a tolerance, CPU seconds and defects, beside manifold3d and pymeshlab.

manifold3d takes a tolerance; pymeshlab's quadric edge collapse takes a number of triangles and is given ours.
Off: the greatest distance of the original's vertices from the result, in tolerances.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from fracslice.formulas import julia, mandelbulb, menger, sphere
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.cleaning import quantise_mesh
from fracslice.mesh.contouring import contour
from fracslice.mesh.model import Nearest, to_manifold
from fracslice.mesh.simplify import simplify
from fracslice.volume import plan, sample_scene
from fracslice.work import Work

from ..runner import Row, Run

SCENES = {
    "sphere": (sphere(), 128.0),
    "Menger level 3": (menger(level=3), 101.3),
    "Mandelbulb": (mandelbulb(iterations=8), 64.0),
    "Julia": (julia(iterations=10), 64.0),
}
TOLERANCE = 0.05
"""In voxels."""

RUNS = 1
SMALLEST = {"scenes": ("sphere",), "share": 0.1}


def by_manifold3d(mesh: Mesh, tolerance: float, count: int) -> Mesh:
    measured = to_manifold(mesh).as_original().simplify(tolerance).to_mesh64()
    return Mesh(np.ascontiguousarray(measured.vert_properties[:, :3]), measured.tri_verts.astype(np.int32))


def by_pymeshlab(mesh: Mesh, tolerance: float, count: int) -> Mesh:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.triangles))
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=count, preservetopology=True, preservenormal=True, planarquadric=True
    )
    measured = meshes.current_mesh()
    return Mesh(measured.vertex_matrix(), measured.face_matrix().astype(np.int32))


def by_us(mesh: Mesh, tolerance: float, count: int) -> Mesh:
    return simplify(mesh, tolerance)[0]


METHODS = {"fracslice": by_us, "manifold3d": by_manifold3d, "pymeshlab": by_pymeshlab}


def rows(run: Run, scenes: tuple[str, ...] = tuple(SCENES), share: float = 1.0) -> Iterator[Row]:
    for name in scenes:
        root, resolution = SCENES[name]
        planned = plan(root, share * resolution)
        mesh, tolerance = quantise_mesh(contour(root, sample_scene(planned))), TOLERANCE * planned.voxel
        count = len(by_us(mesh, tolerance, 0).triangles)
        acts = {how: partial(method, mesh, tolerance, count) for how, method in METHODS.items()}
        measured = run.interleaved(acts, warm=False)
        for how, act in acts.items():
            few = act()
            off = Nearest(few).samples(mesh, 10 * planned.voxel, Work(run.threads[0])).max() / tolerance
            sizes = {
                "triangles": len(few.triangles),
                "of all": f"{len(few.triangles) / len(mesh.triangles):.1%}",
            }
            row = {"": name, "voxels": share * resolution, "by": how, **sizes, "off": float(off)}
            yield {
                **row,
                "CPU s": measured.spread(how, "cpu_s"),
                "defects": ", ".join(check_mesh(few).problems) or "none",
            }
