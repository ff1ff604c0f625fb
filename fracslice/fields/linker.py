"""Linking of a scene to a self-contained Python module: its functions, one for all parts of the same
structure.

Parts of a scene that differ in numbers only share one function, ``N0(x, y, z, P, P0)``. Their numbers lie in
the parameter array P from offset P0, followed by those of their child elements. A union of a hundred spheres
is thus one sphere and a loop, and scenes that differ in numbers only have the same text: editing a value
compiles nothing.

Shapes and CSG operators are called with their arguments read from P. `Fixed` arguments are substituted in a
copy of the function, where dead branches are dropped and loops over fixed tuples are unrolled. A domain
operator's copy calls its child by name. Identities are omitted.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..common.parameters import AUTO
from ..errors import KernelError
from ..expr import functions
from ..expr.functions import Fixed, InMemory
from ..expr.language import CALLED, CHILD, FIELD, Linked, parse, parse_expression
from . import source
from .source import Arguments, append_numbers, arguments

if TYPE_CHECKING:
    from .node import Node

INLINED = 12
"""Parts whose code may be inlined in one function; others are called. Kernels of small scenes are one
function, and the compile time of a large one grows with the number of its parts.
"""

UNROLLED = 3
"""Elements of one structure that are unrolled; more become a loop."""


@dataclass(frozen=True)
class Subroutine:
    """Function ``name(x, y, z, P, P0)`` of all trees of one structure."""

    name: str  # name of the function
    size: int  # number of entries of P that it reads, from P0 on
    weight: int  # number of parts whose code it contains


@dataclass(frozen=True)
class Run:
    """Consecutive elements computed by one function."""

    part: Subroutine  # function of the elements
    count: int  # number of elements
    start: int  # offset of the first element's numbers from P0

    def call(self, k: str = "", points: str = "x, y, z") -> str:
        """Return the call of one element.

        `k`: expression of the element's index.
        """
        place = f"P0 + {self.start}" + (f" + {self.part.size} * {k}" if k else "")
        return f"{self.part.name}({points}, P, {place})"

    @property
    def calls(self) -> list[str]:
        """Calls of all elements."""
        step = self.part.size
        return [Run(self.part, 1, self.start + k * step).call() for k in range(self.count)]


class Dialect(Protocol):
    """Style of the functions of a tree."""

    prefix: str  # prefix of their names

    def kept(self, node: Node) -> Node:
        """Return the node that represents this one."""

    def arguments(self, node: Node) -> Arguments: ...

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """Return an order in which the children may be evaluated."""

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> str:
        """Return the text of a node's function."""


def link_tree(linker: Linker, root: Node, dialect: Dialect) -> str:
    """Write the functions of a tree and append its numbers to P."""
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
            given, start = self.given[id(node)], len(self.linker.parameters)
            self.linker.held += [(start + place, memory) for place, memory in given.held]
            self.linker.parameters += given.numbers
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


LEADING = {"shape": 3, "csg": 2, "domain": 4}
"""Number of leading arguments (points, values or child) by kind of formula."""

OF_FORMULAS = "f_"
"""Prefix of the names of formulas and their helpers, distinct from those of loops and units."""


@dataclass
class FieldDialect:
    """Dialect of functions that return the field's value."""

    linker: Linker
    prefix: str = "N"

    def kept(self, node: Node) -> Node:
        """Return the first node from this one on that is no identity and no CSG operator of one element."""
        while node.is_identity or (node.formula.kind == "csg" and _folds(node) and len(node.children) == 1):
            node = node.children[0]
        return node

    def arguments(self, node: Node) -> Arguments:
        """Return the function of a node and its arguments. Raises `KernelError` if a depth is "auto"."""
        if AUTO in [v for v in node.values.values() if isinstance(v, str)]:
            raise KernelError(
                f"<{node.formula.name}>: the depth is still auto; resolve it for a voxel size first"
            )
        return arguments(node, leading(node))

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """Group elements of the same structure where their order changes no bit of the result."""
        places = range(len(parts))
        if not node.is_unordered:
            return places
        first = list(dict.fromkeys(part.name for part in parts))
        return sorted(places, key=lambda k: first.index(parts[k].name))

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> str:
        """Return the text of a node's function."""
        write = {"shape": self.shape, "csg": self.csg_operator, "domain": self.domain_operator}[
            node.formula.kind
        ]
        return write(name, given, runs)

    def shape(self, name: str, given: Arguments, _: Sequence[Run]) -> str:
        """Return the text of a shape's function."""
        called = self.linker.share(given.function, given.fixed, OF_FORMULAS)
        passed = ", ".join(["x", "y", "z", *given.passed])
        return function(name, [f"return {called}({passed})"])

    def csg_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> str:
        """Return the text of a CSG operator's function."""
        called = self.linker.share(given.function, given.fixed, OF_FORMULAS)
        lines = [f"f = {runs[0].call()}"]
        if sum(run.count for run in runs) == 1:
            lines.append(f"f = {called}({', '.join(['f', *given.passed])})")
        for k, run in enumerate(runs):
            lines += fold_lines(
                run, k == 0, lambda call: [f"f = {called}({', '.join(['f', call, *given.passed])})"]
            )
        return function(name, [*lines, "return f"])

    def domain_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> str:
        """Return the text of a domain operator's function."""
        tree = source.specialise(given.function, dict(given.fixed))
        arguments = [a.arg for a in tree.args.args][4:]
        tree.args.args = [ast.arg(a) for a in ("x", "y", "z", "P", "P0")]
        tree = _CallsChild(runs[0]).visit(tree)
        taken = [parse(f"{a} = {p}").body[0] for a, p in zip(arguments, given.passed, strict=True)]
        tree.body = [*taken, *tree.body]
        return self.linker.named(name, tree, given.function)


def _folds(node: Node) -> bool:
    """True if a CSG operator's function takes the values of two elements and is called once per further
    element.
    """
    return node.formula.children[1] is None


def leading(node: Node) -> int:
    """Return the number of a node's arguments that are points, values or its child."""
    return 1 if node.formula.kind == "csg" and not _folds(node) else LEADING[node.formula.kind]


def fold_lines(run: Run, begun: bool, lines: Callable[[str], list[str]]) -> list[str]:
    """Return the lines that combine the elements of a run, one after the other or in a loop."""
    if run.count <= UNROLLED:
        return [line for call in run.calls[begun:] for line in lines(call)]
    rest = Run(run.part, run.count - begun, run.start + begun * run.part.size)
    return [f"for i in range({rest.count}):", *(f"    {line}" for line in lines(rest.call("i")))]


def function(name: str, lines: Sequence[str]) -> str:
    """Return the text of a part's function."""
    return "\n    ".join([f"def {name}(x, y, z, P, P0):", *lines])


class _CallsChild(ast.NodeTransformer):
    """Replaces ``child(a, b, c)`` by a call of the child's function, with P."""

    def __init__(self, child: Run) -> None:
        self.child = child

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id == CHILD:
            points = ", ".join(map(ast.unparse, node.args))
            return parse_expression(self.child.call(points=points))
        return node


LARGEST = 1 << 24
"""Largest number of parameters: a float32 holds every index."""


def link(root: Node) -> Linked:
    """Link a scene tree.

    Parameters
    ----------
    root
        Scene with resolved depths.

    Returns
    -------
    Linked
        Text and parameters.

    Raises
    ------
    KernelError
        If a depth is "auto" or a formula is not in the language.
    """
    linker = Linker()
    linker.field(root)
    return linker.linked()


@dataclass
class Linker:
    """Writes functions and collects parameters."""

    given: frozenset[str] = frozenset()  # names that the text gets from elsewhere
    parameters: list[float] = field(default_factory=list)  # parameters P
    functions: dict[str, str] = field(default_factory=dict)  # texts of the functions by name
    called: set[str] = field(default_factory=set)  # names of the functions that are called, not inlined
    # arrays that stand behind the numbers in P, each with the index of the number that is its offset
    tables: list[tuple[int, np.ndarray]] = field(default_factory=list)
    held: list[tuple[int, InMemory]] = field(default_factory=list)  # see `Linked`
    _parts: dict[Any, Subroutine] = field(default_factory=dict)
    _shared: dict[Any, str] = field(default_factory=dict)

    def field(self, root: Node) -> None:
        """Write the field of a scene tree."""
        call = link_tree(self, root, FieldDialect(self))
        self.functions[FIELD] = f"def {FIELD}(x, y, z, P):\n    return {call}"

    def part(self, prefix: str, key: tuple[Any, ...], write: Callable[[str], Subroutine]) -> Subroutine:
        """Return the function of a structure; write it once."""
        if (prefix, *key) not in self._parts:
            self._parts[prefix, *key] = write(f"{prefix}{len(self._parts)}")
        return self._parts[prefix, *key]

    def argument(self, value: Any) -> str:
        """Append a value to P."""
        if isinstance(value, np.ndarray):
            self.tables.append((len(self.parameters), value))
            value = 0.0
        return append_numbers(value, self.parameters)

    def numbers(self) -> np.ndarray:
        """Return P: the numbers, then each array once.

        Returns float64 [n].
        """
        numbers, arrays = np.array(self.parameters or [0.0], np.float64), {}
        end = len(numbers)
        for place, array in self.tables:
            if id(array) not in arrays:
                arrays[id(array)] = end, array
                end += array.size
            numbers[place] = arrays[id(array)][0]
        if end > LARGEST:
            raise KernelError(
                f"the pictures of a scene hold {end:,} numbers: expected at most {LARGEST:,} in all"
            )
        return np.concatenate([numbers, *(array.ravel() for _, array in arrays.values())])

    def share(
        self, function: Callable[..., Any], fixed: Sequence[tuple[str, Any]] = (), prefix: str = ""
    ) -> str:
        """Write a copy of the function with its fixed arguments substituted, once."""
        suffix = "".join(f"_{k}_{v}" for k, v in sorted(fixed))
        name = prefix + function.__name__ + "".join(c if c.isalnum() else "_" for c in suffix)
        copy = source.shared_copy(function, tuple(fixed), self.given)
        return self.add((prefix, function, tuple(fixed)), name, copy, prefix)

    def add(self, key: tuple[Any, ...], name: str, copy: source.Copy, prefix: str) -> str:
        """Write a copy and the functions it calls, once per key."""
        if key not in self._shared:
            taken = {*self._shared.values()}
            number = next(
                n for n in range(1, len(taken) + 2) if (f"{name}_{n}" if n > 1 else name) not in taken
            )
            name = self._shared[key] = f"{name}_{number}" if number > 1 else name
            self.functions[name] = self.renamed(copy, name, prefix)
        return self._shared[key]

    def renamed(self, copy: source.Copy, name: str, prefix: str) -> str:
        """Return the text of a copy under a name; write the functions that it calls."""
        names = {called: self.share(f, (), prefix) for called, f in copy.calls.items()}
        return copy.renamed({**names, copy.name: name})

    def named(self, name: str, tree: ast.FunctionDef, function: Callable[..., Any]) -> str:
        """Return the renamed text of a tree derived from a formula; write the functions it calls."""
        copy = source.copy_text(tree, function, self.given | self.functions.keys())
        return self.renamed(copy, name, OF_FORMULAS)

    def bind(self, name: str, function: Callable[..., Any], values: dict[str, Any]) -> None:
        """Write the function ``name(rest..., P)`` that calls a given function.

        Its arguments in `values` are read from P or fixed; the others stay open. An argument named P receives
        P.
        """
        fixed = {k: v.value for k, v in values.items() if isinstance(v, Fixed)}
        called = self.share(function, tuple(fixed.items()))
        names = [a for a in functions.parameters(function) if a not in fixed]
        passed = [self.argument(values[a]) if a in values else a for a in names]
        rest = [a for a in names if a not in values and a != "P"]
        self.functions[name] = (
            f"def {name}({', '.join([*rest, 'P'])}):\n    return {called}({', '.join(passed)})"
        )

    def linked(self) -> Linked:
        """Return what is written and collected."""
        return Linked(self.text(), self.numbers(), tuple(self.held))

    def text(self) -> str:
        """Return the text of all functions."""
        texts = (f"@{CALLED}\n{t}" if name in self.called else t for name, t in self.functions.items())
        return "\n\n\n".join(texts) + "\n"
