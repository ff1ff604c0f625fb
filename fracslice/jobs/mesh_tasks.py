"""Pieces of a mesh as tasks of a cluster: contouring, nesting and finishing."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, ResultFolder, packed, unpacked
from ..mesh.contouring import layers
from ..mesh.halo import WAITS, SelectedPiece, finished_piece
from ..mesh.missed import NEARBY, nearest
from ..mesh.model import Mesh
from ..mesh.pointed_vertices import pointed_in
from ..mesh.survey import components
from ..mesh.tally import Tally
from ..mesh.tip_triangles import at_tips
from ..mesh.touching import NearBodies
from ..volume import SignBricks
from ..volume.lattice import BRICK
from ..work import Work
from .checking import off_surface, on_the_plate
from .finished_pieces import finished_mesh
from .finishing import placing
from .mesh_files import Selection, StoredPieces, read_choice, read_shells
from .mesh_recipe import MeshRecipe, plan_of, sampled
from .mesh_summary import Summary, joined_summary

MOST, LEAST, COUNT = 1 << 15, 1 << 14, 256
"""Bricks of a task: of a gigabyte at most, of 1.5 to 2 seconds at least; about `COUNT` tasks between."""

HALO = WAITS + 0.5
"""Width of the strips at the seams, voxels: wider than the halo that a neighbour takes of them."""


@dataclass(frozen=True)
class MeshTask(ABC):
    """Task of a mesh job.

    Attributes
    ----------
    stage : str
        First part of its name.
    recipe : MeshRecipe
        The mesh.
    pieces : ResultFolder
        Folder with the files of the job.
    job : str
        Key of the mesh and its samples.
    number : int
        Index of the piece.
    """

    stage: ClassVar[str]
    recipe: MeshRecipe
    pieces: ResultFolder
    job: str
    number: int

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"{self.stage}-{self.number:05}"

    @abstractmethod
    def make(self, work: Work) -> Contents:
        """Make the result; see `Task.make`."""


@dataclass(frozen=True)
class ContourTask(MeshTask):
    """Contours a piece of the surface; its result is the summary by which the pieces are joined.

    Attributes
    ----------
    first, last : int
        Layers of bricks, last excluded.
    """

    stage = "surface"
    first: int
    last: int

    def make(self, work: Work) -> Contents:
        """Summary of the piece; see `Task.make`."""
        of = sampled(self.recipe, self.pieces, self.job)
        piece = of.contours.piece(self.first, self.last, of.contours.refiner(work), work)
        start = of.signs.origin[0] + of.signs.voxel * BRICK * self.first if self.number else -np.inf
        voxel = of.planned.voxel
        labels, sums = components(piece.mesh, start, piece.end, voxel, work.threads)
        sharp = pointed_in(piece.mesh, start, piece.end, voxel, work.threads)
        stored = StoredPieces(self.pieces, self.job, HALO * voxel)
        stored.put(self.number, piece.mesh, start, piece.end)
        stored.label(self.number, labels)
        counted = np.array([len(piece.mesh.triangles)])
        return Summary(np.array([piece.end]), counted, sums, sharp, piece.blunt).packed()


@dataclass(frozen=True)
class JoinTask(MeshTask):
    """Joins consecutive ranges of pieces.

    Attributes
    ----------
    children : tuple of str
        Files with their summaries, in order.
    level : int
        Level in the tree, from 1.
    """

    children: tuple[str, ...]
    level: int

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"joined-{self.level}-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Summary of all pieces below; see `Task.make`."""
        ranges = [Summary.read(unpacked(self.pieces.read(self.job, name))) for name in self.children]
        return joined_summary(ranges, plan_of(self.recipe).voxel, work.threads).packed()


class NestTask(MeshTask):
    """Searches the surroundings of the shells whose rays are in a piece."""

    stage = "nesting"

    def make(self, work: Work) -> Contents:
        """Winding numbers and parents; see `Task.make`."""
        of = read_shells(self.pieces, self.job)
        stored = StoredPieces(self.pieces, self.job, prefix=of.prefix)
        mesh, labels = stored.mesh(self.number), stored.labels(self.number) + of.first_labels[self.number]
        return packed(**of.shells.rays(self.number, mesh, labels, of.searched, work.threads)._asdict())


class FinishTask(MeshTask):
    """Cleans and checks a piece."""

    stage = "finished"

    def make(self, work: Work) -> Contents:
        """Measures; the triangles are a file of their own, see `finished_mesh`. See `Task.make`."""
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
        plain = passed.selected(late < 0, threads)
        self.pieces.write(self.job, finished_file(number), finished_mesh(plain))
        return packed(
            rows=np.array(len(plain.triangles)),
            late=late[at],
            near=self.near(choice, own.mesh, voxel, threads),
            corners=passed.vertices[passed.triangles[at]],
            contact=np.array(on_the_plate(passed, threads)),
            tally=np.array(json.dumps(asdict(tally))),
            errors=off_surface(of.planned, choice.place, made.points[:: choice.stride], work),
            distances=nearest([own.mesh], choice.points, NEARBY * voxel, work),
        )

    def near(self, choice: Selection, mesh: Mesh, voxel: float, threads: int) -> NDArray[np.int64]:
        """Shells of the bodies that nearly touch others, in the piece and at its seam with the next one."""
        shells, number = read_shells(self.pieces, self.job).shells, self.number
        stays, stored = np.zeros(len(shells.volumes), bool), choice.stored(self.pieces, self.job)
        stays[shells.of_label] = choice.stays
        bodies = NearBodies(shells, stays, voxel, threads)
        bodies.add(mesh.vertices, self.labels(choice, number), choice.ends[number])
        if number + 1 < len(choice.ends):
            part, _ = stored.beside(number + 1, "head", 0)
            bodies.add(part.mesh.vertices, self.labels(choice, number + 1)[part.numbers], np.inf)
        return bodies.bodies

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
        stays: NDArray[np.bool_] = choice.stays[self.labels(choice, number)]
        return stays

    def labels(self, choice: Selection, number: int) -> NDArray[np.int32]:
        """Labels of the vertices of a piece, counted from the first piece on."""
        own = choice.stored(self.pieces, self.job).labels(number)
        labels: NDArray[np.int32] = own + choice.first_labels[number]
        return labels


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


def finished_file(number: int) -> str:
    """Name of the file with the finished triangles of a piece.

    Parameters
    ----------
    number : int
        Index of the piece; that of the triangles at tips follows the last one.
    """
    return f"finished{number}"


def far_file(turn: int) -> str:
    """Name of the file with points without a triangle nearby.

    Parameters
    ----------
    turn : int
        How many times the reach has grown.
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
