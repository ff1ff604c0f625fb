"""Surface in pieces along x, one in memory at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import near, touching
from ..store import Arrays
from ..work import Work, chunks
from .contouring import Piece
from .model import Mesh

NOTHING = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))


class Strip(NamedTuple):
    """Some triangles of a mesh."""

    mesh: Mesh  # the triangles and their vertices
    numbers: NDArray[np.int64]  # indices of the vertices in the mesh, ascending
    rows: NDArray[np.int64]  # indices of the triangles, ascending


def strip(mesh: Mesh, vertices: NDArray[np.bool_], threads: int = 0) -> Strip:
    """Triangles that use some vertices.

    `vertices`: bool (n,).
    """
    rows = touching(mesh.triangles, vertices, threads)
    triangles, used = mesh.triangles[rows], np.zeros(len(mesh.vertices), bool)
    used[triangles] = True
    numbers, place = np.flatnonzero(used), np.cumsum(used, dtype=np.int32) - 1
    return Strip(Mesh(mesh.vertices[numbers], place[triangles]), numbers, rows)


HEAD, TAIL = "head", "tail"
"""Sides of a piece: the strips at its begin and at its end."""


def strip_at(mesh: Mesh, side: str, seam: float, halo: float, threads: int = 0) -> Strip:
    """Strip of a piece at the seam x = `seam`, of width `halo`."""
    x = mesh.vertices[:, 0]
    return strip(mesh, x < seam + halo if side == HEAD else x > seam - halo, threads)


class Pieces:
    """Pieces of a surface, in order, with labels of their vertices; scene units.

    A label is a connected component of a piece; labels count from the first piece on. `halo`: width of the
    strips at the seams.
    """

    def __init__(self, folder: Path | None = None, halo: float = 0.0) -> None:
        self.folder, self.halo = folder, halo
        self.ends, self.starts = list[float](), list[int]()
        self.fresh, self.first_labels = list[int](), list[int]()
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
        return Pieces(self.folder, self.halo)

    def add(self, piece: Piece, fresh: int = 0) -> None:
        """Append a piece."""
        self.put(len(self), piece.mesh, self.start(len(self)), piece.end)
        self.count(piece.end, len(piece.mesh.triangles), fresh)

    def put(self, number: int, mesh: Mesh, start: float, end: float) -> None:
        """Store a piece, which `count` appends.

        `start`, `end`: x between which it lies.
        """
        self.keep(f"mesh{number}", vertices=mesh.vertices, triangles=mesh.triangles)

    def count(self, end: float, triangles: int, fresh: int = 0) -> None:
        """Append a piece that is stored already."""
        self.ends.append(end)
        self.starts.append(self._count)
        self.fresh.append(fresh)
        self._count += triangles

    def label(self, number: int, labels: NDArray[np.int32]) -> None:
        """Store the labels of a piece, counted from 0.

        `labels`: int32 (n,).
        """
        self.keep(f"labels{number}", labels=labels)

    def mesh(self, number: int) -> Mesh:
        """Load a piece.

        Returns `Mesh` in scene units.
        """
        arrays = self.arrays(f"mesh{number}")
        return Mesh(arrays["vertices"], arrays["triangles"])

    def labels(self, number: int) -> NDArray[np.int32]:
        """Load the labels of a piece.

        Returns int32 (n,).
        """
        labels, first = self.arrays(f"labels{number}")["labels"], self.first_labels[number]
        return labels + np.int32(first) if first else labels

    def start(self, number: int) -> float:
        """X at which a piece begins."""
        return self.ends[number - 1] if number else -np.inf

    def fresh_rows(self, number: int) -> NDArray[np.int64]:
        """Triangles of a piece that were not made by contouring: its last ones.

        Returns int64 (k,).
        """
        first, end = [*self.starts, self._count][number : number + 2]
        return np.arange(end - first - self.fresh[number], end - first)

    def strip(self, number: int, side: str, threads: int = 0) -> Strip:
        """Load the strip of a piece at a seam."""
        seam = self.start(number) if side == HEAD else self.ends[number]
        return strip_at(self.mesh(number), side, seam, self.halo, threads)

    def finish(self, number: int, mesh: Mesh) -> None:
        """Store the finished triangles of a piece, whose vertices are float32 numbers.

        `mesh` in mm.
        """
        self.keep(f"finished{number}", vertices=mesh.vertices.astype(np.float32), triangles=mesh.triangles)

    def finished(self, number: int) -> Mesh:
        """Load the finished triangles of a piece.

        Returns `Mesh` in mm.
        """
        arrays = self.arrays(f"finished{number}")
        return Mesh(arrays["vertices"].astype(np.float64), arrays["triangles"])

    def meshes(self) -> Iterator[Mesh]:
        """Iterate over the pieces."""
        return (self.mesh(number) for number in range(len(self)))

    def drop(self, end: int) -> None:
        """Release the pieces before number `end` that are held in memory."""
        for number in range(end):
            for name in ("mesh", "labels"):
                self._held.pop(f"{name}{number}", None)

    def near(self, points: NDArray[np.float64], reach: float) -> tuple[Mesh, NDArray[np.int64]]:
        """Triangles with a corner near points, as one mesh.

        `points`: float64 (n, 3), scene units. Returns int64 (k,).
        """
        parts, numbers = NOTHING, list[NDArray[np.int64]]()
        for number, mesh in enumerate(self.meshes()):
            chosen = near(mesh.vertices, mesh.triangles, points, reach)
            numbers.append(self.starts[number] + chosen)
            part = mesh.selected(np.bincount(chosen, minlength=len(mesh.triangles)) > 0)
            parts = join_at_seam(parts, part, self.ends[number - 1], reach / 2) if number else part
        return parts, np.concatenate(numbers)

    def together(self, first: int, last: int, seam: float) -> Mesh:
        """Join consecutive pieces to one mesh.

        `seam` in scene units.
        """
        mesh = self.mesh(first)
        for number in range(first + 1, last):
            mesh = join_at_seam(mesh, self.mesh(number), self.ends[number - 1], seam)
        return mesh

    def keep(self, name: str, **arrays: NDArray[np.generic]) -> None:
        """Store arrays in memory or in the folder."""
        if self.folder is None:
            self._held[name] = arrays
        else:
            for part, array in arrays.items():
                path = self.folder / f"{name}-{part}.npy"
                path.unlink(missing_ok=True)  # the array may be the mapped file itself
                np.save(path, array)

    def arrays(self, name: str) -> Arrays:
        """Load arrays from memory or from the folder."""
        if self.folder is None:
            return self._held[name]
        begin = len(name) + 1
        return {path.stem[begin:]: np.load(path, "r") for path in self.folder.glob(f"{name}-*.npy")}


def join_at_seam(one: Mesh, other: Mesh, seam: float, near: float) -> Mesh:
    """Join two meshes: bitwise equal vertices near the plane x = `seam` become one."""
    return concatenate_at_seam(one, other, seam, near)[0].compact()


def concatenate_at_seam(one: Mesh, other: Mesh, seam: float, near: float) -> tuple[Mesh, NDArray[np.int32]]:
    """Join two meshes as `join_at_seam` does, but keep all vertices.

    Returns int32 (n,).
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

    `points`: float64 (n, 3). Returns int64 (k,).
    """
    return np.flatnonzero(np.abs(points[:, 0] - seam) < near) if np.isfinite(seam) else np.empty(0, int)


def rows(points: NDArray[np.float64]) -> NDArray[np.void]:
    """View points as scalars, for bitwise comparison.

    `points`: float64 (n, 3). Returns void (n,).
    """
    return np.ascontiguousarray(points).view("V24").ravel()


ROWS = 1 << 17
"""Rows per task."""


def gather_rows(table: np.ndarray, rows: np.ndarray, threads: int = 0) -> np.ndarray:
    """Gather rows of a table by several threads.

    `table`: [m, ...]; `rows`: int [n, ...]. Returns `table[rows]`.
    """
    result = np.empty(rows.shape + table.shape[1:], table.dtype)

    def task(part: slice) -> None:
        np.take(table, rows[part], axis=0, out=result[part], mode="clip")  # "raise" would copy the output

    Work(threads or os.cpu_count() or 1).map(task, chunks(len(rows), ROWS))
    return result
