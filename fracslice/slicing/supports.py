"""Where layers need supports, and the planned layers of an object with them.

A component of a layer with nothing below it, an island, has a tip under it, unless it grows together with an
older one while it is a speck (the elder rule of merge trees: Edelsbrunner, Letscher and Zomorodian 2002).
Elsewhere a layer may grow into the air: by as much as it is higher without supports, beyond that as far as
the reach. What is used of the reach adds up from layer to layer and is regained slowly where material follows
above. Where it is used up, tips are put at the farthest point, again and again (Gonzalez 1985): dense under
flat ceilings, sparse under slopes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .._slices import count_pixels
from ..common.arrays import distinct
from ..printing.edits import edited_field
from ..printing.pillars import (
    CARRIED,
    CLEARANCE,
    LIFT,
    STRENGTHS,
    WIDEST,
    Contacts,
    Exits,
    Object,
    Room,
    Strength,
    steps_from,
    support,
)
from ..records import PIXEL, Print, SliceJob
from ..volume import Plan, Supports
from ..volume.amount import Sizing
from ..work import Work
from .feature_graph import LayerComponents, layer_components, overlaps
from .layers import SLAB, Layer, Slicer
from .stack import Stack, stack_of

CELLS = 200
"""Cells along the longest side of the room that supports are led through."""

FINEST = 0.2
"""Least side of a cell, mm."""

MARGIN = 6.0
"""Width of the room around the object, mm."""

ACROSS = 2
"""Voxels across the tips of a mesh, at least: thinner ones would break into crumbs."""

ROUNDS, CLOSER = 6, 0.85
"""How often the reach is shortened until enough tips carry the object, and by what at least."""

LATER, WIDER = 1, 2.0
"""Round after which tips are put beside the lowest one, too, and up to which cross-section, relative to the
least that carries the object.
"""

SPECK, PIXELS = 0.02, 8
"""Least area of an island with a tip, mm2, and pixels, as `fracslice.checks` reports them."""

GROWN, TALL = 0.1, 0.3
"""Area, mm2, and height, mm, that a speck reaches alone if it has a tip."""

POCKET = 4.5
"""Reach in holes whose exits are narrow, mm: tips in them are dear. Below the limit of `fracslice.checks`."""

BESIDE = 3
"""Cells from one within which most cells are carried, along each axis."""

REGAINED = 1.0
"""Reach that is regained for each mm of material above."""


def supported_plan(planned: Plan, scale: float, how: Print, size: Sizing, work: Work) -> Plan:
    """Plan of a mesh with the supports of its layers.

    `scale`: mm per scene unit.
    """
    longest = max(planned.box.size) * scale
    layer = max(SliceJob().layer[0], longest / 2048)
    job = SliceJob(layer=layer, pixel=max(PIXEL, longest / 2048), printing=how)
    thinnest = ACROSS * planned.voxel * scale
    return supported(planned, layers_with_room(planned, scale, job, size), how, work, thinnest)


def layers_with_room(planned: Plan, scale: float, job: SliceJob, size: Sizing) -> Stack:
    """Layers of an object with room for supports beside it.

    Layers with supports have the same lattice, so that they show the same specks: what is sampled near the
    rim, and of a fractal the scale of values inside, depend on it.
    """
    wide = replace(planned, outer=planned.outer.grown(MARGIN / scale))
    return stack_of(wide, scale, job, size, stack_of(planned, scale, job, size))


def supported(planned: Plan, stack: Stack, how: Print, work: Work, thinnest: float = 0.0) -> Plan:
    """Plan of an object, lifted, with supports on the plate below.

    `stack`: see `layers_with_room`; `thinnest`: least diameter of tips, mm.
    """
    strength = STRENGTHS[how.supports]
    tip = max(strength.tip, thinnest)
    strength = replace(strength, tip=tip, pillar=max(strength.pillar, 1.5 * tip))
    survey = _Survey.of(stack, work)
    of = Object(stack.root, stack.scale, np.array(survey.areas), float(stack.heights[0]), work)
    room = survey.room(strength, how.raft)
    exits, around = Exits(of, room), 0
    for turn in range(ROUNDS):
        contacts = survey.contacts(of, room, strength, around)
        if not len(contacts.points):
            return planned
        made, carried = support(exits, contacts, strength, how.raft)
        if carried >= 1:
            break
        strength = replace(strength, reach=strength.reach * min(max(0.5, math.sqrt(carried)), CLOSER))
        if turn >= LATER:
            missing = (1 - carried) * survey.least_area
            around += math.ceil(missing / (math.pi / 4 * strength.pillar**2))
    return _joined(planned, made, stack.scale, room, how.raft)


def _joined(planned: Plan, made: Supports, scale: float, room: Room, raft: float) -> Plan:
    """Plan of an object and its supports around the same middle, so that samples stay at the same points."""
    low = (room.floor - raft) / scale
    box = planned.box | made.node.bounds.box
    box = replace(box, lo=(*box.lo[:2], low)) & replace(box, hi=(*box.hi[:2], planned.box.hi[2]))
    x, y, _ = planned.box.centre
    made = replace(made, box=box, bare=made.bare - np.array([x, y, low]) * scale)
    box = box.about((x, y, box.centre[2]))
    outer = (planned.outer | box).about(planned.outer.centre)
    root = edited_field(planned.root, "add", made.node)
    return replace(planned, root=root, box=box, outer=outer, supports=made)


@dataclass
class _Birth:
    """What begins in the air: a component of a layer with nothing below it."""

    layer: int
    place: tuple[int, int]  # a pixel (x, y) in it
    area: float  # in its first layer, mm2
    largest: float = 0.0  # in the layers before it joins an older one
    last: int = 0  # the last one of them
    joined: bool = False  # whether it joins one

    def is_held(self, heights: float, speck: float) -> bool:
        """True if it has a tip."""
        tall = (self.last - self.layer + 1) * heights
        if not self.joined:  # a body by itself
            return self.largest >= speck
        return self.area >= speck or (self.largest >= GROWN and tall >= TALL)


@dataclass(eq=False)
class _Survey:
    """What layers show of an object: what begins in the air, and the cells that hold a part of it."""

    stack: Stack
    cell: tuple[int, int, int]  # pixels along x and y, and layers, of a cell
    areas: list[float] = field(default_factory=list)  # of all layers, mm2
    births: list[_Birth] = field(default_factory=list)
    full: list[NDArray[np.bool_]] = field(default_factory=list)  # cells of each layer of cells, [y, x]
    dense: list[NDArray[np.bool_]] = field(default_factory=list)  # those that the object fills

    @classmethod
    def of(cls, stack: Stack, work: Work) -> _Survey:
        """Survey of all layers of a stack."""
        height = float(stack.heights[0])
        side = max(max(stack.size) / CELLS, FINEST, *stack.pixel, height)
        times = max(round(side / max(stack.pixel)), 1)
        made = cls(stack, (times, times, max(round(side / height), 1)))

        def look(layer: Layer) -> tuple[LayerComponents, float, NDArray[np.int32]]:
            runs = layer.runs
            return layer_components(runs)[0], layer.area, count_pixels(runs, times)

        made.add(Slicer(stack, work).map(look))
        return made

    def add(self, layers: Iterator[tuple[LayerComponents, float, NDArray[np.int32]]]) -> None:
        """Follow the components of layers upwards, each with the oldest of what it grew together of."""
        before: LayerComponents | None = None
        oldest = np.empty(0, np.int64)  # births that the components of the layer before are named by
        square = self.stack.pixel[0] * self.stack.pixel[1]
        for k, (now, area, count) in enumerate(layers):
            self.areas.append(area)
            full, dense = count > 0, count == self.cell[0] * self.cell[1]
            if k % self.cell[2] == 0:
                self.full.append(full)
                self.dense.append(dense)
            else:
                self.full[-1] |= full
                self.dense[-1] &= dense
            names = np.full(len(now), -1)
            pairs = overlaps(before, now) if before is not None else np.empty((0, 2), np.int64)
            if len(pairs):
                below, above = oldest[pairs[:, 0]], pairs[:, 1]
                order = np.lexsort([below, above])  # births are numbered in the order of their layers
                first = np.r_[True, np.diff(above[order]) > 0]
                names[above[order[first]]] = below[order[first]]
                for younger in distinct(below[below != names[above]]).tolist():
                    self.births[younger].joined = True
            own = np.flatnonzero(names < 0)
            for node, place in zip(own.tolist(), _places(now, own), strict=True):
                names[node] = len(self.births)
                self.births.append(_Birth(k, place, float(now.nodes.area[node]) * square))
            for name, size in zip(names.tolist(), now.nodes.area.tolist(), strict=True):
                birth = self.births[name]
                birth.largest, birth.last = max(birth.largest, size * square), k
            before, oldest = now, names

    @cached_property
    def low(self) -> NDArray[np.float64]:
        """Lowest corner of the cells, mm."""
        stack = self.stack
        x, y = (np.array(stack.corner) * stack.scale).tolist()
        return np.array([x, y, float(stack.z[0]) * stack.scale - float(stack.heights[0]) / 2])

    @cached_property
    def sides(self) -> NDArray[np.float64]:
        """Sides of a cell, mm."""
        return np.array([*self.stack.pixel, float(self.stack.heights[0])]) * self.cell

    @cached_property
    def begun(self) -> NDArray[np.float64]:
        """Points (x, y, z) in the first layers of all that has a tip, mm, and its largest cross-section."""
        pixel, height = self.stack.pixel, float(self.stack.heights[0])
        speck = 0.999 * max(SPECK, PIXELS * pixel[0] * pixel[1])  # areas are rounded
        held = [birth for birth in self.births if birth.is_held(height, speck)]
        cells = np.array([(*birth.place, birth.layer) for birth in held], np.float64).reshape(-1, 3)
        largest = [birth.largest for birth in held]
        return np.column_stack([self.low + (cells + 0.5) * [*pixel, height], largest])

    @property
    def least_area(self) -> float:
        """Cross-section that carries the object, mm2."""
        return max(self.areas) / CARRIED

    def open(self, room: Room) -> NDArray[np.bool_]:
        """Cells [z, y, x] of the object, or beside them, that have a way out."""
        z, y, x = (int(axis) for axis in room.at(self.low + 0.5 * self.sides))
        depth, rows, columns = np.array(self.full).shape
        near = steps_from(room.outside, 2) < 2
        return near[z : z + depth, y : y + rows, x : x + columns]

    def around(self, count: int) -> NDArray[np.int64]:
        """Cells (z, y, x) where the object gets wider above its lowest point, spread evenly, up to where it
        carries itself.
        """
        wide = np.array(self.areas[:: self.cell[2]]) > WIDER * self.least_area
        full = np.array(self.full)[: int(wide.argmax()) + 2]
        cells: NDArray[np.int64] = np.argwhere(full[1:] & ~full[:-1]) + np.array([1, 0, 0])
        if not count or not len(cells):
            return cells[:0]
        at, chosen = cells * self.sides[::-1], [int(np.argmax(cells[:, 0]))]
        away = np.linalg.norm(at - at[chosen[0]], axis=1)
        while len(chosen) < count and away.max() > 0:
            chosen.append(int(away.argmax()))
            away = np.minimum(away, np.linalg.norm(at - at[chosen[-1]], axis=1))
        return cells[chosen]

    def contacts(self, of: Object, room: Room, strength: Strength, around: int = 0) -> Contacts:
        """Contacts of supports.

        What is wide before it joins anything older has a wide one. `around`: further ones beside the lowest.
        """
        tip, begun = strength.tip / 2, self.begun
        islands = of.under(begun[:, :3], np.full(len(begun), float(self.stack.heights[0])))
        growth = _Growth(np.array(self.full), self.open(room), self.sides, strength.reach)
        cells = growth.tips(islands, self.low)
        grown = self.on_surface(of, np.concatenate([cells, self.around(around)]))
        points = np.concatenate([islands, grown])
        wide = np.clip(np.sqrt(begun[:, 3] / CARRIED / math.pi), tip, WIDEST * tip)
        radii = np.concatenate([wide, np.full(len(grown), tip)])
        return Contacts(points, radii)

    def room(self, strength: Strength, raft: float) -> Room:
        """Room around the object, which is lifted by whole slabs of layers: its layers stay as they are."""
        slab, cell = SLAB * float(self.stack.heights[0]), self.sides
        lift = math.ceil((LIFT + raft) / slab) * slab - raft
        below = math.ceil(lift / cell[2])
        full, dense = (np.pad(np.array(of), ((below, 0), (0, 0), (0, 0))) for of in (self.full, self.dense))
        origin = self.low - [0, 0, below * cell[2]]
        clear = CLEARANCE + strength.pillar / 2
        return Room.around(full, dense, origin, float(self.low[2] - lift), cell, clear)

    def on_surface(self, of: Object, cells: NDArray[np.int64]) -> NDArray[np.float64]:
        """Lowest points of the solid in cells (z, y, x), [n, 3]; those without any are left out."""
        shares = (0.5, 0.2, 0.8)
        found = np.full((len(cells), 3), np.nan)
        steps = max(3 * self.cell[2], 6)
        for sx in shares:
            for sy in shares:
                left = np.flatnonzero(np.isnan(found[:, 0]))
                at = self.low + (cells[left][:, ::-1] + [sx, sy, -0.5]) * self.sides
                rise = np.arange(steps + 1) * (1.5 * self.sides[2] / steps)
                points = np.repeat(at[:, None], len(rise), 1)
                points[..., 2] += rise
                solid = of.values(points) < 0
                hit = solid.argmax(1)
                good = solid.any(1) & (hit > 0)
                inside = points[good, hit[good]]
                found[left[good]] = of.under(inside, np.full(len(inside), 1.5 * self.sides[2] / steps))
        return np.asarray(found[~np.isnan(found[:, 0])])


def _places(components: LayerComponents, chosen: NDArray[np.int64]) -> list[tuple[int, int]]:
    """A pixel (x, y) of each chosen component, near its middle; `chosen`: ascending."""
    runs, is_chosen = components.runs, np.zeros(len(components), bool)
    is_chosen[chosen] = True
    at = np.flatnonzero(is_chosen[components.label])
    node, row = components.label[at], np.searchsorted(runs.rows, at, "right") - 1
    x, y = components.nodes.middle[node].T - 0.5
    nearest = np.clip(np.rint(x), runs.begin[at], runs.end[at] - 1)
    order = np.lexsort([np.hypot(nearest - x, row - y), node])
    best = order[np.diff(node[order], prepend=-1) > 0]
    return list(zip(nearest[best].astype(int).tolist(), row[best].tolist(), strict=True))


@dataclass(eq=False)
class _Growth:
    """Growth of an object into the air, layer by layer of cells."""

    full: NDArray[np.bool_]  # [z, y, x]
    open: NDArray[np.bool_]  # cells that are not in holes without exit
    cell: NDArray[np.float64]  # sides of a cell, mm
    reach: float

    def tips(self, contacts: NDArray[np.float64], low: NDArray[np.float64]) -> NDArray[np.int64]:
        """Cells (z, y, x) that need tips besides those at the contacts [m, 3], mm; `low`: corner of the
        cells.
        """
        known = np.floor((contacts - low) / self.cell).astype(np.int64)[:, ::-1]
        known = np.clip(known, 0, np.array(self.full.shape) - 1)
        order = np.argsort(known[:, 0], kind="stable")
        starts = np.searchsorted(known[order, 0], np.arange(len(self.full) + 1))
        used, found = np.full(self.full.shape[1:], np.inf, np.float32), []
        for k, now in enumerate(self.full):
            tips = known[order[starts[k] : starts[k + 1]], 1:]
            reach = np.where(self.open[k], self.reach, POCKET).astype(np.float32)
            used, more = self._layer(used, now, tips, reach)
            found += [(k, *place) for place in more]
        return np.array(found, np.int64).reshape(-1, 3)

    def _layer(
        self,
        used: NDArray[np.float32],
        now: NDArray[np.bool_],
        tips: NDArray[np.int64],
        reach: NDArray[np.float32],
    ) -> tuple[NDArray[np.float32], list[tuple[int, int]]]:
        """Reach that is used in a layer, of that in the layer below, and the places of its further tips."""
        result = np.where(now, np.maximum(used - REGAINED * self.cell[2], 0), np.inf).astype(np.float32)
        result[tuple(tips.T)] = 0
        bare, more = now & np.isinf(result), list[tuple[int, int]]()
        rows, columns = np.nonzero(bare)
        if not len(rows):
            return result, more
        here = result.copy()
        here[rows, columns] = self._grown(result, rows, columns)
        while True:
            worst = int((here[rows, columns] - reach[rows, columns]).argmax())
            y, x = int(rows[worst]), int(columns[worst])
            if not here[y, x] > reach[y, x]:
                break
            more.append((y, x))
            wide, deep = (math.ceil(self.reach * 2 / side) for side in self.cell[:2].tolist())
            window = np.s_[max(y - deep, 0) : y + deep + 1, max(x - wide, 0) : x + wide + 1]
            j, i = (np.arange(n)[part] for n, part in zip(now.shape, window, strict=True))
            away = np.hypot((i - x) * self.cell[0], (j[:, None] - y) * self.cell[1]).astype(np.float32)
            here[window] = np.minimum(here[window], away)
        result[bare] = here[bare]
        return result, more

    def _grown(
        self, used: NDArray[np.float32], rows: NDArray[np.intp], columns: NDArray[np.intp]
    ) -> NDArray[np.float32]:
        """Reach that bare cells use: of the nearest one that is carried and, beyond what is free, the way to
        it. Most are beside one; what is farther than a few cells is looked for in the whole layer.
        """
        padded = np.pad(used, BESIDE, constant_values=np.inf)
        left, result = np.arange(len(rows)), np.full(len(rows), 1e6, np.float32)
        for y, x, away in self._beside:
            near = padded[rows[left] + y, columns[left] + x]
            found = np.isfinite(near)
            result[left[found]] = near[found] + max(away - float(self.cell[2]), 0.0)
            left = left[~found]
            if not len(left):
                return result
        carried = np.isfinite(used)
        if carried.any():
            from scipy.ndimage import distance_transform_edt

            side = self.cell[1::-1].tolist()
            far, nearest = distance_transform_edt(~carried, sampling=side, return_indices=True)
            at = rows[left], columns[left]
            result[left] = used[tuple(nearest[:, at[0], at[1]])] + np.maximum(far[at] - self.cell[2], 0)
        return result

    @cached_property
    def _beside(self) -> list[tuple[int, int, float]]:
        """Cells (y, x) around one at `BESIDE`, the nearest first, and how far they are, mm."""
        steps = range(-BESIDE, BESIDE + 1)
        wide, deep = self.cell[:2].tolist()
        around = [(math.hypot(j * deep, i * wide), BESIDE + j, BESIDE + i) for j in steps for i in steps]
        return [(y, x, away) for away, y, x in sorted(around) if away < (BESIDE + 1) * min(wide, deep)]
