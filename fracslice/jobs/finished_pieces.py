"""Finished triangles of the pieces of a shared mesh."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, ResultFolder, packed, unpacked
from ..mesh.model import Mesh, joined


def finished_mesh(mesh: Mesh) -> Contents:
    """Contents of a file with finished triangles, whose vertices are float32 numbers.

    Parameters
    ----------
    mesh : Mesh
        The triangles, mm, quantised.

    Returns
    -------
    sequence of bytes-like
        For `read_finished`.
    """
    return packed(vertices=mesh.vertices.astype(np.float32), triangles=mesh.triangles)


def read_finished(pieces: ResultFolder, job: str, name: str) -> Mesh:
    """Finished triangles from their file.

    Parameters
    ----------
    pieces : ResultFolder
        Folder with the files of the job.
    job, name : str
        Key of the job and name of the file.

    Returns
    -------
    Mesh
        The triangles, mm.
    """
    files = unpacked(pieces.read(job, name))
    return Mesh(files["vertices"].astype(np.float64), files["triangles"])


def welded(mesh: Mesh) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Merge equal vertices.

    Parameters
    ----------
    mesh : Mesh
        Finished triangles.

    Returns
    -------
    ndarray of float32, shape (n, 3)
        Vertices by their first use.
    ndarray of int32, shape (m, 3)
        Triangles.
    """
    from .._native import weld

    ordered = mesh.in_order()
    points = ordered.vertices.astype(np.float32)
    first, labels = weld(points)
    return points[first], labels[ordered.triangles]


def joined_pieces(meshes: Iterable[Mesh]) -> Mesh:
    """One mesh of the finished triangles of all pieces.

    Parameters
    ----------
    meshes : iterable of Mesh
        Finished triangles, in order.

    Returns
    -------
    Mesh
        The mesh, mm; its vertices are in the order of their first use.
    """
    points, triangles = welded(joined(list(meshes)))
    return Mesh(points.astype(np.float64), triangles)


def piece_rows(starts: NDArray[np.int64], begin: int, end: int) -> Iterator[tuple[int, slice]]:
    """Rows of each piece within a range of the rows of all pieces.

    Parameters
    ----------
    starts : ndarray of int64, shape (p + 1,)
        Row at which each piece starts, and the end.
    begin, end : int
        The range, `end` excluded.

    Yields
    ------
    int, slice
        Index of a piece, and its rows.
    """
    first, last = np.searchsorted(starts, (begin, end - 1), side="right") - 1
    for number in range(first, min(last + 1, len(starts) - 1)):
        start, stop = (int(at) for at in starts[number : number + 2])
        yield number, slice(max(begin - start, 0), min(end, stop) - start)
