"""Pieces of a mesh as tasks of a cluster: contouring, nesting and finishing."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass

import numpy as np

from .cluster import ResultFolder
from .finishing import off_surface, on_the_plate, placing
from .mesh.contouring import layers
from .mesh.halo import SelectedPiece, finished_piece
from .mesh.missed import NEARBY, nearest
from .mesh.pointed_vertices import pointed_in
from .mesh.survey import components
from .mesh.tally import Tally
from .mesh.tip_triangles import at_tips
from .mesh.whole_shells import WholeShells
from .meshfiles import Selection, StoredPieces, packed, read_choice, unpacked
from .meshrecipe import MeshRecipe, sampled
from .volume import SignBricks
from .volume.lattice import BRICK
from .work import Work

MOST, LEAST, COUNT = 1 << 14, 1 << 12, 256
"""Bricks of a task: of half a gigabyte at most, of a second at least; about `COUNT` tasks between."""

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
    def make(self, work: Work) -> bytes:
        """Make the result; see `Task.make`."""

    @property
    def stored(self) -> StoredPieces:
        """Pieces of the surface."""
        return StoredPieces(self.pieces, self.job)


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

    def make(self, work: Work) -> bytes:
        """Components and pointed vertices of the piece; see `Task.make`."""
        of = sampled(self.recipe, self.pieces, self.job)
        piece = of.contours.piece(self.first, self.last, of.contours.refiner(work), work)
        start = of.signs.origin[0] + of.signs.voxel * BRICK * self.first if self.number else -np.inf
        voxel = of.planned.voxel
        labels, sums = components(piece.mesh, start, piece.end, voxel, work.threads)
        sharp = pointed_in(piece.mesh, start, piece.end, voxel, work.threads)
        stored = self.stored
        stored.put(self.number, piece.mesh)
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

    def make(self, work: Work) -> bytes:
        """Winding numbers and parents; see `Task.make`."""
        files = unpacked(self.pieces.read(self.job, SHELLS))
        searched, prefix = files.pop("searched"), str(files.pop("prefix"))
        first_label = int(files.pop("labels")[self.number])
        stored = StoredPieces(self.pieces, self.job, prefix)
        shells = WholeShells(**files)
        mesh, labels = stored.mesh(self.number), stored.labels(self.number) + np.int32(first_label)
        return packed(**shells.rays(self.number, mesh, labels, searched, work.threads)._asdict())


class FinishTask(MeshTask):
    """Cleans, checks and encodes a piece."""

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"finished-{self.number:05}"

    def make(self, work: Work) -> bytes:
        """Triangles as an STL file holds them, and measures; see `Task.make`."""
        from ._native import stl

        of = sampled(self.recipe, self.pieces, self.job)
        choice = read_choice(self.pieces, self.job)
        number, voxel, threads = self.number, of.planned.voxel, work.threads
        planes, frame = placing(of.planned, of.signs, choice.place)
        own, before, after = (self.kept(choice, n) for n in (number, number - 1, number + 1))
        assert own is not None
        ends = choice.ends[number - 1] if number else -np.inf, choice.ends[number]
        made = finished_piece(own, before, after, ends, voxel, planes, frame, threads)
        tally = Tally(threads)
        tally.add(made)
        passed, late = made.passed, at_tips(made.passed, choice.tips)
        at = np.flatnonzero(late >= 0)
        plain = passed.selected(late < 0)
        return packed(
            stl=np.frombuffer(stl(plain.vertices, plain.triangles).data, np.uint8),
            late=late[at],
            corners=passed.vertices[passed.triangles[at]],
            contact=np.array(on_the_plate(passed, threads)),
            tally=np.array(json.dumps(asdict(tally))),
            errors=off_surface(of.planned, choice.place, made.points[:: choice.stride], work),
            distances=nearest([own.mesh], choice.points, NEARBY * voxel, work),
        )

    def kept(self, choice: Selection, number: int) -> SelectedPiece | None:
        """A piece with the choice of its bodies; None beyond the ends of the surface."""
        if not 0 <= number < len(choice.ends):
            return None
        stored = StoredPieces(self.pieces, self.job, choice.prefix)
        mesh, count = stored.mesh(number), int(choice.fresh[number])
        labels = stored.labels(number) + choice.first_labels[number]
        fresh = np.arange(len(mesh.triangles) - count, len(mesh.triangles))
        return SelectedPiece(mesh, choice.stays[labels], fresh)


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
