"""Steps of a mesh job, made piece by piece, and what makes them: this process, or the pool of `shared`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..mesh.contouring import BLUNT, Piece, SurfaceContours, contour_whole
from ..mesh.model import Mesh
from ..mesh.pieces import HEAD, TAIL, Pieces
from ..mesh.shells import PieceComponents, components, groups, joined_components, levels
from ..mesh.tips import Pointed, PointedPiece, pointed_in
from ..store import Arrays
from ..volume.lattice import BRICK
from ..work import Work, ahead

if TYPE_CHECKING:
    from ..volume import Plan, SignBricks

R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class Sampled:
    """A planned field and its samples."""

    planned: Plan  # the field
    signs: SignBricks  # its samples
    threads: int = 0  # threads that index them

    @cached_property
    def contours(self) -> SurfaceContours:
        """Pieces of the surface."""
        return SurfaceContours(self.planned.root, self.signs, self.threads)


class MeshStep(ABC, Generic[R]):
    """A step of a mesh job: a function of the number of a piece, of what is kept of the steps before."""

    pieces: Pieces  # pieces of the surface

    @property
    def name(self) -> str:
        """First part of the names of its results."""
        return type(self).__name__.lower()

    @abstractmethod
    def result(self, number: int, work: Work) -> R:
        """Make the result of a piece."""

    def results(self, numbers: Sequence[int], work: Work) -> Iterator[R]:
        """Make the results of pieces in this process, in order."""
        return (self.result(number, work) for number in numbers)

    @abstractmethod
    def about(self) -> Arrays:
        """What the step is made of besides the pieces and the samples, for another process."""

    @classmethod
    @abstractmethod
    def read(cls, about: Arrays, pieces: Pieces, sampled: Callable[[], Sampled]) -> Self:
        """Make the step from what `about` returned."""

    @staticmethod
    @abstractmethod
    def pack(result: R) -> Arrays:
        """Arrays of a result, for another process."""

    @staticmethod
    @abstractmethod
    def unpack(arrays: Arrays) -> R:
        """Make a result from its arrays."""


class Executor(ABC):
    """What makes the steps of a job."""

    @abstractmethod
    def results(self, step: MeshStep[R], numbers: Iterable[int], stage: str) -> Iterator[R]:
        """Results of a step for some pieces, in order."""

    @abstractmethod
    def summary(self, step: Contour, stage: str) -> Summary:
        """Results of contouring, joined by a tree."""


@dataclass(frozen=True)
class Local(Executor):
    """This process: one piece after another, by all threads."""

    work: Work  # threads, progress and cancellation

    def results(self, step: MeshStep[R], numbers: Iterable[int], stage: str) -> Iterator[R]:
        """See `Executor.results`."""
        numbers = list(numbers)
        for done, result in enumerate(step.results(numbers, self.work), 1):
            self.work.check()
            self.work.progress(stage, done / len(numbers))
            yield result

    def summary(self, step: Contour, stage: str) -> Summary:
        """See `Executor.summary`."""
        count, join = len(step.cuts), partial(joined_summary, step.of.planned.voxel, self.work.threads)
        ranges = self.results(step, range(count), stage)
        for _ in levels(count):
            ranges = map(join, groups(ranges))
        (whole,) = ranges
        return whole


class Summary(NamedTuple):
    """What consecutive pieces of a surface are joined by."""

    ends: NDArray[np.float64]  # x at which each piece ends
    triangles: NDArray[np.int64]  # triangles of each piece
    components: PieceComponents  # connected components
    pointed: PointedPiece  # pointed vertices
    blunt: NDArray[np.float64]  # middles of blunt cells; if there are more than `BLUNT`, some of them


def joined_summary(voxel: float, threads: int, ranges: list[Summary]) -> Summary:
    """Join the summaries of consecutive ranges of pieces."""
    pointed = Pointed(voxel, threads)
    for one in ranges:
        pointed.join(one.pointed, float(one.ends[-1]))
    return Summary(
        np.concatenate([one.ends for one in ranges]),
        np.concatenate([one.triangles for one in ranges]),
        joined_components([one.components for one in ranges]),
        pointed.before(ranges[0].pointed.head),
        np.concatenate([one.blunt for one in ranges])[: BLUNT + 1],
    )


@dataclass(frozen=True, eq=False)
class Contour(MeshStep[Summary]):
    """Contours the surface and labels its connected components."""

    of: Sampled
    cuts: list[tuple[int, int]]  # layers of bricks of each piece, last excluded
    pieces: Pieces

    def result(self, number: int, work: Work) -> Summary:
        """Contour a piece; see `MeshStep.result`."""
        contours = self.of.contours
        return self._keep(number, contours.piece(*self.cuts[number], contours.refiner(work), work), work)

    def results(self, numbers: Sequence[int], work: Work) -> Iterator[Summary]:
        """Contour the pieces with one search for roots; see `MeshStep.results`."""
        if len(self.cuts) == 1:
            pieces = iter([contour_whole(self.of.planned.root, self.of.signs, work)])
        else:
            made = self.of.contours.pieces((self.cuts[number] for number in numbers), work)
            pieces = ahead(made)  # while the one before is stored
        return (self._keep(number, piece, work) for number, piece in zip(numbers, pieces, strict=True))

    def _keep(self, number: int, piece: Piece, work: Work) -> Summary:
        """Store a piece and its labels."""
        signs, mesh, voxel = self.of.signs, piece.mesh, self.of.planned.voxel
        start = signs.origin[0] + signs.voxel * BRICK * self.cuts[number][0] if number else -np.inf
        self.pieces.put(number, mesh, start, piece.end)
        labels, found = components(mesh, start, piece.end, voxel, work.threads)
        self.pieces.label(number, labels)
        pointed = pointed_in(mesh, start, piece.end, voxel, work.threads)
        ends, triangles = np.array([piece.end]), np.array([len(mesh.triangles)])
        return Summary(ends, triangles, found, pointed, piece.blunt)

    def about(self) -> Arrays:
        """See `MeshStep.about`."""
        return {"cuts": np.array(self.cuts)}

    @classmethod
    def read(cls, about: Arrays, pieces: Pieces, sampled: Callable[[], Sampled]) -> Self:
        """See `MeshStep.read`."""
        return cls(sampled(), about["cuts"].tolist(), pieces)

    @staticmethod
    def pack(result: Summary) -> Arrays:
        """See `MeshStep.pack`."""
        ends, triangles, found, pointed, blunt = result
        parts: dict[str, Any] = {
            "ends": ends,
            "counted": triangles,
            "pointed": pointed.points,
            "blunt": blunt,
        }
        for side in (HEAD, TAIL):
            mesh: Mesh = getattr(pointed, side)
            parts |= {f"{side}_vertices": mesh.vertices, f"{side}_triangles": mesh.triangles}
        return parts | vars(found)

    @staticmethod
    def unpack(arrays: Arrays) -> Summary:
        """See `MeshStep.unpack`."""
        head, tail = (Mesh(arrays[f"{side}_vertices"], arrays[f"{side}_triangles"]) for side in (HEAD, TAIL))
        found = PieceComponents(**{name: arrays[name] for name in PieceComponents.__dataclass_fields__})
        pointed = PointedPiece(arrays["pointed"], head, tail)
        return Summary(arrays["ends"], arrays["counted"], found, pointed, arrays["blunt"])
