"""From a tree to functions: one for all parts that have the same structure, and differ in numbers only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import TYPE_CHECKING, Any, Protocol

from ..errors import KernelError
from ..formulas.registry import Fixed, Node
from . import language

if TYPE_CHECKING:
    from .linker import Linker

INLINED = 12
"""How many parts' code may lie inside that of one function; the others are called. Kernels of small scenes
are one piece, and the time to compile a large one grows with the number of its parts.
"""

UNROLLED = 3
"""How many elements of one structure are written out; more are a loop."""


@dataclass(frozen=True)
class Subroutine:
    """The function ``name(x, y, z, P, P0)`` of all trees of one structure.

    size: how many numbers of P it reads, from P0 on. weight: how many parts' code it holds.
    """

    name: str
    size: int
    weight: int


@dataclass(frozen=True)
class Run:
    """Elements side by side that one function computes. start: where the first one's numbers begin, from P0
    on.
    """

    part: Subroutine
    count: int
    start: int

    def call(self, k: str = "", points: str = "x, y, z") -> str:
        """The call of its first element, or of the one k after that."""
        place = f"P0 + {self.start}" + (f" + {self.part.size} * {k}" if k else "")
        return f"{self.part.name}({points}, P, {place})"

    @property
    def calls(self) -> list[str]:
        """The calls of all of them."""
        step = self.part.size
        return [Run(self.part, 1, self.start + k * step).call() for k in range(self.count)]


@dataclass(frozen=True)
class Arguments:
    """A node's function and what it is called with.

    fixed: written into a copy of the function. passed: for the others, in the function's own order, the
    expression that reads each from P. numbers: those that lie there.
    """

    function: Callable[..., Any]
    fixed: tuple[tuple[str, Any], ...]
    passed: tuple[str, ...]
    numbers: tuple[float, ...]


class Dialect(Protocol):
    """How the functions of a tree are written. prefix: of their names."""

    prefix: str

    def kept(self, node: Node) -> Node:
        """The node that stands for this one: the first below it that does something."""

    def arguments(self, node: Node) -> Arguments: ...

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """The order in which the children may be evaluated."""

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> str:
        """The text of a node's function."""


def link_tree(linker: Linker, root: Node, dialect: Dialect) -> str:
    """Writes the functions of a tree and appends its numbers to P; returns the call of its field at ``x, y,
    z``.
    """
    tree = _Tree(linker, dialect)
    start = len(linker.parameters)
    top = tree.linked(dialect.kept(root))
    return f"{top.name}(x, y, z, P, {start})"


@dataclass
class _Tree:
    linker: Linker
    dialect: Dialect
    parts: dict[int, Subroutine] = field(default_factory=dict)
    inside: dict[int, list[Node]] = field(default_factory=dict)
    given: dict[int, Arguments] = field(default_factory=dict)

    def linked(self, root: Node) -> Subroutine:
        order, stack = [], [root]
        while stack:
            node = stack.pop()
            order.append(node)
            self.inside[id(node)] = [self.dialect.kept(child) for child in node.children]
            stack += self.inside[id(node)]
        for node in reversed(order):
            self.parts[id(node)] = self.part(node)
        stack = [root]
        while stack:
            node = stack.pop()
            self.linker.parameters += self.given[id(node)].numbers
            stack += reversed(self.inside[id(node)])
        return self.parts[id(root)]

    def part(self, node: Node) -> Subroutine:
        """The function of a node whose children have theirs."""
        given = self.given[id(node)] = self.dialect.arguments(node)
        children = self.inside[id(node)]
        places = self.dialect.order(node, [self.parts[id(child)] for child in children])
        children = self.inside[id(node)] = [children[k] for k in places]
        runs, size = [], len(given.numbers)
        for part, group in groupby(self.parts[id(child)] for child in children):
            runs.append(Run(part, len(list(group)), size))
            size += part.size * runs[-1].count
        key = (given.function, given.fixed, given.passed, *((run.part.name, run.count) for run in runs))

        def written(name: str) -> Subroutine:
            self.linker.functions[name] = self.dialect.write(name, node, given, runs)
            return Subroutine(name, size, self.weight(runs))

        return self.linker.part(self.dialect.prefix, key, written)

    def weight(self, runs: Sequence[Run]) -> int:
        """What a function holds that calls these; where that is too much, the heaviest are called."""
        held = {run.part.name: 0 for run in runs}
        for run in runs:
            sites = run.count if run.count <= UNROLLED else 2
            held[run.part.name] += 0 if run.part.name in self.linker.apart else sites * run.part.weight
        for name in sorted(held, key=lambda name: -held[name]):
            if sum(held.values()) < INLINED:
                break
            if held[name]:
                self.linker.apart.add(name)
                held[name] = 0
        return 1 + sum(held.values())


def arguments(node: Node, leading: int) -> Arguments:
    """What a node's function is called with, by name. leading: how many of its arguments are points or
    values.

    Raises `KernelError` if the formula gives other arguments than its function has.
    """
    function, values = node.function, node.arguments
    names = language.parameters(function)[leading:]
    if set(names) != set(values):
        place = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        wanted, found = (", ".join(s) or "nothing" for s in (values, names))
        raise KernelError(
            f"{place}: formula {node.formula.name}: expected {function.__name__} to take {wanted} "
            f"after its points, found {found}"
        )
    fixed = tuple((name, values[name].value) for name in names if isinstance(values[name], Fixed))
    numbers: list[float] = []
    passed = [read(values[name], numbers, "P0") for name in names if not isinstance(values[name], Fixed)]
    return Arguments(function, fixed, tuple(passed), tuple(numbers))


def read(value: Any, numbers: list[float], origin: str = "") -> str:
    """Appends a number or a tuple of numbers; returns the expression that reads it back from P, from an
    origin on.
    """
    if isinstance(value, tuple):
        return f"({', '.join(read(v, numbers, origin) for v in value)},)"
    place = f"{origin} + {len(numbers)}" if origin else str(len(numbers))
    numbers.append(float(value))
    return f"int(P[{place}])" if isinstance(value, int) else f"P[{place}]"
