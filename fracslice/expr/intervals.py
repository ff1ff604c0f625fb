"""Interval arithmetic on lanes and on NumPy arrays: enclosures of values over a cell.

Every bound is moved outwards by a unit in the last place or more, so that an interval encloses the exact
result and the rounded one of the same precision, fused or not (Moore 1966, "Interval Analysis"). Magnitudes
beyond `Numbers.huge` count as that; underflow is not enclosed, so that a bound below `Numbers.tiny` has no
sign. Conditions become a `Possible`: a pair of masks. Where a condition holds in a part of a cell only,
`where` returns the hull of both values.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from . import vocabulary
from .graph import ON_ARRAYS, Evaluator

Bound = Any
"""Lanes or NumPy array."""


TINY = {32: 1e-36, 64: 1e-290}
"""Smallest magnitude that has a sign, by the width of floats."""


@dataclass(frozen=True)
class Numbers:
    """Kind of the bounds."""

    functions: Any  # module with the functions of the vocabulary
    unit: float  # distance from 1 to the next number
    huge: float  # largest magnitude, and the smallest that has a sign
    tiny: float
    # function of a bound and a number that returns the number in the form of the bound
    constant: Callable[[Bound, float], Bound]


ARRAYS = Numbers(vocabulary, 2.0**-52, 1e300, TINY[64], np.full_like)


ROUNDED = 16
"""Errors of the elementary functions, units in the last place; the tests hold them to less."""

LONGEST = 4096.0
"""Largest argument of sine and cosine; the interval of a larger one is [-1, 1]."""


@dataclass(frozen=True, eq=False)
class Possible:
    """Condition on the points of a cell."""

    must: Any  # masks: it holds at all points; it can hold at one
    may: Any

    __array_ufunc__ = None  # makes NumPy defer to these operators

    def __and__(self, other: Possible) -> Possible:
        return Possible(self.must & other.must, self.may & other.may)

    def __or__(self, other: Possible) -> Possible:
        return Possible(self.must | other.must, self.may | other.may)

    def __invert__(self) -> Possible:
        return Possible(~self.may, ~self.must)

    def where(self, yes: Interval, no: Interval) -> Interval:
        """Hull of the values that points of the cell have."""
        choose = yes.of.functions.where
        low = choose(self.must, yes.lo, choose(self.may, yes.of.functions.minimum(yes.lo, no.lo), no.lo))
        high = choose(self.must, yes.hi, choose(self.may, yes.of.functions.maximum(yes.hi, no.hi), no.hi))
        return Interval(low, high, yes.of)


@dataclass(frozen=True, eq=False)
class Interval:
    """Closed intervals, one for each lane or element, with Python's operators and the vocabulary as
    methods.
    """

    lo: Bound  # bounds
    hi: Bound
    of: Numbers  # kind of the bounds
    known: float | None = None  # the number that all of them are, if it is known

    __array_ufunc__ = None  # makes NumPy defer to these operators

    @classmethod
    def at(cls, value: Bound, of: Numbers, known: float | None = None) -> Interval:
        """Interval of one value, which may be infinite."""
        within = cls(value, value, of, known)
        if known is not None and abs(known) <= of.huge:
            return within
        limited = within._limited().lo
        return cls(limited, limited, of, known)

    @property
    def single(self) -> bool:
        """True if both bounds are the same value."""
        return self.lo is self.hi

    def _like(self, number: float) -> Bound:
        """Constant in the form of the bounds."""
        return self.of.constant(self.lo, number)

    def number(self, value: Interval | float) -> Interval:
        """Interval of a number; an interval unchanged."""
        if isinstance(value, Interval):
            return value
        return Interval.at(self._like(value), self.of, float(value))

    def outward(self, units: float = 1.0) -> Interval:
        """Interval with its bounds moved outwards by units in the last place."""
        absolute, by = self.of.functions.absolute, units * self.of.unit
        return Interval(self.lo - absolute(self.lo) * by, self.hi + absolute(self.hi) * by, self.of)

    def cell_middle(self) -> Interval:
        """See `vocabulary.cell_middle`."""
        centre = self.lo * self._like(0.5) + self.hi * self._like(0.5)
        return Interval(centre, centre, self.of)

    def cell_extent(self) -> Interval:
        """See `vocabulary.cell_extent`."""
        centre = self.cell_middle().lo
        reach = self.of.functions.maximum(centre - self.lo, self.hi - centre)
        return Interval(reach, reach, self.of).outward()

    def _limited(self) -> Interval:
        """Interval with finite bounds."""
        lesser, greater, huge = self.of.functions.minimum, self.of.functions.maximum, self._like(self.of.huge)
        low, high = (lesser(greater(bound, -huge), huge) for bound in (self.lo, self.hi))
        return Interval(low, high, self.of)

    # --- arithmetic ---
    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo, self.of, None if self.known is None else -self.known)

    def __add__(self, other: Interval | float) -> Interval:
        other = self.number(other)
        return Interval(self.lo + other.lo, self.hi + other.hi, self.of).outward()

    def __sub__(self, other: Interval | float) -> Interval:
        other = self.number(other)
        return Interval(self.lo - other.hi, self.hi - other.lo, self.of).outward()

    def __rsub__(self, other: float) -> Interval:
        return self.number(other) - self

    def __mul__(self, other: Interval | float) -> Interval:
        other = self.number(other)
        if other is self:
            size = self.absolute()
            return Interval(size.lo * size.lo, size.hi * size.hi, self.of)._limited().outward()
        for factor, value in ((self, other), (other, self)):
            if factor.known is not None:
                return value._scaled(factor)
        lesser, greater = self.of.functions.minimum, self.of.functions.maximum
        p, q = self.lo * other.lo, self.hi * other.hi
        low, high = lesser(p, q), greater(p, q)
        if not (self.single or other.single):
            r, s = self.lo * other.hi, self.hi * other.lo
            low, high = lesser(low, lesser(r, s)), greater(high, greater(r, s))
        return Interval(low, high, self.of)._limited().outward()

    def _scaled(self, factor: Interval) -> Interval:
        """Product with a known number; that with a power of two is exact."""
        assert factor.known is not None
        low, high = self.lo * factor.lo, self.hi * factor.lo
        if factor.known < 0:
            low, high = high, low
        exact = math.frexp(factor.known)[0] in (0.0, 0.5, -0.5)
        scaled = Interval(low, high, self.of)._limited()
        return scaled if exact else scaled.outward()

    def __truediv__(self, other: Interval | float) -> Interval:
        other = self.number(other)
        return self * other._inverse()

    def __rtruediv__(self, other: float) -> Interval:
        return self.number(other) / self

    def _inverse(self) -> Interval:
        """Reciprocal; all numbers where the interval contains zero."""
        choose, huge, one = self.of.functions.where, self._like(self.of.huge), self._like(1.0)
        signed = (self.lo > self.of.tiny) | (self.hi < -self.of.tiny)
        low, high = (one / choose(signed, end, one) for end in (self.hi, self.lo))
        inverse = Interval(low, high, self.of).outward()
        return Interval(choose(signed, inverse.lo, -huge), choose(signed, inverse.hi, huge), self.of)

    # --- conditions ---
    def __lt__(self, other: Interval | float) -> Possible:
        other = self.number(other)
        return Possible(self.hi < other.lo, ~(self.lo >= other.hi))

    def __le__(self, other: Interval | float) -> Possible:
        other = self.number(other)
        return Possible(self.hi <= other.lo, ~(self.lo > other.hi))

    def __gt__(self, other: Interval | float) -> Possible:
        return self.number(other) < self

    def __ge__(self, other: Interval | float) -> Possible:
        return self.number(other) <= self

    def __eq__(self, other: object) -> Possible:  # type: ignore[override]
        least, most = self <= other, self >= other  # type: ignore[operator]
        return least & most

    def __ne__(self, other: object) -> Possible:  # type: ignore[override]
        return ~(self == other)

    # --- the vocabulary ---
    __rmul__, __radd__ = __mul__, __add__

    def minimum(self, other: Interval | float) -> Interval:
        """See `vocabulary.minimum`."""
        other, lesser = self.number(other), self.of.functions.minimum
        return Interval(lesser(self.lo, other.lo), lesser(self.hi, other.hi), self.of)

    def maximum(self, other: Interval | float) -> Interval:
        """See `vocabulary.maximum`."""
        other, greater = self.number(other), self.of.functions.maximum
        return Interval(greater(self.lo, other.lo), greater(self.hi, other.hi), self.of)

    def absolute(self) -> Interval:
        """See `vocabulary.absolute`."""
        greater = self.of.functions.maximum
        low = greater(greater(self.lo, -self.hi), self._like(0.0))
        return Interval(low, greater(-self.lo, self.hi), self.of)

    def floor(self) -> Interval:
        """See `vocabulary.floor`."""
        return Interval(self.of.functions.floor(self.lo), self.of.functions.floor(self.hi), self.of)

    def sqrt(self) -> Interval:
        """See `vocabulary.sqrt`; that of a negative number counts as 0."""
        value = self.maximum(0.0)
        root = self.of.functions.sqrt
        return Interval(root(value.lo), root(value.hi), self.of).outward()

    def rsqrt(self) -> Interval:
        """See `vocabulary.rsqrt`."""
        return self.sqrt()._inverse()._widened()

    def ratio(self, other: Interval | float) -> Interval:
        """See `vocabulary.ratio`."""
        return self / other

    def exp(self) -> Interval:
        """See `vocabulary.exp`."""
        choose, low = self.of.functions.where, -0.9 * math.log(1 / self.of.tiny)
        image = self._each(self.of.functions.exp)._limited()
        return Interval(choose(self.lo > low, image.lo, self._like(0.0)), image.hi, self.of)

    def log(self) -> Interval:
        """See `vocabulary.log`."""
        choose, least = self.of.functions.where, self._like(self.of.tiny)
        image = self.maximum(self.of.tiny)._each(self.of.functions.log)
        none = self._like(-self.of.huge)
        return Interval(choose(self.lo > least, image.lo, none), image.hi, self.of)

    def sin(self) -> Interval:
        """See `vocabulary.sin`."""
        return self._wave(self.of.functions.sin, 0.5)

    def cos(self) -> Interval:
        """See `vocabulary.cos`."""
        return self._wave(self.of.functions.cos, 0.0)

    def atan2(self, x: Interval | float) -> Interval:
        """See `vocabulary.atan2`: extremes are at corners of a box that the cut from the origin misses."""
        x = self.number(x)
        choose, angle, pi = self.of.functions.where, self.of.functions.atan2, self._like(math.pi)
        corners = [angle(b, a) for b in (self.lo, self.hi) for a in (x.lo, x.hi)]
        lesser, greater = self.of.functions.minimum, self.of.functions.maximum
        low = lesser(lesser(corners[0], corners[1]), lesser(corners[2], corners[3]))
        high = greater(greater(corners[0], corners[1]), greater(corners[2], corners[3]))
        cut = (x.lo <= self.of.tiny) & (self.lo <= self.of.tiny) & (self.hi >= -self.of.tiny)
        return Interval(choose(cut, -pi, low), choose(cut, pi, high), self.of)._widened()

    def _each(self, function: Callable[[Bound], Bound]) -> Interval:
        """Image under an increasing elementary function."""
        return Interval(function(self.lo), function(self.hi), self.of)._widened()

    def _widened(self) -> Interval:
        """Interval that encloses errors of elementary functions."""
        by = ROUNDED * self.of.unit
        wider = self.outward(ROUNDED)
        return Interval(wider.lo - by, wider.hi + by, self.of)

    def _wave(self, function: Callable[[Bound], Bound], shift: float) -> Interval:
        """Image under a wave with maxima at ``2 pi k + shift pi`` and minima between."""
        m, one = self.of.functions, self._like(1.0)
        turns = (self * (1 / math.pi) - shift)._widened()
        first, last = m.floor(turns.lo), m.floor(turns.hi)
        least, most = m.minimum(self.lo, self._like(LONGEST)), m.maximum(self.hi, self._like(-LONGEST))
        ends = [function(end) for end in (m.maximum(least, -one * LONGEST), m.minimum(most, one * LONGEST))]
        image = Interval(m.minimum(*ends), m.maximum(*ends), self.of)._widened()
        top = last * 0.5 - m.floor(last * 0.5) < 0.25
        all_of = (last - first > 1.5) | (self.lo < -LONGEST) | (self.hi > LONGEST)
        some = last - first > 0.5
        high = m.where(all_of | (some & top), one, m.minimum(image.hi, one))
        low = m.where(all_of | (some & ~top), -one, m.maximum(image.lo, -one))
        return Interval(low, high, self.of)


def enclosed(distance: Callable[..., Bound], *sides: Interval) -> Interval:
    """Values on cells of a function of points that is a distance: its L is 1."""
    of, extents = sides[0].of, [side.cell_extent() for side in sides]
    reach = reduce(operator.add, (a * a for a in extents)).sqrt()
    value = distance(*(side.cell_middle().lo for side in sides))
    around = Interval(value, value, of).outward()
    return Interval((around - reach).lo, (around + reach).hi, of)


def on_cells(name: str) -> Callable[..., Any]:
    """Return a function of the vocabulary for NumPy that takes intervals, too."""
    plain = getattr(vocabulary, name)

    def function(first: Any, *others: Any) -> Any:
        if name == "any_of" and isinstance(first, Possible):
            return bool(first.may.any())
        given = (first, *others)
        if not any(isinstance(v, (Interval, Possible)) for v in given):
            return plain(*given)
        if name == "where":
            yes, no = map(_on_arrays, others)
            return (first if isinstance(first, Possible) else Possible(first, first)).where(yes, no)
        return getattr(_on_arrays(first), name)(*others)

    return function


def _on_arrays(value: Any) -> Interval:
    """Interval of numbers; an interval unchanged."""
    return value if isinstance(value, Interval) else Interval.at(np.asarray(value, np.float64), ARRAYS)


ON_CELLS: Mapping[str, Callable[..., Any]] = {name: on_cells(name) for name in ON_ARRAYS}
"""The vocabulary on intervals."""

evaluate_on_cells = Evaluator(ON_CELLS)
"""Evaluates a function of the language on intervals."""
