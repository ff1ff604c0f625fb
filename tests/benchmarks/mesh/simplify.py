"""Triangles left within a tolerance, beside libraries: ``python -m tests.benchmarks.mesh.simplify``.

manifold3d takes a tolerance; pymeshlab's quadric edge collapse takes a number of triangles and is given ours.
Off: the greatest distance of the original's vertices from the result, in tolerances.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from fracslice.formulas import julia, mandelbulb, menger, sphere
from fracslice.mesh import Mesh
from fracslice.mesh.check import check_mesh
from fracslice.mesh.extract import contour
from fracslice.mesh.nearest import Nearest
from fracslice.mesh.quantisation import quantised
from fracslice.mesh.simplify import simplify
from fracslice.mesh.solid import to_manifold
from fracslice.volume import plan, sample_scene
from fracslice.work import Work

SCENES = {
    "sphere, 128": (sphere(), 128),
    "Menger level 3, 101.3": (menger(level=3), 101.3),
    "Mandelbulb, 64": (mandelbulb(iterations=8), 64),
    "Julia, 64": (julia(iterations=10), 64),
}
TOLERANCE = 0.05
"""In voxels."""


def by_manifold3d(mesh: Mesh, tolerance: float, count: int) -> Mesh:
    found = to_manifold(mesh).as_original().simplify(tolerance).to_mesh64()
    return Mesh(np.ascontiguousarray(found.vert_properties[:, :3]), found.tri_verts.astype(np.int32))


def by_pymeshlab(mesh: Mesh, tolerance: float, count: int) -> Mesh:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.triangles))
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=count, preservetopology=True, preservenormal=True, planarquadric=True
    )
    found = meshes.current_mesh()
    return Mesh(found.vertex_matrix(), found.face_matrix().astype(np.int32))


def by_us(mesh: Mesh, tolerance: float, count: int) -> Mesh:
    return simplify(mesh, tolerance)[0]


def main() -> None:
    ways: tuple[Callable[[Mesh, float, int], Mesh], ...] = (by_us, by_manifold3d, by_pymeshlab)
    simplify(quantised(contour(sphere(), sample_scene(plan(sphere(), 16)))), 0.01)
    print(f"{'':22}{'':15}{'triangles':>10}{'of all':>8}{'off':>8}{'CPU s':>8}  defects")
    for name, (root, resolution) in SCENES.items():
        planned, count = plan(root, resolution), 0
        mesh, tolerance = quantised(contour(root, sample_scene(planned))), TOLERANCE * planned.voxel
        for way in ways:
            start = time.process_time()
            few = way(mesh, tolerance, count)
            spent, count = time.process_time() - start, count or len(few.triangles)
            off = Nearest(few).samples(mesh, 10 * planned.voxel, Work()).max() / tolerance
            share = len(few.triangles) / len(mesh.triangles)
            defects = ", ".join(check_mesh(few).problems) or "none"
            numbers = f"{len(few.triangles):10}{share:8.1%}{off:8.2f}{spent:8.1f}"
            print(f"{name:22}{way.__name__[3:]:15}{numbers}  {defects}", flush=True)


if __name__ == "__main__":
    main()
