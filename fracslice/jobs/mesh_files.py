"""Files of a shared mesh job: arrays, and the pieces of its surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..cluster import ResultFolder, packed, unpacked
from ..mesh.contouring import Piece
from ..mesh.halo import Strip, strip
from ..mesh.model import Mesh
from ..mesh.pieces import Pieces as MeshPieces
from ..mesh.whole_shells import WholeShells
from ..store import Arrays
from .placement import Placement

SIDES = "head", "tail"
"""Names of the strips at the begin and at the end of a piece."""

CHOICE, SHELLS = "choice", "shells"
"""Files of a job with what stays of its surface, and with the shells of its surface."""


class StoredPieces(MeshPieces):
    """Pieces of a surface as files of a job.

    Parameters
    ----------
    store : ResultFolder
        Files.
    job : str
        Key of the job.
    halo : float, optional
        Width of the strips at the seams, which the neighbours read; scene units.
    prefix : str, optional
        Begin of their names.
    """

    def __init__(self, store: ResultFolder, job: str, halo: float = 0.0, prefix: str = "") -> None:
        super().__init__()
        self.store, self.job, self.halo, self.prefix = store, job, halo, prefix
        self.first_labels = list[int]()

    def anew(self) -> StoredPieces:
        """Return an empty collection with other names; see `Pieces.anew`."""
        return StoredPieces(self.store, self.job, self.halo, f"tipped-{self.prefix}")

    def add(self, piece: Piece, fresh: int = 0) -> None:
        """Append a piece; see `Pieces.add`."""
        self.put(len(self), piece.mesh, self.ends[-1] if self.ends else -np.inf, piece.end)
        self.count(piece.end, len(piece.mesh.triangles), fresh)

    def labels(self, number: int) -> NDArray[np.int32]:
        """Load the labels of a piece, which its file counts from 0; see `Pieces.labels`."""
        return super().labels(number) + np.int32(self.first_labels[number] if self.first_labels else 0)

    def put(self, number: int, mesh: Mesh, start: float, end: float) -> None:
        """Store a piece that another process counts, and its strips.

        Parameters
        ----------
        number : int
            Index of the piece.
        mesh : Mesh
            The piece.
        start, end : float
            x at which it begins and ends.
        """
        self._put(f"mesh{number}", vertices=mesh.vertices, triangles=mesh.triangles)
        x = mesh.vertices[:, 0]
        for side, near in zip(SIDES, (x < start + self.halo, x > end - self.halo), strict=True):
            part = strip(mesh, near, threads=1)
            self._put(
                f"{side}{number}",
                vertices=part.mesh.vertices,
                triangles=part.mesh.triangles,
                numbers=part.numbers,
                from_end=len(mesh.triangles) - part.rows,
            )

    def beside(self, number: int, side: str, fresh: int) -> tuple[Strip, NDArray[np.int64]]:
        """Load the strip at a seam of a piece.

        Parameters
        ----------
        number : int
            Index of the piece.
        side : {"head", "tail"}
            Its begin or its end.
        fresh : int
            Trailing triangles of the piece that were not made by contouring.

        Returns
        -------
        Strip
            Triangles at the seam.
        ndarray of int64, shape (k,)
            Those of them that were not made by contouring, ascending.
        """
        files = self._get(f"{side}{number}")
        part = Strip(Mesh(files["vertices"], files["triangles"]), files["numbers"], -files["from_end"])
        return part, np.flatnonzero(files["from_end"] <= fresh)

    def _put(self, name: str, **arrays: NDArray[Any]) -> None:
        self.store.write(self.job, self.prefix + name, packed(**arrays))

    def _get(self, name: str) -> Arrays:
        return unpacked(self.store.read(self.job, self.prefix + name))


@dataclass(frozen=True, eq=False)
class Selection:
    """What stays of a surface, and where it is placed.

    Attributes
    ----------
    prefix : str
        Begin of the names of the pieces.
    ends : ndarray of float64, shape (p,)
        x at which each piece ends.
    fresh, first_labels : ndarray of int, shape (p,)
        Trailing triangles of each piece that were not made by contouring, and its first label.
    stays : ndarray of bool, shape (l,)
        Labels that stay.
    placed : ndarray of float64, shape (4,)
        Scale and offset.
    points, tips : ndarray of float64, shape (n, 3)
        Points whose distance from the mesh is measured, scene units; tips, mm.
    stride : int
        Each vertex of this stride is measured.
    """

    prefix: str
    ends: NDArray[np.float64]
    fresh: NDArray[np.int64]
    first_labels: NDArray[np.int32]
    stays: NDArray[np.bool_]
    placed: NDArray[np.float64]
    points: NDArray[np.float64]
    tips: NDArray[np.float64]
    stride: int

    def stored(self, pieces: ResultFolder, job: str) -> StoredPieces:
        """Pieces of the surface.

        Parameters
        ----------
        pieces : ResultFolder
            Folder with the files of the job.
        job : str
            Key of the job.
        """
        return StoredPieces(pieces, job, prefix=self.prefix)

    @property
    def place(self) -> Placement:
        """Placement."""
        scale, x, y, z = self.placed.tolist()
        return Placement(scale, (x, y, z))


@lru_cache(maxsize=1)
def read_choice(pieces: ResultFolder, job: str) -> Selection:
    """Selection of the bodies of a job from its file, read once in a process."""
    files = unpacked(pieces.read(job, CHOICE))
    prefix, stride = str(files.pop("prefix")), int(files.pop("stride"))
    return Selection(prefix=prefix, stride=stride, **files)


class StoredShells(NamedTuple):
    """Shells of a job.

    Attributes
    ----------
    shells : WholeShells
        The shells.
    searched : ndarray of bool, shape (s,)
        Shells whose surroundings are searched.
    prefix : str
        Begin of the names of the pieces.
    first_labels : ndarray of int32, shape (p,)
        First label of each piece.
    """

    shells: WholeShells
    searched: NDArray[np.bool_]
    prefix: str
    first_labels: NDArray[np.int32]


@lru_cache(maxsize=1)
def read_shells(pieces: ResultFolder, job: str) -> StoredShells:
    """Shells of a job from its file, read once in a process."""
    files = unpacked(pieces.read(job, SHELLS))
    searched, prefix, labels = files.pop("searched"), str(files.pop("prefix")), files.pop("labels")
    return StoredShells(WholeShells(**files), searched, prefix, labels)
