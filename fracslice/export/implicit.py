"""3MF with the volumetric and implicit extensions 0.8: an object as a formula, in the form that lib3mf
2.5 reads and writes. (There arctan2 of the specification is atan2.)

A loop over an orbit has as many steps as its depth. Points that have escaped go on, as in arrays, and do not
change the value.

The function has the input "pos", mm, and the output "shape": at most the distance from the surface, mm,
negative inside. It is evaluated within a box.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.files import HEAD, package, replacing
from ..errors import KernelError
from ..expr.graph import Evaluator
from ..fields.linker import FIELD
from ..formats._3mf import CORE_NAMES, mesh_element
from ..mesh.model import Mesh

if TYPE_CHECKING:
    from ..fields.box import Box
    from ..fields.node import Node


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
        if node.is_in_memory:
            raise node.fail("is data in memory, no formula: expected formulas alone, or a mesh of them")
    linked, made = root.linked, _Graph()
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


LEVEL = 9
ELEMENTS = {
    "add": "addition", "subtract": "subtraction", "multiply": "multiplication", "divide": "division",
    "minimum": "min", "maximum": "max", "absolute": "abs",
}  # fmt: skip
"""Names of elements that differ from the operation's."""

MODEL = (
    HEAD + '<model unit="millimeter" xml:lang="en-US" requiredextensions="v i" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:v="http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01" '
    'xmlns:i="http://schemas.3mf.io/3dmanufacturing/implicit/2023/12" '
    'xmlns:fracslice="urn:fracslice:metadata">\n'
)
FUNCTION = (
    '<resources>\n<i:implicitfunction id="1" displayname="{}">\n'
    '<i:in><i:vector identifier="pos" displayname="position"/></i:in>\n'
    '<i:decomposevector identifier="p"><i:in><i:vectorref identifier="A" ref="inputs.pos"/></i:in><i:out>'
    '<i:scalar identifier="x"/><i:scalar identifier="y"/><i:scalar identifier="z"/></i:out>'
    "</i:decomposevector>\n"
)
OBJECT = (
    '<i:out><i:scalarref identifier="shape" displayname="distance" ref="{}"/></i:out>\n'
    '</i:implicitfunction>\n<object id="2" type="model">'
)
LEVEL_SET = (
    '</object>\n<object id="3" type="model"><v:levelset functionid="1" channel="shape" meshid="2" '
    'meshbboxonly="true" minfeaturesize="{:.9g}"/></object>\n</resources>\n'
    '<build><item objectid="3"/></build>\n</model>\n'
)


def write_implicit(
    operations: Sequence[Operation], box: Box, finest: float, path: str | Path, metadata: Mapping[str, str]
) -> Path:
    """Write an object as a formula.

    `operations`, `box`, `finest` in mm.
    """
    with replacing(path) as file:
        package(file, _model(operations, box, finest, metadata), False, LEVEL)
    return Path(path)


def _model(
    operations: Sequence[Operation], box: Box, finest: float, metadata: Mapping[str, str]
) -> Iterator[bytes]:
    yield MODEL.encode()
    for key, value in metadata.items():
        name = key if key in CORE_NAMES else f"fracslice:{key}"
        yield f'<metadata name="{escape(name)}">{escape(value)}</metadata>\n'.encode()
    yield FUNCTION.format(escape(metadata.get("Title", ""))).encode()
    references: list[str] = []
    for operation in operations:
        text, reference = _element(operation, references)
        references.append(reference)
        yield text.encode()
    yield OBJECT.format(references[-1]).encode()
    yield from (text() for text in mesh_element(_cuboid(box)))
    yield LEVEL_SET.format(finest).encode()


def _element(operation: Operation, references: Sequence[str]) -> tuple[str, str]:
    """Element of an operation, and the reference to its output."""
    if operation.name in ("x", "y", "z"):
        return "", f"p.{operation.name}"
    name = f"n{len(references)}"
    if operation.name == "constant":
        text = f'<i:constant identifier="{name}" value="{operation.value!r}">'
        return f'{text}<i:out><i:scalar identifier="value"/></i:out></i:constant>\n', f"{name}.value"
    element = ELEMENTS.get(operation.name, operation.name)
    given = "".join(
        f'<i:scalarref identifier="{letter}" ref="{references[k]}"/>'
        for letter, k in zip("ABCD", operation.operands, strict=False)
    )
    text = (
        f'<i:{element} identifier="{name}"><i:in>{given}</i:in><i:out><i:scalar identifier="result"/></i:out>'
    )
    return f"{text}</i:{element}>\n", f"{name}.result"


def _cuboid(box: Box) -> Mesh:
    """Triangles of a box."""
    corners = np.array([[(box.lo, box.hi)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
    return Mesh(corners, np.array(triangles, np.int32))
