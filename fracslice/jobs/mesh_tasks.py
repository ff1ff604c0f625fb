"""Pieces of a mesh as tasks of a cluster: contouring, nesting and finishing."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, ResultFolder, packed, unpacked
from ..mesh.contouring import layers
from ..mesh.halo import WAITS, SelectedPiece, finished_piece
from ..mesh.missed import NEARBY, nearest
from ..mesh.pointed_vertices import pointed_in
from ..mesh.survey import components
from ..mesh.tally import Tally
from ..mesh.tip_triangles import at_tips
from ..mesh.whole_shells import WholeShells
from ..volume import SignBricks
from ..volume.lattice import BRICK
from ..work import Work
from .checking import off_surface, on_the_plate
from .finishing import placing
from .mesh_files import Selection, StoredPieces, read_choice
from .mesh_recipe import MeshRecipe, sampled

MOST, LEAST, COUNT = 1 << 15, 1 << 12, 256
"""Bricks of a task: of a gigabyte at most, of 0.7 seconds at least; about `COUNT` tasks between."""

HALO = WAITS + 0.5
"""Width of the strips at the seams, voxels: wider than the halo that a neighbour takes of them."""

SHELLS = "shells"
"""File of a job with the shells of its surface."""


@dataclass(frozen=True)
class MeshTask(ABC):
    """Task of a mesh job.

    Attributes
    ----------
    recipe : MeshRecipe
        The mesh.
    pieces : ResultFolder
        Folder with the files of the job.
    job : str
        Key of the mesh and its samples.
    number : int
        Index of the piece.
    """

    recipe: MeshRecipe
    pieces: ResultFolder
    job: str
    number: int

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the task."""

    @abstractmethod
    def make(self, work: Work) -> Contents:
        """Make the result; see `Task.make`."""


@dataclass(frozen=True)
class ContourTask(MeshTask):
    """Contours a piece of the surface; its result is what the pieces are joined by.

    Attributes
    ----------
    first, last : int
        Layers of bricks, last excluded.
    """

    first: int
    last: int

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"surface-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Components and pointed vertices of the piece; see `Task.make`."""
        of = sampled(self.recipe, self.pieces, self.job)
        piece = of.contours.piece(self.first, self.last, of.contours.refiner(work), work)
        start = of.signs.origin[0] + of.signs.voxel * BRICK * self.first if self.number else -np.inf
        voxel = of.planned.voxel
        labels, sums = components(piece.mesh, start, piece.end, voxel, work.threads)
        sharp = pointed_in(piece.mesh, start, piece.end, voxel, work.threads)
        stored = StoredPieces(self.pieces, self.job, HALO * voxel)
        stored.put(self.number, piece.mesh, start, piece.end)
        stored.label(self.number, labels)
        ends = {
            f"{name}_{part}": getattr(mesh, part)
            for name, mesh in (("head", sharp.head), ("tail", sharp.tail))
            for part in ("vertices", "triangles")
        }
        counts = np.array([piece.end, len(piece.mesh.triangles)])
        return packed(counts=counts, pointed=sharp.points, **ends, **vars(sums))


class NestTask(MeshTask):
    """Searches the surroundings of the shells whose rays are in a piece."""

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"nesting-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Winding numbers and parents; see `Task.make`."""
        files = unpacked(self.pieces.read(self.job, SHELLS))
        searched, prefix = files.pop("searched"), str(files.pop("prefix"))
        first_label = int(files.pop("labels")[self.number])
        stored = StoredPieces(self.pieces, self.job, prefix=prefix)
        shells = WholeShells(**files)
        mesh, labels = stored.mesh(self.number), stored.labels(self.number) + np.int32(first_label)
        return packed(**shells.rays(self.number, mesh, labels, searched, work.threads)._asdict())


class FinishTask(MeshTask):
    """Cleans, checks and encodes a piece."""

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"finished-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Measures; the triangles are a file of their own, as an STL file holds them. See `Task.make`."""
        from .._native import stl

        of = sampled(self.recipe, self.pieces, self.job)
        choice = read_choice(self.pieces, self.job)
        number, voxel, threads = self.number, of.planned.voxel, work.threads
        planes, frame = placing(of.planned, of.signs, choice.place)
        own = self.kept(choice)
        before, after = self.beside(choice, number - 1, "tail"), self.beside(choice, number + 1, "head")
        ends = choice.ends[number - 1] if number else -np.inf, choice.ends[number]
        made = finished_piece(own, before, after, ends, voxel, planes, frame, threads)
        tally = Tally(threads)
        tally.add(made)
        passed, late = made.passed, at_tips(made.passed, choice.tips)
        at = np.flatnonzero(late >= 0)
        plain = passed.selected(late < 0) if len(at) else passed
        self.pieces.write(self.job, triangles_file(number), [stl(plain.vertices, plain.triangles).data])
        return packed(
            late=late[at],
            corners=passed.vertices[passed.triangles[at]],
            contact=np.array(on_the_plate(passed, threads)),
            tally=np.array(json.dumps(asdict(tally))),
            errors=off_surface(of.planned, choice.place, made.points[:: choice.stride], work),
            distances=nearest([own.mesh], choice.points, NEARBY * voxel, work),
        )

    def kept(self, choice: Selection) -> SelectedPiece:
        """The piece with the choice of its bodies."""
        mesh, count = choice.stored(self.pieces, self.job).mesh(self.number), choice.fresh[self.number]
        fresh = np.arange(len(mesh.triangles) - count, len(mesh.triangles))
        return SelectedPiece(mesh, self.stays(choice, self.number), fresh)

    def beside(self, choice: Selection, number: int, side: str) -> SelectedPiece | None:
        """Strip of a neighbour with the choice of its bodies; None beyond the ends of the surface."""
        if not 0 <= number < len(choice.ends):
            return None
        stored = choice.stored(self.pieces, self.job)
        part, fresh = stored.beside(number, side, int(choice.fresh[number]))
        return SelectedPiece(part.mesh, self.stays(choice, number)[part.numbers], fresh)

    def stays(self, choice: Selection, number: int) -> NDArray[np.bool_]:
        """True for each vertex of a piece whose body stays."""
        labels = choice.stored(self.pieces, self.job).labels(number)
        stays: NDArray[np.bool_] = choice.stays[labels + choice.first_labels[number]]
        return stays


@dataclass(frozen=True)
class MissedTask(MeshTask):
    """Measures the distances of points without a triangle nearby.

    Attributes
    ----------
    turn : int
        How many times the reach has grown.
    """

    turn: int

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"missed-{self.turn}-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Distances to the triangles of the piece; see `Task.make`."""
        far = unpacked(self.pieces.read(self.job, far_file(self.turn)))
        mesh = read_choice(self.pieces, self.job).stored(self.pieces, self.job).mesh(self.number)
        return packed(distances=nearest([mesh], far["points"], float(far["reach"]), work))


def triangles_file(number: int) -> str:
    """Name of the file with the finished triangles of a piece.

    Parameters
    ----------
    number : int
        Index of the piece.

    Returns
    -------
    str
    """
    return f"triangles{number}"


def far_file(turn: int) -> str:
    """Name of the file with points without a triangle nearby.

    Parameters
    ----------
    turn : int
        How many times the reach has grown.

    Returns
    -------
    str
    """
    return f"far{turn}"


def cuts(signs: SignBricks) -> list[tuple[int, int]]:
    """Layers of bricks of each piece, the same for any number of workers.

    Parameters
    ----------
    signs : SignBricks
        Samples.

    Returns
    -------
    list of tuple of int
        First and last layer, last excluded.
    """
    return layers(signs, min(max(len(signs) // COUNT, LEAST), MOST))
