"""Triangles at tips, which a file holds last."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from .model import Mesh
from .pieces import rows


def tips_last(meshes: Iterable[Mesh], tips: NDArray[np.float64]) -> Iterator[Mesh]:
    """Move the triangles at tips to the end, tip after tip, in the order of a mesh in one piece.

    Parameters
    ----------
    meshes : iterable of Mesh
        Pieces, mm, quantised.
    tips : ndarray of float64, shape (k, 3)
        Tips, mm, placed as the mesh is.

    Yields
    ------
    Mesh
        The pieces without triangles at tips, then these triangles.
    """
    late: list[tuple[int, NDArray[np.float64]]] = []
    for mesh in meshes:
        of = at_tips(mesh, tips)
        at = np.flatnonzero(of >= 0)
        late += zip(of[at].tolist(), mesh.corners[at], strict=True)
        yield mesh.selected(of < 0) if len(at) else mesh
    if late:
        yield by_tip(late)


def at_tips(mesh: Mesh, tips: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find the triangles at tips.

    Parameters
    ----------
    mesh : Mesh
        A piece, mm, quantised.
    tips : ndarray of float64, shape (k, 3)
        Tips, mm, placed as the mesh is.

    Returns
    -------
    ndarray of int64, shape (m,)
        Tip of each triangle, or -1.
    """
    if not len(tips):
        return np.full(len(mesh.triangles), -1)
    places = {tuple(tip): number for number, tip in enumerate(tips.astype(np.float32).tolist())}
    near = np.flatnonzero(np.isin(mesh.vertices[:, 0], [tip[0] for tip in places]))
    of_vertex = np.full(len(mesh.vertices), -1)
    of_vertex[near] = [places.get(tuple(point), -1) for point in mesh.vertices[near].tolist()]
    of_triangle: NDArray[np.int64] = of_vertex[mesh.triangles].max(axis=1, initial=-1)
    return of_triangle


def by_tip(triangles: list[tuple[int, NDArray[np.float64]]]) -> Mesh:
    """Mesh of triangles at tips, tip after tip.

    Parameters
    ----------
    triangles : list of tuple
        Tip and corners of each triangle.

    Returns
    -------
    Mesh
        The triangles, unconnected.
    """
    corners = np.array([corners for _, corners in sorted(triangles, key=lambda pair: pair[0])])
    count = 3 * len(corners)
    return Mesh(corners.reshape(-1, 3), np.arange(count, dtype=np.int32).reshape(-1, 3))


def tips_to_end(mesh: Mesh, tips: NDArray[np.float64]) -> tuple[Mesh, NDArray[np.int64], int]:
    """Move the triangles at tips to the end of a piece, tip after tip.

    Parameters
    ----------
    mesh : Mesh
        A piece, scene units.
    tips : ndarray of float64, shape (k, 3)
        Tips, scene units.

    Returns
    -------
    Mesh
        The piece.
    ndarray of int64, shape (m,)
        Former index of each triangle.
    int
        Number of triangles at tips.
    """
    _, known, here = np.intersect1d(rows(tips), rows(mesh.vertices), return_indices=True)
    of_vertex = np.full(len(mesh.vertices), -1)
    of_vertex[here] = known
    of = of_vertex[mesh.triangles].max(axis=1, initial=-1)
    order = np.argsort(of, kind="stable")
    return Mesh(mesh.vertices, mesh.triangles[order]), order, int(np.count_nonzero(of >= 0))
