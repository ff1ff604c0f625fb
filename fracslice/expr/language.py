"""Language of formulas: what of Python a formula may use, and where it goes wrong.

A formula is plain Python over points: arithmetic, comparisons, the intrinsics of `expr.vocabulary`,
``for`` over a range or a tuple of numbers, and ``if not any_of(...): break``. Functions of Python and NumPy
with the same meaning (abs, min, max, pow, ``math.sqrt``, ``np.sqrt``) stand for intrinsics. Everything else
is rejected here, by file and line, before anything is compiled.
"""

from __future__ import annotations

import ast
import builtins
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from threading import Lock
from types import FunctionType, ModuleType
from typing import Any, NamedTuple, NoReturn

from ..common.messages import hint
from ..errors import KernelError
from . import vocabulary
from .functions import is_number

CHILD = "child"
"""Name of a domain operator's child function."""

HIGHEST = 16
"""Largest exponent expanded to products."""

_ONE_THREAD = Lock()


def parse(text: str) -> ast.Module:
    """Parse Python, one thread at a time.

    CPython 3.11 and 3.12 keep the depth of the tree that they build per interpreter. If garbage is collected
    meanwhile, another thread may run and parse, and both raise SystemError.
    """
    with _ONE_THREAD:
        return ast.parse(text)


def parse_expression(text: str) -> ast.expr:
    """Parse an expression; see `parse`."""
    with _ONE_THREAD:
        return ast.parse(text, mode="eval").body


def stored_names(*trees: ast.AST) -> set[str]:
    """Return the names that trees assign."""
    return {n.id for tree in trees for n in _names(tree) if isinstance(n.ctx, ast.Store)}


def _names(tree: ast.AST) -> Iterator[ast.Name]:
    return (n for n in ast.walk(tree) if isinstance(n, ast.Name))


def point_names(tree: ast.FunctionDef, first: set[str]) -> set[str]:
    """Return the names whose values differ from point to point."""
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
    """Return True if a value may differ from point to point; ``any_of`` does not, ``child`` does."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("any_of", CHILD):
        return node.func.id == CHILD
    if isinstance(node, ast.Name):
        return node.id in points
    return any(
        depends_on_points(part, points) for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)
    )


_PYTHON = {"abs": "absolute", "min": "minimum", "max": "maximum", "fabs": "absolute", "pow": "pow"}

_INTRINSICS = {id(getattr(vocabulary, name)): name for name in (*vocabulary.ALL, "orbit")} | {
    id(getattr(module, name)): _PYTHON.get(name, name)
    for module in (builtins, math)
    for name in (*_PYTHON, *vocabulary.NAMES)
    if hasattr(module, name)
}


def intrinsic_name(value: Any) -> str | None:
    """Return the name of the intrinsic that a value stands for, or None: ``np.sqrt`` is ``sqrt``."""
    return _INTRINSICS.get(id(value))


_STATEMENTS = (ast.Assign, ast.AugAssign, ast.Return, ast.For, ast.If, ast.Break, ast.Expr, ast.Pass)
_EXPRESSIONS = (
    ast.BinOp,
    ast.UnaryOp,
    ast.BoolOp,
    ast.Compare,
    ast.Call,
    ast.Name,
    ast.Constant,
    ast.Tuple,
    ast.Subscript,
    ast.IfExp,
    ast.Attribute,
)
_ON_NUMBERS_ALONE = {ast.And: "&", ast.Or: "|", ast.Not: "~"}


def check(
    tree: ast.FunctionDef, scope: Mapping[str, Any], error: Callable[[Any, str], KernelError]
) -> set[str]:
    """Check that a function is in the language of formulas; return the names of its points.

    `scope`: what it sees outside; `error`: makes the error about a node.
    """
    checked = _Check(tree, scope, error)
    checked.arguments_of(tree)
    for statement in body_of(tree):
        checked.visit(statement)
    return checked.points


def body_of(tree: ast.FunctionDef) -> list[ast.stmt]:
    """Return the statements of a function without its docstring."""
    return tree.body[1:] if ast.get_docstring(tree) is not None else tree.body


class _Place(NamedTuple):
    """Place of an error that shows no statement."""

    lineno: int


class _Check(ast.NodeVisitor):
    """Checks a function statement by statement."""

    def __init__(
        self, tree: ast.FunctionDef, scope: Mapping[str, Any], error: Callable[[Any, str], KernelError]
    ) -> None:
        self.scope, self.error = scope, error
        arguments = [a.arg for a in (*tree.args.posonlyargs, *tree.args.args)]
        self.arguments = set(arguments)
        self.local = {*arguments, *stored_names(tree)}
        points = {"w", "c"} if arguments[:2] == ["w", "c"] else {"x", "y", "z", "a", "b"}
        self.points = point_names(tree, points & self.arguments)

    def fail(self, node: ast.AST, message: str) -> NoReturn:
        raise self.error(_Place(getattr(node, "lineno", 1)), message)

    def refuse(self, node: ast.AST, instead: str) -> NoReturn:
        self.fail(node, f"{short(node)} is not in the language of formulas: expected {instead}")

    def arguments_of(self, tree: ast.FunctionDef) -> None:
        if tree.args.vararg or tree.args.kwarg or tree.args.kwonlyargs or tree.args.defaults:
            self.fail(tree, "expected plain arguments, without * and without defaults")

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, ast.stmt) and not isinstance(node, _STATEMENTS):
            self.refuse(node, "assignments, for over a range, if, break and return")
        if isinstance(node, ast.expr) and not isinstance(node, _EXPRESSIONS):
            self.refuse(node, "numbers, points, arithmetic and comparisons")
        super().visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if not isinstance(node.target, ast.Name):
            self.refuse(node, "a name to assign to")
        self.visit(node.value)
        if isinstance(node.op, ast.Pow):
            self.exponent(node, node.value)

    def visit_Expr(self, node: ast.Expr) -> None:
        if not (isinstance(node.value, ast.Call) and short(node.value.func) == "'orbit'"):
            self.refuse(node, "a value that is used")
        self.generic_visit(node)

    def visit_If(self, node: ast.If | ast.IfExp) -> None:
        if depends_on_points(node.test, self.points):
            self.fail(
                node.test,
                f"if {short(node.test)} may differ from point to point: expected where(..., ..., ...)",
            )
        self.generic_visit(node)

    visit_IfExp = visit_If  # noqa: N815

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        self.of_numbers(node, node.op)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        self.of_numbers(node, node.op)

    def of_numbers(self, node: ast.expr, op: ast.AST) -> None:
        """Refuse operators that require scalars if their operands are points."""
        if type(op) in _ON_NUMBERS_ALONE and depends_on_points(node, self.points):
            self.refuse(node, _ON_NUMBERS_ALONE[type(op)])
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        self.generic_visit(node)
        if isinstance(node.op, ast.Pow):
            self.exponent(node, node.right)

    def exponent(self, node: ast.AST, exponent: ast.expr) -> None:
        match exponent:
            case ast.Name(name) if name not in self.local and is_number(self.scope.get(name)):
                number = self.scope[name]
            case ast.Constant(number):
                pass
            case _:
                number = None
        if number != 0.5 and number not in range(1, HIGHEST + 1):
            self.refuse(
                node, f"a whole exponent from 1 to {HIGHEST}, or 0.5; for others exp(exponent * log(base))"
            )

    def visit_For(self, node: ast.For) -> None:
        match node.iter:
            case ast.Call(ast.Name("range")):
                self.generic_visit(node)
                return
            case ast.Name(name) if name in self.arguments - self.points or is_number(self.scope.get(name)):
                pass
            case ast.Tuple():
                pass
            case _:
                self.refuse(node, "for over a range or a tuple of numbers")
        for statement in _breaks(node.body):
            self.refuse(statement, "a loop over a range to leave")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            self.refuse(node, "arguments by their place")
        self.generic_visit(node)
        if isinstance(node.func, (ast.Name, ast.Attribute)) and len(node.args) == 2:
            called = (
                self.scope.get(node.func.id) if isinstance(node.func, ast.Name) else self.attribute(node.func)
            )
            if intrinsic_name(called) == "pow":
                self.exponent(node, node.args[1])

    def visit_Constant(self, node: ast.Constant) -> None:
        if not isinstance(node.value, (int, float)):
            self.refuse(node, "numbers")

    def attribute(self, node: ast.Attribute) -> Any:
        """What ``np.sqrt`` or ``math.pi`` is."""
        module = self.scope.get(node.value.id) if isinstance(node.value, ast.Name) else None
        return getattr(module, node.attr, None) if isinstance(module, ModuleType) else None

    def visit_Attribute(self, node: ast.Attribute) -> None:
        value = self.attribute(node)
        if not intrinsic_name(value) and not isinstance(value, (int, float)):
            self.unknown(node, node.attr)

    def visit_Name(self, node: ast.Name) -> None:
        if isinstance(node.ctx, ast.Store) or node.id in self.local or node.id == "range":
            return
        value = self.scope.get(node.id)
        if value is None and node.id in vocabulary.NAMES:
            return
        if not (intrinsic_name(value) or is_number(value) or isinstance(value, FunctionType) or value is int):
            self.unknown(node, node.id)

    def unknown(self, node: ast.AST, name: str) -> NoReturn:
        near = hint(name, {*vocabulary.NAMES, *self.local, *_PYTHON}, "{}")
        self.fail(node, f"{short(node)} is not in the language of formulas; {near}")


def _breaks(body: Sequence[ast.stmt]) -> Iterator[ast.Break]:
    """Statements that leave the loop with this body."""
    for statement in body:
        if isinstance(statement, ast.Break):
            yield statement
        elif isinstance(statement, ast.If):
            yield from _breaks([*statement.body, *statement.orelse])


def short(node: ast.AST) -> str:
    """Return a node as text of one line, quoted."""
    line = " ".join(ast.unparse(node).split())
    return repr(line if len(line) <= 40 else line[:37] + "...")
