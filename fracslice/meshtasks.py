"""Pieces of a mesh as tasks of a cluster: contouring, nesting and finishing."""

from __future__ import annotations

import json
import threading
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .clock import Clock
from .cluster import ResultFolder
from .errors import ClusterError
from .finishing import off_surface, on_the_plate, placing
from .keys import key, program
from .mesh.extract import SurfaceContours, layers
from .mesh.halo import SelectedPiece, finished_alone
from .mesh.missed import NEARBY, nearest
from .mesh.model import Mesh
from .mesh.pointed_vertices import pointed_in
from .mesh.survey import PieceComponents, WholeShells, components
from .mesh.window import Tally, at_tips
from .meshfiles import Files, StoredPieces, packed, unpacked
from .meshjob import MeshJob
from .placement import Placement
from .planning import edited, planned
from .scene.reader import reads
from .volume import Plan, SignBricks
from .volume.lattice import BRICK
from .volume.sizing import sizing
from .work import Work

MOST, LEAST, COUNT = 1 << 13, 1 << 10, 256
"""Bricks of a task: at most those of about two seconds; fewer for more than `COUNT` tasks of the whole."""

SAMPLES, SHELLS, CHOICE = "samples", "shells", "choice"
"""Files of a job: its samples, the shells of its surface, and what stays of them."""


@dataclass(frozen=True)
class MeshRecipe:
    """Everything that a mesh is made from; a worker plans it once.

    Attributes
    ----------
    scene, name : str
        XML and name of the scene.
    what : MeshJob
        Size, resolution and changes of the mesh.
    edited : bool
        True if the bodies of the scene are chosen in the field; see `planning.edited`.
    """

    scene: str
    name: str
    what: MeshJob
    edited: bool = False

    def plan(self) -> Plan:
        """Plan the field.

        Returns
        -------
        Plan
            The same in every process.
        """
        scene, clock = reads(self.scene, self.name), Clock(Work(threads=1))
        size = sizing(scene, self.what.size_mm, self.what.scale, clock.work)
        sized = planned(scene, self.what, size, clock)
        return (edited(sized.planned, scene, self.what, size, clock) if self.edited else sized).planned


@dataclass(frozen=True)
class MeshTask(ABC):
    """Task of a mesh job.

    Attributes
    ----------
    recipe : MeshRecipe
        The mesh.
    pieces : Pieces
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
        of = _sampled(self.recipe, self.pieces, self.job)
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

        of = _sampled(self.recipe, self.pieces, self.job)
        choice = _chosen(self.pieces, self.job)
        number, voxel, threads = self.number, of.planned.voxel, work.threads
        planes, frame = placing(of.planned, of.signs, choice.place)
        own, before, after = (self.kept(choice, n) for n in (number, number - 1, number + 1))
        assert own is not None
        ends = choice.ends[number - 1] if number else -np.inf, choice.ends[number]
        made = finished_alone(own, before, after, ends, voxel, planes, frame, threads)
        tally = Tally(threads)
        tally.add(made)
        late = at_tips(made.passed, choice.tips)
        plain = made.passed.selected(late < 0)
        return packed(
            stl=np.frombuffer(stl(plain.vertices, plain.triangles).data, np.uint8),
            late=late[late >= 0],
            corners=made.passed.corners[late >= 0],
            contact=np.array(on_the_plate(made.passed, threads)),
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

    @property
    def place(self) -> Placement:
        """Placement."""
        scale, x, y, z = self.placed.tolist()
        return Placement(scale, (x, y, z))


@dataclass(frozen=True, eq=False)
class Sampled:
    """A planned field and its samples.

    Attributes
    ----------
    planned : Plan
        The field.
    signs : SignBricks
        Its samples.
    contours : SurfaceContours
        Pieces of its surface.
    """

    planned: Plan
    signs: SignBricks
    contours: SurfaceContours


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


def samples_key(recipe: MeshRecipe, root_key: str, signs: SignBricks) -> str:
    """Key of a sampled field.

    Parameters
    ----------
    recipe : MeshRecipe
        The mesh.
    root_key : str
        Key of its field.
    signs : SignBricks
        Its samples.

    Returns
    -------
    str
        The key.
    """
    return key(program(), recipe, root_key, signs.origin, signs.voxel, signs.ijk, signs.signs)


_READING = threading.Lock()


def _sampled(recipe: MeshRecipe, pieces: ResultFolder, job: str) -> Sampled:
    """Field and samples of a job, planned and read once in a process."""
    with _READING:
        return _kept(recipe, pieces, job)


@lru_cache(maxsize=1)
def _kept(recipe: MeshRecipe, pieces: ResultFolder, job: str) -> Sampled:
    made, files = recipe.plan(), unpacked(pieces.read(job, SAMPLES))
    lattice = made.lattice
    signs = SignBricks(lattice.origin, lattice.voxel, files["ijk"], files["signs"], files["index"])
    if samples_key(recipe, made.root.key, signs) != str(files["key"]):
        raise ClusterError("the field planned here is another than that of the job")
    return Sampled(made, signs, SurfaceContours(made.root, signs, threads=1))


def _chosen(pieces: ResultFolder, job: str) -> Selection:
    files = unpacked(pieces.read(job, CHOICE))
    prefix, stride = str(files.pop("prefix")), int(files.pop("stride"))
    return Selection(prefix=prefix, stride=stride, **files)


def read_components(files: Files) -> PieceComponents:
    """Components of a piece from the result of its `ContourTask`.

    Parameters
    ----------
    files : dict
        Arrays by name.

    Returns
    -------
    Components
        The components.
    """
    return PieceComponents(**{name: files[name] for name in PieceComponents.__dataclass_fields__})


def read_seam(files: Files, name: str) -> Mesh:
    """Triangles at a seam from the result of a `ContourTask`.

    Parameters
    ----------
    files : dict
        Arrays by name.
    name : {"head", "tail"}
        The begin or the end of the piece.

    Returns
    -------
    Mesh
        The triangles.
    """
    return Mesh(files[f"{name}_vertices"], files[f"{name}_triangles"])
