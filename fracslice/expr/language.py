"""Language of formulas: a subset of Python, its syntax trees, and the names in a function.

A formula is plain Python over points: arithmetic, comparisons, the intrinsics of `expr.vocabulary`,
``for`` over a range or a tuple of numbers, and ``if not any_of(...): break``. Functions of Python and NumPy
with the same meaning (abs, min, max, pow, ``math.sqrt``, ``np.sqrt``) are rewritten as intrinsics. Everything
else is rejected here, by file and line, before anything is compiled.
"""

from __future__ import annotations

import ast
import builtins
import hashlib
import inspect
import math
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from threading import Lock
from types import FunctionType, ModuleType
from typing import Any, NoReturn

import numpy as np

from ..common.messages import hint
from ..errors import KernelError
from . import vocabulary
from .functions import InMemory, fingerprint, is_number, parameters, scope

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


_OF_THE_KERNEL = re.compile(r"[NT]\d+|P0?")

_PLAIN = ("range", "int")
_PYTHON = {"abs": "absolute", "min": "minimum", "max": "maximum", "fabs": "absolute", "pow": "pow"}
_HIGHEST = 16
"""Largest exponent expanded to products."""

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
)
_ON_NUMBERS_ALONE = {ast.And: "&", ast.Or: "|", ast.Not: "~"}
_FLOORED = {ast.Mod: "a - b * floor(a / b)", ast.FloorDiv: "floor(a / b)"}
"""Operators of Python on points, in the vocabulary."""


def text(function: Callable[..., Any]) -> str:
    """Return a function rewritten in the language of formulas."""
    return _text(function, fingerprint(function))


@lru_cache(maxsize=1024)
def _text(function: Callable[..., Any], _: object) -> str:
    try:
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError):
        raise KernelError(
            f"formula {function.__name__}: its source cannot be read; expected a def in a file or a notebook"
        ) from None
    tree = parse(textwrap.dedent("".join(lines))).body[0]
    place = f"{function.__code__.co_filename}:{{}}: formula {function.__name__}: "
    if not isinstance(tree, ast.FunctionDef):
        raise KernelError(place.format(first) + "expected a def")
    rewritten = _Language(function, tree, place, first).visit(tree)
    return ast.unparse(rewritten)


def intrinsic_name(value: Any) -> str | None:
    """Return the name of the intrinsic that a value stands for, or None: ``np.sqrt`` is ``sqrt``."""
    return _INTRINSICS.get(id(value))


INTRINSICS = frozenset({*vocabulary.NAMES, *vocabulary.OF_CELLS, *vocabulary.OF_FILES, *_PLAIN})
"""Names that a text in the language may use without a definition."""

_OWN = (*vocabulary.NAMES, *vocabulary.OF_CELLS, *vocabulary.OF_FILES, "orbit")
_INTRINSICS = {id(getattr(vocabulary, name)): name for name in _OWN} | {
    id(getattr(module, name)): _PYTHON.get(name, name)
    for module in (builtins, math)
    for name in (*_PYTHON, *vocabulary.NAMES)
    if hasattr(module, name)
}


class _Language(ast.NodeTransformer):
    """Checks a function statement by statement, and replaces outside names by intrinsics or constants."""

    def __init__(self, function: Callable[..., Any], tree: ast.FunctionDef, place: str, first: int) -> None:
        self.scope, self.place, self.first = scope(function), place, first
        arguments = parameters(function)
        self.arguments = set(arguments)
        self.local = {*arguments, *stored_names(tree)}
        points = {"w", "c"} if arguments[:2] == ["w", "c"] else {"x", "y", "z", "a", "b"}
        self.points = point_names(tree, points & {*arguments})

    def fail(self, node: ast.AST, message: str) -> NoReturn:
        line = self.first + getattr(node, "lineno", 1) - 1
        raise KernelError(self.place.format(line) + message)

    def refuse(self, node: ast.AST, instead: str) -> NoReturn:
        self.fail(node, f"{_short(node)} is not in the language of formulas: expected {instead}")

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        if node.args.vararg or node.args.kwarg or node.args.kwonlyargs or node.args.defaults:
            self.fail(node, "expected plain arguments, without * and without defaults")
        node.decorator_list, node.returns = [], None
        node.args.args = [ast.arg(a.arg) for a in [*node.args.posonlyargs, *node.args.args]]
        node.args.posonlyargs = []
        body = node.body[1:] if ast.get_docstring(node) is not None else node.body
        node.body = [self.visit(statement) for statement in body]
        return node

    def visit(self, node: ast.AST) -> Any:
        if isinstance(node, ast.stmt) and not isinstance(node, (*_STATEMENTS, ast.FunctionDef)):
            self.refuse(node, "assignments, for over a range, if, break and return")
        if isinstance(node, ast.expr) and not isinstance(node, (*_EXPRESSIONS, ast.Attribute)):
            self.refuse(node, "numbers, points, arithmetic and comparisons")
        return super().visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        if not isinstance(node.target, ast.Name):
            self.refuse(node, "a name to assign to")
        value = ast.BinOp(ast.Name(node.target.id, ast.Load()), node.op, node.value)
        assign = ast.Assign([node.target], ast.copy_location(value, node))
        return self.generic_visit(ast.copy_location(assign, node))

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        if not (isinstance(node.value, ast.Call) and _short(node.value.func) == "'orbit'"):
            self.refuse(node, "a value that is used")
        return self.generic_visit(node)

    def visit_If(self, node: ast.If) -> ast.AST:
        self.one_for_all(node.test)
        return self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        self.one_for_all(node.test)
        return self.generic_visit(node)

    def one_for_all(self, test: ast.expr) -> None:
        if self.on_points(test):
            self.fail(
                test, f"if {_short(test)} may differ from point to point: expected where(..., ..., ...)"
            )

    def on_points(self, node: ast.expr) -> bool:
        return depends_on_points(node, self.points)

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        return self.of_numbers(node, node.op)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        if isinstance(node.op, ast.UAdd):
            operand: ast.expr = self.visit(node.operand)
            return operand
        return self.of_numbers(node, node.op)

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        if len(node.ops) == 1:
            return self.generic_visit(node)
        terms = [node.left, *node.comparators]
        pairs = [ast.Compare(a, [op], [b]) for a, op, b in zip(terms, node.ops, terms[1:], strict=False)]
        visited: list[Any] = [self.generic_visit(pair) for pair in pairs]
        joined: ast.expr = reduce(lambda a, b: ast.BinOp(a, ast.BitAnd(), b), visited)
        return ast.copy_location(joined, node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        on_points = self.on_points(node)
        node.left, node.right = self.visit(node.left), self.visit(node.right)
        if isinstance(node.op, ast.Pow):
            return self.power(node, node.left, node.right)
        if on_points and type(node.op) in _FLOORED:
            names = {"a": node.left, "b": node.right}
            floored: ast.expr = Naming(names).visit(parse_expression(_FLOORED[type(node.op)]))
            return floored
        return node

    def visit_For(self, node: ast.For) -> ast.AST:
        match node.iter:
            case ast.Call(ast.Name("range")):
                return self.generic_visit(node)
            case ast.Name(name) if name in self.arguments - self.points or is_number(self.scope.get(name)):
                pass
            case ast.Tuple():
                pass
            case _:
                self.refuse(node, "for over a range or a tuple of numbers")
        for statement in _breaks(node.body):
            self.refuse(statement, "a loop over a range to leave")
        return self.generic_visit(node)

    def of_numbers(self, node: ast.expr, op: ast.AST) -> ast.AST:
        """Reject operators that require scalars if their operands are points."""
        if type(op) in _ON_NUMBERS_ALONE and self.on_points(node):
            self.refuse(node, _ON_NUMBERS_ALONE[type(op)])
        return self.generic_visit(node)

    def power(self, node: ast.expr, base: ast.expr, exponent: ast.expr) -> ast.AST:
        match exponent:
            case ast.Name(name) if name not in self.local and is_number(self.scope.get(name)):
                return self.power(node, base, ast.Constant(self.scope[name]))
            case ast.Constant(0.5):
                return _call("sqrt", base)
            case ast.Constant(int(n) | float(n)) if n in range(1, _HIGHEST + 1):
                product = base
                for _ in range(int(n) - 1):
                    product = ast.BinOp(product, ast.Mult(), base)
                return product
        self.refuse(
            node, f"a whole exponent from 1 to {_HIGHEST}, or 0.5; for others exp(exponent * log(base))"
        )

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            self.refuse(node, "arguments by their place")
        node.func, node.args = self.visit(node.func), [self.visit(a) for a in node.args]
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        if called == "pow" and len(node.args) == 2:
            return self.power(node, *node.args)
        if called in ("minimum", "maximum") and len(node.args) > 2:
            first, *others = node.args
            for other in others:
                first = _call(called, first, other)
            return first
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if not isinstance(node.value, (int, float)):
            self.refuse(node, "numbers")
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """Resolve ``np.sqrt`` and ``math.pi``."""
        module = self.scope.get(node.value.id) if isinstance(node.value, ast.Name) else None
        value = getattr(module, node.attr, None) if isinstance(module, ModuleType) else None
        return self.known(node, value, node.attr)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if isinstance(node.ctx, ast.Store) and _OF_THE_KERNEL.fullmatch(node.id):
            self.refuse(node, "another name: this is one of the kernel's own")
        if isinstance(node.ctx, ast.Store) or node.id in self.local:
            return node
        return self.known(node, self.scope.get(node.id), node.id)

    def known(self, node: ast.expr, value: Any, name: str) -> ast.AST:
        meant = intrinsic_name(value) or (name if value is None and name in vocabulary.NAMES else None)
        if meant:
            return ast.Name(meant, ast.Load())
        if isinstance(value, (int, float)) and isinstance(node, ast.Attribute):
            return ast.Constant(value)
        if isinstance(node, ast.Name) and (
            is_number(value) or isinstance(value, FunctionType) or name in _PLAIN
        ):
            return node
        near = hint(name, {*vocabulary.NAMES, *self.local, *_PYTHON}, "{}")
        self.fail(node, f"{_short(node)} is not in the language of formulas; {near}")


def _breaks(body: Sequence[ast.stmt]) -> Iterator[ast.Break]:
    """Statements that leave the loop with this body."""
    for statement in body:
        if isinstance(statement, ast.Break):
            yield statement
        elif isinstance(statement, ast.If):
            yield from _breaks([*statement.body, *statement.orelse])


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


def _short(node: ast.AST) -> str:
    line = " ".join(ast.unparse(node).split())
    return repr(line if len(line) <= 40 else line[:37] + "...")


FIELD = "field"
"""Name of the field's function."""

CALLED = "called"
"""Decorator of functions that are called, not inlined."""


@dataclass(frozen=True, eq=False)
class Linked:
    """Linked scene; equal if text and numbers are.

    Attributes
    ----------
    source
        Source text with the signed field ``field(x, y, z, P)``.
    parameters
        Parameters P, float64 [n].
    held
        Arguments in memory, each with the index in P of its first word.
    """

    source: str
    parameters: np.ndarray
    held: tuple[tuple[int, InMemory], ...] = ()

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
