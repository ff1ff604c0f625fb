"""Pieces of a shared mesh as files: arrays, summaries by which they are joined, finished triangles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, Files, ResultFolder, pack_arrays, unpack_arrays
from ..mesh.cleaning import Strip, strip
from ..mesh.contouring import BLUNT, Piece
from ..mesh.model import Mesh, concatenate
from ..mesh.pieces import Pieces as MeshPieces
from ..mesh.shells import PieceComponents, WholeShells, joined_components
from ..mesh.tips import Pointed, PointedPiece
from ..store import Arrays
from .report import Placement

SIDES = "head", "tail"
"""Names of the strips at the begin and at the end of a piece."""

CHOICE, SHELLS = "choice", "shells"
"""Files of a job with what stays of its surface, and with the shells of its surface."""


class StoredPieces(MeshPieces):
    """Pieces of a surface as files of a job."""

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
        """Store a piece that another process counts, and its strips."""
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

        Returns int64 (k,).
        """
        files = self._get(f"{side}{number}")
        part = Strip(Mesh(files["vertices"], files["triangles"]), files["numbers"], -files["from_end"])
        return part, np.flatnonzero(files["from_end"] <= fresh)

    def _put(self, name: str, **arrays: NDArray[Any]) -> None:
        self.store.write(self.job, self.prefix + name, pack_arrays(**arrays))

    def _get(self, name: str) -> Arrays:
        return unpack_arrays(self.store.read(self.job, self.prefix + name))


@dataclass(frozen=True, eq=False)
class Selection:
    """What stays of a surface, and where it is placed."""

    prefix: str  # begin of the names of the pieces
    ends: NDArray[np.float64]  # x at which each piece ends
    # trailing triangles of each piece that were not made by contouring, and its first label
    fresh: NDArray[np.int64]
    first_labels: NDArray[np.int32]
    stays: NDArray[np.bool_]  # labels that stay
    placed: NDArray[np.float64]  # scale and offset
    points: NDArray[np.float64]  # points whose distance from the mesh is measured, scene units; tips, mm
    tips: NDArray[np.float64]
    stride: int  # each vertex of this stride is measured

    def stored(self, pieces: ResultFolder, job: str) -> StoredPieces:
        """Pieces of the surface."""
        return StoredPieces(pieces, job, prefix=self.prefix)

    @property
    def place(self) -> Placement:
        """Placement."""
        scale, x, y, z = self.placed.tolist()
        return Placement(scale, (x, y, z))


@lru_cache(maxsize=1)
def read_choice(pieces: ResultFolder, job: str) -> Selection:
    """Selection of the bodies of a job from its file, read once in a process."""
    files = unpack_arrays(pieces.read(job, CHOICE))
    prefix, stride = str(files.pop("prefix")), int(files.pop("stride"))
    return Selection(prefix=prefix, stride=stride, **files)


class StoredShells(NamedTuple):
    """Shells of a job."""

    shells: WholeShells  # the shells
    searched: NDArray[np.bool_]  # shells whose surroundings are searched
    prefix: str  # begin of the names of the pieces
    first_labels: NDArray[np.int32]  # first label of each piece


@lru_cache(maxsize=1)
def read_shells(pieces: ResultFolder, job: str) -> StoredShells:
    """Shells of a job from its file, read once in a process."""
    files = unpack_arrays(pieces.read(job, SHELLS))
    searched, prefix, labels = files.pop("searched"), str(files.pop("prefix")), files.pop("labels")
    return StoredShells(WholeShells(**files), searched, prefix, labels)


def finished_mesh(mesh: Mesh) -> Contents:
    """Contents of a file with finished triangles, whose vertices are float32 numbers.

    `mesh` in mm.
    """
    return pack_arrays(vertices=mesh.vertices.astype(np.float32), triangles=mesh.triangles)


def read_finished(pieces: ResultFolder, job: str, name: str) -> Mesh:
    """Finished triangles from their file.

    Returns `Mesh` in mm.
    """
    files = unpack_arrays(pieces.read(job, name))
    return Mesh(files["vertices"].astype(np.float64), files["triangles"])


def weld_pieces(mesh: Mesh) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Merge equal vertices.

    Returns float32 (n, 3); int32 (m, 3).
    """
    from .._native import weld

    ordered = mesh.in_order()
    points = ordered.vertices.astype(np.float32)
    first, labels = weld(points)
    return points[first], labels[ordered.triangles]


def joined_pieces(meshes: Iterable[Mesh]) -> Mesh:
    """One mesh of the finished triangles of all pieces.

    Returns `Mesh` in mm.
    """
    points, triangles = weld_pieces(concatenate(list(meshes)))
    return Mesh(points.astype(np.float64), triangles)


def piece_rows(starts: NDArray[np.int64], begin: int, end: int) -> Iterator[tuple[int, slice]]:
    """Rows of each piece within a range of the rows of all pieces.

    `starts`: int64 (p + 1,).
    """
    first, last = np.searchsorted(starts, (begin, end - 1), side="right") - 1
    for number in range(first, min(last + 1, len(starts) - 1)):
        start, stop = (int(at) for at in starts[number : number + 2])
        yield number, slice(max(begin - start, 0), min(end, stop) - start)


SEAMS = "head", "tail"
"""Fields of a `PointedPiece` with the triangles at its begin and at its end."""


@dataclass(frozen=True, eq=False)
class Summary:
    """What consecutive pieces of a surface are joined by."""

    ends: NDArray[np.float64]  # x at which each piece ends
    triangles: NDArray[np.int64]  # triangles of each piece
    components: PieceComponents  # connected components
    pointed: PointedPiece  # pointed vertices
    blunt: NDArray[np.float64]  # middles of blunt cells; if there are more than `BLUNT`, some of them

    def packed(self) -> Contents:
        """Contents of a file."""
        seams = {
            f"{side}_{part}": getattr(getattr(self.pointed, side), part)
            for side in SEAMS
            for part in ("vertices", "triangles")
        }
        about = {
            "ends": self.ends,
            "counted": self.triangles,
            "pointed": self.pointed.points,
            "blunt": self.blunt,
        }
        return pack_arrays(**about, **seams, **vars(self.components))

    @classmethod
    def read(cls, files: Files) -> Summary:
        """Summary from its file."""
        head, tail = (Mesh(files[f"{side}_vertices"], files[f"{side}_triangles"]) for side in SEAMS)
        whole = PieceComponents(**{name: files[name] for name in PieceComponents.__dataclass_fields__})
        sharp = PointedPiece(files["pointed"], head, tail)
        return cls(files["ends"], files["counted"], whole, sharp, files["blunt"])


def joined_summary(ranges: Sequence[Summary], voxel: float, threads: int = 0) -> Summary:
    """Join the summaries of consecutive ranges of pieces."""
    sharp = Pointed(voxel, threads)
    for one in ranges:
        sharp.join(one.pointed, float(one.ends[-1]))
    return Summary(
        np.concatenate([one.ends for one in ranges]),
        np.concatenate([one.triangles for one in ranges]),
        joined_components([one.components for one in ranges]),
        sharp.before(ranges[0].pointed.head),
        np.concatenate([one.blunt for one in ranges])[: BLUNT + 1],
    )
