"""A surface in pieces along x, one in memory at a time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..store import Arrays
from .extract import Piece
from .model import Mesh

NOTHING = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))


class Pieces:
    """Pieces of a surface in turn, scene units, each with the labels of its triangles.

    They are held in memory if there is no folder, else in its files. ends: the x where each ends, infinite
    for the last one. starts: the number of each one's first triangle. fresh: how many of each one's last
    triangles contouring did not lay.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder, self.ends, self.starts = folder, list[float](), list[int]()
        self.fresh = list[int]()
        self._count = 0
        self._held: dict[str, Arrays] = {}

    def __len__(self) -> int:
        return len(self.ends)

    def add(self, piece: Piece, fresh: int = 0) -> None:
        """Append a piece. fresh: how many of its last triangles contouring did not lay."""
        self._put(f"mesh{len(self)}", vertices=piece.mesh.vertices, triangles=piece.mesh.triangles)
        self.ends.append(piece.end)
        self.starts.append(self._count)
        self.fresh.append(fresh)
        self._count += len(piece.mesh.triangles)

    def label(self, number: int, labels: NDArray[np.int64]) -> None:
        """Set the label of each triangle of a piece, int64 [m]."""
        self._put(f"labels{number}", labels=labels)

    def mesh(self, number: int) -> Mesh:
        """The triangles of a piece."""
        return Mesh(**self._get(f"mesh{number}"))

    def labels(self, number: int) -> NDArray[np.int64]:
        """Their labels, int64 [m]."""
        return self._get(f"labels{number}")["labels"]

    def meshes(self) -> Iterator[Mesh]:
        """All pieces in turn."""
        return (self.mesh(number) for number in range(len(self)))

    def labelled(self) -> Iterator[tuple[Mesh, NDArray[np.int64]]]:
        """All pieces in turn, with their labels."""
        return ((self.mesh(number), self.labels(number)) for number in range(len(self)))

    def drop(self, number: int) -> None:
        """Let go of a piece that is not needed any more."""
        for name in ("mesh", "labels"):
            self._held.pop(f"{name}{number}", None)

    def near(self, points: NDArray[np.float64], reach: float) -> tuple[Mesh, NDArray[np.int64]]:
        """The triangles with a corner near points, as one mesh, and their numbers, int64 [k], ascending.

        All corners within `reach` along each axis are near. Triangles are numbered from the first piece on.
        """
        around, parts, numbers = Around(points, reach), NOTHING, list[NDArray[np.int64]]()
        for number, mesh in enumerate(self.meshes()):
            chosen = around.triangles(mesh)
            numbers.append(self.starts[number] + np.flatnonzero(chosen))
            part = mesh.selected(chosen)
            parts = joined(parts, part, self.ends[number - 1], reach / 2) if number else part
        return parts, np.concatenate(numbers)

    def together(self, first: int, last: int, seam: float) -> Mesh:
        """Pieces first to last - 1 as one mesh. seam: half the width in which vertices meet."""
        mesh = self.mesh(first)
        for number in range(first + 1, last):
            mesh = joined(mesh, self.mesh(number), self.ends[number - 1], seam)
        return mesh

    def _put(self, name: str, **arrays: NDArray[np.generic]) -> None:
        if self.folder is None:
            self._held[name] = arrays
        else:
            np.savez(self.folder / f"{name}.npz", **arrays)  # type: ignore[arg-type]

    def _get(self, name: str) -> Arrays:
        if self.folder is None:
            return self._held[name]
        with np.load(self.folder / f"{name}.npz") as arrays:
            return dict(arrays)


class Around:
    """The cells of some size around points: their own and all next to it."""

    def __init__(self, points: NDArray[np.float64], size: float) -> None:
        self.low = points.min(axis=0) - 2 * size
        self.size = max(size, float(np.ptp(points, axis=0).max()) / 256)
        own = self.cells(points)
        self.near = np.zeros(own.max(axis=0) + 3, bool)
        for step in np.ndindex(3, 3, 3):
            self.near[tuple((own + step).T - 1)] = True

    def cells(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """The cell of each point, int64 [n, 3]."""
        found: NDArray[np.int64] = np.floor((points - self.low) / self.size).astype(np.int64)
        return found

    def triangles(self, mesh: Mesh) -> NDArray[np.bool_]:
        """Whether each triangle has a corner in these cells, bool [m]."""
        cells = np.clip(self.cells(mesh.vertices), 0, np.array(self.near.shape) - 1)
        seen = self.near[tuple(cells.T)]
        found: NDArray[np.bool_] = seen[mesh.triangles].any(axis=1)
        return found


def joined(one: Mesh, other: Mesh, seam: float, near: float) -> Mesh:
    """Two meshes as one: vertices near the plane x = seam that are equal, bit by bit, become one."""
    vertices = np.concatenate([one.vertices, other.vertices])
    triangles = np.concatenate([one.triangles, other.triangles + np.int32(len(one.vertices))])
    close = np.flatnonzero(np.abs(vertices[:, 0] - seam) < near)
    _, first, which = np.unique(rows(vertices[close]), return_index=True, return_inverse=True)
    number = np.arange(len(vertices), dtype=np.int32)
    number[close] = close[first[which]]
    return Mesh(vertices, number[triangles]).selected(np.ones(len(triangles), dtype=bool))


def rows(points: NDArray[np.float64]) -> NDArray[np.void]:
    """Points, [n, 3], as values that are equal if all their bits are, [n]."""
    return np.ascontiguousarray(points).view("V24").ravel()
