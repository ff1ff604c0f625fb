"""Supports in the field: tips, and the tree of pillars that carries them, routed through the free space of a
grid.

From the highest tip down, a branch is led to the one or the trunk with which it takes the least way, within
45 degrees of vertical (Vanek, Galicia and Benes 2014, "Clever Support"), else by the shortest way to the
plate. Ways of all cells are found at once, cell by cell upwards from the plate: a way down is never longer
than it is steep.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import grow_forest
from ..common.arrays import distinct, triple
from ..fields.field import Field, Kernel
from ..formulas import Node, box, capsule, intersection, plane, transform, union
from ..volume import Pillars, Supports
from ..volume.bricks import values_at
from ..work import Work
from .walls import slopes

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Strength:
    """Measures of supports, mm."""

    tip: float  # diameter of a contact
    pillar: float  # least diameter of a branch
    reach: float  # how far from what carries it a layer may grow into the air


STRENGTHS = {
    "light": Strength(0.3, 0.8, 3.5),
    "medium": Strength(0.4, 1.0, 3.0),
    "heavy": Strength(0.6, 1.4, 3.0),
}
"""Contacts of 0.3 to 0.6 mm are those that makers of printers advise (Formlabs, "Touchpoint size";
PrusaSlicer's default is 0.4 mm); the reach is ours.
"""

LIFT = 5.0
"""Least height of the object above the plate, mm."""

CLEARANCE = 0.4
"""Least distance of pillars from the object, mm, but for its narrow places."""

NARROW = 2
"""Cells between a way through a narrow place and the object, at least one of them free."""

DETOUR = 4.0
"""What a way through a narrow place costs, lengths of a free one."""

FOOT = 8.0
"""What another foot on the plate costs, mm of a pillar."""

LOWEST = 2.0
"""Least height above the plate at which branches meet, mm."""

FARTHEST = 12.0
"""Longest branch to another one, mm."""

TRIES = 12
"""Branches and trunks that are tried, those first that save most."""

SUNK = np.array(
    [(0, 0, 0), (0, 0, -1.2), *((0.8 * x, 0.8 * y, -0.8) for x in (-1, 0, 1) for y in (-1, 0, 1))]
)
"""Places in what a strut stands on, radii from its end, which must not look out below: it would be an island.
"""

PIECE = 0.05
"""What radii of pieces to be taken out are multiples of, mm."""

POCKET = 80
"""How far from a strut the exit of a pocket is looked for, steps of half a radius."""

LENGTHS = 2.0, 1.4, 1.0, 0.7
"""Lengths of the cones of tips, mm."""

SLENDER = 50.0
"""Largest height of a pillar without braces, diameters: thinner ones bend under the peeling of a layer
(Euler).
"""

CARRIED = 42.0
"""Cross-section of the object that an area of 1 of all trunks carries; see `fracslice.checks.support`."""

WIDEST = 2.5
"""Largest factor by which contacts and pillars are wider for that."""

CONE = 1.7
"""Largest factor by which the lower ends of the cones of tips are wider for that."""

TALL, NEAR, APART = 15.0, 10.0, 12.0
"""Height of pillars that are braced, greatest distance of those that are braced with each other, and the
height between two braces, mm.
"""

RIM, RISE = 0.6, 1.0
"""Width of the rim of a foot, and height up to which it narrows to the pillar, mm."""


@dataclass(frozen=True, eq=False)
class Room:
    """Grid of cells around an object and below it, down to the plate; lengths in mm of the scene's axes."""

    origin: Points  # corner of the first cell, [3]: x, y, z
    floor: float  # height of the plate, or of the raft, in the first cells
    cell: Points  # sides of a cell, [3]
    away: NDArray[np.uint8]  # steps from the nearest cell with a part of the object, at most 255; [z, y, x]
    wide: int  # steps from which on a way is free
    dense: NDArray[np.bool_]  # cells that the object fills

    @classmethod
    def around(
        cls,
        full: NDArray[np.bool_],
        dense: NDArray[np.bool_],
        origin: Points,
        floor: float,
        cell: Points,
        clear: float,
    ) -> Room:
        """Room around cells with parts of an object, some of which it fills.

        `clear`: least distance of a pillar's axis from it, mm.
        """
        wide = max(math.ceil(clear / float(cell.min())), NARROW + 1)
        return cls(origin, floor, cell, steps_from(full, wide), wide, dense)

    @cached_property
    def cost(self) -> NDArray[np.float32]:
        """Length of the shortest way down to the plate from each cell, mm; infinite where there is none."""
        x, y, z = self.cell.tolist()
        result = np.full(self.away.shape, np.inf, np.float32)
        result[0][self.away[0] >= self.wide] = 0
        for k in range(1, len(result)):
            below, away = result[k - 1], self.away[k]
            times = np.where(away >= self.wide, 1, np.where(away >= NARROW, DETOUR, np.inf)).astype(
                np.float32
            )
            least = below + z * times
            for axis, side in ((0, y), (1, x)):
                way = math.hypot(side, z) * times
                low, high = (slice(None, -1), slice(1, None)) if axis == 0 else (np.s_[:, :-1], np.s_[:, 1:])
                for here, there in ((low, high), (high, low)):
                    np.minimum(least[here], below[there] + way[here], out=least[here])
            result[k] = least
        return result

    @cached_property
    def outside(self) -> NDArray[np.bool_]:
        """Cells from which a piece as wide as a cell finds a way out."""
        return self.exits(1)

    def exits(self, steps: int) -> NDArray[np.bool_]:
        """Cells as many steps away from the object that have a way out of such cells."""
        from scipy.ndimage import label

        least = min(steps, self.wide)
        if least not in self._exits:
            labels, _ = label(self.away >= least)
            self._exits[least] = np.asarray((labels == labels[0, 0, 0]) & (labels > 0))
        return self._exits[least]

    @cached_property
    def sealed(self) -> NDArray[np.bool_]:
        """Cells from which no way leads out, however narrow."""
        from scipy.ndimage import label

        labels, _ = label(~self.dense)
        return np.asarray(labels != labels[0, 0, 0])

    @cached_property
    def _exits(self) -> dict[int, NDArray[np.bool_]]:
        return {}

    def at(self, points: Points) -> tuple[NDArray[np.int64], ...]:
        """Cells (z, y, x) of points [..., 3], of those outside of the room the nearest ones."""
        cells = np.floor((points - self.origin) / self.cell)
        cells = np.minimum(np.maximum(cells, 0), self._last).astype(np.int64)
        return cells[..., 2], cells[..., 1], cells[..., 0]

    @cached_property
    def _last(self) -> NDArray[np.int64]:
        return np.array(self.away.shape[::-1]) - 1

    def is_free(self, start: Points, end: Points, least: int) -> bool:
        """True if all cells along a segment are as many steps away from the object."""
        count = int(2 * math.dist(start, end) / float(self.cell.min())) + 2
        along = start + (np.arange(count) / (count - 1))[:, None] * (end - start)
        return bool((self.away[self.at(along)] >= least).all())


def steps_from(full: NDArray[np.bool_], most: int) -> NDArray[np.uint8]:
    """Steps from the nearest full cell, at most `most`: a ball of as many cells is free around cells that are
    more steps away. Every other step goes to the cells that share a corner, which together are nearly round.
    """
    near, away = full.copy(), np.where(full, 0, most).astype(np.uint8)
    for step in range(1, most):
        before = near
        near = near.copy()
        for axis in range(3):
            # across corners: what was reached along one axis is taken along the next one
            grown = before if step % 2 else near.copy()
            here = np.moveaxis(near, axis, 0)
            there = np.moveaxis(grown, axis, 0)
            here[1:] |= there[:-1]
            here[:-1] |= there[1:]
        away[near & (away == most)] = step
    return away


class Forest:
    """Branches that grow from tips down to the plate.

    Attributes
    ----------
    place : float64 [n, 3]
        Nodes, those of the tips first.
    down : list of int
        The next node on the way down from each; -1 if it is straight down to the plate, or on a trunk.
    trunks : list of int
        Nodes from which it is straight down to the plate.
    joins : list of list of int
        Nodes on each trunk at which branches end.
    """

    def __init__(self, room: Room, strength: Strength, ends: Points, radii: NDArray[np.float64]) -> None:
        self.room, self.strength, self.tips, self.radii = room, strength, len(ends), radii
        steps, lengths = (room.wide, NARROW), (FARTHEST, LOWEST, FOOT)
        grid = room.away, room.cost, triple(room.origin), triple(room.cell), room.floor
        self.place, down, trunks, on = grow_forest(*grid, steps, lengths, TRIES, ends)
        self.down, self.trunks = down.tolist(), trunks.tolist()
        self.joins = [np.flatnonzero(on == trunk).tolist() for trunk in range(len(trunks))]

    def beams(self, largest: float, lowest: float) -> tuple[Points, Points, Points]:
        """Beams [m, 2, 4] of all branches, the feet of trunks [t, 4], and the radii of all nodes [n].

        `largest`: largest cross-section of the object, mm2; `lowest`: height of the lowest contact.
        """
        load, floor, least = self._loads(), self.room.floor, self.strength.pillar / 2
        radii = np.maximum(least, np.sqrt(np.array(load)))
        beams, feet = list[tuple[int, int]](), list[int]()  # pairs of balls (x, y, z, radius)
        balls = np.column_stack([self.place, radii]).tolist()
        for k, nxt in enumerate(self.down):
            if nxt >= 0:
                beams.append((k, nxt))
        for number, k in enumerate(self.trunks):
            joins = sorted(self.joins[number], key=lambda j: -self.place[j][2])
            carried, top = load[k], k
            slender = (self.place[k][2] - floor) / SLENDER / 2
            balls[k][3] = max(balls[k][3], 0.7 * slender)
            for j in joins:
                carried += load[j]
                balls[j][3] = max(least, slender, math.sqrt(carried))
                beams.append((top, j))
                top = j
            balls.append([*self.place[k][:2].tolist(), floor, max(balls[top][3], slender)])
            beams.append((top, len(balls) - 1))
            feet.append(len(balls) - 1)
        made, pairs = np.array(balls).reshape(-1, 4), np.array(beams, np.int64).reshape(-1, 2)
        low = made[:, 2] < lowest
        ends = float(self.place[: self.tips, 2].min(initial=np.inf)) if self.tips else floor
        wider = _widening(made[pairs], floor, min(ends, lowest), largest)
        made[low, 3] *= wider
        made[: self.tips][low[: self.tips], 3] *= min(wider, CONE) / wider
        return made[pairs], made[feet], made[: len(self.place), 3]

    def _loads(self) -> list[float]:
        """Contacts that each node carries, squares of their radii."""
        load = [*(self.radii**2).tolist(), *([0.0] * (len(self.place) - self.tips))]
        for k in np.argsort(-self.place[:, 2], kind="stable").tolist():
            if self.down[k] >= 0:
                load[self.down[k]] += load[k]
        return load

    def braces(self) -> Points:
        """Beams [m, 2, 4] across between tall trunks that are near each other."""
        from scipy.spatial import cKDTree

        floor, result, held = self.room.floor, [], dict[int, int]()
        tops = self.place[self.trunks].reshape(-1, 3)
        tall = np.flatnonzero(tops[:, 2] - floor > TALL)
        near = cKDTree(tops[tall, :2]).query_pairs(NEAR, output_type="ndarray") if len(tall) else tall
        some, others = tall[near.reshape(-1, 2)].T
        away = np.sqrt(((tops[some] - tops[others])[:, :2] ** 2).sum(1))
        for n in np.lexsort([others, some, away]).tolist():
            a, b, far = int(some[n]), int(others[n]), float(away[n])
            if max(held.get(a, 0), held.get(b, 0)) >= 2 or far < 1.5:
                continue
            radius, low, made = self.strength.pillar * 0.35, floor + 3.0, 0
            while low + far < min(tops[a, 2], tops[b, 2]) - 2:
                start, end = np.array([*tops[a, :2], low]), np.array([*tops[b, :2], low + far])
                if self.room.is_free(start, end, self.room.wide):
                    result.append([[*start, radius], [*end, radius]])
                    made += 1
                low, a, b = low + max(far, APART), b, a
            if made:
                held[a], held[b] = held.get(a, 0) + 1, held.get(b, 0) + 1
        return np.array(result).reshape(-1, 2, 4)


@dataclass(frozen=True, eq=False)
class Object:
    """The object that is supported, in mm of the scene's axes."""

    root: Field
    scale: float  # mm per scene unit
    areas: NDArray[np.float64]  # cross-sections, from the lowest one upwards, mm2
    step: float  # distance between them
    work: Work

    @cached_property
    def kernel(self) -> Kernel:
        """Kernel of double precision."""
        return self.root.kernel("cpu", "float64")

    def values(self, points: Points) -> NDArray[np.float64]:
        """Field at points [..., 3] in mm."""
        flat = points.reshape(-1, 3).T / self.scale
        return values_at(self.kernel, flat, self.work).reshape(points.shape[:-1])

    def under(self, inside: Points, depth: NDArray[np.float64]) -> Points:
        """Lowest points of the solid beneath points [n, 3] inside it that are outside at a depth below."""
        low, high = inside[:, 2] - depth, inside[:, 2].copy()
        for _ in range(24):
            middle = (low + high) / 2
            full = self.values(np.column_stack([inside[:, :2], middle])) < 0
            high, low = np.where(full, middle, high), np.where(full, low, middle)
        return np.column_stack([inside[:, :2], high])

    def carried(self, beams: Points, lowest: float) -> float:
        """Smallest share that the object and beams together, near the lowest contact, have of the
        cross-section that is to carry the largest one.
        """
        steps = np.arange(-math.ceil(0.1 / self.step), math.ceil(LENGTHS[0] / self.step))
        heights = np.asarray(lowest + self.step * (steps + 0.5), np.float64)
        own = np.where(steps < 0, 0.0, self.areas[np.clip(steps, 0, len(self.areas) - 1)])
        return float(((own + sections(beams, heights)) / (self.areas.max() / CARRIED)).min())

    def first_below(
        self, points: Points, floor: float, step: float, radii: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Heights below points [n, 3] at which a ball first ends inside the solid, to a step; the floor where
        none does.
        """
        result = np.full(len(points), floor)
        left, z = np.arange(len(points)), points[:, 2] - step
        while len(left := left[z[left] > floor]):
            middle = np.column_stack([points[left, :2], z[left]])
            full = (self.values(middle + SUNK[:, None] * radii[left, None]) < 0).all(0)
            result[left[full]] = z[left[full]]
            left = left[~full]
            z[left] -= step
        return result

    def slopes(self, points: Points, step: float) -> Points:
        """Unit normals [n, 3]."""
        _, normals = slopes(self.kernel, points.T / self.scale, step / self.scale, self.work)
        return normals.T


class NearSamples:
    """Samples of the field in a box, taken where a way is looked for; they are numbered as they lie."""

    def __init__(self, of: Object, low: NDArray[np.int64], high: NDArray[np.int64], step: float) -> None:
        """`low`, `high`: corners, steps from the origin, [3]; `step` in mm."""
        self.of, self.low, self.step = of, low, step
        self.shape = tuple((high - low).tolist())
        self._known = np.zeros(math.prod(self.shape), np.int8)  # 1 outside of the solid, 2 in it
        self._entered = np.ones(self.shape, bool)
        self._entered[2:-2, 2:-2, 2:-2] = False
        self._steps = np.array([[s, -s] for s in (self.shape[1] * self.shape[2], self.shape[2], 1)]).ravel()

    def places(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Samples [n, 3], steps from the origin."""
        places: NDArray[np.int64] = np.column_stack(np.unravel_index(numbers, self.shape)) + self.low
        return places

    def points(self, numbers: NDArray[np.int64]) -> Points:
        """Samples [n, 3], mm."""
        return np.asarray(self.places(numbers) * self.step, np.float64)

    def enter(self, places: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers of samples [n, 3] from which a way begins."""
        return self._new(np.asarray(np.ravel_multi_index(tuple((places - self.low).T), self.shape)))

    def beside(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Neighbours of samples that were not entered yet."""
        return self._new((numbers[:, None] + self._steps).ravel())

    def free(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Those of some samples where a ball of two steps is outside of the solid."""
        ball = numbers[:, None] + np.append(0, 2 * self._steps)
        new = distinct(ball[self._known[ball] == 0])
        self._known[new] = 1 + (self.of.values(self.points(new)) <= 0)
        return np.asarray(numbers[(self._known[ball] == 1).all(1)])

    def _new(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        entered = self._entered.reshape(-1)
        new = distinct(numbers[~entered[numbers]])
        entered[new] = True
        return new


@dataclass(eq=False)
class Exits:
    """Ways out of an object for balls, on samples of the field half a radius apart.

    Cells hold the object where a part of it is in them, so that they lack narrow exits.
    """

    of: Object
    room: Room
    shut: dict[float, set[tuple[int, ...]]] = field(default_factory=dict)  # samples without a way, by radii
    known: dict[tuple[float, ...], bool] = field(default_factory=dict)  # verdicts on struts

    def lead_out(self, radius: float, top: Points, ground: float) -> bool:
        """True if a ball in the place of a strut straight down, or beside it, finds a way out."""
        strut = radius, *top.tolist(), ground
        if strut not in self.known:  # supports with a shorter reach have most struts again
            self.known[strut] = self._found(radius, top, ground)
        return self.known[strut]

    def _found(self, radius: float, top: Points, ground: float) -> bool:
        """See `lead_out`."""
        step, shut = radius / 2, self.shut.setdefault(radius, set())
        along = np.arange(ground, float(top[2]), step)
        x, y, z = (axis.ravel() for axis in np.meshgrid(SIDES * step, SIDES * step, along, indexing="ij"))
        halfway = np.column_stack([top[0] + x / 2, top[1] + y / 2, z])
        start = np.column_stack([top[0] + x, top[1] + y, z])
        start = start[(self.of.values(halfway) > 0) & ~self.room.sealed[self.room.at(start)]]
        places = set(map(tuple, np.round(start / step).astype(np.int64).tolist())) - shut
        seen = self._flood(radius, np.array(sorted(places), np.int64).reshape(-1, 3))
        shut.update(map(tuple, seen.tolist()))
        return bool(places) and not len(seen)

    def _flood(self, radius: float, start: NDArray[np.int64]) -> NDArray[np.int64]:
        """Samples [m, 3] that are reached from some, [n, 3]; none if a way leads out from one of them."""
        if not len(start):
            return start
        seen = [start]
        open_cells = self.room.exits(math.ceil(2 * radius / float(self.room.cell.min())))
        window = NearSamples(self.of, start.min(0) - POCKET, start.max(0) + POCKET, radius / 2)
        front = window.enter(start)
        while len(front := window.free(front)):
            seen.append(window.places(front))
            if open_cells[self.room.at(window.points(front))].any():
                return start[:0]
            front = window.beside(front)
        return np.concatenate(seen)


SIDES = np.arange(-4, 5)
"""Places beside a strut from which a way out is looked for, steps."""


class Contacts(NamedTuple):
    """Places where supports touch the surface."""

    points: Points  # mm, [n, 3]
    radii: NDArray[np.float64]  # mm, [n]


def directions(normals: Points) -> Points:
    """Directions [n, 18, 3] in which tips may leave: against the normal if that is within 45 degrees of
    vertical, straight down, and leaning by 22 and by 45 degrees to eight sides.
    """
    turns = np.arange(8) * math.pi / 4
    fixed = [(0.0, 0.0, -1.0)]
    for lean in (math.pi / 8, math.pi / 4):
        fixed += [
            (math.sin(lean) * math.cos(t), math.sin(lean) * math.sin(t), -math.cos(lean)) for t in turns
        ]
    flat = normals[:, :2]
    across = np.linalg.norm(flat, axis=1)
    lean = np.minimum(np.arctan2(across, np.maximum(-normals[:, 2], 0)), math.pi / 4)
    side = flat / np.maximum(across, 1e-12)[:, None]
    own = np.column_stack([side * np.sin(lean)[:, None], -np.cos(lean)])
    return np.concatenate([own[:, None], np.broadcast_to(fixed, (len(normals), len(fixed), 3))], 1)


def tip_ends(room: Room, contacts: Points, normals: Points) -> Points:
    """Lower ends of the cones of tips [n, 3], NaN where none has room and a way down.

    The direction nearest to the normal is taken, and the longest cone; leaning to a way that is shorter pays.
    """
    where = directions(normals)
    best, result = np.full(len(contacts), np.inf), np.full_like(contacts, np.nan)
    for length in LENGTHS:
        ends = contacts[:, None] + length * where
        cost = room.cost[room.at(ends)] + 3 * np.linalg.norm(where - where[:, :1], axis=2) - 4 * length
        for share, least in ((0.5, 1), (0.75, NARROW)):
            cost[room.away[room.at(contacts[:, None] + share * length * where)] < least] = np.inf
        cost[ends[..., 2] < room.floor + 1] = np.inf
        first = cost.argmin(1)
        least = cost[np.arange(len(cost)), first]
        better = least < best
        best[better], result[better] = least[better], ends[better, first[better]]
    return result


def support(exits: Exits, where: Contacts, strength: Strength, raft: float) -> tuple[Supports, float]:
    """Supports of points of the surface, and the share of the cross-section that they have to have next to
    it; `raft`: height of the raft, mm.
    """
    (points, tips), of, room = where, exits.of, exits.room
    lowest = float(points[:, 2].min())
    ends = tip_ends(room, points, of.slopes(points, strength.tip / 4))
    led = np.isfinite(ends[:, 0])
    forest = Forest(room, strength, ends[led], tips[led])
    branches, feet, radii = forest.beams(float(of.areas.max()), lowest)
    cones = np.stack(
        [np.column_stack([points, tips])[led], np.column_stack([ends[led], radii[: forest.tips]])], 1
    )
    ground = of.first_below(points[~led], room.floor, float(room.cell.min()) / 2, tips[~led])
    struts, shut = _struts(exits, np.column_stack([points, tips])[~led], ground, strength.pillar / 2)
    ends = struts[:, 1, 1]
    inner = ends[:, 2] > room.floor
    feet = np.concatenate([feet, ends[~inner]])
    beams = np.concatenate([cones, branches, struts.reshape(-1, 2, 4), forest.braces()])
    discs = np.stack([feet + [0, 0, 0, RIM], feet + [0, 0, RISE, 0]], 1)
    plate, area = _raft(feet, room.floor - raft, raft) if raft else (np.empty((0, 4)), 0.0)
    pillars = Pillars(
        np.concatenate([beams, discs]) / of.scale, room.floor / of.scale, plate / [1, 1, 1, of.scale]
    )
    volume = _volume(pillars.beams * of.scale) + area * raft
    counts = len(cones) + len(struts), int(inner.sum())
    scars = math.pi * float(
        (tips[led] ** 2).sum() + (struts[:, 0, 0, 3] ** 2).sum() + (ends[inner, 3] ** 2).sum()
    )
    bare = points[~led][shut]
    made = Supports(of.root, _node(pillars), pillars, strength.tip, *counts, volume, scars, bare)
    return made, of.carried(beams, lowest)


def _widening(beams: Points, floor: float, high: float, largest: float) -> float:
    """By how much wider beams have to be, between two heights, to carry the largest cross-section, at most
    `WIDEST`.
    """
    least = float(sections(beams, np.linspace(floor, high, 16)[1:-1]).min())
    return min(max(math.sqrt(largest / CARRIED / least), 1.0), WIDEST) if least else 1.0


def sections(beams: Points, heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of beams [m, 2, 4] at heights [k], across the beams."""
    low, high = np.sort(beams[:, :, 2], 1).T
    order = np.argsort(beams[:, :, 2], 1)
    first, last = np.take_along_axis(beams[:, :, 3], order, 1).T
    share = (heights[:, None] - low) / np.maximum(high - low, 1e-9)
    radii = first + np.clip(share, 0, 1) * (last - first)
    return np.asarray(np.where((share >= 0) & (share <= 1), math.pi * radii**2, 0).sum(1))


def _struts(
    exits: Exits, tops: Points, ground: NDArray[np.float64], pillar: float
) -> tuple[Points, NDArray[np.bool_]]:
    """Beams [m, 2, 2, 4] straight down from balls [n, 4] to what is below, thicker between if they are long
    and a piece as wide can be taken out, thinner if only that can; and which of the balls, [n], have none, as
    no piece can.
    """
    tops, low, middle = tops.copy(), tops.copy(), tops.copy()
    low[:, 2] = ground
    middle[:, 2] = (tops[:, 2] + ground) / 2
    middle[:, 3] = np.clip((tops[:, 2] - ground) / 8, tops[:, 3], np.maximum(tops[:, 3], pillar))
    shut = ground > exits.room.floor
    for k in np.flatnonzero(shut).tolist():
        tip = float(tops[k, 3])
        for radius in (float(middle[k, 3]), tip, tip / 2):
            piece = PIECE * max(round(min(radius, (tops[k, 2] - ground[k]) / 2) / PIECE), 1)
            if exits.lead_out(piece, tops[k, :3], float(ground[k])):
                middle[k, 3], tops[k, 3], low[k, 3] = radius, min(tip, radius), min(tip, radius)
                shut[k] = False
                break
    made = np.stack([np.stack([tops, middle], 1), np.stack([middle, low], 1)], 1)
    return made[~shut], shut


def _volume(beams: Points) -> float:
    """Volume of cones between balls, mm3, where they overlap counted twice."""
    length = np.linalg.norm(beams[:, 1, :3] - beams[:, 0, :3], axis=1)
    a, b = beams[:, 0, 3], beams[:, 1, 3]
    return float((math.pi / 3 * length * (a * a + a * b + b * b)).sum())


def _node(of: Pillars) -> Node:
    """Element of pillars and their raft."""
    parts = (capsule(start[:3], end[:3], start[3], end[3]) for start, end in of.beams.tolist())
    whole = intersection(union(*parts), plane(normal=(0, 0, -1), offset=-of.floor))
    if not len(of.raft):
        return whole
    (_, _, _, top), (_, _, _, low), *rim = of.raft.tolist()
    right, back, left, front = ((d - c * top) / math.hypot(a, b) for a, b, c, d in rim[::3])
    size, middle = (
        (right + left, back + front, top + low),
        ((right - left) / 2, (back - front) / 2, (top - low) / 2),
    )
    sides = [plane(normal=(a, b, c), offset=d) for a, b, c, d in rim]
    return union(whole, intersection(transform(box(size=size), translate=middle), *sides))


def _raft(feet: Points, floor: float, height: float) -> tuple[Points, float]:
    """Half spaces [14, 4] of a plate under feet, of twelve sides whose rim is wider at its top, so that a
    scraper gets under it; and the area of its top, mm2.
    """
    turns = np.arange(12) * math.pi / 6
    sides = np.column_stack([np.cos(turns), np.sin(turns)])
    reach = (feet[:, :2] @ sides.T + feet[:, 3:]).max(0) + 2 * RIM
    share, top = math.sqrt(0.5), floor + height
    rim = np.column_stack([share * sides, np.full(12, -share), share * (reach - top)])
    corners = [np.linalg.solve(sides[[k, k - 1]], reach[[k, k - 1]]) for k in range(12)]
    x, y = np.array(corners).T
    area = abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1))) / 2
    return np.concatenate([[(0, 0, 1, top), (0, 0, -1, -floor)], rim]), area
