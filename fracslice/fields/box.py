"""Axis-aligned boxes, possibly infinite or empty, that bound the region where a field can be negative."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

from ..common.parameters import Triple as Triple


@dataclass(frozen=True)
class Box:
    """The box ``lo <= p <= hi``, empty if ``lo > hi`` on any axis.

    Attributes
    ----------
    lo, hi : (float, float, float)
        Opposite corners, scene units; infinite along an unbounded axis.
    """

    lo: Triple
    hi: Triple

    @classmethod
    def centred(cls, x: float, y: float | None = None, z: float | None = None) -> Box:
        """Box centred at the origin.

        Parameters
        ----------
        x : float
            Half size along x.
        y, z : float, optional
            Half sizes along y and z; x by default.

        Returns
        -------
        Box
        """
        half = (x, x if y is None else y, x if z is None else z)
        return cls((-half[0], -half[1], -half[2]), half)

    @classmethod
    def everywhere(cls) -> Box:
        """Box of all space.

        Returns
        -------
        Box
        """
        return cls.centred(math.inf)

    @classmethod
    def around(cls, points: Iterable[Triple]) -> Box:
        """Bounding box of points.

        Parameters
        ----------
        points : iterable of (float, float, float)
            At least one point.

        Returns
        -------
        Box
        """
        axes = list(zip(*points, strict=True))
        return cls(_triple(min(a) for a in axes), _triple(max(a) for a in axes))

    @property
    def empty(self) -> bool:
        """True if the box holds no points."""
        return any(a > b for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def finite(self) -> bool:
        """True if both corners are finite."""
        return all(map(math.isfinite, self.lo + self.hi))

    @property
    def size(self) -> Triple:
        """Edge lengths along x, y and z."""
        return _triple(b - a for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def centre(self) -> Triple:
        """Centre of the box."""
        return _triple((a + b) / 2 for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def corners(self) -> list[Triple]:
        """The eight corners."""
        return [_triple(corner) for corner in product(*zip(self.lo, self.hi, strict=True))]

    def __or__(self, other: Box) -> Box:
        """Smallest box that encloses both."""
        if self.empty or other.empty:
            return other if self.empty else self
        return Box(_triple(map(min, self.lo, other.lo)), _triple(map(max, self.hi, other.hi)))

    def __and__(self, other: Box) -> Box:
        """Intersection of both."""
        return Box(_triple(map(max, self.lo, other.lo)), _triple(map(min, self.hi, other.hi)))

    def grown(self, by: float) -> Box:
        """Box with every face moved outwards.

        Parameters
        ----------
        by : float
            Distance, scene units; negative to move the faces inwards.

        Returns
        -------
        Box
        """
        return Box(_triple(a - by for a in self.lo), _triple(b + by for b in self.hi))

    def about(self, middle: Triple) -> Box:
        """Smallest box with the given centre that encloses this box.

        Parameters
        ----------
        middle : (float, float, float)
            The centre.

        Returns
        -------
        Box
        """
        half = [max(m - a, b - m) for m, a, b in zip(middle, self.lo, self.hi, strict=True)]
        lo, hi = (_triple(m + s * h for m, h in zip(middle, half, strict=True)) for s in (-1, 1))
        return Box(lo, hi)

    def radius(self, *axes: int) -> float:
        """Largest distance of a point of the box from the subspace where the given coordinates are zero.

        Parameters
        ----------
        *axes : int
            Coordinates, 0 to 2: two give the distance from a line; none, from the origin.

        Returns
        -------
        float
            0 for an empty box.
        """
        if self.empty:
            return 0.0
        return math.hypot(*(max(abs(self.lo[a]), abs(self.hi[a])) for a in axes or (0, 1, 2)))


def _triple(values: Iterable[float]) -> Triple:
    x, y, z = values
    return x, y, z


Axis = Literal["x", "y", "z"]
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def direction(axis: Any) -> tuple[Any, ...]:
    """Direction of an axis that is given by a letter or by three numbers."""
    if isinstance(axis, str):
        return AXES.get(axis, (axis,))
    return tuple(axis) if hasattr(axis, "__len__") else (axis,)


def three(value: Any) -> Any:
    """One value for each axis."""
    return value if hasattr(value, "__len__") else (value,) * 3
