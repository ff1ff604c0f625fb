"""An object in parts that fit a printer's bed: planes that cut few thin things, holes for pegs, numbers.

Lengths are mm, and places are measured from the low corner of the object's box, unless they say otherwise.
The object is cut in its field, so that cut faces are exact planes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..common.parameters import Sides
from ..errors import SceneError
from ..fields.box import Box, Triple
from ..fields.field import Field
from ..fields.registry import Node
from ..formulas import box as cuboid
from ..formulas import cylinder, intersection, plane, transform, union
from ..records import PartsJob
from ..scene.calibration import bars
from ..volume import Plan
from ..work import Work
from .edits import edited_field

if TYPE_CHECKING:
    from ..scene import Scene

ACROSS, FINER = 128, 400
"""Samples along the longest side in the search for planes, and most of them in that for pegs."""
FINEST = 0.4
"""Least distance of the latter."""
MOST_PARTS, LEAST_BED = 64, 20.0
"""Most parts, and least side of a bed."""
PEGS = ((8.0, 20.0), (6.0, 16.0), (4.0, 12.0), (3.0, 10.0))
"""Diameters and lengths of pegs, in the order of preference."""
SPARE = 0.5
"""How much deeper holes are than pegs at either end."""
WALL = 1.0
"""Least wall around a hole, and a quarter of the peg's diameter."""
THIN, NEAR = 6.0, 4.0
"""Width below which parts of a section are thin, and how far from a plane it is looked at."""
FAR, MOST_PEGS = 60.0, 4
"""Distance from which on a joint has more than two pegs, and most of them."""
HEIGHTS, DEPTH, OVER = (8.0, 5.0, 3.0), 0.6, 0.2
"""Heights of the digits that are tried, their depth, and what they are higher than that."""
UNEVEN, BARE = 0.02, 10.0
"""What parts of unequal length cost, by the square of their relative difference, and a plane without a place
for a peg. A plane that cuts thin things alone costs 1.
"""

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class CutPart:
    """A part of a divided object."""

    root: Field
    cell: tuple[int, int, int]  # where it is along each axis
    number: int | None  # engraved in it; None if there is no place for that


@dataclass(frozen=True)
class Peg:
    """A peg in its holes."""

    axis: int
    middle: Triple
    cells: tuple[tuple[int, int, int], tuple[int, int, int]]  # parts that it joins


@dataclass(frozen=True)
class Divided:
    """An object in parts that pegs join."""

    parts: list[CutPart]
    pegs: list[Peg]
    diameter: float  # of the pegs, and their length
    length: float
    bare: int  # joints without a place for a peg
    low: Triple  # low corner of the object's box, scene units
    unit: float  # mm per scene unit

    @property
    def peg(self) -> Scene:
        """Scene of a peg, upright."""
        from ..scene import scene

        return scene(cylinder(radius=self.diameter / 2, height=self.length), unit=1.0, name="peg")


def divide(planned: Plan, scale: float, how: PartsJob, work: Work | None = None) -> Divided:
    """Divide an object into parts.

    Parameters
    ----------
    planned
        The object.
    scale
        mm per scene unit.
    how
        The bed, the number of parts, and the clearance around pegs.
    work
        Execution settings.

    Raises
    ------
    SceneError
        If the parts do not fit the bed, or are too many.
    """
    whole = _Whole(planned.root, planned.box, scale, work or Work())
    counts = _counts(whole.sides, how)
    step = max(whole.sides) / ACROSS
    solid = whole.inside(*(np.arange(step / 2, side, step) for side in whole.sides))
    cuts = [
        _planes(np.moveaxis(solid, axis, 0), step, whole.sides[axis], counts[axis], how.side(axis))
        for axis in range(3)
    ]
    joints = [_Joint(whole, axis, n, cuts) for axis in range(3) for n in range(len(cuts[axis]))]
    return _Division(whole, cuts, joints, how.clearance, _filled(solid, step, cuts)).made()


@dataclass(frozen=True)
class _Whole:
    """The object that is divided."""

    root: Field
    box: Box  # scene units
    unit: float  # mm per scene unit
    work: Work

    @property
    def sides(self) -> Triple:
        x, y, z = (self.unit * side for side in self.box.size)
        return x, y, z

    def scene_point(self, at: Sequence[float]) -> list[float]:
        """A place in scene units."""
        return [low + place / self.unit for low, place in zip(self.box.lo, at, strict=True)]

    def inside(self, x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64]) -> Mask:
        """True where a grid of places is in the solid, bool [nx, ny, nz]."""
        kernel, axes = (
            self.root.kernel(),
            [a / self.unit + low for a, low in zip((x, y, z), self.box.lo, strict=True)],
        )
        result = np.empty((len(x), len(y), len(z)), bool)

        def task(number: int) -> None:
            points = np.broadcast_arrays(axes[0][number], *np.meshgrid(*axes[1:], indexing="ij"))
            result[number] = kernel.points(*(np.ascontiguousarray(p) for p in points)) < 0

        self.work.map(task, range(len(x)))
        return result


def _counts(sides: Triple, how: PartsJob) -> tuple[int, int, int]:
    """Number of parts along each axis."""
    if how.bed is not None and min(how.bed) < LEAST_BED:
        raise SceneError(
            f"bed {text_of(how.bed)}: expected at least {LEAST_BED:g}mm along each side, for pegs"
        )
    if how.parts is None or isinstance(how.parts, str):
        assert how.bed is not None
        x, y, z = (max(math.ceil(side / most - 1e-9), 1) for side, most in zip(sides, how.bed, strict=True))
    else:
        x, y, z = how.parts
    if x * y * z > MOST_PARTS:
        raise SceneError(
            f"{x} x {y} x {z} parts: expected at most {MOST_PARTS}, of a smaller object or for a larger bed"
        )
    for axis, count in enumerate((x, y, z)):
        if how.side(axis) < sides[axis] / count - 1e-9:
            size = " x ".join(f"{side / n:.4g}" for side, n in zip(sides, (x, y, z), strict=True))
            bed = f"a bed of {text_of(how.bed)}"
            raise SceneError(f"parts of {size} mm do not fit {bed}: expected --parts auto, or more of them")
        if sides[axis] / count < PEGS[-1][1] and count > 1:
            each = f"{count} parts along {'xyz'[axis]}, each {sides[axis] / count:.3g} mm long"
            raise SceneError(f"{each}: expected at least {PEGS[-1][1]:g} mm, for pegs")
    return x, y, z


def text_of(bed: Triple | None) -> str:
    """A bed as text."""
    return Sides(None, "").text(bed)


def _opened(section: Mask, step: float, width: float) -> tuple[Mask, bool]:
    """What discs of a width cover within a section, and whether there is anything."""
    from scipy.ndimage import distance_transform_edt

    core = distance_transform_edt(np.pad(section, 1))[1:-1, 1:-1] * step >= width / 2
    if not core.any():
        return core, False
    return section & (distance_transform_edt(~core) * step <= width / 2), True


def _planes(solid: Mask, step: float, side: float, count: int, most: float) -> list[float]:
    """Places of the planes across an axis, by dynamic programming.

    `solid`: samples, first along the axis; `most`: longest part.
    """
    if count == 1:
        return []
    places = np.arange(1, len(solid)) * step
    near = max(round(NEAR / step), 1)
    costs = np.array([_cost(solid[max(n - near, 0) : n + near], step) for n in range(1, len(solid))])
    even = side / count
    ends = np.array([0.0, *places, side])
    gaps = ends[None, :] - ends[:, None]  # from the first index to the second
    allowed = (gaps <= most * (1 + 1e-9)) & (gaps >= even / 2)
    between = np.where(allowed, UNEVEN * (gaps / even - 1) ** 2, np.inf)
    own = np.array([0.0, *costs, 0.0])
    best, before = between[0] + own, []
    for _ in range(count - 1):
        total = best[:, None] + between
        before.append(total.argmin(0))
        best = total.min(0) + own
    if not math.isfinite(best[-1]):
        return [even * k for k in range(1, count)]
    chosen, at = [], len(ends) - 1
    for back in reversed(before):
        at = int(back[at])
        chosen.append(float(ends[at]))
    return chosen[::-1]


def _cost(slabs: Mask, step: float) -> float:
    """Share of what is near a plane that is thin, along it or across; more without a place for a peg."""
    total = np.logical_or.reduce(slabs).sum()
    if not total:
        return BARE
    wide, some = _opened(np.logical_and.reduce(slabs), step, THIN)
    return float(1 - wide.sum() / total) + (0.0 if some else BARE)


def _filled(solid: Mask, step: float, cuts: Sequence[Sequence[float]]) -> list[tuple[int, int, int]]:
    """Cells with something in them."""
    ends = [[0, *(round(c / step) for c in some), None] for some in cuts]
    ranges = [[slice(a, b) for a, b in pairwise(some)] for some in ends]
    cells = product(*(range(len(some)) for some in ranges))
    return [(i, j, k) for i, j, k in cells if solid[ranges[0][i], ranges[1][j], ranges[2][k]].any()]


@dataclass(frozen=True)
class _Joint:
    """A plane between parts, with samples of the solid on both sides."""

    whole: _Whole
    axis: int
    number: int  # of the plane along the axis
    cuts: Sequence[Sequence[float]]  # all planes

    @property
    def at(self) -> float:
        return self.cuts[self.axis][self.number]

    @property
    def across(self) -> tuple[int, int]:
        """The other axes."""
        return (self.axis + 1) % 3, (self.axis + 2) % 3

    @cached_property
    def step(self) -> float:
        return max(FINEST, max(self.whole.sides) / FINER)

    @cached_property
    def offsets(self) -> NDArray[np.float64]:
        """Distances of the slabs from the plane."""
        most = PEGS[0][1] / 2 + SPARE + WALL
        return np.array([*np.linspace(-most, -DEPTH / 2, 7), *np.linspace(DEPTH / 2, most, 7)])

    @cached_property
    def slabs(self) -> Mask:
        """Samples beside the plane, bool [offset, u, v]."""
        axes = [np.empty(0)] * 3
        axes[self.axis] = self.at + self.offsets
        for axis in self.across:
            axes[axis] = np.arange(self.step / 2, self.whole.sides[axis], self.step)
        u, v = self.across
        return np.transpose(self.whole.inside(*axes), (self.axis, u, v)).copy()

    def faces(self) -> Iterator[tuple[tuple[int, int], tuple[slice, slice]]]:
        """Cells across the plane, and the samples of each."""
        ends = [[0, *(round(c / self.step) for c in self.cuts[axis]), None] for axis in self.across]
        parts = [list(enumerate(slice(a, b) for a, b in pairwise(some))) for some in ends]
        for (i, one), (j, other) in product(*parts):
            yield (i, j), (one, other)

    def cells(self, face: tuple[int, int]) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
        """Cells below and above a face."""
        cell = [0, 0, 0]
        for axis, index in zip(self.across, face, strict=True):
            cell[axis] = index
        low, high = list(cell), list(cell)
        low[self.axis], high[self.axis] = self.number, self.number + 1
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    def place(self, row: int, column: int, off: float = 0.0) -> Triple:
        """Place of a sample."""
        at = [0.0] * 3
        at[self.axis] = self.at + off
        for axis, index in zip(self.across, (row, column), strict=True):
            at[axis] = (index + 0.5) * self.step
        return at[0], at[1], at[2]

    def room(self, mask: Mask) -> NDArray[np.float64]:
        """Distances of samples from what is not in a mask."""
        from scipy.ndimage import distance_transform_edt

        distances: NDArray[np.float64] = distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1] * self.step
        return distances

    def pegs(self, diameter: float, length: float, clearance: float) -> tuple[list[Peg], int]:
        """Pegs, and the number of faces without a place for one."""
        deep = np.abs(self.offsets) <= length / 2 + SPARE + WALL
        need = diameter / 2 + clearance + max(WALL, diameter / 4) + self.step
        found, bare = [], 0
        for face, (rows, columns) in self.faces():
            solid = self.slabs[:, rows, columns]
            if not (solid[6] & solid[7]).any():
                continue
            common: Mask = np.logical_and.reduce(solid[deep])
            room = self.room(common)
            spots = np.argwhere(room >= need)
            corner = np.array([rows.start, columns.start])
            chosen = _spread(spots, 2 * need / self.step, FAR / self.step, room)
            found += [Peg(self.axis, self.place(*(corner + at)), self.cells(face)) for at in chosen]
            bare += not len(spots)
        return found, bare

    def spot(
        self, face: tuple[int, int], above: bool, pegs: list[Peg], radius: float, wide: float
    ) -> Triple | None:
        """Middle of a place for a number on one side of a face; None if there is none that is so wide."""
        rows, columns = dict(self.faces())[face]
        mask = self.slabs[7 if above else 6, rows, columns].copy()
        u = (np.arange(mask.shape[0]) + rows.start + 0.5) * self.step
        v = (np.arange(mask.shape[1]) + columns.start + 0.5) * self.step
        for peg in pegs:
            du, dv = u - peg.middle[self.across[0]], v - peg.middle[self.across[1]]
            mask &= du[:, None] ** 2 + dv[None] ** 2 > radius**2
        room = self.room(mask)
        row, column = np.unravel_index(room.argmax(), room.shape)
        if room[row, column] < wide:
            return None
        return self.place(int(row) + rows.start, int(column) + columns.start)


def _spread(
    spots: NDArray[np.intp], near: float, far: float, room: NDArray[np.float64]
) -> list[NDArray[np.intp]]:
    """Places among spots that are far from each other, samples."""
    if not len(spots):
        return []
    first = spots[((spots - spots.mean(0)) ** 2).sum(1).argmax()]
    chosen = [first]
    while len(chosen) < MOST_PEGS:
        away = np.sqrt(np.min([((spots - one) ** 2).sum(1) for one in chosen], axis=0))
        if away.max() < (near if len(chosen) == 1 else far):
            break
        chosen.append(spots[away.argmax()])
    if len(chosen) == 1:  # alone, it is where most room is
        return [spots[room[tuple(spots.T)].argmax()]]
    return chosen


@dataclass(frozen=True)
class _Division:
    """What the parts are made of."""

    whole: _Whole
    cuts: Sequence[Sequence[float]]
    joints: list[_Joint]
    clearance: float
    cells: list[tuple[int, int, int]]

    def made(self) -> Divided:
        """The parts."""
        diameter, length, pegs, bare = self.chosen_pegs()
        parts = [self.part(cell, n, pegs, diameter, length) for n, cell in enumerate(self.cells, 1)]
        size = (diameter, length) if pegs else (0.0, 0.0)
        return Divided(parts, pegs, *size, bare, self.whole.box.lo, self.whole.unit)

    def chosen_pegs(self) -> tuple[float, float, list[Peg], int]:
        """The largest pegs that have places in all joints; else those that have most."""
        tried = []
        for diameter, length in PEGS:
            found = [joint.pegs(diameter, length, self.clearance) for joint in self.joints]
            tried.append((diameter, length, [p for some, _ in found for p in some], sum(n for _, n in found)))
            if not tried[-1][-1]:
                break
        return min(tried, key=lambda one: one[-1])

    def part(
        self, cell: tuple[int, int, int], number: int, pegs: list[Peg], diameter: float, length: float
    ) -> CutPart:
        """A cell of the object, with holes and its number."""
        whole = self.whole
        own = [peg for peg in pegs if cell in peg.cells]
        holes = [self.hole(peg, diameter, length) for peg in own]
        spot = self.number(cell, number, own, diameter / 2 + self.clearance + WALL)
        limits = [
            plane(
                normal=[sign * (k == axis) for k in range(3)], offset=sign * whole.scene_point([at] * 3)[axis]
            )
            for axis in range(3)
            for sign, at in self.limits(axis, cell[axis])
        ]
        root = edited_field(whole.root, "keep", intersection(*limits)) if limits else whole.root
        if cut := [*holes, *(spot or [])]:
            root = edited_field(root, "cut", union(*cut))
        return CutPart(root, cell, number if spot else None)

    def limits(self, axis: int, index: int) -> Iterator[tuple[int, float]]:
        """Signs and places of the planes around a cell."""
        if index:
            yield -1, self.cuts[axis][index - 1]
        if index < len(self.cuts[axis]):
            yield 1, self.cuts[axis][index]

    def hole(self, peg: Peg, diameter: float, length: float) -> Node:
        """Hole of a peg."""
        unit = self.whole.unit
        sizes = (diameter / 2 + self.clearance) / unit, (length + 2 * SPARE) / unit
        turn = {0: (0, 1, 0, 90), 1: (1, 0, 0, 90), 2: None}[peg.axis]
        upright = cylinder(radius=sizes[0], height=sizes[1])
        turned = transform(upright, rotate=turn) if turn else upright
        return transform(turned, translate=self.whole.scene_point(peg.middle))

    def number(
        self, cell: tuple[int, int, int], number: int, pegs: list[Peg], around: float
    ) -> list[Node] | None:
        """Number of a part on one of its cut faces; None without a place."""
        for height in HEIGHTS:
            wide = math.hypot(height, 0.8 * height * len(str(number))) / 2
            for joint in self.joints:
                for face, _ in joint.faces():
                    if cell not in joint.cells(face):
                        continue
                    above = joint.cells(face)[1] == cell
                    inner = [peg for peg in pegs if peg.axis == joint.axis]
                    if spot := joint.spot(face, above, inner, around, wide):
                        return list(self.digits(str(number), spot, joint.axis, above, height))
        return None

    def digits(self, text: str, middle: Triple, axis: int, above: bool, height: float) -> Iterator[Node]:
        """Bars of digits that are read from outside; `above`: whether the part is above the plane."""
        outward = -1 if above else 1
        up = np.eye(3)[1 if axis == 2 else 2]
        normal = outward * np.eye(3)[axis]
        right = np.cross(up, normal)
        stroke = height / 7
        for u, v, across, along in bars(text, height - stroke, stroke):
            size = np.abs(right) * across + np.abs(up) * along + np.abs(normal) * (DEPTH + OVER)
            at = middle + u * right + v * up - (DEPTH - OVER) / 2 * normal
            made = cuboid(size=(size / self.whole.unit).tolist())
            yield transform(made, translate=self.whole.scene_point(at.tolist()))
