"""From a surface in scene units to finished triangles in mm: selection of bodies, placement, cleaning and
checks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial, reduce
from itertools import count
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from ..mesh.checks import Tally, nearest, surface_to_mesh
from ..mesh.cleaning import SelectedPiece, finished_piece, grid_planes, place_and_round
from ..mesh.pieces import HEAD, TAIL, Pieces, gather_rows
from ..mesh.shells import NearBodies, Nesting, WholeShells
from ..mesh.tips import Late, without_tips
from ..mesh.topology import choose
from ..records import PIECES
from ..scene import Print
from ..store import Arrays
from ..work import Work, in_background
from .mesh_steps import Executor, MeshStep, Sampled
from .report import Clock, Placement

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..mesh.checks import MeshReport
    from ..mesh.cleaning import Finished, Frame
    from ..mesh.topology import Removed
    from ..volume import Plan, SignBricks
    from .surfaces import Surface

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
    executor: Executor,
) -> tuple[Finish, Chosen]:
    """Choose the bodies of a surface and place them.

    `dust`: limit, mm3, of the volume and of the largest crumb; `scale`: mm per scene unit.
    """
    planned, pieces, shells, unit = surface.planned, surface.pieces, surface.shells, scale**3
    searched = shells.searched(how.cavities == "fill")
    numbers = np.unique(shells.piece[searched]).tolist()
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
    return Finish(of, shells, stays, place, surface.tips, pieces), chosen


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

    @property
    def near_bodies(self) -> int:
        """Number of bodies that nearly touch others; cavities are none."""
        return len(np.unique(np.concatenate([np.empty(0, np.int64), *self.near])))

    def include(self, other: Checks) -> None:
        """Add the sums over other pieces."""
        self.tally.include(other.tally)
        self.contact += other.contact
        for name in ("near", "errors", "rows", "late"):
            getattr(self, name).extend(getattr(other, name))


@dataclass(frozen=True, eq=False)
class Finish(MeshStep[Checks]):
    """Places, cleans and checks the bodies that stay."""

    of: Sampled
    shells: WholeShells
    stays: NDArray[np.bool_]  # shells that stay
    place: Placement
    added: NDArray[np.float64]  # vertices that were added at tips, scene units
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
        return np.union1d(found, near.across(pieces.ends[number], own, other, threads))

    def checks(self, made: Finished, near: NDArray[np.int64], work: Work) -> Checks:
        """Check a finished piece."""
        planned, tally = self.of.planned, Tally(work.threads)
        with in_background(partial(on_the_plate, made.passed, work.threads), work.threads) as contact:
            tally.add(made)
            points = made.points[:: stride(len(self.of.signs))]
            errors = off_surface(planned, self.place, points, work)
            return Checks(tally, contact(), [near], [errors])

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
        return {"stays": self.stays, "place": place, "added": self.added, **vars(self.shells)}

    @classmethod
    def read(cls, about: Arrays, pieces: Pieces, sampled: Callable[[], Sampled]) -> Self:
        """See `MeshStep.read`."""
        scale, x, y, z = about["place"].tolist()
        place = Placement(scale, (x, y, z))
        return cls(sampled(), read_shells(about), about["stays"], place, about["added"], pieces)

    @staticmethod
    def pack(result: Checks) -> Arrays:
        """See `MeshStep.pack`."""
        (near,), (errors,), (rows,), (late,) = result.near, result.errors, result.rows, result.late
        own = {"contact": np.array(result.contact), "near": near, "errors": errors, "rows": np.array(rows)}
        tally = {f"tally-{name}": np.array(value) for name, value in vars(result.tally).items()}
        return own | late._asdict() | tally

    @staticmethod
    def unpack(arrays: Arrays) -> Checks:
        """See `MeshStep.unpack`."""
        tally = Tally(**{name: arrays[f"tally-{name}"].tolist() for name in vars(Tally())})
        late = Late(arrays["tips"], arrays["corners"])
        near, errors, rows = [arrays["near"]], [arrays["errors"]], [int(arrays["rows"])]
        return Checks(tally, float(arrays["contact"]), near, errors, rows, [late])


MOST_ERRORS = 1 << 20
"""Approximate maximum of vertices whose distance from the surface is measured, evenly distributed over it."""

VERTICES_A_BRICK = 170


def stride(bricks: int) -> int:
    """Return the stride of the vertices whose distance from the surface is measured."""
    return -(-VERTICES_A_BRICK * bricks // MOST_ERRORS)


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
