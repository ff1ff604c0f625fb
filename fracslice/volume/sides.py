"""How far an object reaches towards one side, proved by free balls.

Seen from that side the object stands in columns, each with a ceiling above which it is proved to be empty. A
ball without the object, of radius ``f / L`` around a point, lowers the ceiling of a column that it spans; a
column that it does not span is cut in four. The highest ceilings come first, so that a wall that stands on a
plate is found before anything is spent on the plate. From high above a flat face a ball spans a wide column
and still comes near the face: where values are distances, some thousand of them prove it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..formulas.box import Box
from ..kernel import Kernel
from ..work import Work
from .values import values_at

COLUMNS = 32
"""Along each axis at first."""

NARROWEST = 2.0**-16
"""Of the first columns' width: the field is zero there, but not below."""

FRONT = 1 << 13
"""Columns that are looked at together, about."""

DEPTHS = 2.0, 8.0
STARTS = 4
UNKNOWN = np.full((3, STARTS), np.nan)

PROBES = 64
HEIGHTS = np.linspace(0, 1, 17)[1:-1, None]
"""Of the way up from an inside point to the ceiling."""

ROUNDING = 4 * float(np.finfo(np.float32).eps)
"""Of the largest coordinate: what float32 leaves unknown of a distance."""


@dataclass(frozen=True)
class FreeSpace:
    """kernel: of the scene; its signs count. conservative: to skip space by; its values over `lipschitz` are
    radii of free balls. far: these are nearly as large as can be, from far away too.
    """

    kernel: Kernel
    conservative: Kernel
    lipschitz: float
    far: bool
    work: Work

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Whether points [3, n] are inside."""
        found: np.ndarray = values_at(self.kernel, points, self.work) < 0
        return found

    def free(self, points: np.ndarray) -> np.ndarray:
        """The radius of a ball around each that nothing is in; at most zero if there may be none."""
        f = values_at(self.conservative, points, self.work).astype(np.float64)
        rounding = ROUNDING * np.abs(points).max(initial=0.0)
        return np.where(f > 0, f / self.lipschitz - rounding, 0.0)


@dataclass(eq=False)
class Side:
    """One side of what is in `region`; heights are along `axis`, outwards by `sign`.

    best: inside points [3, n], the highest first. known: the height of the first. above: the height that
    nothing is above. spent: how many columns were looked at.
    """

    field: FreeSpace
    region: Box
    axis: int
    sign: int
    best: np.ndarray
    spent: int = 0

    def __post_init__(self) -> None:
        lo, hi = np.array(self.region.lo), np.array(self.region.hi)
        self.learn(self.best)
        self.across = [(self.axis + 1) % 3, (self.axis + 2) % 3]
        self.floor, self.above = sorted((self.sign * lo[self.axis], self.sign * hi[self.axis]))
        self.longest = float((hi - lo).max())
        self.half = (hi - lo)[self.across] / COLUMNS / 2
        cells = np.indices((COLUMNS, COLUMNS)).reshape(2, -1)
        middles = lo[self.across, None] + self.half[:, None] * (2 * cells + 1)
        # Rows: a column's middle, its width as a share of the first ones', its ceiling.
        self.columns = np.vstack([middles, np.ones(cells.shape[1]), np.full(cells.shape[1], self.above)])

    def learn(self, points: np.ndarray) -> None:
        """Takes in points [3, n] that are inside."""
        found = np.hstack([self.best, points])
        order = np.argsort(-self.sign * found[self.axis], kind="stable")  # what is not known comes last
        self.best = found[:, order[:STARTS]]
        height = self.sign * float(self.tip[self.axis])
        self.known = -np.inf if np.isnan(height) else height

    @property
    def tip(self) -> np.ndarray:
        """The highest inside point known."""
        return self.best[:, 0]

    def guess(self, share: float, aim: float, most: int) -> None:
        """Learns of tips as if the bound were that share of what it is."""
        bold = replace(self.field, lipschitz=share * self.field.lipschitz)
        other = Side(bold, self.region, self.axis, self.sign, self.best)
        other.prove(aim, most)
        self.best = other.best

    def prove(self, aim: float, most: int) -> None:
        """Lowers ceilings until none is more than `aim` above what is known, or `most` columns were looked
        at.
        """
        while self.spent < most:
            self.columns = self.columns[:, self.columns[3] > max(self.known, self.floor)]
            waiting = np.flatnonzero(self.high(self.columns, aim) & (self.columns[2] > NARROWEST))
            if not len(waiting):
                break
            tops = self.columns[3, waiting]
            rank = max(len(tops) - FRONT, 0)
            front = waiting[tops >= np.partition(tops, rank)[rank]]
            lowered = self.lowered(self.columns[:, front], aim)
            self.columns = np.hstack([np.delete(self.columns, front, 1), lowered])
        self.above = max(self.columns[3].max(initial=self.floor), self.known)

    def high(self, columns: np.ndarray, aim: float) -> np.ndarray:
        """Which ceilings are to be lowered."""
        found: np.ndarray = columns[3] > max(self.known + aim, self.floor)
        return found

    def lowered(self, columns: np.ndarray, aim: float) -> np.ndarray:
        """The columns with lower ceilings, cut in four where none was lowered much."""
        self.spent += columns.shape[1]
        top, radius = columns[3], columns[2] * np.hypot(*self.half)
        lower = np.minimum(top, self.bottom(columns, radius, top))
        if self.field.far and np.isfinite(self.known):
            # From so high a ball that spans the column comes as near to a flat face as is wanted.
            height = self.known + np.clip(radius**2 / aim, top - self.known, self.longest / 2)
            lower = np.minimum(lower, self.bottom(columns, radius, height))
        columns = np.vstack([columns[:3], lower])
        stuck = (top - lower < radius / 2) & self.high(columns, aim)
        self.probe(columns[:, stuck], radius[stuck])
        return np.hstack([columns[:, ~stuck], self.quarters(columns[:, stuck])])

    def bottom(self, columns: np.ndarray, radius: np.ndarray, heights: np.ndarray) -> np.ndarray:
        """Down to where free balls around these heights empty columns; infinite where one spans none."""
        free = self.field.free(self.points(columns, heights))
        depth = np.sqrt(np.maximum(free**2 - radius**2, 0.0))
        return np.where(free > radius, heights - depth, np.inf)

    def probe(self, columns: np.ndarray, radius: np.ndarray) -> None:
        """Looks for inside points a little below ceilings, and on the way up from the highest of them."""
        for depth in DEPTHS:
            deep = columns[3] - depth * radius
            inside = np.flatnonzero(self.field.inside(self.points(columns, deep)) & (deep > self.known))
            if len(inside):
                self.learn(self.points(columns[:, inside], deep[inside]))
                inside = inside[np.argsort(-columns[3, inside], kind="stable")[:PROBES]]
                heights = columns[3, inside] - depth * radius[inside] * HEIGHTS
                way = self.points(np.tile(columns[:, inside], len(HEIGHTS)), heights.reshape(-1))
                self.learn(way[:, self.field.inside(way)])

    def points(self, columns: np.ndarray, heights: np.ndarray) -> np.ndarray:
        """Places in the middle of columns, [3, n]."""
        found = np.empty((3, columns.shape[1]))
        found[self.across], found[self.axis] = columns[:2], self.sign * heights
        return found

    def quarters(self, columns: np.ndarray) -> np.ndarray:
        """Each column as four."""
        corners = np.array([(-0.5, -0.5, 0.5, 0.5), (-0.5, 0.5, -0.5, 0.5)])[:, None]
        middles = columns[:2, :, None] + corners * self.half[:, None, None] * columns[2, :, None]
        widths, tops = np.repeat(columns[2] / 2, 4), np.repeat(columns[3], 4)
        return np.vstack([middles.reshape(2, -1), widths, tops])
