"""Names in a function: assigned ones, and those whose values differ from point to point."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from typing import Any

CHILD = "child"
"""Name of a domain operator's child function."""


class Naming(ast.NodeTransformer):
    """Puts expressions in the place of names."""

    def __init__(self, values: dict[str, ast.expr]) -> None:
        self.values = values

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return self.values.get(node.id, node)


class Folding(ast.NodeTransformer):
    """Evaluates operators on whole numbers and truth values; keeps the branch that a constant selects."""

    def statements(self, body: Sequence[ast.stmt]) -> list[ast.stmt]:
        """Visit statements, each of which may become several."""
        visited = (self.visit(statement) for statement in body)
        return [part for one in visited for part in (one if isinstance(one, list) else [one])]

    def visit_If(self, node: ast.If) -> Any:
        node.test = self.visit(node.test)
        if isinstance(node.test, (ast.Constant, ast.Tuple)):
            return self.statements(node.body if _is_true(node.test) else node.orelse)
        node.body, node.orelse = self.statements(node.body), self.statements(node.orelse)
        return node

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        node.test = self.visit(node.test)
        if isinstance(node.test, (ast.Constant, ast.Tuple)):
            return self.visit(node.body if _is_true(node.test) else node.orelse)
        return self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        match self.generic_visit(node):
            case ast.Subscript(ast.Tuple(elements), ast.Constant(int(index))) if index < len(elements):
                return elements[index]
        return node

    def folded(self, node: Any) -> Any:
        """Visit an operator, and evaluate it if its operands are known."""
        node = self.generic_visit(node)
        operands = [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]
        if not all(isinstance(o, ast.Constant) and isinstance(o.value, int) for o in operands):
            return node
        return ast.copy_location(ast.Constant(eval(ast.unparse(node), {})), node)

    visit_UnaryOp = visit_BinOp = visit_Compare = folded  # noqa: N815


def _is_true(node: ast.Constant | ast.Tuple) -> bool:
    return bool(node.value if isinstance(node, ast.Constant) else node.elts)


def stored_names(*trees: ast.AST) -> set[str]:
    """Return the names that trees assign."""
    return {n.id for tree in trees for n in _names(tree) if isinstance(n.ctx, ast.Store)}


def assigned_names(body: Sequence[ast.stmt]) -> set[str]:
    """Return the names that statements assign, and the hidden counters of loops."""
    loops = [n for statement in body for n in ast.walk(statement) if isinstance(n, ast.For)]
    return stored_names(*body) | {f"{ast.unparse(loop.target)} of {loop.lineno}" for loop in loops}


def _names(tree: ast.AST) -> Iterator[ast.Name]:
    return (n for n in ast.walk(tree) if isinstance(n, ast.Name))


def point_names(tree: ast.FunctionDef, first: set[str]) -> set[str]:
    """Return the names whose values differ from point to point.

    Returns
    -------
    set of str
        These names, and those computed from them.
    """
    known = set(first)
    assigned = [
        (target, node.value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Assign, ast.AugAssign))
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
    ]
    while True:
        more = {
            name.id
            for target, value in assigned
            if depends_on_points(value, known)
            for name in _assigned_points(target, value, known)
        }
        if more <= known:
            return known
        known |= more


def _assigned_points(target: ast.expr, value: ast.expr, points: set[str]) -> Iterator[ast.Name]:
    """Names of a target that are assigned points: of ``a, b = x, 1.0`` the first."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
        for part, given in zip(target.elts, value.elts, strict=True):
            if depends_on_points(given, points):
                yield from _names(part)
    else:
        yield from _names(target)


def depends_on_points(node: ast.expr, points: set[str]) -> bool:
    """Return True if a value may differ from point to point; ``any_of`` does not, ``child`` does.

    Parameters
    ----------
    node
        Expression.
    points
        Names whose values differ from point to point.
    """
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("any_of", CHILD):
        return node.func.id == CHILD
    if isinstance(node, ast.Name):
        return node.id in points
    return any(
        depends_on_points(part, points) for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)
    )
