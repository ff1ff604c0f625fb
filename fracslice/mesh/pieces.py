"""Surface in pieces along x, one in memory at a time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .._native import near
from ..store import Arrays
from .contouring import Piece
from .model import Mesh

NOTHING = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))


class Pieces:
    """Pieces of a surface, in order, with labels of their vertices; scene units.

    Parameters
    ----------
    folder : Path, optional
        Folder for the pieces; they are held in memory by default.

    Attributes
    ----------
    ends : list of float
        x at which each piece ends; infinite for the last one.
    starts : list of int
        Index of the first triangle of each piece.
    fresh : list of int
        Trailing triangles of each piece that were not made by contouring.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder, self.ends, self.starts = folder, list[float](), list[int]()
        self.fresh = list[int]()
        self._count = 0
        self._held: dict[str, Arrays] = {}

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def triangles(self) -> int:
        """Number of all triangles."""
        return self._count

    def anew(self) -> Pieces:
        """Return an empty collection in the same place, whose pieces replace those of this one."""
        return Pieces(self.folder)

    def add(self, piece: Piece, fresh: int = 0) -> None:
        """Append a piece.

        Parameters
        ----------
        piece : Piece
            The piece.
        fresh : int, optional
            Its trailing triangles that were not made by contouring.
        """
        self._put(f"mesh{len(self)}", vertices=piece.mesh.vertices, triangles=piece.mesh.triangles)
        self.count(piece.end, len(piece.mesh.triangles), fresh)

    def count(self, end: float, triangles: int, fresh: int = 0) -> None:
        """Append a piece that is stored already.

        Parameters
        ----------
        end : float
            x at which it ends.
        triangles : int
            Number of its triangles.
        fresh : int, optional
            Its trailing triangles that were not made by contouring.
        """
        self.ends.append(end)
        self.starts.append(self._count)
        self.fresh.append(fresh)
        self._count += triangles

    def label(self, number: int, labels: NDArray[np.int32]) -> None:
        """Store the labels of a piece.

        Parameters
        ----------
        number : int
            Index of the piece.
        labels : ndarray of int32, shape (n,)
            Label of each vertex.
        """
        self._put(f"labels{number}", labels=labels)

    def mesh(self, number: int) -> Mesh:
        """Load a piece.

        Parameters
        ----------
        number : int
            Index of the piece.

        Returns
        -------
        Mesh
            Its triangles, scene units.
        """
        arrays = self._get(f"mesh{number}")
        return Mesh(arrays["vertices"], arrays["triangles"])

    def labels(self, number: int) -> NDArray[np.int32]:
        """Load the labels of a piece.

        Parameters
        ----------
        number : int
            Index of the piece.

        Returns
        -------
        ndarray of int32, shape (n,)
            Label of each vertex.
        """
        return self._get(f"labels{number}")["labels"]

    def meshes(self) -> Iterator[Mesh]:
        """Iterate over the pieces.

        Returns
        -------
        iterator of Mesh
            Pieces, by ascending x.
        """
        return (self.mesh(number) for number in range(len(self)))

    def drop(self, number: int) -> None:
        """Release a piece that is held in memory.

        Parameters
        ----------
        number : int
            Index of the piece.
        """
        for name in ("mesh", "labels"):
            self._held.pop(f"{name}{number}", None)

    def near(self, points: NDArray[np.float64], reach: float) -> tuple[Mesh, NDArray[np.int64]]:
        """Triangles with a corner near points, as one mesh.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            Points, scene units.
        reach : float
            All corners within this distance along each axis are near.

        Returns
        -------
        Mesh
            The triangles.
        ndarray of int64, shape (k,)
            Their indices, ascending, counted from the first piece on.
        """
        parts, numbers = NOTHING, list[NDArray[np.int64]]()
        for number, mesh in enumerate(self.meshes()):
            chosen = near(mesh.vertices, mesh.triangles, points, reach)
            numbers.append(self.starts[number] + chosen)
            part = mesh.selected(np.bincount(chosen, minlength=len(mesh.triangles)) > 0)
            parts = joined(parts, part, self.ends[number - 1], reach / 2) if number else part
        return parts, np.concatenate(numbers)

    def together(self, first: int, last: int, seam: float) -> Mesh:
        """Join consecutive pieces to one mesh.

        Parameters
        ----------
        first, last : int
            Pieces `first` to `last` - 1.
        seam : float
            Maximum distance from the seam of vertices to be joined, scene units.
        """
        mesh = self.mesh(first)
        for number in range(first + 1, last):
            mesh = joined(mesh, self.mesh(number), self.ends[number - 1], seam)
        return mesh

    def _put(self, name: str, **arrays: NDArray[np.generic]) -> None:
        """Store arrays in memory or in the folder."""
        if self.folder is None:
            self._held[name] = arrays
        else:
            for part, array in arrays.items():
                path = self.folder / f"{name}-{part}.npy"
                path.unlink(missing_ok=True)  # the array may be the mapped file itself
                np.save(path, array)

    def _get(self, name: str) -> Arrays:
        """Load arrays from memory or from the folder."""
        if self.folder is None:
            return self._held[name]
        begin = len(name) + 1
        return {path.stem[begin:]: np.load(path, "r") for path in self.folder.glob(f"{name}-*.npy")}


def joined(one: Mesh, other: Mesh, seam: float, near: float) -> Mesh:
    """Join two meshes: bitwise equal vertices near the plane x = `seam` become one.

    Parameters
    ----------
    one, other : Mesh
        Meshes; the triangles of `one` come first.
    seam : float
        x of the plane.
    near : float
        Maximum distance of a joined vertex from the plane.
    """
    return seamed(one, other, seam, near)[0].compact()


def seamed(one: Mesh, other: Mesh, seam: float, near: float) -> tuple[Mesh, NDArray[np.int32]]:
    """Join two meshes as `joined` does, but keep all vertices.

    Parameters
    ----------
    one, other, seam, near
        As in `joined`.

    Returns
    -------
    Mesh
        The joined mesh.
    ndarray of int32, shape (n,)
        The first vertex with the same position, for each vertex; those of `other` come first.
    """
    vertices = np.concatenate([other.vertices, one.vertices])
    close = near_plane(vertices, seam, near)
    _, first, which = np.unique(rows(vertices[close]), return_index=True, return_inverse=True)
    number = np.arange(len(vertices), dtype=np.int32)
    number[close] = close[first[which]]
    corners = number[one.triangles + np.int32(len(other.vertices))]
    return Mesh(vertices, np.concatenate([corners, other.triangles])), number


def near_plane(points: NDArray[np.float64], seam: float, near: float) -> NDArray[np.int64]:
    """Points near a plane x = `seam`.

    Parameters
    ----------
    points : ndarray of float64, shape (n, 3)
        Points.
    seam : float
        x of the plane; no point is near an infinite one.
    near : float
        Maximum distance from the plane.

    Returns
    -------
    ndarray of int64, shape (k,)
        Their indices, ascending.
    """
    return np.flatnonzero(np.abs(points[:, 0] - seam) < near) if np.isfinite(seam) else np.empty(0, int)


def rows(points: NDArray[np.float64]) -> NDArray[np.void]:
    """View points as scalars, for bitwise comparison.

    Parameters
    ----------
    points : ndarray of float64, shape (n, 3)
        Points.

    Returns
    -------
    ndarray of void, shape (n,)
        One value per point.
    """
    return np.ascontiguousarray(points).view("V24").ravel()
