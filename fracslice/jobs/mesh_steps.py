"""From a scene to finished triangles in mm: the plan with its edits for printing, its samples, and the steps
from contouring on, made piece by piece by this process, or by the pool of `shared`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial, reduce
from itertools import count
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import distinct
from ..common.memory import available_bytes
from ..common.messages import significant
from ..errors import GridError, TooLargeError, VolumeError
from ..mesh.checks import Tally, nearest, surface_samples, surface_to_mesh
from ..mesh.cleaning import SelectedPiece, finished_piece, grid_planes, place_and_round
from ..mesh.contouring import BLUNT, Piece, SurfaceContours, contour_whole
from ..mesh.model import Mesh, build, choose
from ..mesh.shells import (
    HEAD,
    TAIL,
    NearBodies,
    Nesting,
    PieceComponents,
    Pieces,
    WholeShells,
    components,
    gather_rows,
    groups,
    joined_components,
    levels,
)
from ..mesh.tips import Late, Pointed, PointedPiece, pointed_in, without_tips
from ..printing.walls import MeshSurface, ThinWalls, thin_walls
from ..records import PIECES, MeshJob
from ..scene import Print, Scene
from ..store import Arrays
from ..volume.bricks import BRICK
from ..work import Work, ahead, in_background
from .report import Clock, Placement

if TYPE_CHECKING:
    from ..common.arrays import Triangles
    from ..mesh import Mesh
    from ..mesh.checks import MeshReport
    from ..mesh.cleaning import Finished, Frame
    from ..mesh.model import Removed
    from ..mesh.refine import Refined
    from ..mesh.shells import Pieces, WholeShells
    from ..volume import Plan, SignBricks
    from ..volume.amount import Sizing
    from ..volume.sampler import Evaluate


@dataclass(frozen=True)
class Sized:
    """A plan, its scale, and the remaining choice of bodies."""

    planned: Plan  # field and voxel
    scale: float  # mm per scene unit
    left: Print  # choice of bodies and cavities that is made in the mesh


def plan_mesh(scene: Scene, what: MeshJob, size: Sizing, clock: Clock) -> Sized:
    """Plan the field to be meshed, with its edits."""
    from ..volume import plan
    from ..volume.amount import orient_field

    how = what.edits(scene)
    with clock("planning"):
        root = orient_field(scene.root, what.up, size.stretch, clock.work)
        made = plan(root, what.voxels(size.longest), clock.work)
        if how.bodies is not None:
            from ..printing.edits import frame_bodies

            made = frame_bodies(made, size, how.bodies, clock.work)
    if not how.whole:
        return apply_edits(made, scene, what, size, clock)
    return Sized(made.strict if what.proved else made, size.scale(made.box), how)


@contextmanager
def in_mm(size: Sizing) -> Iterator[None]:
    """Add the voxel in mm to the error of too large a grid."""
    try:
        yield
    except GridError as error:
        raise VolumeError(f"{error}, {significant(size.longest / error.most)} mm") from None


def apply_edits(made: Plan, scene: Scene, what: MeshJob, size: Sizing, clock: Clock) -> Sized:
    """Make all edits for printing."""
    from ..printing import printable

    how = what.edits(scene)
    with clock("changing"):
        changed, scale = printable(made, size, how, clock.work, measured=False)
        if how.supports != "none":
            from ..slicing.supports import supported_plan

            changed = supported_plan(changed, scale, how, size, clock.work)
    # Walls thinner than a voxel are crumbs in the mesh: choose bodies in the field where it can tell.
    keep = how.keep if made.root.bounds.exterior_only else "all"
    # Keep cavities: the hollow is one.
    changed = changed.strict if what.proved else changed
    return Sized(changed, scale, Print(keep=keep, cavities=how.cavities if how.whole else "keep"))


BYTES_A_CROSSING = 140
"""Peak memory by grid edges that the surface crosses, bytes: 125 to 150 measured, on meshes of 66 and 375
million triangles.
"""

SEAM = 2.0
"""Distance from supports from which on sharp edges are looked for, voxels."""

COUNTED = 1 << 12
"""Bricks whose crossings are counted."""

BRICKS = 1 << 13
"""Bricks per piece of a mesh that does not fit in memory, and of a mesh that always fits: 256 voxels along
the longest side.
"""


@dataclass(frozen=True, eq=False)
class Surface:
    """Exact surface of a field, scene units."""

    planned: Plan  # sampled field
    signs: SignBricks  # its samples
    pieces: Pieces  # labelled pieces of the mesh
    shells: WholeShells  # shells of the mesh
    tips: NDArray[np.float64]  # vertices that were added at tips, and at sharp edges that samples cut off
    own: bool = False  # whether these are the triangles of a model, which no voxel is too large for
    split: bool = False  # whether tetrahedra were split until they showed what is thinner than a voxel

    @property
    def thin(self) -> str:
        """Note on walls thinner than a voxel; empty if there are none."""
        return "" if self.own or self.split else self.shells.thin_walls(self.planned.voxel)


def sample_surface(planned: Plan, clock: Clock, evaluate: Evaluate | None = None) -> SignBricks:
    """Sample the signs of a planned scene around its surface.

    `planned`: field and voxel.
    """
    from ..volume import sample_scene_signs

    with clock("sampling"):
        return sample_scene_signs(planned, clock.work, evaluate)


def has_thin_walls(signs: SignBricks) -> bool:
    """True if walls thinner than a voxel hold too much of the material for the samples to distinguish
    bodies.
    """
    from ..printing.walls import components_of, sign_samples

    return not components_of(sign_samples(signs)).tells_bodies


def refuse_what_does_not_fit(signs: SignBricks, voxel: float) -> None:
    """Raise an error for a surface that needs more memory than is available.

    The number of bricks grows with a power of the resolution: the box-counting dimension of the surface,
    estimated from boxes of one and of two bricks.

    `voxel` in mm.
    """
    needed, free = len(signs) * crossings_a_brick(signs) * BYTES_A_CROSSING, available_bytes()
    if len(signs) <= BRICKS or needed <= free:
        return
    boxes = len(distinct(np.ravel_multi_index((signs.ijk // (2 * BRICK)).T, signs.index.shape)))
    dimension = min(max(math.log2(len(signs) / boxes), 2.0), 3.0)
    fits = voxel * (needed / free) ** (1 / dimension)
    raise TooLargeError(
        f"a voxel of {voxel:.3g}mm needs about {needed / 1e9:.1f} GB of memory, and {free / 1e9:.1f} GB are "
        f"free; a voxel of {fits * 1.02:.3g}mm fits"
    )


def crossings_a_brick(signs: SignBricks) -> float:
    """Count the grid edges that the surface crosses, in bricks that are spread evenly."""
    some = signs.signs[:: max(len(signs) // COUNTED, 1)]
    changes = some[:, 1:] ^ some[:, :-1], some[:, :, 1:] ^ some[:, :, :-1], (some ^ (some >> 1)) & 0x7F
    within = sum(int(np.bitwise_count(change).sum()) for change in changes)
    return within / len(some) * BRICK / (BRICK - 1)


def surface_of(
    of: Sampled, cuts: list[tuple[int, int]], pieces: Pieces, executor: Executor, clock: Clock
) -> Surface:
    """Mesh the surface of samples.

    `cuts`: layers of bricks of each piece; `pieces`: where they are kept, empty.
    """
    from ..mesh.ridges import with_ridges
    from ..mesh.shells import survey
    from ..mesh.tips import Pointed, with_tips

    planned, work = of.planned, clock.work
    with clock("meshing"):
        found = executor.summary(Contour(of, cuts, pieces), "meshing")
        for end, triangles in zip(found.ends.tolist(), found.triangles.tolist(), strict=True):
            pieces.count(end, triangles)
        pieces.first_labels = np.cumsum([0, *found.components.counts[:-1]]).tolist()
        pointed = Pointed(planned.voxel, work.threads)
        pointed.join(found.pointed, np.inf)
        changed, tips = with_tips(planned, pieces, pointed.points, work)
        blunt = found.blunt
        if planned.supports:  # pillars keep their blunt seams, of which there are thousands
            blunt = blunt[planned.supports.distances(blunt) > SEAM * planned.voxel]
        changed, tips = with_ridges(planned, changed, blunt, tips, work)
        if changed is pieces:
            shells = found.components.shells()
        else:
            shells = survey(changed, planned.voxel, work.threads)
        return Surface(planned, of.signs, changed, shells, tips)


def surface_of_triangles(of: Sampled, own: Triangles, clock: Clock) -> Surface:
    """Take the triangles of a model, scene units, for its surface."""
    from ..mesh.contouring import Piece
    from ..mesh.shells import survey

    pieces, none = Pieces(), np.empty((0, 3))
    with clock("meshing"):
        pieces.add(Piece(Mesh(own.vertices, own.triangles), np.inf), fresh=0)
        shells = survey(pieces, of.planned.voxel, clock.work.threads)
        return Surface(of.planned, of.signs, pieces, shells, none, own=True)


def split_surface(planned: Plan, clock: Clock) -> Surface:
    """Surface of a field of which samples miss what is thinner than a voxel."""
    from ..mesh.contouring import Piece
    from ..mesh.shells import survey
    from ..mesh.subgrid import thin_surface
    from ..volume.bricks import SignBricks

    pieces, lattice, none = Pieces(), planned.lattice, np.empty((0, 3))
    with clock("meshing"):
        mesh, evaluations = thin_surface(planned.root, lattice, clock.work)
        pieces.add(Piece(mesh, np.inf), fresh=len(mesh.triangles))
        shells = survey(pieces, planned.voxel, clock.work.threads)
        signs = SignBricks.without(lattice, evaluations)
        return Surface(planned, signs, pieces, shells, none, split=True)


def refine_surface(surface: Surface, chord: float, clock: Clock) -> tuple[Surface, Refined]:
    """Refine a surface in one piece.

    `chord`, and the lengths of the result, in scene units.
    """
    from ..mesh.contouring import Piece
    from ..mesh.refine import refine
    from ..mesh.shells import Pieces, survey

    planned, pieces = surface.planned, Pieces()
    with clock("refining"):
        mesh, done = refine(planned.root, surface.pieces.mesh(0), chord, planned.voxel, clock.work)
        pieces.add(Piece(mesh, np.inf), fresh=len(mesh.triangles))
        shells = survey(pieces, planned.voxel, clock.work.threads)
        return replace(surface, pieces=pieces, shells=shells), done


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


FLAT = 0.1
"""Fraction of the minimum distance between vertices. Vertices within this height of the bed are moved to the
bed, which keeps a flat base flat; a larger one would fold the small triangles around a lowest vertex.
"""

CRUMB = 0.5
"""Volume of a body around a single sample, at most, voxels."""


def placing(planned: Plan, signs: SignBricks, place: Placement) -> tuple[NDArray[np.float64], Frame]:
    """Return what quantisation needs of a placement.

    Returns float64 (k, 3), mm.
    """
    from ..mesh.contouring import minimum_edge_parameter

    bed = FLAT * minimum_edge_parameter(signs) * planned.voxel * place.scale
    return place.mm(grid_planes(signs)), (place.scale, place.offset, bed)


def largest_crumb(volumes: NDArray[np.float64], voxel: float) -> float:
    """Return the volume below which bodies are tips that the samples separate from the body beside them.

    `volumes`: float64 (s,); `voxel`: volume of a voxel. Returns half a voxel, or 0 if such
    bodies hold much of the material.
    """
    crumbs = volumes[(volumes > 0) & (volumes < CRUMB * voxel)]
    return CRUMB * voxel if crumbs.sum() < PIECES * volumes.sum() else 0.0


@dataclass(frozen=True, eq=False)
class Nest(MeshStep[Nesting]):
    """Searches the surroundings of the shells whose rays are in a piece."""

    shells: WholeShells
    searched: NDArray[np.bool_]  # shells whose surroundings are searched
    pieces: Pieces

    def result(self, number: int, work: Work) -> Nesting:
        """Winding numbers and parents; see `MeshStep.result`."""
        mesh, labels = self.pieces.mesh(number), self.pieces.labels(number)
        return self.shells.rays(number, mesh, labels, self.searched, work.threads)

    def about(self) -> Arrays:
        """See `MeshStep.about`."""
        return {"searched": self.searched, **vars(self.shells)}

    @classmethod
    def read(cls, about: Arrays, pieces: Pieces, sampled: Callable[[], Sampled]) -> Self:
        """See `MeshStep.read`."""
        return cls(read_shells(about), about["searched"], pieces)

    @staticmethod
    def pack(result: Nesting) -> Arrays:
        """See `MeshStep.pack`."""
        return result._asdict()

    @staticmethod
    def unpack(arrays: Arrays) -> Nesting:
        """See `MeshStep.unpack`."""
        return Nesting(**arrays)


def read_shells(arrays: Arrays) -> WholeShells:
    """Shells from their arrays, which may be among others."""
    return WholeShells(**{name: arrays[name] for name in WholeShells.__dataclass_fields__})


@dataclass(frozen=True, eq=False)
class Distances(MeshStep[NDArray[np.float64]]):
    """Measures the distances of points, scene units, from the triangles of a piece within reach."""

    points: NDArray[np.float64]  # float64 [n, 3]
    reach: float
    pieces: Pieces
    turn: int = 0  # how many times the reach has grown

    @property
    def name(self) -> str:
        """See `MeshStep.name`."""
        return f"distances-{self.turn}"

    def result(self, number: int, work: Work) -> NDArray[np.float64]:
        """Distances, float64 [n]; see `MeshStep.result`."""
        return nearest(self.pieces.mesh(number), self.points, self.reach, work)

    def about(self) -> Arrays:
        """See `MeshStep.about`."""
        return {"points": self.points, "reach": np.array(self.reach), "turn": np.array(self.turn)}

    @classmethod
    def read(cls, about: Arrays, pieces: Pieces, sampled: Callable[[], Sampled]) -> Self:
        """See `MeshStep.read`."""
        return cls(about["points"], float(about["reach"]), pieces, int(about["turn"]))

    @staticmethod
    def pack(result: NDArray[np.float64]) -> Arrays:
        """See `MeshStep.pack`."""
        return {"distances": result}

    @staticmethod
    def unpack(arrays: Arrays) -> NDArray[np.float64]:
        """See `MeshStep.unpack`."""
        return arrays["distances"]


def surface_distances(surface: Surface, executor: Executor, work: Work) -> NDArray[np.float64]:
    """Distances from points on the surface of the field to its mesh, scene units, float64 [n]."""
    pieces, margin = surface.pieces, surface.planned.voxel
    if surface.own:  # triangles of any size
        return nearest(pieces.mesh(0), surface_samples(surface.planned, work), np.inf, work)
    ends = np.array(pieces.ends)
    begins, turns = np.concatenate([[-np.inf], ends[:-1]]), count()

    def search(points: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
        x = points[:, :1]
        near = ((x > begins - reach - margin) & (x < ends + reach + margin)).any(axis=0)
        step = Distances(points, reach, pieces, next(turns))
        found = executor.results(step, np.flatnonzero(near).tolist(), "checking")
        return reduce(np.minimum, found, np.full(len(points), np.inf))

    return surface_to_mesh(surface.planned, search, work)


@dataclass(frozen=True)
class Chosen:
    """Figures of the bodies of a surface that stay, mm."""

    removed: Removed  # bodies and cavities that were removed
    misplaced: int  # shells that are inside out
    loose: int  # bodies that do not stand on the plate
    size: list[float]  # size of all bodies, removed ones included
    volume: float  # volume of all bodies, removed ones included
    cavities: float  # volume of the cavities that stay


def choose_bodies(
    surface: Surface,
    how: Print,
    dust: Callable[[float, float], float],
    scale: float,
    thickness: float,
    executor: Executor,
) -> tuple[Finish, Chosen]:
    """Choose the bodies of a surface and place them.

    `dust`: limit, mm3, of the volume and of the largest crumb; `scale`: mm per scene unit; `thickness`: below
    which walls are looked for, mm.
    """
    planned, pieces, shells, unit = surface.planned, surface.pieces, surface.shells, scale**3
    searched = shells.searched(how.cavities == "fill")
    numbers = distinct(shells.piece[searched]).tolist()
    rays = executor.results(Nest(shells, searched, pieces), numbers, "finishing")
    nested, misplaced = shells.nested(searched, dict(zip(numbers, rays, strict=True)))
    sized = replace(nested, volumes=nested.volumes * unit)
    limit = dust(float(sized.volumes.sum()), largest_crumb(sized.volumes, planned.voxel**3 * unit))
    stays, removed = choose(sized, keep=how.bodies, dust_mm3=limit, cavities=how.cavities)
    (x, y, _), lowest = planned.box.centre, float(shells.bounds(stays)[0, 2])
    bottoms, volumes = shells.outermost[stays & (shells.volumes > 0), 2, 2], nested.volumes[stays]
    chosen = Chosen(
        removed,
        misplaced,
        loose=int((bottoms > lowest + planned.voxel).sum()),
        size=(scale * np.ptp(shells.bounds(), axis=0)).tolist(),
        volume=float(volumes.sum()) * unit + (removed.bodies_mm3 - removed.filled_mm3),
        cavities=-float(volumes[volumes < 0].sum()) * unit,
    )
    place = Placement(scale, (-scale * x, -scale * y, -scale * lowest))
    of = Sampled(planned, surface.signs)
    return Finish(of, shells, stays, place, surface.tips, thickness, pieces), chosen


@dataclass
class Checks:
    """What the checks of finished pieces found; sums over pieces."""

    tally: Tally = field(default_factory=Tally)
    contact: float = 0.0  # area on the plate, mm2
    # shells of bodies that nearly touch others, of each piece
    near: list[NDArray[np.int64]] = field(default_factory=list)
    # distances of vertices from the surface, scene units, of each piece
    errors: list[NDArray[np.float64]] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)  # triangles of each piece that are at no tip
    late: list[Late] = field(default_factory=list)  # the others
    thin: list[ThinWalls] = field(default_factory=list)  # walls below the thickness, of each piece

    @property
    def near_bodies(self) -> int:
        """Number of bodies that nearly touch others; cavities are none."""
        return len(distinct(np.concatenate([np.empty(0, np.int64), *self.near])))

    def include(self, other: Checks) -> None:
        """Add the sums over other pieces."""
        self.tally.include(other.tally)
        self.contact += other.contact
        for name in ("near", "errors", "rows", "late", "thin"):
            getattr(self, name).extend(getattr(other, name))


@dataclass(frozen=True, eq=False)
class Finish(MeshStep[Checks]):
    """Places, cleans and checks the bodies that stay."""

    of: Sampled
    shells: WholeShells
    stays: NDArray[np.bool_]  # shells that stay
    place: Placement
    added: NDArray[np.float64]  # vertices that were added at tips, scene units
    thickness: float  # thickness below which walls are looked for, mm; 0 for none
    pieces: Pieces

    @cached_property
    def _placing(self) -> tuple[NDArray[np.float64], Frame]:
        return placing(self.of.planned, self.of.signs, self.place)

    @cached_property
    def tips(self) -> NDArray[np.float64]:
        """The vertices that were added at tips, in the finished mesh, mm."""
        return place_and_round(self.added, self._placing[1])

    @cached_property
    def _labels_that_stay(self) -> NDArray[np.bool_]:
        return self.stays[self.shells.of_label]

    @cached_property
    def _near_bodies(self) -> NearBodies:
        return NearBodies(self.shells, self.stays, self.of.planned.voxel)

    def report(self, tally: Tally, misplaced: int) -> MeshReport:
        """Report on the whole mesh."""
        hollow = self.shells.volumes < 0
        bodies, cavities = int((self.stays & ~hollow).sum()), int((self.stays & hollow).sum())
        return tally.report(bodies, cavities, misplaced)

    def finished(self, number: int, threads: int) -> tuple[Finished, NDArray[np.int64]]:
        """Place and clean a piece, mm. Returns the shells of its bodies that nearly touch others, too."""
        voxel, pieces, last = self.of.planned.voxel, self.pieces, len(self.pieces) - 1
        mesh, labels = pieces.mesh(number), pieces.labels(number)
        near = self._near(number, mesh, labels, threads)
        before = self._strip(number - 1, TAIL, threads) if number else None
        after = self._strip(number + 1, HEAD, threads) if number < last else None
        own = SelectedPiece(mesh, self._stays(labels, threads), pieces.fresh_rows(number))
        ends = pieces.start(number), pieces.ends[number]
        return finished_piece(own, before, after, ends, voxel, *self._placing, threads), near

    def _strip(self, number: int, side: str, threads: int) -> SelectedPiece:
        """Strip of a neighbour with the choice of its bodies."""
        part = self.pieces.strip(number, side, threads)
        fresh = np.flatnonzero(np.isin(part.rows, self.pieces.fresh_rows(number)))
        return SelectedPiece(part.mesh, self._stays(self.pieces.labels(number)[part.numbers], threads), fresh)

    def _stays(self, labels: NDArray[np.int32], threads: int) -> NDArray[np.bool_]:
        """True for vertices whose body stays."""
        return gather_rows(self._labels_that_stay, labels, threads)

    def _near(self, number: int, mesh: Mesh, labels: NDArray[np.int32], threads: int) -> NDArray[np.int64]:
        """Shells of the bodies that nearly touch others, in a piece and at its seam with the next one."""
        near, pieces, own = self._near_bodies, self.pieces, (mesh.vertices, labels)
        if not near.several:
            return np.empty(0, np.int64)
        found = near.within(*own, threads)
        if number + 1 == len(pieces):
            return found
        part = pieces.strip(number + 1, HEAD, threads)
        other = part.mesh.vertices, pieces.labels(number + 1)[part.numbers]
        return distinct(np.concatenate([found, near.across(pieces.ends[number], own, other, threads)]))

    def checks(self, made: Finished, near: NDArray[np.int64], work: Work) -> Checks:
        """Check a finished piece."""
        planned, tally = self.of.planned, Tally(work.threads)
        with in_background(partial(on_the_plate, made.passed, work.threads), work.threads) as contact:
            tally.add(made)
            points = made.points[:: stride(len(self.of.signs))]
            errors = off_surface(planned, self.place, points, work)
            return Checks(tally, contact(), [near], [errors], thin=self._thin_walls(made, work))

    def _thin_walls(self, made: Finished, work: Work) -> list[ThinWalls]:
        """Walls of a finished piece that are too thin, if any are looked for."""
        if not (self.thickness and made.done):
            return []
        mesh, tree = made.mesh, build(made.mesh, work.threads, halved=True)
        surface = MeshSurface(mesh.vertices, mesh.triangles, *tree)
        return [thin_walls(surface, made.done, self.thickness, work.threads)]

    def each(self, clock: Clock) -> Iterator[tuple[Finished, NDArray[np.int64]]]:
        """Finish the pieces in this process, with their near bodies. Those held in memory are released."""
        work, pieces = clock.work, len(self.pieces)
        for number in range(pieces):
            with clock("finishing"):
                work.progress("finishing", number / pieces)
                made = self.finished(number, work.threads)
                self.pieces.drop(number if number + 1 < pieces else pieces)
            work.progress("finishing", (number + 1) / pieces)
            yield made

    def passing(
        self, each: Iterable[tuple[Finished, NDArray[np.int64]]], checks: Checks, clock: Clock
    ) -> Iterator[Mesh]:
        """Pass finished pieces on, mm, and check each while the caller uses it."""
        for made, near in each:
            yield made.passed
            with clock("checking"):
                checks.include(self.checks(made, near, clock.work))

    def result(self, number: int, work: Work) -> Checks:
        """Finish a piece, store its triangles but those at tips, and check it; see `MeshStep.result`."""
        made, near = self.finished(number, work.threads)
        checks = self.checks(made, near, work)
        plain, late = without_tips(made.passed, self.tips, work.threads)
        self.pieces.finish(number, plain)
        return replace(checks, rows=[len(plain.triangles)], late=[late])

    def about(self) -> Arrays:
        """See `MeshStep.about`."""
        place = np.array([self.place.scale, *self.place.offset])
        own = {"stays": self.stays, "place": place, "added": self.added}
        return own | {"thickness": np.array(self.thickness)} | vars(self.shells)

    @classmethod
    def read(cls, about: Arrays, pieces: Pieces, sampled: Callable[[], Sampled]) -> Self:
        """See `MeshStep.read`."""
        scale, x, y, z = about["place"].tolist()
        place = Placement(scale, (x, y, z))
        shells, thickness = read_shells(about), float(about["thickness"])
        return cls(sampled(), shells, about["stays"], place, about["added"], thickness, pieces)

    @staticmethod
    def pack(result: Checks) -> Arrays:
        """See `MeshStep.pack`."""
        (near,), (errors,), (rows,), (late,) = result.near, result.errors, result.rows, result.late
        own = {"contact": np.array(result.contact), "near": near, "errors": errors, "rows": np.array(rows)}
        tally = {f"tally-{name}": np.array(value) for name, value in vars(result.tally).items()}
        thin = {f"thin-{name}": rows for walls in result.thin for name, rows in vars(walls).items()}
        return own | late._asdict() | tally | thin

    @staticmethod
    def unpack(arrays: Arrays) -> Checks:
        """See `MeshStep.unpack`."""
        tally = Tally(**{name: arrays[f"tally-{name}"].tolist() for name in vars(Tally())})
        late = Late(arrays["tips"], arrays["corners"])
        near, errors, rows = [arrays["near"]], [arrays["errors"]], [int(arrays["rows"])]
        names = [f"thin-{name}" for name in ThinWalls.__dataclass_fields__ if "thin-width" in arrays]
        thin = [ThinWalls(*(arrays[name] for name in names))] if names else []
        return Checks(tally, float(arrays["contact"]), near, errors, rows, [late], thin)


MOST_ERRORS = 1 << 20
"""Approximate maximum of vertices whose distance from the surface is measured, evenly distributed over it."""

VERTICES_A_BRICK = 170


def stride(bricks: int) -> int:
    """Return the stride of the vertices whose distance from the surface is measured."""
    return max(-(-VERTICES_A_BRICK * bricks // MOST_ERRORS), 1)


def off_surface(
    planned: Plan, place: Placement, vertices: NDArray[np.float64], work: Work
) -> NDArray[np.float64]:
    """Measure the distances of vertices from the surface.

    `vertices`: float64 (n, 3), mm. Returns float64 (n,), scene units.
    """
    from ..mesh.fit import surface_error

    return surface_error(planned.root, vertices, planned.voxel, work, place.scale, place.offset)


def on_the_plate(mesh: Mesh, threads: int = 0) -> float:
    """Return the area of the triangles at z = 0.

    `mesh` in mm; the area in mm2.
    """
    from .._native import touching

    low = mesh.vertices[:, 2] == 0
    near = mesh.triangles[touching(mesh.triangles, low, threads)]
    x, y = np.moveaxis(mesh.vertices[near[low[near].all(1)], :2], 2, 0)
    double = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    return float(np.abs(double).sum()) / 2
