"""Numbers that differ from point to point: expressions in x, y and z, with a proved bound of their slope."""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
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
        found = _evaluated(self.text, *(np.linspace(low, high, CELLS + 1) for low, high in ends))
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
    "cos": "cos({})",
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


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Values on cells with their derivatives by x, y and z.

    `squares`: those whose sum of squares it is, up to a number that is not negative.
    """

    value: Interval
    slopes: tuple[Interval, ...]
    squares: tuple[_Slopes, ...] = ()

    def chained(self, value: Interval, slope: Interval | float) -> _Slopes:
        """A function of it, of this derivative."""
        return _Slopes(value, tuple(s * slope for s in self.slopes))

    def __neg__(self) -> _Slopes:
        return _Slopes(-self.value, tuple(-s for s in self.slopes))

    def __add__(self, other: _Slopes | float) -> _Slopes:
        if not isinstance(other, _Slopes):
            return _Slopes(self.value + other, self.slopes, self.squares if other >= 0 else ())
        both = self.squares + other.squares if self.squares and other.squares else ()
        return _Slopes(self.value + other.value, _pairwise(operator.add, self, other), both)

    __radd__ = __add__

    def __sub__(self, other: _Slopes | float) -> _Slopes:
        return self + -other

    def __rsub__(self, other: float) -> _Slopes:
        return -self + other

    def __mul__(self, other: _Slopes | float) -> _Slopes:
        if not isinstance(other, _Slopes):
            return self.chained(self.value * other, other)
        if other is self:
            square = self.chained(self.value * self.value, self.value * 2.0)
            return _Slopes(square.value, square.slopes, (self,))
        pairs = zip(self.slopes, other.slopes, strict=True)
        slopes = tuple(a * other.value + b * self.value for a, b in pairs)
        return _Slopes(self.value * other.value, slopes)

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
            first = _Slopes(root, _pairwise(operator.add, first, other))
        return _Slopes(root, first.slopes)

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
        return _Slopes(self.value.minimum(other.value), _pairwise(less.where, self, other))

    def _constant(self, number: float) -> _Slopes:
        return _Slopes(self.value.number(number), tuple(s.number(0.0) for s in self.slopes))


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


def _evaluated(text: str, *edges: NDArray[np.float64]) -> _Slopes:
    """Values and slopes of an expression on the cells between edges along each axis."""
    low, high = (np.meshgrid(*(e[part] for e in edges)) for part in (slice(None, -1), slice(1, None)))
    sides = [Interval(a.ravel(), b.ravel(), ARRAYS) for a, b in zip(low, high, strict=True)]
    zero, one = (Interval.at(np.full(low[0].size, number), ARRAYS, number) for number in (0.0, 1.0))
    units = [tuple(one if k == axis else zero for k in range(3)) for axis in range(3)]
    point = [_Slopes(side, slopes) for side, slopes in zip(sides, units, strict=True)]
    with np.errstate(all="ignore"):
        found: _Slopes = _evaluator(formula(_function(text)), *point)
    return found


@lru_cache(maxsize=256)
def _slope(text: str) -> float:
    far = 2.0 ** np.arange(NEAREST, FARTHEST + 1)
    edges = np.concatenate([-far[::-1], [0.0], far])
    try:
        slopes = _evaluated(text, edges, edges, edges).slopes
    except (KeyError, TypeError, AttributeError):  # what jumps, such as floor, has no slopes here
        return float("inf")
    steepest = [np.minimum(np.maximum(-s.lo, s.hi), 1e100) for s in slopes]
    return float(np.linalg.norm(steepest, axis=0).max() * (1 + 1e-12))
