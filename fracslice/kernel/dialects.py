"""Functions that return the value of a field, from the parts of its tree."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import KernelError
from ..formulas.parameters import AUTO
from ..formulas.registry import Node
from . import source
from .arguments import Arguments, arguments
from .parsing import parse, parse_expression
from .structure import UNROLLED, Run, Subroutine
from .syntax import CHILD

if TYPE_CHECKING:
    from .linker import Linker

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
            return parse_expression(self.child.call(points=points))
        return node
