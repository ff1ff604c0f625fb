"""Axis-aligned boxes, possibly infinite or empty: where a field can be negative."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """The box ``lo <= p <= hi``. Empty if ``lo > hi`` on any axis."""

    lo: Triple
    hi: Triple

    @classmethod
    def centred(cls, x: float, y: float | None = None, z: float | None = None) -> Box:
        """The box of half sizes x, y, z around the origin; a cube if only x is given."""
        half = (x, x if y is None else y, x if z is None else z)
        return cls((-half[0], -half[1], -half[2]), half)

    @classmethod
    def everywhere(cls) -> Box:
        return cls.centred(math.inf)

    @classmethod
    def around(cls, points: Iterable[Triple]) -> Box:
        axes = list(zip(*points, strict=True))
        return cls(_triple(min(a) for a in axes), _triple(max(a) for a in axes))

    @property
    def empty(self) -> bool:
        return any(a > b for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def finite(self) -> bool:
        return all(map(math.isfinite, self.lo + self.hi))

    @property
    def size(self) -> Triple:
        return _triple(b - a for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def centre(self) -> Triple:
        return _triple((a + b) / 2 for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def corners(self) -> list[Triple]:
        return [_triple(corner) for corner in product(*zip(self.lo, self.hi, strict=True))]

    def __or__(self, other: Box) -> Box:
        if self.empty or other.empty:
            return other if self.empty else self
        return Box(_triple(map(min, self.lo, other.lo)), _triple(map(max, self.hi, other.hi)))

    def __and__(self, other: Box) -> Box:
        return Box(_triple(map(max, self.lo, other.lo)), _triple(map(min, self.hi, other.hi)))

    def grown(self, by: float) -> Box:
        return Box(_triple(a - by for a in self.lo), _triple(b + by for b in self.hi))

    def about(self, middle: Triple) -> Box:
        """The smallest box with this middle that encloses it."""
        half = [max(m - a, b - m) for m, a, b in zip(middle, self.lo, self.hi, strict=True)]
        lo, hi = (_triple(m + s * h for m, h in zip(middle, half, strict=True)) for s in (-1, 1))
        return Box(lo, hi)

    def radius(self, *axes: int) -> float:
        """The greatest distance from the line or point where all `axes` are zero (default: the origin)."""
        if self.empty:
            return 0.0
        return math.hypot(*(max(abs(self.lo[a]), abs(self.hi[a])) for a in axes or (0, 1, 2)))


def _triple(values: Iterable[float]) -> Triple:
    x, y, z = values
    return x, y, z
