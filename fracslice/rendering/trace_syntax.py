"""Syntax transformations of the formulas that a trace evaluates."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from typing import Any

from ..kernel import functions, source
from ..kernel.parsing import parse
from ..kernel.structure import Run


class KeepNearest(ast.NodeTransformer):
    """Replace orbit marks by the update of a running value, and return it beside the field's."""

    def __init__(self, update: str) -> None:
        self.update = update

    def visit_Expr(self, node: ast.Expr) -> Any:
        if not source.is_mark(node):
            return node
        assert isinstance(node.value, ast.Call)
        r2, alive, x, y, z = (f"({ast.unparse(argument)})" for argument in node.value.args)
        value = self.update.format(r2=r2, x=x, y=y, z=z)
        return parse(f"nearest = where({alive}, {value}, nearest)").body[0]

    def visit_Return(self, node: ast.Return) -> Any:
        assert node.value is not None
        return parse(f"return {ast.unparse(node.value)}, nearest").body[0]


class KeepChild(ast.NodeTransformer):
    """Evaluate the child's triple before each statement that calls the child.

    The triple of lowest value is kept.
    """

    def __init__(self, child: Run) -> None:
        self.child = child

    def visit_Assign(self, node: ast.Assign) -> Any:
        return self.taken(node)

    def visit_Return(self, node: ast.Return) -> Any:
        lines = self.taken(node)
        value = ast.unparse(lines[-1].value)
        return [*lines[:-1], parse(f"return {value}, paint, tone").body[0]]

    def taken(self, node: Any) -> list[Any]:
        calls = [
            c
            for c in ast.walk(node)
            if isinstance(c, ast.Call) and isinstance(c.func, ast.Name) and c.func.id == "child"
        ]
        if not calls:
            return [node]
        point = ", ".join(map(ast.unparse, calls[0].args))
        text = ast.unparse(node).replace(ast.unparse(calls[0]), "inner")
        lines = [
            f"inner, p, t = {self.child.call(points=point)}",
            "paint, tone = where(inner < lowest, p, paint), where(inner < lowest, t, tone)",
            "lowest = minimum(lowest, inner)",
        ]
        return [statement for line in [*lines, text] for statement in self.parsed(line)]

    @staticmethod
    def parsed(line: str) -> list[Any]:
        # `ast.parse` accepts a return statement outside a function.
        return parse(line).body


def text_of(function: Callable[..., Any], lines: Sequence[str]) -> str:
    """Assemble the source of a function.

    Parameters
    ----------
    function : callable
        Function whose name and parameters are used.
    lines : sequence of str
        Body.
    """
    names = ", ".join(functions.parameters(function))
    return "\n    ".join([f"def {function.__name__}({names}):", *lines])
