"""Plates of many parts: their outlines from above, a place for each, and one stack of layers of all.

Outlines are cells that a part covers at any height. Parts are placed one after the other, the largest first,
as far in front and then as far to the left as there is room (bottom-left filling: Baker, Coffman and Rivest
1980, "Orthogonal packings in two dimensions"). All places of a part are tried at once: the correlation of its
outline with what is taken is zero where it fits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Triangles
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

MARGIN = 1
"""Cells by which outlines reach beyond their parts: what is thinner than a cell may lie between samples."""

SPACING = 2.0
"""Usual distance between parts, mm."""

ROOM = 1.1
"""Factor by which a bed without limits is enlarged until all parts stand on it."""

SQUARE = 1e-3
"""Greatest difference of the sides of a pixel, relative to them, with which parts are turned by a quarter."""


@dataclass(frozen=True)
class Spot:
    """Where a part stands."""

    turns: int  # quarter turns counter-clockwise
    middle: tuple[float, float]  # middle of its outline, mm from the middle of the plate


@dataclass(frozen=True)
class Outlines:
    """Parts as they are seen from above, and the bed for them."""

    masks: Sequence[NDArray[np.bool_]]  # cells that a part covers, [rows, columns], the first row in front
    cell: float  # side of a cell, mm
    bed: tuple[float, float] | None = None  # width and depth, mm; None for no limits
    spacing: float = SPACING  # distance between parts, mm
    turns: Sequence[int] = (0, 1, 2, 3)  # quarter turns that are tried

    def places(self) -> list[Spot | None]:
        """Places of all parts, as close as they go together; None for those without room."""
        if self.bed:
            return self._centred(self._packed(self.bed))
        sides = np.array([mask.shape for mask in self.masks]) * self.cell + self.spacing
        side = max(math.sqrt(float(sides.prod(1).sum())), float(sides.max()))
        while None in (found := self._packed((side, side))):
            side *= ROOM
        return self._centred(found)

    @property
    def _reach(self) -> int:
        """Cells by which outlines grow, of which two then keep the distance between parts."""
        return math.ceil(self.spacing / self.cell / 2)

    def _packed(self, bed: tuple[float, float]) -> list[Spot | None]:
        """Places on a bed, mm from its corner."""
        reach = self._reach
        columns, rows = (int(side / self.cell + 1e-6) + 2 * (reach + MARGIN) for side in bed)
        full = np.zeros((rows, columns))
        views = {id(mask): self._views(mask) for mask in self.masks}
        spots: list[Spot | None] = [None] * len(self.masks)
        for k in sorted(range(len(self.masks)), key=lambda k: (-self.masks[k].size, k)):
            spectrum, choices = np.fft.rfft2(full), views[id(self.masks[k])]
            found = [
                (place, grown) for t, grown in choices if (place := _first_place(spectrum, full, grown, t))
            ]
            if not found:
                choices.clear()  # nor is there room for another of these
                continue
            (end, left, turns), grown = min(found, key=lambda one: one[0])
            height, width = grown.shape
            full[end - height : end, left : left + width] += grown
            middle = left + width / 2 - reach, end - height / 2 - reach
            spots[k] = Spot(turns, (middle[0] * self.cell, middle[1] * self.cell))
        return spots

    def _views(self, mask: NDArray[np.bool_]) -> list[tuple[int, NDArray[np.bool_]]]:
        """Grown outlines of an outline that is turned, without those that are like another."""
        views = list[tuple[int, NDArray[np.bool_]]]()
        for turns in self.turns:
            grown = _grown(_turned(mask, turns), self._reach)
            if not any(np.array_equal(grown, other) for _, other in views):
                views.append((turns, grown))
        return views

    def _centred(self, spots: list[Spot | None]) -> list[Spot | None]:
        """Places from the middle of what they take together."""
        if not any(spots):
            return spots
        found = [(mask, spot) for mask, spot in zip(self.masks, spots, strict=True) if spot]
        low, high = taken(found, self.cell)
        middle = (low + high) / 2
        return [spot and Spot(spot.turns, tuple((np.array(spot.middle) - middle).tolist())) for spot in spots]


def _first_place(
    spectrum: NDArray[np.complex128], full: NDArray[np.float64], grown: NDArray[np.bool_], turns: int
) -> tuple[int, int, int] | None:
    """Row behind the foremost place that is free for an outline, its first column, and the turns of that.

    `spectrum`: of what is taken, `full`. None if there is no such place.
    """
    rows, columns = (whole - own + 1 for whole, own in zip(full.shape, grown.shape, strict=True))
    if rows < 1 or columns < 1:
        return None
    touched = np.fft.irfft2(spectrum * np.fft.rfft2(grown, full.shape).conj(), full.shape)
    free = np.flatnonzero(touched[:rows, :columns] < 0.5)
    return (int(free[0]) // columns + grown.shape[0], int(free[0]) % columns, turns) if len(free) else None


def taken(
    parts: Iterable[tuple[NDArray[np.bool_], Spot]], cell: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Opposite corners of what parts with these outlines take together, mm."""
    sides = [(np.array(spot.middle), np.array(_turned(mask, spot.turns).shape[::-1])) for mask, spot in parts]
    low = np.min([middle - cell * half / 2 for middle, half in sides], 0)
    return low, np.max([middle + cell * half / 2 for middle, half in sides], 0)


def _turned(mask: NDArray[np.bool_], turns: int) -> NDArray[np.bool_]:
    """Outline turned counter-clockwise, as its first row is in front."""
    return np.rot90(mask, -turns)


def _grown(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Cells within a distance of those of a mask, with a margin."""
    from scipy.ndimage import distance_transform_edt

    wide = np.pad(mask, reach)
    return np.asarray(distance_transform_edt(~wide) <= reach) if reach else wide


def cell_for(bed: tuple[float, float] | None, sizes: Sequence[float]) -> float:
    """Side of a cell for a bed, or for parts of some sizes, mm."""
    longest = max(bed) if bed else max(sizes) * math.sqrt(len(sizes))
    return max(CELL, longest / ACROSS)


def outline_of_layers(stack: Stack, cell: float, work: Work) -> NDArray[np.bool_]:
    """Cells that any layer of an object covers, symmetric about the middle of its lattice, with a margin.

    `cell` in mm. Returns bool [rows, columns].
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
    return _cropped(covered)


def outline_of_mesh(mesh: Triangles, cell: float) -> NDArray[np.bool_]:
    """Cells below the triangles of a mesh, symmetric about x = y = 0, with a margin.

    `mesh`, `cell` in mm. Returns bool [rows, columns].
    """
    corners = mesh.vertices[mesh.triangles][:, :, :2]
    half = np.abs(mesh.vertices[:, :2]).max(0)
    columns, rows = (2 * math.ceil(side / cell) + 2 for side in half.tolist())
    covered = np.zeros((rows, columns), bool)
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
    parts = np.maximum(np.ceil(2 * longest / cell), 1).astype(int)
    for count in np.unique(parts):
        u, v = (grid.ravel() for grid in np.meshgrid(*2 * [np.arange(count + 1) / count]))
        u, v = u[u + v <= 1 + 1e-9], v[u + v <= 1 + 1e-9]
        of = corners[parts == count]
        for a, b in zip(u.tolist(), v.tolist(), strict=True):
            at = (1 - a - b) * of[:, 0] + a * of[:, 1] + b * of[:, 2]
            column, row = (np.floor(at / cell) + (columns // 2, rows // 2)).astype(int).T
            covered[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)] = True
    return _cropped(covered)


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
    field = PlateField(parts, shape)
    heights = highest.heights
    size = 2 * max(-low[0], high[0]), 2 * max(-low[1], high[1]), max(stack.size[2] for stack in stacks)
    return Stack(
        root=field,
        scale=1.0,
        corner=(-half_columns * across, -half_rows * along),
        pixel=(across, along),
        shape=shape,
        z=highest.tops - heights / 2,
        tops=highest.tops,
        size=size,
        outer=field.bounds.box,
        notes=tuple(dict.fromkeys(note for stack in stacks for note in stack.notes)),
        drains=tuple(drain for part in parts for drain in _drains(part, shape)),
        parts=parts,
        side=max(size),
    )


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


def packed(
    masks: Sequence[NDArray[np.bool_]],
    names: Sequence[str],
    cell: float,
    bed: tuple[float, float] | None,
    spacing: float,
    where: str,
    turns: Sequence[int] = (0, 1, 2, 3),
) -> list[Spot]:
    """Places of all parts on a bed.

    `masks`, `cell`, `bed`, `spacing`: as in `Outlines`; `where`: what the bed is called.

    Raises
    ------
    SliceError
        If they do not fit: which part does not, and how many do.
    """
    spots = Outlines(masks, cell, bed, spacing, turns).places()
    found = [spot for spot in spots if spot]
    if len(found) < len(spots):
        name = names[spots.index(None)]
        raise SliceError(
            f"{name}: no room for it on {where} {spacing:g} mm beside the others; {len(found)} of "
            f"{len(spots)} parts fit: expected fewer parts, or a smaller size or spacing"
        )
    return found
