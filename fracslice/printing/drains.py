"""Holes by which resin leaves an object: where it cannot, and holes at a place or where they are needed.

While an object is printed, upside down, air has to come in from the layers that exist already; when it drips
off, resin has to run out through the layers above. Both are asked of cells of a grid, layer by layer: empty
cells of a layer are connected within it, and to those of its neighbours. They are shut if no way leads to the
outside through the layers up to their own, from either end. The plate closes the first layer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .._slices import closed_nodes
from ..common.arrays import distinct, triple
from ..common.messages import format_count, place, significant
from ..errors import VolumeError
from ..fields.box import Box
from ..fields.field import Field
from ..formulas import Node, cylinder, intersection, plane, transform, union
from ..records import Print
from ..volume import Drain, Plan
from ..work import Work
from .edits import edited_field

CELLS, FINEST = 128, 224
"""Usual and maximum number of cells along the longest side."""

ACROSS = 3
"""Cells across a hole, as far as `FINEST` permits."""

FEWEST = 27
"""Cells of a space without a way out from which it counts."""

LEAST = 1e-4
"""Share of the box of an object from which such a space counts."""

MOST_HOLES = 16
"""Most holes that are drilled where they are needed."""

DIRECTIONS = 400
"""Directions of a hole that are compared, evenly distributed (Fibonacci)."""

STEP = 0.5
"""Cells between the samples of a direction."""


@dataclass(frozen=True, eq=False)
class Pocket:
    """A space that is shut, scene units."""

    volume: float
    at: NDArray[np.float64]  # middle of the end at which a hole lets all out
    up: bool  # true if that is its upper end


@dataclass(frozen=True, eq=False)
class Drainage:
    """Cells of an object that stands on its plate, with one more on all sides but below."""

    empty: NDArray[np.bool_]  # [z, y, x]
    origin: tuple[float, float, float]  # middle of the first cell, scene units
    cell: float  # side of a cell, scene units

    @classmethod
    def of(cls, root: Field, box: Box, cell: float, work: Work) -> Drainage:
        """Sample an object of which no layer is below its box."""
        (x0, y0, z0), sides = box.lo, [math.ceil(side / cell - 1e-6) for side in box.size]
        origin = x0 - cell / 2, y0 - cell / 2, z0 + cell / 2
        axes = [
            first + cell * np.arange(n)
            for first, n in zip(origin, (sides[0] + 2, sides[1] + 2, sides[2] + 1), strict=True)
        ]
        x, y = np.meshgrid(axes[0], axes[1])
        kernel, empty = root.kernel(), np.empty((len(axes[2]), *x.shape), bool)

        def layer(k: int) -> None:
            empty[k] = ~(kernel.points(x, y, np.full_like(x, axes[2][k])) < 0)

        work.collect(layer, range(len(axes[2])))
        empty[:, [0, -1]] = empty[:, :, [0, -1]] = empty[-1] = True
        return cls(empty, origin, cell)

    @cached_property
    def shut(self) -> NDArray[np.bool_]:
        """Cells that are shut while it is printed, or when it drips off."""
        return self._shut(self.empty) | self._shut_upwards

    def _shut(self, empty: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Cells without a way out through the layers up to their own."""
        from scipy.ndimage import label

        flat = np.zeros((3, 3, 3), bool)
        flat[1] = [[False, True, False], [True, True, True], [False, True, False]]
        nodes, count = label(empty, flat)
        below, above = nodes[:-1][empty[:-1] & empty[1:]], nodes[1:][empty[:-1] & empty[1:]]
        pairs = distinct(below.astype(np.int64) * (count + 1) + above)
        edges = np.stack(np.divmod(pairs, count + 1), 1) - 1
        layer = np.zeros(count, np.int64)
        level, *_ = np.nonzero(nodes)
        layer[nodes[nodes > 0] - 1] = level
        free = np.zeros(count, bool)
        rim = np.concatenate(
            [nodes[:, 0].ravel(), nodes[:, -1].ravel(), nodes[:, :, 0].ravel(), nodes[:, :, -1].ravel()]
        )
        free[rim[rim > 0] - 1] = True
        later = layer[edges].max(1, initial=0)
        order = np.argsort(later, kind="stable")
        closed = closed_nodes(np.ascontiguousarray(edges[order]), later[order], layer, free)
        return np.asarray(np.concatenate([[False], closed])[nodes])

    def pockets(self) -> list[Pocket]:
        """Spaces that are shut, the largest first."""
        from scipy.ndimage import label

        numbers, count = label(self.shut)
        sizes = np.bincount(numbers.ravel(), minlength=count + 1)[1:]
        least = max(FEWEST, LEAST * self.empty.size)
        found = []
        for k in np.argsort(-sizes, kind="stable").tolist():
            if sizes[k] < least:
                break
            found.append(self._pocket(numbers == k + 1))
        return found

    def _pocket(self, cells: NDArray[np.bool_]) -> Pocket:
        """A space that is shut: resin stays at its upper end, as it hangs; air misses at its lower end."""
        z, y, x = np.nonzero(cells)
        up = bool(self._shut_upwards[z, y, x].mean() >= 0.5)
        end = z == (z.max() if up else z.min())
        here = np.stack([x[end], y[end]], 1)
        nearest = here[np.square(here - here.mean(0)).sum(1).argmin()]
        at = np.array(self.origin) + self.cell * np.array([*nearest, z[end][0]])
        return Pocket(len(z) * self.cell**3, at, up)

    @cached_property
    def _shut_upwards(self) -> NDArray[np.bool_]:
        return self._shut(self.empty[::-1])[::-1]

    def with_holes(self, drains: Sequence[Drain]) -> Drainage:
        """The cells with some holes."""
        empty = self.empty.copy()
        axes = [
            first + self.cell * np.arange(n) for first, n in zip(self.origin, empty.shape[::-1], strict=True)
        ]
        z, y, x = np.meshgrid(*axes[::-1], indexing="ij", sparse=True)
        for drain in drains:
            start, end = np.array(drain.start), np.array(drain.end)
            way = end - start
            along = ((x - start[0]) * way[0] + (y - start[1]) * way[1] + (z - start[2]) * way[2]) / (
                way @ way
            )
            t = np.clip(along, 0, 1)
            away = sum((a - s - t * w) ** 2 for a, s, w in zip((x, y, z), start, way, strict=True))
            empty |= away <= drain.radius**2
        return Drainage(empty, self.origin, self.cell)

    def holds(self, point: NDArray[np.float64]) -> bool:
        """Whether a point is within a cell of the object's box."""
        index = np.rint((point - np.array(self.origin)) / self.cell)
        return bool((index >= (0, 0, -1)).all() and (index < np.array(self.empty.shape[::-1])).all())

    def open_at(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Points [3, n] in cells that are empty and not shut, or beside the object or above it."""
        index = np.rint((points - np.array(self.origin)[:, None]) / self.cell).astype(int)
        nz, ny, nx = self.empty.shape
        x, y, z = index
        beyond = (x < 0) | (y < 0) | (x >= nx) | (y >= ny) | (z >= nz)
        kept = np.clip(z, 0, nz - 1), np.clip(y, 0, ny - 1), np.clip(x, 0, nx - 1)
        return np.asarray((z >= 0) & (beyond | (self.empty[kept] & ~self.shut[kept])))


@dataclass(frozen=True, eq=False)
class Drill:
    """Finds the way of a hole through an object."""

    root: Field
    drainage: Drainage

    def through(self, at: NDArray[np.float64], direction: NDArray[np.float64], radius: float) -> Drain | None:
        """Hole along a direction from a place in a wall, or before it; None without a wall, or a way out."""
        found = self._ways(at, direction[:, None])
        return None if found is None else self._drain(at, found, radius)

    def shortest(self, at: NDArray[np.float64], radius: float, up: bool | None = None) -> Drain | None:
        """Hole with the shortest way out; `up`: out above the place, or out below it, and never steep."""
        directions = _directions()
        if up is not None:
            directions = directions[:, np.abs(directions[2]) <= math.sqrt(0.5)]
            directions = directions[:, directions[2] >= 0 if up else directions[2] <= 0]
        found = self._ways(at, directions)
        return None if found is None else self._drain(at, found, radius)

    def _ways(
        self, at: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], float, float] | None:
        """Direction of the shortest way out, and the distances along it at which the wall begins and ends.

        From a place outside, it is the way in, to a space that is shut.
        """
        step, nz = STEP * self.drainage.cell, max(self.drainage.empty.shape)
        far = np.arange(int(1.8 * nz / STEP)) * step
        points = at[:, None, None] + directions[:, :, None] * far
        flat = points.reshape(3, -1)
        solid = (self.root.kernel().points(*flat) < 0).reshape(points.shape[1:])
        outside = self.drainage.open_at(flat).reshape(solid.shape)
        out = (outside != outside[0, 0]) & ~solid & (np.cumsum(solid, 1) > 0)
        first = np.where(out.any(1), out.argmax(1), out.shape[1])
        best = int(first.argmin())
        if first[best] == out.shape[1]:
            return None
        return directions[:, best], float(far[solid[best].argmax()]), float(far[first[best]])

    def _drain(
        self, at: NDArray[np.float64], way: tuple[NDArray[np.float64], float, float], radius: float
    ) -> Drain:
        """Hole from the space before a wall to what is behind it."""
        direction, begin, end = way
        step = STEP * self.drainage.cell
        if begin == 0.0:  # in the wall: the space is behind
            back = -np.arange(1, 4 * max(self.drainage.empty.shape)) * step
            solid = self.root.kernel().points(*(at[:, None] + direction[:, None] * back)) < 0
            begin = 0.0 if solid.all() else float(back[solid.argmin()])
        start, stop = (at + direction * t for t in (begin - radius / 2, end + radius))
        if self.drainage.open_at(at[:, None])[0]:
            start, stop = at + direction * (end + radius / 2), at + direction * (begin - radius)
        return Drain(triple(start), triple(stop), radius)


def _directions() -> NDArray[np.float64]:
    """Directions: those of the axes, then points of a Fibonacci lattice on the sphere, float64 [3, n]."""
    k = np.arange(DIRECTIONS) + 0.5
    z, angle = 1 - 2 * k / DIRECTIONS, math.pi * (1 + math.sqrt(5)) * k
    ring = np.sqrt(1 - z * z)
    return np.concatenate(
        [np.eye(3), -np.eye(3), np.array([ring * np.cos(angle), ring * np.sin(angle), z])[:, :].T]
    ).T


def _cut(drain: Drain) -> Node:
    """Cylinder of a hole."""
    start, end = np.array(drain.start), np.array(drain.end)
    way = end - start
    length = float(np.linalg.norm(way))
    axis = np.cross((0, 0, 1), way)
    turn = math.degrees(math.atan2(float(np.linalg.norm(axis)), float(way[2])))
    hole: Node = cylinder(radius=drain.radius, height=length)
    if axis.any():
        hole = transform(hole, rotate=(*axis.tolist(), turn))
    elif turn:
        hole = transform(hole, rotate=(1, 0, 0, 180))
    return transform(hole, translate=triple((start + end) / 2))


def drained(planned: Plan, how: Print, scale: float, work: Work) -> Plan:
    """Drill the holes that are asked for, or needed, and note where resin or air still cannot get out.

    `how` in mm, from the middle of the object and above its lowest point; `scale`: mm per scene unit.

    Raises
    ------
    VolumeError
        If there is no wall at a place, or no way out.
    """
    longest, narrowest = max(planned.box.size), how.drain / scale
    cell = max(min(longest / CELLS, narrowest / ACROSS), longest / FINEST)
    drainage = Drainage.of(planned.root, planned.box, cell, work)
    drill = Drill(planned.root, drainage)
    middle = np.array([*planned.box.centre[:2], planned.box.lo[2]])
    if how.drain_at == "auto":
        drains = _needed(drill, how.drain / scale / 2)
    else:
        drains = [_asked(drill, hole, middle, how.drain, scale) for hole in how.drain_at]
    root = planned.root
    if drains:
        root = edited_field(root, "cut", union(*map(_cut, drains)))
        drainage = Drainage.of(root, planned.box, cell, work)
    notes = tuple(_note(drainage.pockets(), middle, scale))
    made, undrilled = (*planned.drains, *drains), planned.undrilled or (planned.root if drains else None)
    return replace(planned, root=root, drains=made, undrilled=undrilled, notes=(*planned.notes, *notes))


def plugs(planned: Plan, clearance: float) -> Iterator[tuple[Drain, Field]]:
    """Each drain hole of an object, and what it cut out of that, less a clearance all around.

    `clearance` in scene units.

    Raises
    ------
    VolumeError
        If the clearance leaves nothing.
    """
    for drain in planned.drains:
        if clearance >= drain.radius:
            raise VolumeError("clearance: expected less than half of the diameter of the drain holes")
        assert planned.undrilled is not None
        pin = _cut(replace(drain, radius=drain.radius - clearance))
        above = plane(normal=(0, 0, -1), offset=-planned.box.lo[2])
        yield drain, edited_field(planned.undrilled, "keep", intersection(pin, above))


def _needed(drill: Drill, radius: float) -> list[Drain]:
    """Holes for all spaces that are shut, until none is, or none that can be helped."""
    drains, drainage = list[Drain](), drill.drainage
    while len(drains) < MOST_HOLES:
        pockets, made = drainage.pockets(), list[Drain]()
        for pocket in pockets[: MOST_HOLES - len(drains)]:
            inwards = np.array([0, 0, (radius - drainage.cell / 2) * (-1 if pocket.up else 1)])
            if hole := replace(drill, drainage=drainage).shortest(pocket.at + inwards, radius, pocket.up):
                made.append(hole)
        if not made:
            break
        drains += made
        drainage = drainage.with_holes(made)
    return drains


def _asked(
    drill: Drill, hole: Sequence[float], middle: NDArray[np.float64], usual: float, scale: float
) -> Drain:
    """A hole at a place: three numbers, mm; its direction behind them; its diameter behind that."""
    at, way = middle + np.array(hole[:3]) / scale, np.array(hole[3:6])
    radius = (hole[6] if len(hole) > 6 else usual) / scale / 2
    where = f"drain-at {','.join(f'{c:g}' for c in hole[:3])}"
    if not drill.drainage.holds(at):
        raise VolumeError(
            f"{where}: outside of the object: expected mm from its middle and above its lowest point"
        )
    made = drill.through(at, way / np.linalg.norm(way), radius) if len(way) else drill.shortest(at, radius)
    if made is None:
        along = " in that direction" if len(way) else ""
        raise VolumeError(
            f"{where}: no wall with a way out behind it{along}: expected a place in or before one"
        )
    return made


def _note(pockets: list[Pocket], middle: NDArray[np.float64], scale: float) -> Iterator[str]:
    """A line on the spaces that are shut."""
    if pockets:
        volume = sum(pocket.volume for pocket in pockets) * scale**3
        count = format_count(len(pockets), "space")
        at = place((scale * (pockets[0].at - middle)).tolist(), 1)
        yield (
            f"{count} of {significant(volume / 1000)} ml that resin or air cannot leave, the largest at "
            f"{at} mm: --drain-at auto, or a place for a hole"
        )
