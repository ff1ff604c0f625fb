"""Bodies of a mesh that nearly touch."""

from __future__ import annotations

import numpy as np

from .model import Mesh
from .topology import component_sizes, connected_components


def near_bodies(mesh: Mesh, reach: float, threads: int = 0) -> int:
    """Count the bodies of a mesh that have another within reach.

    Vertices are sorted into the cubes of two lattices; bodies with vertices in one cube are near. Bodies that
    are nearer than half the reach share one, but for a few.

    Parameters
    ----------
    mesh : Mesh
        Closed mesh.
    reach : float
        Edge length of the cubes.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    int
        Number of bodies; cavities are none.
    """
    labels, count = connected_components(mesh.triangles, len(mesh.vertices), threads)
    sizes = component_sizes(mesh.vertices, mesh.triangles, labels, count, threads)
    body = (labels >= 0) & (sizes.volumes > 0)[labels]
    near = np.zeros(count, bool)
    for shift in (0.0, 0.5):
        cells = np.floor(mesh.vertices[body] / reach + shift).astype(np.int64)
        rows = np.unique(np.column_stack([cells, labels[body]]), axis=0)
        same = (rows[1:, :3] == rows[:-1, :3]).all(axis=1)
        near[rows[1:, 3][same]] = near[rows[:-1, 3][same]] = True
    return int(near.sum())


def touching_note(mesh: Mesh, voxel: float, threads: int = 0) -> tuple[str, ...]:
    """Describe the bodies that touch at points or edges only, and the option that joins them.

    Parameters
    ----------
    mesh : Mesh
        Mesh of several bodies, mm.
    voxel : float
        Voxel size, mm.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    tuple of str
        One note, or none.
    """
    near = near_bodies(mesh, 2 * voxel, threads)
    if not near:
        return ()
    return (
        f"{near} bodies come within two voxels of another: solids that touch at points or edges only are not "
        f"joined, and tips thinner than a voxel come off; --thickness {3 * voxel:.2g}mm joins them, --bridge "
        f"adds struts between bodies that are apart, --keep largest leaves one, a smaller voxel keeps tips",
    )
