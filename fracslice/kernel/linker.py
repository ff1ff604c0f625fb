"""Linking of a scene to a self-contained Python module: only the functions it uses, its numbers as arguments.

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
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import KernelError
from ..formulas.parameters import AUTO
from ..formulas.registry import Fixed, Node
from . import language, source
from .structure import UNROLLED, Arguments, Run, Subroutine, arguments, link_tree, read
from .syntax import CHILD

FIELD = "field"
"""Name of the field's function."""

CALLED = "called"
"""Decorator of functions that are called, not inlined."""

LEADING = {"shape": 3, "csg": 2, "domain": 4}
"""Number of leading arguments (points, values or child) by kind of formula."""


@dataclass(frozen=True, eq=False)
class Linked:
    """Linked scene; equal if text and numbers are.

    Attributes
    ----------
    source
        Source text with the signed field ``field(x, y, z, P)``.
    parameters
        Parameters P, float64 [n].
    """

    source: str
    parameters: np.ndarray

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Linked) and self._contents == other._contents

    def __hash__(self) -> int:
        return hash(self._contents)

    @property
    def _contents(self) -> tuple[str, bytes]:
        return self.source, self.parameters.tobytes()

    @property
    def digest(self) -> str:
        """First 20 hexadecimal digits of the SHA-256 digest of the text."""
        return hashlib.sha256(self.source.encode()).hexdigest()[:20]


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
    return Linked(linker.text(), np.array(linker.parameters or [0.0], dtype=np.float64))


@dataclass
class Linker:
    """Writes functions and collects parameters.

    Attributes
    ----------
    given
        Names that the text gets from elsewhere.
    parameters
        Parameters P.
    functions
        Texts of the functions by name.
    apart
        Names of the functions that are called, not inlined.
    """

    given: frozenset[str] = frozenset()
    parameters: list[float] = field(default_factory=list)
    functions: dict[str, str] = field(default_factory=dict)
    apart: set[str] = field(default_factory=set)
    _parts: dict[Any, Subroutine] = field(default_factory=dict)
    _shared: dict[Any, str] = field(default_factory=dict)

    def field(self, root: Node) -> None:
        """Write the field of a scene tree.

        Parameters
        ----------
        root
            Scene with resolved depths.

        Raises
        ------
        KernelError
            If a depth is "auto" or a formula is not in the language.
        """
        call = link_tree(self, root, FieldDialect(self))
        self.functions[FIELD] = f"def {FIELD}(x, y, z, P):\n    return {call}"

    def part(self, prefix: str, key: tuple[Any, ...], write: Callable[[str], Subroutine]) -> Subroutine:
        """Return the function of a structure; write it once.

        Parameters
        ----------
        prefix
            Prefix of its name.
        key
            Structure.
        write
            Writes the function under a name.

        Returns
        -------
        Subroutine
            Function of the structure.
        """
        if (prefix, *key) not in self._parts:
            self._parts[prefix, *key] = write(f"{prefix}{len(self._parts)}")
        return self._parts[prefix, *key]

    def argument(self, value: Any) -> str:
        """Append a value to P.

        Parameters
        ----------
        value
            Number or nested tuple of numbers.

        Returns
        -------
        str
            Expression that reads the value back.
        """
        return read(value, self.parameters)

    def share(
        self, function: Callable[..., Any], fixed: Sequence[tuple[str, Any]] = (), prefix: str = ""
    ) -> str:
        """Write a copy of the function with its fixed arguments substituted, once.

        Parameters
        ----------
        function
            Formula or helper.
        fixed
            Names and values of the fixed arguments.
        prefix
            Prefix of its name and of those of the functions it calls.

        Returns
        -------
        str
            Name of the copy.
        """
        suffix = "".join(f"_{k}_{v}" for k, v in sorted(fixed))
        name = prefix + function.__name__ + "".join(c if c.isalnum() else "_" for c in suffix)
        copy = source.shared(function, tuple(fixed), self.given)
        return self.add((prefix, function, tuple(fixed)), name, copy, prefix)

    def add(self, key: tuple[Any, ...], name: str, copy: source.Copy, prefix: str) -> str:
        """Write a copy and the functions it calls, once per key.

        Parameters
        ----------
        key
            Identity of the copy.
        name
            Preferred name.
        copy
            Text and called functions.
        prefix
            Prefix of the names of the functions it calls.

        Returns
        -------
        str
            Name of the copy, numbered if `name` is in use.
        """
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
        copy = source.copied(tree, function, self.given | self.functions.keys())
        return self.renamed(copy, name, OF_FORMULAS)

    def bind(self, name: str, function: Callable[..., Any], values: dict[str, Any]) -> None:
        """Write the function ``name(rest..., P)`` that calls a given function.

        Its arguments in `values` are read from P or fixed; the others stay open. An argument named P receives
        P.

        Parameters
        ----------
        name
            Name of the new function.
        function
            Function to call.
        values
            Values of some arguments by name.
        """
        fixed = {k: v.value for k, v in values.items() if isinstance(v, Fixed)}
        called = self.share(function, tuple(fixed.items()))
        names = [a for a in language.parameters(function) if a not in fixed]
        passed = [self.argument(values[a]) if a in values else a for a in names]
        rest = [a for a in names if a not in values and a != "P"]
        self.functions[name] = (
            f"def {name}({', '.join([*rest, 'P'])}):\n    return {called}({', '.join(passed)})"
        )

    def text(self) -> str:
        """Return the text of all functions."""
        texts = (f"@{CALLED}\n{t}" if name in self.apart else t for name, t in self.functions.items())
        return "\n\n\n".join(texts) + "\n"


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
            lines += folded(
                run, k == 0, lambda call: [f"f = {called}({', '.join(['f', call, *given.passed])})"]
            )
        return function(name, [*lines, "return f"])

    def domain_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> str:
        """Return the text of a domain operator's function."""
        tree = source.specialised(given.function, dict(given.fixed))
        arguments = [a.arg for a in tree.args.args][4:]
        tree.args.args = [ast.arg(a) for a in ("x", "y", "z", "P", "P0")]
        tree = _CallsChild(runs[0]).visit(tree)
        taken = [ast.parse(f"{a} = {p}").body[0] for a, p in zip(arguments, given.passed, strict=True)]
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


def folded(run: Run, begun: bool, lines: Callable[[str], list[str]]) -> list[str]:
    """Return the lines that combine the elements of a run, one after the other or in a loop.

    Parameters
    ----------
    run
        Elements of one function.
    begun
        True if the first element is combined already.
    lines
        Returns the lines for one call.

    Returns
    -------
    list of str
        Lines of source text.
    """
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
            return ast.parse(self.child.call(points=points), mode="eval").body
        return node
