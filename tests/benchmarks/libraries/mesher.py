"""A Python library as a peer: `python -m tests.benchmarks.libraries.mesher NAME WORKLOAD RESOLUTION OUTPUT`.

Each is given our compiled field, so that what is compared is how it samples and meshes. Once warm, it writes
a PLY file and prints its seconds and how often it evaluated the field.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

import numpy as np

from fracslice.bench.measure import WARM, WORKLOADS, Workload, grid
from fracslice.formats import write
from fracslice.mesh import Mesh
from fracslice.work import Work

from ..runner import timed

Result = tuple[Mesh, int]
"""A mesh in scene units, and how often the field was evaluated."""


def by_sdf(what: Workload, resolution: int) -> Result:
    """sdf (Fogleman): batches skipped by |f|, which is taken for a distance: f / L is one."""
    import sdf

    kernel, bound, count = what.root.kernel(), what.root.bounds.lipschitz, 0

    def field(p: np.ndarray) -> np.ndarray:
        nonlocal count
        count += len(p)
        return kernel.points(*p.T) / np.float32(bound)

    reach = what.half, what.half, what.half
    box = tuple(-x for x in reach), reach
    soup = np.array(sdf.generate(sdf.sdf3(lambda: field)(), what.voxel(resolution), box, verbose=False))
    points, corners = np.unique(soup, axis=0, return_inverse=True)
    return Mesh(points, corners.reshape(-1, 3).astype(np.int32)), count


def by_isomesh(what: Workload, resolution: int) -> Result:
    """isomesh (Seo): an octree, manifold dual contouring, vertices moved onto the surface.

    From a coarser start it finds nothing of the Menger sponge.
    """
    import isomesh

    kernel, count, depth = what.root.kernel("cpu", "float64"), 0, resolution.bit_length() - 1

    def field(p: np.ndarray) -> tuple[np.ndarray, None]:
        nonlocal count
        count += len(p)
        return kernel.points(*p.T), None

    box = {"bbox_min": (-what.half,) * 3, "bbox_max": (what.half,) * 3}
    points, triangles = isomesh.extract(field, **box, min_depth=depth - 1, max_depth=depth)
    return Mesh(points, triangles.astype(np.int32)), count


def by_mcubes(what: Workload, resolution: int) -> Result:
    """PyMCubes: marching cubes on every point of the cube."""
    import mcubes

    values = grid(what, resolution, Work())
    points, triangles = mcubes.marching_cubes(values, 0.0)
    return _placed(points, triangles, what, resolution), values.size


def by_vtk(what: Workload, resolution: int) -> Result:
    """VTK's flying edges on every point of the cube, through pyvista."""
    import pyvista

    values = grid(what, resolution, Work())
    image = pyvista.ImageData(dimensions=values.shape)
    image["f"] = values.ravel(order="F")
    result = image.contour([0.0], "f", method="flying_edges", compute_normals=False, compute_scalars=False)
    return _placed(result.points, result.faces.reshape(-1, 4)[:, 1:], what, resolution), values.size


def _placed(points: np.ndarray, triangles: np.ndarray, what: Workload, resolution: int) -> Mesh:
    """From grid coordinates."""
    placed = points.astype(np.float64) * what.voxel(resolution) - what.half
    return Mesh(placed, np.ascontiguousarray(triangles, np.int32))


MESHERS: dict[str, Callable[[Workload, int], Result]] = {
    "sdf": by_sdf,
    "isomesh": by_isomesh,
    "mcubes": by_mcubes,
    "pyvista": by_vtk,
}
"""By the name of the module that each needs."""


def main() -> None:
    name, workload, resolution, output = sys.argv[1:]
    make, what = MESHERS[name], WORKLOADS[workload]
    make(what, 1 << (WARM.bit_length() - 1))
    made: list[Result] = []
    spent = timed(lambda: made.append(make(what, int(resolution))))
    mesh, count = made[0]
    if mesh.volume < 0:
        mesh = Mesh(mesh.vertices, np.ascontiguousarray(mesh.triangles[:, ::-1]))
    write(mesh, output)
    print(json.dumps({**spent, "evaluations": count}))


if __name__ == "__main__":
    main()
