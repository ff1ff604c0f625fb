"""Operations of a scene without loops: its program evaluated on symbols.

A loop over an orbit has as many steps as its depth. Points that have escaped go on, as in arrays, and do not
change the value.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..errors import KernelError
from ..expr.graph import Evaluator
from .linker import FIELD, link

if TYPE_CHECKING:
    from .node import Node

MOST = 1 << 16
"""Maximum number of operations of a graph."""

FUNCTIONS: dict[str, Callable[..., float]] = {
    "add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "divide": operator.truediv,
    "minimum": min, "maximum": max, "absolute": abs, "sqrt": math.sqrt, "floor": math.floor, "sin": math.sin,
    "cos": math.cos, "atan2": math.atan2, "exp": math.exp, "log": math.log,
    "select": lambda a, b, yes, no: yes if a < b else no,
}  # fmt: skip
"""Operations on numbers: ``select(a, b, yes, no)`` is `yes` where a < b."""

INPUTS = ("x", "y", "z")


@dataclass(frozen=True)
class Operation:
    """Node of a graph."""

    name: str  # A key of `FUNCTIONS`, one of `INPUTS`, or "constant"
    operands: tuple[int, ...] = ()  # indices of earlier nodes
    value: float = 0.0  # value of a constant


def operations(
    root: Node, scale: float = 1.0, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> list[Operation]:
    """Return the operations of a field.

    `scale`: length of a scene unit.
    """
    for node in root.solids():
        if node.formula.name == "model":
            raise node.fail("is made of triangles: expected formulas alone, or a mesh of them")
    linked, made = link(root), _Graph()
    vocabulary = FUNCTIONS.keys() - {"add", "subtract", "multiply", "divide", "select"}
    domain: dict[str, Any] = {name: made.function(name) for name in vocabulary}
    domain |= {"where": made.where, "any_of": made.any_of}
    domain |= {"rsqrt": lambda a: 1.0 / made.call("sqrt", a), "ratio": lambda a, b: a / b}
    inputs = [_Symbol(made, made.add(Operation(name))) for name in INPUTS]
    points = [(p - o) * (1.0 / scale) for p, o in zip(inputs, offset, strict=True)]
    named = linked.program.functions
    try:
        value = Evaluator(domain, named)(named[FIELD], *points, linked.parameters.tolist())
        value = value * (scale / root.bounds.lipschitz)
    except (ArithmeticError, ValueError) as error:
        raise KernelError(f"the formulas have a constant that is not finite: {error}") from None
    return made.needed(made.index(value))


@dataclass(eq=False)
class _Graph:
    """Operations, each once."""

    operations: list[Operation] = field(default_factory=list)
    known: dict[Operation, int] = field(default_factory=dict)

    def add(self, operation: Operation) -> int:
        """Index of an operation."""
        if operation not in self.known:
            if len(self.operations) == MOST:
                raise KernelError(f"the formulas have more than {MOST:,} operations when unrolled")
            self.known[operation] = len(self.operations)
            self.operations.append(operation)
        return self.known[operation]

    def index(self, value: Any) -> int:
        """Index of a symbol or a number."""
        if isinstance(value, _Symbol):
            return value.index
        if not math.isfinite(value):
            raise ValueError(f"{value}")
        return self.add(Operation("constant", value=float(value)))

    def function(self, name: str) -> Callable[..., Any]:
        return lambda *given: self.call(name, *given)

    def call(self, name: str, *given: Any) -> Any:
        """Apply an operation; a number if all operands are."""
        if not any(isinstance(value, _Symbol) for value in given):
            return float(FUNCTIONS[name](*given))
        first, second = (None if isinstance(value, _Symbol) else value for value in given[:1] + given[-1:])
        if name in _NEUTRAL and second == _NEUTRAL[name]:
            return given[0]
        if name in _COMMUTING and first == _COMMUTING[name]:
            return given[1]
        if name == "multiply" and 0.0 in (first, second):
            return 0.0
        return _Symbol(self, self.add(Operation(name, tuple(map(self.index, given)))))

    def where(self, mask: Any, yes: Any, no: Any) -> Any:
        """`yes` where the mask holds, else `no`."""
        if isinstance(mask, bool):
            return yes if mask else no
        if self.index(yes) == self.index(no):
            return yes
        a, b = mask.sides
        return self.call("select", a, b, *((no, yes) if mask.negated else (yes, no)))

    @staticmethod
    def any_of(mask: Any) -> bool:
        """False if the mask holds nowhere for certain."""
        return mask is not False

    def needed(self, last: int) -> list[Operation]:
        """Operations that the last one needs, renumbered."""
        live = {last}
        for index in range(last, -1, -1):
            if index in live:
                live.update(self.operations[index].operands)
        order = sorted(live)
        place = {old: new for new, old in enumerate(order)}
        rows = [self.operations[old] for old in order]
        return [Operation(r.name, tuple(place[k] for k in r.operands), r.value) for r in rows]


_COMMUTING = {"add": 0.0, "multiply": 1.0}
_NEUTRAL = {**_COMMUTING, "subtract": 0.0, "divide": 1.0}
"""Neutral second operands; those of `_COMMUTING` are neutral as the first, too."""


@dataclass(frozen=True, eq=False)
class _Symbol:
    """Value of an operation, for the operators of Python."""

    graph: _Graph
    index: int

    def __add__(self, other: Any) -> Any:
        return self.graph.call("add", self, other)

    def __radd__(self, other: Any) -> Any:
        return self.graph.call("add", other, self)

    def __sub__(self, other: Any) -> Any:
        return self.graph.call("subtract", self, other)

    def __rsub__(self, other: Any) -> Any:
        return self.graph.call("subtract", other, self)

    def __mul__(self, other: Any) -> Any:
        return self.graph.call("multiply", self, other)

    def __rmul__(self, other: Any) -> Any:
        return self.graph.call("multiply", other, self)

    def __truediv__(self, other: Any) -> Any:
        return self.graph.call("divide", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return self.graph.call("divide", other, self)

    def __neg__(self) -> Any:
        return self.graph.call("subtract", 0.0, self)

    def __lt__(self, other: Any) -> _Mask:
        return _Mask(self.graph, (self, other))

    def __gt__(self, other: Any) -> _Mask:
        return _Mask(self.graph, (other, self))

    def __le__(self, other: Any) -> _Mask:
        return _Mask(self.graph, (other, self), negated=True)

    def __ge__(self, other: Any) -> _Mask:
        return _Mask(self.graph, (self, other), negated=True)

    def __eq__(self, other: Any) -> Any:
        return (self <= other) & (self >= other)

    def __ne__(self, other: Any) -> Any:
        return (self < other) | (self > other)


@dataclass(frozen=True, eq=False)
class _Mask:
    """Condition a < b, or its negation."""

    graph: _Graph
    sides: tuple[Any, Any]
    negated: bool = False

    def __invert__(self) -> _Mask:
        return _Mask(self.graph, self.sides, not self.negated)

    def __and__(self, other: Any) -> Any:
        return self.joined(other, self.graph.where(self, self.number(other), 0.0))

    def __or__(self, other: Any) -> Any:
        return self.joined(other, self.graph.where(self, 1.0, self.number(other)))

    __rand__, __ror__ = __and__, __or__

    def number(self, mask: Any) -> Any:
        """1 where a mask holds, else 0."""
        return self.graph.where(mask, 1.0, 0.0)

    def joined(self, other: Any, number: Any) -> Any:
        """Mask of a number that is 1 or 0."""
        return bool(number) if not isinstance(number, _Symbol) else _Mask(self.graph, (0.5, number))
