"""Plates of many parts: their outlines from above, a place for each, and one stack of layers of all.

Outlines are cells that a part covers at any height. Parts are placed one after the other, the largest first,
on the first bed with room, as far in front and then as far to the left as there is room (bottom-left filling:
Baker, Coffman and Rivest 1980, "Orthogonal packings in two dimensions"). All places of a part are tried at
once: the correlation of its outline with what is taken is zero where it fits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Triangles, distinct
from ..common.cache import key
from ..errors import SliceError
from ..fields.box import Box
from ..fields.devices import ArrayField
from ..fields.field import Bounds, Device, Kernel, Precision
from ..volume import Drain
from ..work import Work
from .layers import Slicer
from .stack import Stack, Standing

CELL = 0.25
"""Least side of a cell of outlines, mm."""

ACROSS = 640
"""Most cells along a side of the bed."""

AT_ONCE = 1 << 20
"""Points of triangles that are looked up together."""

MARGIN = 1
"""Cells by which outlines reach beyond their parts: what is thinner than a cell may lie between samples."""

SPACING = 2.0
"""Usual distance between parts, mm."""

ROOM = 1.1
"""Factor by which a bed without limits is enlarged until all parts stand on it."""

SQUARE = 1e-3
"""Greatest difference of the sides of a pixel, relative to them, with which parts are turned by a quarter."""


@dataclass(frozen=True)
class Beds:
    """Beds for parts."""

    sides: tuple[float, float] | None = None  # width and depth, mm; None for no limits
    spacing: float = SPACING  # distance between parts, mm
    name: str = "the bed"  # what they are called in errors
    turns: Sequence[int] = (0, 1, 2, 3)  # quarter turns of parts that are tried
    most: int | None = 1  # number of beds; None for as many as are needed


@dataclass(frozen=True, eq=False)
class Footprint:
    """A part as it is seen from above; copies share it."""

    mask: NDArray[np.bool_]  # cells that it covers, [rows, columns], the first row in front
    size: tuple[float, float]  # width and depth of what it covers, around the middle of the mask, mm

    def turned(self, turns: int) -> Footprint:
        """The outline, turned counter-clockwise, as its first row is in front."""
        return Footprint(np.rot90(self.mask, -turns), self.size[::-1] if turns % 2 else self.size)


@dataclass(frozen=True)
class Spot:
    """Where a part stands."""

    turns: int  # quarter turns counter-clockwise
    middle: tuple[float, float]  # middle of its outline, mm from the middle of the bed
    bed: int = 0  # number of the bed


def packed(outlines: Sequence[Footprint], names: Sequence[str], cell: float, beds: Beds) -> list[Spot]:
    """Places of all parts, as close as they go together, in the middle of their beds.

    `cell`: side of the cells of the outlines, mm; `names`: of the parts, for errors.

    Raises
    ------
    SliceError
        If they do not fit: which part does not, and how many do.
    """
    if beds.sides:
        spots = _placed(outlines, cell, beds, beds.sides)
    else:
        sides = np.array([outline.mask.shape for outline in outlines]) * cell + beds.spacing
        side = max(math.sqrt(float(sides.prod(1).sum())), float(sides.max()))
        while None in (spots := _placed(outlines, cell, beds, (side, side))):
            side *= ROOM
    found = [spot for spot in spots if spot]
    if len(found) < len(spots):
        name = names[spots.index(None)]
        raise SliceError(
            f"{name}: no room for it on {beds.name} {beds.spacing:g} mm beside the others; {len(found)} of "
            f"{len(spots)} parts fit: expected fewer parts, or a smaller size or spacing"
        )
    return _centred(outlines, found)


def _placed(
    outlines: Sequence[Footprint], cell: float, beds: Beds, sides: tuple[float, float]
) -> list[Spot | None]:
    """Places on beds with sides, mm; None for parts without room."""
    filled, spots = list[_Filled](), list[Spot | None]([None] * len(outlines))
    views = {outline: _views(outline, cell, beds) for outline in dict.fromkeys(outlines)}
    for k in sorted(range(len(outlines)), key=lambda k: (-outlines[k].mask.size, k)):
        for number in range(len(filled) + 1):
            if number == len(filled):
                if number == beds.most:
                    break
                filled.append(_Filled.empty(sides, cell, _reach(cell, beds) + MARGIN))
            if found := filled[number].put(views[outlines[k]]):
                spots[k] = replace(found, bed=number)
                break
    return spots


def _reach(cell: float, beds: Beds) -> int:
    """Cells by which outlines grow, of which two then keep the distance between parts."""
    return math.ceil(beds.spacing / cell / 2)


def _views(outline: Footprint, cell: float, beds: Beds) -> list[tuple[int, Footprint]]:
    """Turns of an outline that are unlike each other, and its grown outlines."""
    views = list[tuple[int, Footprint]]()
    for turns in beds.turns:
        turned = outline.turned(turns)
        grown = Footprint(_grown(turned.mask, _reach(cell, beds)), turned.size)
        if not any(np.array_equal(grown.mask, other.mask) for _, other in views):
            views.append((turns, grown))
    return views


@dataclass(eq=False)
class _Filled:
    """A bed with what is taken on it."""

    sides: tuple[float, float]  # mm
    cell: float  # mm
    taken: NDArray[np.float64]  # 1 where a grown outline is, [rows, columns]
    spectrum: NDArray[np.complex128] | None = None  # of that; None if it is another by now
    refused: set[int] = field(default_factory=set)  # identities of the views of parts without room

    @classmethod
    def empty(cls, sides: tuple[float, float], cell: float, beyond: int) -> _Filled:
        """An empty bed, with cells beyond its edges on which only the space between parts may be."""
        columns, rows = (2 * (math.ceil(side / cell / 2 - 1e-6) + beyond) for side in sides)
        return cls(sides, cell, np.zeros((rows, columns)))

    def put(self, views: list[tuple[int, Footprint]]) -> Spot | None:
        """Place a part, turned as it gets farthest in front; None without room."""
        if id(views) in self.refused:
            return None
        places = [(*at, turns, grown) for turns, grown in views if (at := self._first_place(grown.mask))]
        if not places:
            self.refused.add(id(views))
            return None
        end, left, turns, grown = min(places, key=lambda one: one[:3])
        height, width = grown.mask.shape
        self.taken[end - height : end, left : left + width] += grown.mask
        self.spectrum = None
        rows, columns = self.taken.shape
        middle = (left + (width - columns) / 2) * self.cell, (end - (height + rows) / 2) * self.cell
        room = [max(whole - own, 0.0) / 2 for whole, own in zip(self.sides, grown.size, strict=True)]
        x, y = np.clip(middle, np.negative(room), room).tolist()  # a cell may reach beyond the edge
        return Spot(turns, (x, y))

    def _first_place(self, grown: NDArray[np.bool_]) -> tuple[int, int] | None:
        """Row behind the foremost free place for an outline, and its first column; None without one."""
        rows, columns = (whole - own + 1 for whole, own in zip(self.taken.shape, grown.shape, strict=True))
        if rows < 1 or columns < 1:
            return None
        if self.spectrum is None:
            self.spectrum = np.fft.rfft2(self.taken)
        touched = np.fft.irfft2(
            self.spectrum * np.fft.rfft2(grown, self.taken.shape).conj(), self.taken.shape
        )
        free = np.flatnonzero(touched[:rows, :columns] < 0.5)
        return (int(free[0]) // columns + grown.shape[0], int(free[0]) % columns) if len(free) else None


def _centred(outlines: Sequence[Footprint], spots: list[Spot]) -> list[Spot]:
    """Places from the middle of what is taken on each bed."""
    middles = {}
    for bed in {spot.bed for spot in spots}:
        here = [(outline, spot) for outline, spot in zip(outlines, spots, strict=True) if spot.bed == bed]
        middles[bed] = np.mean(corners(*zip(*here, strict=True)), 0)
    return [replace(s, middle=tuple((np.array(s.middle) - middles[s.bed]).tolist())) for s in spots]


def corners(outlines: Sequence[Footprint], spots: Sequence[Spot]) -> NDArray[np.float64]:
    """Opposite corners of what parts of a bed cover together, mm, float64 [2, 2]."""
    halves = np.array(
        [outline.turned(spot.turns).size for outline, spot in zip(outlines, spots, strict=True)]
    )
    middles = np.array([spot.middle for spot in spots])
    return np.array([(middles - halves / 2).min(0), (middles + halves / 2).max(0)])


def _grown(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Cells within a distance of those of a mask, with a margin."""
    from scipy.ndimage import distance_transform_edt

    wide = np.pad(mask, reach)
    return np.asarray(distance_transform_edt(~wide) <= reach) if reach else wide


def cell_for(bed: tuple[float, float] | None, sizes: Sequence[float]) -> float:
    """Side of a cell for a bed, or for parts of some sizes, mm."""
    longest = max(bed) if bed else max(sizes) * math.sqrt(len(sizes))
    return max(CELL, longest / ACROSS)


def outline_of_layers(stack: Stack, cell: float, work: Work) -> Footprint:
    """Cells that any layer of an object covers, symmetric about the middle of its lattice, with a margin.

    `cell` in mm.
    """
    shape = [
        2 * math.ceil(n * side / cell / 2) + 2 for n, side in zip(stack.shape, stack.pixel[::-1], strict=True)
    ]
    x, y, _ = stack.origin
    corner = (x - shape[1] / 2 * cell / stack.scale, y - shape[0] / 2 * cell / stack.scale)
    coarse = replace(stack, pixel=(cell, cell), shape=(shape[0], shape[1]), corner=corner)
    every = max(int(cell / float(stack.heights.max())), 1)
    covered = np.zeros(shape, bool)
    for layer in Slicer(coarse, work).map(lambda layer: layer.coverage > 0, range(0, len(stack.z), every)):
        covered |= layer
    return Footprint(_cropped(covered), stack.size[:2])


def outline_of_mesh(mesh: Triangles, cell: float) -> Footprint:
    """Cells below the triangles of a mesh, symmetric about x = y = 0, with a margin.

    `mesh`, `cell` in mm.
    """
    corners = mesh.vertices[mesh.triangles][:, :, :2]
    half = np.abs(mesh.vertices[:, :2]).max(0)
    columns, rows = (2 * math.ceil(side / cell) + 2 for side in half.tolist())
    covered = np.zeros((rows, columns), bool)
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
    parts = np.maximum(np.ceil(2 * longest / cell), 1).astype(int)
    for count in distinct(parts):
        u, v = (grid.ravel() for grid in np.meshgrid(*2 * [np.arange(count + 1) / count]))
        within, of = u + v <= 1 + 1e-9, corners[parts == count]
        weights = np.stack([1 - u - v, u, v], 1)[within]
        for some in np.array_split(weights, math.ceil(len(weights) * len(of) / AT_ONCE)):
            at = sum(some[:, k, None, None] * of[:, k] for k in range(3))
            column, row = (np.floor(at / cell) + (columns // 2, rows // 2)).astype(int).reshape(-1, 2).T
            covered[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)] = True
    width, depth = (2 * half).tolist()
    return Footprint(_cropped(covered), (width, depth))


def _cropped(covered: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Covered cells with their margin, without as many empty rows and columns on both sides."""
    (rows, columns), (row, column) = covered.shape, np.nonzero(covered)
    above = int(min(row.min(), rows - 1 - row.max()))
    beside = int(min(column.min(), columns - 1 - column.max()))
    return _grown(covered[above : rows - above, beside : columns - beside], MARGIN)


def turns_for(pixel: tuple[float, float]) -> tuple[int, ...]:
    """Quarter turns of parts in pixels of a size, mm: half turns if they are no squares."""
    return (0, 1, 2, 3) if abs(pixel[0] / pixel[1] - 1) < SQUARE else (0, 2)


def plate_of(stacks: Sequence[Stack], spots: Sequence[Spot]) -> Stack:
    """One stack of many parts at their places."""
    across, along = stacks[0].pixel
    standing, low, high = list[Standing](), [math.inf] * 2, [-math.inf] * 2
    for stack, spot in zip(stacks, spots, strict=True):
        rows, columns = Standing(stack, spot.turns, (0, 0)).shape
        column, row = round(spot.middle[0] / across - columns / 2), round(spot.middle[1] / along - rows / 2)
        standing.append(Standing(stack, spot.turns, (row, column)))
        half = np.array(stack.size[1::-1] if spot.turns % 2 else stack.size[:2]) / 2
        middle = np.array([(column + columns / 2) * across, (row + rows / 2) * along])
        low, high = np.minimum(low, middle - half).tolist(), np.maximum(high, middle + half).tolist()
    ends = [[s.at[k] + extra * s.shape[k] for s in standing for extra in (0, 1)] for k in range(2)]
    half_rows, half_columns = (max(map(abs, end)) for end in ends)
    parts = tuple(replace(s, at=(s.at[0] + half_rows, s.at[1] + half_columns)) for s in standing)
    highest = max(stacks, key=lambda stack: len(stack.z))
    shape = 2 * half_rows, 2 * half_columns
    whole = PlateField(parts, shape)
    heights = highest.heights
    size = 2 * max(-low[0], high[0]), 2 * max(-low[1], high[1]), max(stack.size[2] for stack in stacks)
    return Stack(
        root=whole,
        scale=1.0,
        corner=(-half_columns * across, -half_rows * along),
        pixel=(across, along),
        shape=shape,
        z=highest.tops - heights / 2,
        tops=highest.tops,
        size=size,
        outer=whole.bounds.box,
        notes=tuple(dict.fromkeys(note for stack in stacks for note in _notes(stack))),
        drains=tuple(drain for part in parts for drain in _drains(part, shape)),
        parts=parts,
        side=max(size),
    )


def _notes(stack: Stack) -> tuple[str, ...]:
    """Notes of a part, one on its supports among them."""
    return (str(stack.supports), *stack.notes) if stack.supports else stack.notes


def _drains(part: Standing, shape: tuple[int, int]) -> list[Drain]:
    """Drain holes of a part on its plate, mm."""
    made, stack = [], part.stack
    for drain in stack.drains:
        ends = (np.array([drain.start, drain.end]) - stack.origin) * stack.scale
        flat = part.moved(ends[:, :2], shape)
        start, end = np.column_stack([flat, ends[:, 2]]).tolist()
        made.append(Drain(tuple(start), tuple(end), drain.radius * stack.scale))
    return made


@dataclass(frozen=True, eq=False)
class PlateField(ArrayField):
    """The union of the parts of a plate, mm from the middle of its lower face."""

    parts: tuple[Standing, ...]
    shape: tuple[int, int]  # rows and columns of the plate

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds of all parts together."""
        own = [part.stack.root.bounds for part in self.parts]
        box = self._box(self.parts[0])
        for part in self.parts[1:]:
            box |= self._box(part)
        return Bounds(
            box,
            max(one.lipschitz for one in own),
            any(one.exterior_only for one in own),
            max(one.steepening for one in own),
            (),
            tuple(dict.fromkeys(name for one in own for name in one.measured)),
        )

    def _box(self, part: Standing) -> Box:
        """Conservative box of a part on the plate, mm."""
        stack = part.stack
        corners = (np.array(stack.outer.corners) - stack.origin) * stack.scale
        flat = part.moved(corners[:, :2], self.shape)
        low, high = (np.concatenate([f(flat, 0), f(corners[:, 2:], 0)]).tolist() for f in (np.min, np.max))
        return Box((low[0], low[1], low[2]), (high[0], high[1], high[2]))

    @property
    def key(self) -> str:
        """`Field.key`."""
        return key(self.shape, *((p.turns, p.at, key(*p.stack.identity)) for p in self.parts))

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`, always on the CPU."""
        return _PlateKernel(self, precision)


class _PlateKernel(Kernel):
    """Kernel of a plate: the least of all parts' values."""

    def __init__(self, field: PlateField, precision: Precision) -> None:
        kernels = {id(p.stack): p.stack.root.kernel("cpu", precision) for p in field.parts}
        self.dtype, self.batch = np.dtype(precision), max(kernel.batch for kernel in kernels.values())
        self._parts = [(part, kernels[id(part.stack)]) for part in field.parts]
        self._shape = field.shape

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        values = np.full(np.shape(x), np.inf, self.dtype)
        for part, kernel in self._parts:
            cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[part.turns]
            (middle,) = part.moved(np.zeros((1, 2)), self._shape)
            u, v, stack = x - middle[0], y - middle[1], part.stack
            own = [
                at / stack.scale + first
                for at, first in zip(
                    (cosine * u + sine * v, cosine * v - sine * u, z), stack.origin, strict=True
                )
            ]
            values = np.minimum(values, kernel.points(*own) * self.dtype.type(stack.scale))
        return values
