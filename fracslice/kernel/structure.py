"""Functions of a tree: one for all parts that have the same structure and differ in numbers only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import TYPE_CHECKING, Protocol

from ..formulas.registry import Node
from .arguments import Arguments

if TYPE_CHECKING:
    from .linker import Linker

INLINED = 12
"""Parts whose code may be inlined in one function; others are called. Kernels of small scenes are one
function, and the compile time of a large one grows with the number of its parts.
"""

UNROLLED = 3
"""Elements of one structure that are unrolled; more become a loop."""


@dataclass(frozen=True)
class Subroutine:
    """Function ``name(x, y, z, P, P0)`` of all trees of one structure.

    Attributes
    ----------
    name
        Name of the function.
    size
        Number of entries of P that it reads, from P0 on.
    weight
        Number of parts whose code it contains.
    """

    name: str
    size: int
    weight: int


@dataclass(frozen=True)
class Run:
    """Consecutive elements computed by one function.

    Attributes
    ----------
    part
        Function of the elements.
    count
        Number of elements.
    start
        Offset of the first element's numbers from P0.
    """

    part: Subroutine
    count: int
    start: int

    def call(self, k: str = "", points: str = "x, y, z") -> str:
        """Return the call of one element.

        Parameters
        ----------
        k
            Expression of the element's index; default: the first element.
        points
            Expressions of the coordinates.

        Returns
        -------
        str
            Expression.
        """
        place = f"P0 + {self.start}" + (f" + {self.part.size} * {k}" if k else "")
        return f"{self.part.name}({points}, P, {place})"

    @property
    def calls(self) -> list[str]:
        """Calls of all elements."""
        step = self.part.size
        return [Run(self.part, 1, self.start + k * step).call() for k in range(self.count)]


class Dialect(Protocol):
    """Style of the functions of a tree.

    Attributes
    ----------
    prefix
        Prefix of their names.
    """

    prefix: str

    def kept(self, node: Node) -> Node:
        """Return the node that represents this one.

        Parameters
        ----------
        node
            Node of a scene.

        Returns
        -------
        Node
            The first node at or below it that is no identity.
        """

    def arguments(self, node: Node) -> Arguments: ...

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """Return an order in which the children may be evaluated.

        Parameters
        ----------
        node
            Node of a scene.
        parts
            Functions of its children.

        Returns
        -------
        sequence of int
            Indices of the children.
        """

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> str:
        """Return the text of a node's function.

        Parameters
        ----------
        name
            Name of the function.
        node
            Node of a scene.
        given
            Function of its formula and arguments.
        runs
            Its children.

        Returns
        -------
        str
            Source text.
        """


def link_tree(linker: Linker, root: Node, dialect: Dialect) -> str:
    """Write the functions of a tree and append its numbers to P.

    Parameters
    ----------
    linker
        Receives functions and numbers.
    root
        Scene.
    dialect
        Style of the functions.

    Returns
    -------
    str
        Call of the tree's field at ``x, y, z``.

    Raises
    ------
    KernelError
        If a formula is not in the language.
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
            self.inside[id(node)] = [self.dialect.kept(child) for child in node.fields]
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
        """Function of a node whose children are linked."""
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
        """Weight of a function with these calls. If it is too large, the heaviest parts are called, not
        inlined.
        """
        held = {run.part.name: 0 for run in runs}
        for run in runs:
            sites = run.count if run.count <= UNROLLED else 2
            held[run.part.name] += 0 if run.part.name in self.linker.called else sites * run.part.weight
        for name in sorted(held, key=lambda name: -held[name]):
            if sum(held.values()) < INLINED:
                break
            if held[name]:
                self.linker.called.add(name)
                held[name] = 0
        return 1 + sum(held.values())
