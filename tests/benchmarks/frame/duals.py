"""A field's exact gradient by forward differentiation: every number carries its three derivatives along.

Clifford 1873's dual numbers, as Wengert 1964 computes with them. The linked scene runs on them as it is; only
the words of the formulas mean something else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fracslice.formulas import Node, vocabulary
from fracslice.kernel.linker import CALLED, FIELD, link


@dataclass(eq=False)
class Dual:
    """v: [n]; d: [3, n], its derivatives by x, y and z."""

    v: Any
    d: Any

    __array_ufunc__ = None  # NumPy's numbers leave the arithmetic to this class

    def __add__(self, o: Any) -> Dual:
        o = lifted(o)
        return Dual(self.v + o.v, self.d + o.d)

    def __neg__(self) -> Dual:
        return Dual(-self.v, -self.d)

    def __sub__(self, o: Any) -> Dual:
        return self + -lifted(o)

    def __rsub__(self, o: Any) -> Dual:
        return -self + o

    def __mul__(self, o: Any) -> Dual:
        o = lifted(o)
        return Dual(self.v * o.v, self.v * o.d + o.v * self.d)

    def __truediv__(self, o: Any) -> Dual:
        return self * inverse(o)

    def __rtruediv__(self, o: Any) -> Dual:
        return inverse(self) * o

    __radd__, __rmul__ = __add__, __mul__

    def __lt__(self, o: Any) -> Any:
        return self.v < lifted(o).v

    def __gt__(self, o: Any) -> Any:
        return self.v > lifted(o).v

    def __le__(self, o: Any) -> Any:
        return self.v <= lifted(o).v

    def __ge__(self, o: Any) -> Any:
        return self.v >= lifted(o).v


def lifted(a: Any) -> Dual:
    return a if isinstance(a, Dual) else Dual(a, 0.0)


def _chain(function: Callable[..., Any], slope: Callable[..., Any]) -> Callable[[Any], Dual]:
    def word(a: Any) -> Dual:
        a = lifted(a)
        return Dual(function(a.v), slope(a.v) * a.d)

    return word


def where(mask: Any, a: Any, b: Any) -> Dual:
    a, b = lifted(a), lifted(b)
    return Dual(np.where(mask, a.v, b.v), np.where(mask, a.d, b.d))


def _atan2(y: Any, x: Any) -> Dual:
    y, x = lifted(y), lifted(x)
    over = 1 / (x.v * x.v + y.v * y.v)
    return Dual(np.arctan2(y.v, x.v), over * (x.v * y.d - y.v * x.d))


inverse = _chain(lambda v: 1 / v, lambda v: -1 / (v * v))
WORDS = {
    "where": where,
    "atan2": _atan2,
    "minimum": lambda a, b: where(lifted(a) < b, a, b),
    "maximum": lambda a, b: where(lifted(a) > b, a, b),
    "absolute": _chain(np.abs, np.sign),
    "sqrt": _chain(np.sqrt, lambda v: 0.5 / np.sqrt(v)),
    "rsqrt": _chain(lambda v: 1 / np.sqrt(v), lambda v: -0.5 / (v * np.sqrt(v))),
    "ratio": lambda a, b: lifted(a) / b,
    "log": _chain(np.log, lambda v: 1 / v),
    "exp": _chain(np.exp, np.exp),
    "sin": _chain(np.sin, np.cos),
    "cos": _chain(np.cos, lambda v: -np.sin(v)),
    "floor": _chain(np.floor, lambda v: 0.0 * v),
    "any_of": vocabulary.any_of,
}


def gradients(root: Node) -> Callable[[np.ndarray], np.ndarray]:
    """The gradient of a scene's field at float64 points [n, 3]."""
    linked, scope = link(root), {**WORDS, CALLED: lambda function: function}
    exec(compile(linked.source, "<linked scene>", "exec"), scope)
    numbers = [float(p) for p in linked.parameters]

    def evaluate(points: np.ndarray) -> np.ndarray:
        ones = np.eye(3)[:, :, None] * np.ones(len(points))
        with np.errstate(all="ignore"):
            found: Any = scope[FIELD](*(Dual(points[:, k], ones[k]) for k in range(3)), numbers)  # type: ignore[operator]
        return np.asarray(found.d).T

    return evaluate
