"""Proven bounds of an object on one side, by free balls.

Seen from that side, the object stands in columns, each with a ceiling above which it is proven empty. A free
ball, of radius ``f / L`` around a point, lowers the ceiling of a column that it spans; a column that it does
not span is split in four. The highest ceilings are processed first, so that a wall on a plate is found before
any work is spent on the plate. From high above a flat face a ball spans a wide column and still comes near
the face: where values are distances, some thousand balls prove it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..formulas.box import Box
from ..kernel import Kernel
from ..work import Work
from .values import values_at

COLUMNS = 32
"""Initial columns along each axis."""

NARROWEST = 2.0**-16
"""Smallest column width, as a fraction of the initial one: the field is zero there, but not below."""

FRONT = 1 << 13
"""Approximate number of columns processed together."""

DEPTHS = 2.0, 8.0
"""Depths below a ceiling, in column radii, that are probed for interior points."""

STARTS = 4
"""Number of the highest interior points kept."""

UNKNOWN = np.full((3, STARTS), np.nan)

PROBES = 64
"""Columns whose segment to the ceiling is probed."""

HEIGHTS = np.linspace(0, 1, 17)[1:-1, None]
"""Probed positions between an interior point and the ceiling, as fractions."""

ROUNDING = 4 * float(np.finfo(np.float32).eps)
"""Uncertainty of a float32 distance, as a fraction of the largest coordinate."""


@dataclass(frozen=True)
class FreeSpace:
    """Field queries: sign, and radius of a free ball.

    Attributes
    ----------
    kernel
        Kernel of the scene; its signs count.
    conservative
        Kernel to skip space by: its values divided by `lipschitz` are radii of free balls.
    lipschitz
        Lipschitz bound of `conservative`.
    far
        True if these radii are nearly maximal, from far away too.
    work
        Execution settings.
    """

    kernel: Kernel
    conservative: Kernel
    lipschitz: float
    far: bool
    work: Work

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Test points.

        Parameters
        ----------
        points
            Points, [3, n], scene units.

        Returns
        -------
        ndarray
            Mask of the interior points, bool [n].
        """
        found: np.ndarray = values_at(self.kernel, points, self.work) < 0
        return found

    def free(self, points: np.ndarray) -> np.ndarray:
        """Return radii of free balls.

        Parameters
        ----------
        points
            Centres, [3, n], scene units.

        Returns
        -------
        ndarray
            Radii, float64 [n], scene units; at most zero if no free ball is proven.
        """
        f = values_at(self.conservative, points, self.work).astype(np.float64)
        rounding = ROUNDING * np.abs(points).max(initial=0.0)
        return np.where(f > 0, f / self.lipschitz - rounding, 0.0)


@dataclass(eq=False)
class Side:
    """One side of the object within `region`. Heights are measured along `axis`, outwards by `sign`.

    Attributes
    ----------
    field
        Field queries.
    region
        Box to search, scene units.
    axis, sign
        Axis of the side, and -1 or 1 for its lower or upper side.
    best
        Highest interior points, [3, n], the highest first.
    known
        Height of the highest interior point.
    above
        Height that nothing is above.
    spent
        Columns processed.
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
        # Rows: centre of a column, width as a fraction of the initial one, ceiling.
        self.columns = np.vstack([middles, np.ones(cells.shape[1]), np.full(cells.shape[1], self.above)])

    def learn(self, points: np.ndarray) -> None:
        """Add interior points.

        Parameters
        ----------
        points
            Interior points, [3, n], scene units.
        """
        found = np.hstack([self.best, points])
        order = np.argsort(-self.sign * found[self.axis], kind="stable")  # NaN comes last
        self.best = found[:, order[:STARTS]]
        height = self.sign * float(self.tip[self.axis])
        self.known = -np.inf if np.isnan(height) else height

    @property
    def tip(self) -> np.ndarray:
        """Highest known interior point."""
        return self.best[:, 0]

    def guess(self, share: float, aim: float, most: int) -> None:
        """Search for tips with a reduced Lipschitz bound.

        Parameters
        ----------
        share
            Fraction of the Lipschitz bound.
        aim, most
            As for `prove`.
        """
        bold = replace(self.field, lipschitz=share * self.field.lipschitz)
        other = Side(bold, self.region, self.axis, self.sign, self.best)
        other.prove(aim, most)
        self.best = other.best

    def prove(self, aim: float, most: int) -> None:
        """Lower the ceilings and set `above`.

        Parameters
        ----------
        aim
            Allowed height of a ceiling above the highest interior point, scene units.
        most
            Number of columns to process at most.
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
        """Return a mask of the ceilings to lower.

        Parameters
        ----------
        columns
            Columns, [4, n].
        aim
            Allowed height of a ceiling above the highest interior point, scene units.

        Returns
        -------
        ndarray
            Mask, bool [n].
        """
        found: np.ndarray = columns[3] > max(self.known + aim, self.floor)
        return found

    def lowered(self, columns: np.ndarray, aim: float) -> np.ndarray:
        """Lower the ceilings of columns; split in four those not lowered much.

        Parameters
        ----------
        columns
            Columns, [4, n].
        aim
            Allowed height of a ceiling above the highest interior point, scene units.

        Returns
        -------
        ndarray
            New columns, [4, m].
        """
        self.spent += columns.shape[1]
        top, radius = columns[3], columns[2] * np.hypot(*self.half)
        lower = np.minimum(top, self.bottom(columns, radius, top))
        if self.field.far and np.isfinite(self.known):
            # From this height, a ball that spans the column comes within `aim` of a flat face.
            height = self.known + np.clip(radius**2 / aim, top - self.known, self.longest / 2)
            lower = np.minimum(lower, self.bottom(columns, radius, height))
        columns = np.vstack([columns[:3], lower])
        stuck = (top - lower < radius / 2) & self.high(columns, aim)
        self.probe(columns[:, stuck], radius[stuck])
        return np.hstack([columns[:, ~stuck], self.quarters(columns[:, stuck])])

    def bottom(self, columns: np.ndarray, radius: np.ndarray, heights: np.ndarray) -> np.ndarray:
        """Return the heights down to which free balls empty columns.

        Parameters
        ----------
        columns
            Columns, [4, n].
        radius
            Radii of the columns, [n], scene units.
        heights
            Heights of the balls' centres, [n], scene units.

        Returns
        -------
        ndarray
            Heights, [n], scene units; infinite where the ball does not span its column.
        """
        free = self.field.free(self.points(columns, heights))
        depth = np.sqrt(np.maximum(free**2 - radius**2, 0.0))
        return np.where(free > radius, heights - depth, np.inf)

    def probe(self, columns: np.ndarray, radius: np.ndarray) -> None:
        """Search for interior points slightly below the ceilings.

        From the highest ones found, the segments up to the ceilings are searched too.

        Parameters
        ----------
        columns
            Columns, [4, n].
        radius
            Radii of the columns, [n], scene units.
        """
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
        """Return points on the axes of columns.

        Parameters
        ----------
        columns
            Columns, [4, n].
        heights
            Heights, [n], scene units.

        Returns
        -------
        ndarray
            Points, float64 [3, n], scene units.
        """
        found = np.empty((3, columns.shape[1]))
        found[self.across], found[self.axis] = columns[:2], self.sign * heights
        return found

    def quarters(self, columns: np.ndarray) -> np.ndarray:
        """Split each column in four.

        Parameters
        ----------
        columns
            Columns, [4, n].

        Returns
        -------
        ndarray
            Columns, [4, 4 n].
        """
        corners = np.array([(-0.5, -0.5, 0.5, 0.5), (-0.5, 0.5, -0.5, 0.5)])[:, None]
        middles = columns[:2, :, None] + corners * self.half[:, None, None] * columns[2, :, None]
        widths, tops = np.repeat(columns[2] / 2, 4), np.repeat(columns[3], 4)
        return np.vstack([middles.reshape(2, -1), widths, tops])
