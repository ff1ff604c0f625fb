"""Numbers that differ from point to point: expressions in x, y and z, with a proved bound of their slope."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, reduce
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.parameters import Number, short_repr
from ..errors import SceneError
from ..expr.frontend import formula
from ..expr.graph import Evaluator
from ..expr.intervals import ARRAYS, Interval
from ..expr.language import OfPoint
from .box import Box
from .definitions import Definition
from .definitions import formula as defined

FARTHEST, NEAREST, STEEPEST = 30, -5, 100.0
"""Space is proved in cells between powers of 2, of these exponents, on both sides of 0; steepest slope."""
CELLS = 24
"""Cells along each side of a box."""
ROUNDS, FEW = 24, 1 << 11
"""How often the steepest cells are halved, and how many at once."""


@dataclass(frozen=True)
class Varying:
    """A number that an expression in x, y and z gives."""

    text: str

    def __repr__(self) -> str:
        return repr(self.text)

    def times(self, factor: float) -> Varying:
        """The product with a number."""
        return Varying(f"({self.text}) * {factor!r}")

    def at_least(self, least: float) -> Varying:
        """The number, or another one where it is less."""
        return Varying(f"max({self.text}, {least!r})")

    @property
    def argument(self) -> OfPoint:
        """Argument of a kernel."""
        return OfPoint(_function(self.text))

    @property
    def slope(self) -> float:
        """Bound of the length of its gradient, proved by intervals on cells that fill space."""
        return _slope(self.text)

    def most(self, box: Box) -> float:
        """Bound of its values in a box."""
        ends = zip(np.clip(box.lo, -(2.0**FARTHEST), None), np.clip(box.hi, None, 2.0**FARTHEST), strict=True)
        found = _on_cells(self.text, *_between(*(np.linspace(*end, CELLS + 1) for end in ends)))
        return float(found.value.hi.max())


@dataclass(frozen=True)
class Variable(Number):
    """Kind of a number, or of an expression that gives one at each point."""

    annotation: ClassVar[Any] = float | str | Callable[..., Any]

    @property
    def expects(self) -> str:
        return f"{super().expects}, or an expression such as 0.1+0.02*z"

    def read(self, text: str) -> Any:
        try:
            float(text)
        except ValueError:
            return self.check(text)
        return super().read(text)

    def check(self, value: Any) -> Any:
        if isinstance(value, Varying) or not (isinstance(value, str) or callable(value)):
            return value if isinstance(value, Varying) else super().check(value)
        try:
            return _checked(" ".join(value.split()) if isinstance(value, str) else _followed(value))
        except ValueError as error:
            raise ValueError(f"{self.expects}: {error}") from None

    def text(self, value: Any) -> str:
        return value.text if isinstance(value, Varying) else super().text(value)


def as_argument(value: float | Varying) -> Any:
    """Argument of a kernel for a value of a variable."""
    return value.argument if isinstance(value, Varying) else value


def slope_of(value: float | Varying) -> float:
    """Bound of the slope of a value of a variable."""
    return value.slope if isinstance(value, Varying) else 0.0


@lru_cache(maxsize=256)
def _checked(text: str) -> Varying:
    """Value of an expression. Raises `ValueError` with what is wrong."""
    try:
        _function(text)
    except SceneError as error:
        reason = str(error).partition(": ")[2].partition("; ")[0]
        raise ValueError(reason if len(reason) < 80 else f"{reason[:77]}...") from None
    if not _slope(text) < STEEPEST:
        raise ValueError("its slope has no bound, as that of min(..., 1) may have")
    return Varying(text)


@lru_cache(maxsize=256)
def _function(text: str) -> Callable[..., Any]:
    """Function of x, y and z that an expression is."""
    return defined(Definition("number", (), f"return {text}", "distance")).function


class Point(NamedTuple):
    """What a function of a point is called with, to follow what it does."""

    x: Quantity
    y: Quantity
    z: Quantity


_UFUNCS = {
    "add": "({} + {})", "subtract": "({} - {})", "multiply": "({} * {})", "divide": "({} / {})",
    "negative": "(-{})", "square": "({0} * {0})", "absolute": "abs({})", "minimum": "min({}, {})",
    "maximum": "max({}, {})", "sqrt": "sqrt({})", "exp": "exp({})", "log": "log({})", "sin": "sin({})",
    "cos": "cos({})", "hypot": "sqrt({} ** 2 + {} ** 2)",
}  # fmt: skip


@dataclass(frozen=True)
class Quantity(np.lib.mixins.NDArrayOperatorsMixin):
    """Text of a number; operators and functions of NumPy make the text of their result."""

    text: str

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *given: Any, **settings: Any) -> Any:
        if ufunc is np.power and isinstance(given[0], Quantity):
            return Quantity(f"({given[0].text} ** {given[1]!r})")
        if method != "__call__" or settings or ufunc.__name__ not in _UFUNCS:
            return NotImplemented
        texts = (v.text if isinstance(v, Quantity) else repr(float(v)) for v in given)
        return Quantity(_UFUNCS[ufunc.__name__].format(*texts))


def _followed(function: Callable[..., Any]) -> str:
    """Expression of a function of a point."""
    try:
        found = function(Point(Quantity("x"), Quantity("y"), Quantity("z")))
    except Exception as error:
        raise ValueError(f"of a point, +, -, *, / and functions of NumPy make it; {error}") from None
    if not isinstance(found, Quantity):
        raise ValueError(f"the function returns {short_repr(found)}, which does not depend on the point")
    return found.text


HUGE = 1e100
"""Largest bound of a slope, or value of a factor of one."""


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Values on cells with their derivatives by x, y and z.

    `steepest`: bound of the length of the gradient that follows from the operation; `squares`: those whose
    sum of squares the value is, up to a number that is not negative; `multiple`: another one, and how many
    times that the value is.
    """

    value: Interval
    slopes: tuple[Interval, ...]
    steepest: NDArray[np.float64]
    squares: tuple[_Slopes, ...] = ()
    multiple: tuple[_Slopes, float] | None = None

    @cached_property
    def length(self) -> NDArray[np.float64]:
        """Bound of the length of the gradient."""
        length = np.linalg.norm([_most(s) for s in self.slopes], axis=0)
        bound: NDArray[np.float64] = np.fmin(length, self.steepest)
        return bound

    def along(self, other: _Slopes) -> NDArray[np.float64]:
        """Bound of the product of the lengths of both gradients with the cosine of the angle between."""
        products = (a * b for a, b in zip(self.slopes, other.slopes, strict=True))
        whole = reduce(operator.add, products)
        bound: NDArray[np.float64] = np.fmin(_most(whole), self.length * other.length)
        return bound

    def times(self, factor: float) -> _Slopes:
        """The product with a number."""
        made = self.chained(self.value * factor, factor)
        squares = tuple(s.times(math.sqrt(factor)) for s in self.squares) if factor >= 0 else ()
        of, often = self.multiple or (self, 1.0)
        return replace(made, squares=squares, multiple=(of, often * factor))

    def chained(self, value: Interval, slope: Interval | float) -> _Slopes:
        """A function of it, of this derivative."""
        steepest = self.length * (_most(slope) if isinstance(slope, Interval) else abs(slope))
        return _Slopes(value, tuple(s * slope for s in self.slopes), steepest)

    def __neg__(self) -> _Slopes:
        return self.times(-1.0)

    def __add__(self, other: _Slopes | float) -> _Slopes:
        if not isinstance(other, _Slopes):
            squares = self.squares if other >= 0 else ()
            return _Slopes(self.value + other, self.slopes, self.steepest, squares)
        both = self.squares + other.squares if self.squares and other.squares else ()
        steepest = np.sqrt(self.length**2 + other.length**2 + 2 * self.along(other))
        return _Slopes(self.value + other.value, _pairwise(operator.add, self, other), steepest, both)

    __radd__ = __add__

    def __sub__(self, other: _Slopes | float) -> _Slopes:
        return self + -other

    def __rsub__(self, other: float) -> _Slopes:
        return -self + other

    def __mul__(self, other: _Slopes | float) -> _Slopes:
        if not isinstance(other, _Slopes):
            return self.times(other)
        (of, often), (same, again) = self.multiple or (self, 1.0), other.multiple or (other, 1.0)
        if of is same:
            square = replace(of.chained(of.value * of.value, of.value * 2.0), squares=(of,))
            return square.times(often * again)
        pairs = zip(self.slopes, other.slopes, strict=True)
        slopes = tuple(a * other.value + b * self.value for a, b in pairs)
        one, two = _most(self.value), _most(other.value)
        squares = (two * self.length) ** 2 + (one * other.length) ** 2
        steepest = np.sqrt(squares + 2 * one * two * self.along(other))
        return _Slopes(self.value * other.value, slopes, steepest)

    __rmul__ = __mul__

    def __truediv__(self, other: _Slopes | float) -> _Slopes:
        return self * (other.inverse() if isinstance(other, _Slopes) else 1.0 / other)

    def __rtruediv__(self, other: float) -> _Slopes:
        return self.inverse() * other

    def inverse(self) -> _Slopes:
        """Reciprocal."""
        inverse = 1.0 / self.value
        return self.chained(inverse, -(inverse * inverse))

    def sqrt(self) -> _Slopes:
        """Square root; of a sum of squares, a length, whose derivative is bounded at 0, too."""
        root = self.value.sqrt()
        if not self.squares:
            return self.chained(root, 0.5 / root)
        parts = [(part, (part.value / root).maximum(-1.0).minimum(1.0)) for part in self.squares]
        first, *rest = (part.chained(part.value, ratio) for part, ratio in parts)
        for other in rest:
            first = _Slopes(root, _pairwise(operator.add, first, other), first.steepest)
        return _Slopes(root, first.slopes, _stretch(self.squares))

    def rsqrt(self) -> _Slopes:
        """Reciprocal of the square root."""
        return self.sqrt().inverse()

    def ratio(self, other: _Slopes | float) -> _Slopes:
        """Quotient."""
        return self / other

    def exp(self) -> _Slopes:
        """Exponential."""
        return self.chained(self.value.exp(), self.value.exp())

    def log(self) -> _Slopes:
        """Logarithm."""
        return self.chained(self.value.log(), 1.0 / self.value)

    def sin(self) -> _Slopes:
        """Sine."""
        return self.chained(self.value.sin(), self.value.cos())

    def cos(self) -> _Slopes:
        """Cosine."""
        return self.chained(self.value.cos(), -self.value.sin())

    def absolute(self) -> _Slopes:
        """Absolute value."""
        return self.maximum(-self)

    def maximum(self, other: _Slopes | float) -> _Slopes:
        """The larger of two; where either may be, the slopes of both."""
        return -(-self).minimum(-other)

    def minimum(self, other: _Slopes | float) -> _Slopes:
        """The smaller of two; where either may be, the slopes of both."""
        other = other if isinstance(other, _Slopes) else self._constant(other)
        less = self.value <= other.value
        either = np.where(less.may, np.maximum(self.length, other.length), other.length)
        steepest = np.where(less.must, self.length, either)
        return _Slopes(self.value.minimum(other.value), _pairwise(less.where, self, other), steepest)

    def _constant(self, number: float) -> _Slopes:
        zero = tuple(s.number(0.0) for s in self.slopes)
        return _Slopes(self.value.number(number), zero, np.zeros_like(self.steepest))


def _most(value: Interval) -> NDArray[np.float64]:
    """Largest magnitude on each cell."""
    most: NDArray[np.float64] = np.minimum(np.maximum(-value.lo, value.hi), HUGE)
    return most


def _stretch(parts: tuple[_Slopes, ...]) -> NDArray[np.float64]:
    """Bound of the slope of a radius in these coordinates, and so of the norm of their Jacobian J: its square
    is the norm of J times its transpose, which is at most the largest sum of a row.
    """
    rows = [
        np.sum([one.length**2 if one is other else one.along(other) for other in parts], axis=0)
        for one in parts
    ]
    bound: NDArray[np.float64] = np.sqrt(np.max(rows, axis=0))
    return bound


def _pairwise(function: Callable[..., Interval], a: _Slopes, b: _Slopes) -> tuple[Interval, ...]:
    return tuple(map(function, a.slopes, b.slopes))


def _operation(name: str) -> Callable[..., Any]:
    """A function of the vocabulary on values with slopes, in any place."""

    def function(*given: Any) -> Any:
        known = next((v for v in given if isinstance(v, _Slopes)), None)
        if known is None:
            return getattr(np, {"absolute": "abs"}.get(name, name))(*given)
        first, *rest = (v if isinstance(v, _Slopes) else known._constant(v) for v in given)
        return getattr(first, name)(*rest)

    return function


_CONTINUOUS = ("sqrt", "rsqrt", "ratio", "log", "exp", "sin", "cos", "minimum", "maximum", "absolute")
_evaluator = Evaluator({name: _operation(name) for name in _CONTINUOUS})


def _between(*edges: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners [3, n] of the cells between edges along each axis."""
    low, high = (np.meshgrid(*(e[part] for e in edges)) for part in (slice(None, -1), slice(1, None)))
    return np.array(low).reshape(3, -1), np.array(high).reshape(3, -1)


def _on_cells(text: str, low: NDArray[np.float64], high: NDArray[np.float64]) -> _Slopes:
    """Values and slopes of an expression on cells between corners [3, n]."""
    sides = [Interval(a, b, ARRAYS) for a, b in zip(low, high, strict=True)]
    ones = np.ones(low.shape[1])
    zero, one = (Interval.at(number * ones, ARRAYS, number) for number in (0.0, 1.0))
    units = [tuple(one if k == axis else zero for k in range(3)) for axis in range(3)]
    point = [_Slopes(side, slopes, ones) for side, slopes in zip(sides, units, strict=True)]
    with np.errstate(all="ignore"):
        found: _Slopes = _evaluator(formula(_function(text)), *point)
    return found


@lru_cache(maxsize=256)
def _slope(text: str) -> float:
    far = 2.0 ** np.arange(NEAREST, FARTHEST + 1)
    edges = np.concatenate([-far[::-1], [0.0], far])
    used = [edges if re.search(rf"\b{name}\b", text) else edges[[0, -1]] for name in "xyz"]
    low, high = _between(*used)
    try:
        slopes = _on_cells(text, low, high).length
        for _ in range(ROUNDS):
            # The steepest cells, if they are few, are halved along each axis.
            steep = slopes > 0.97 * slopes.max()
            if not 0 < steep.sum() <= FEW:
                break
            parts = _halves(low[:, steep], high[:, steep])
            slopes = np.append(slopes[~steep], _on_cells(text, *parts).length)
            low, high = (np.append(a[:, ~steep], b, 1) for a, b in zip((low, high), parts, strict=True))
    except (KeyError, TypeError, AttributeError):  # what jumps, such as floor, has no slopes here
        return float("inf")
    return float(slopes.max() * (1 + 1e-12))


def _halves(low: NDArray[np.float64], high: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Corners of the eight parts of cells, each [3, 8 n]."""
    middle = (low + high) / 2
    which = [[side >> axis & 1 for axis in range(3)] for side in range(8)]
    begins = [np.where(np.array(upper)[:, None], middle, low) for upper in which]
    ends = [np.where(np.array(upper)[:, None], high, middle) for upper in which]
    return np.concatenate(begins, 1), np.concatenate(ends, 1)
