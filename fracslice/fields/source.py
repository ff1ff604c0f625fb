"""Copies of formulas as text: fixed arguments substituted, dead branches dropped, outside names resolved."""

from __future__ import annotations

import ast
import linecache
import re
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

from ..errors import KernelError
from ..expr import functions, language
from ..expr.functions import Fixed, InMemory, words
from ..expr.host import kept_text
from ..expr.language import Folding, parse, stored_names

if TYPE_CHECKING:
    from .node import Node

Texts = tuple[str, str, list[str]]
"""Name and text of a copy, and the names of the functions that it calls."""


def cached_copy(
    function: Callable[..., Any], made_of: tuple[object, ...], make: Callable[[], Texts]
) -> Texts:
    """Return the texts of a copy: cached, or made and cached.

    A file that other users could have written is not used. A function without a source is not cached.
    """
    code = function.__code__
    linecache.checkcache(code.co_filename)
    lines = "".join(linecache.getlines(code.co_filename, function.__globals__))
    if not lines:
        return make()
    outside = _stable(functions.fingerprint(function))
    place = lines, code.co_firstlineno, function.__qualname__, outside

    def written() -> str:
        copy, text, calls = make()
        return f"{copy}\n{' '.join(calls)}\n{text}"

    name, calls, text = kept_text("copies", (*place, *made_of), written).split("\n", 2)
    return name, text, calls.split()


def _stable(mark: Hashable) -> str:
    """Fingerprint that is the same in every process. The code itself is in the source."""
    if isinstance(mark, tuple):
        return f"({', '.join(map(_stable, mark))})"
    if isinstance(mark, (FunctionType, type)):
        return f"{mark.__module__}.{mark.__qualname__}"
    if isinstance(mark, ModuleType):
        return mark.__name__
    return mark if isinstance(mark, str) else ""


@dataclass(frozen=True)
class Copy:
    """Text of a function."""

    name: str  # name of the function in the text
    text: str  # source text
    calls: Mapping[str, Callable[..., Any]]  # functions that it calls, by the names used in the text

    def renamed(self, names: Mapping[str, str]) -> str:
        """Return the text with other names for the function and for those it calls."""
        changed = {old: new for old, new in names.items() if old != new}
        if not changed:
            return self.text
        return re.sub(rf"\b({'|'.join(map(re.escape, changed))})\b", lambda m: changed[m[0]], self.text)


def specialise(function: Callable[..., Any], fixed: Mapping[str, Any]) -> ast.FunctionDef:
    """Return a function's tree with its fixed arguments substituted.

    Decorators, docstring and annotations are removed.
    """
    tree = parse(language.text(function)).body[0]
    assert isinstance(tree, ast.FunctionDef)
    tree.args.args = [a for a in tree.args.args if a.arg not in fixed]
    pruned: ast.FunctionDef = _Substitute(fixed).visit(tree)
    return pruned


def copy_text(
    tree: ast.FunctionDef, function: Callable[..., Any], given: frozenset[str] = frozenset()
) -> Copy:
    """Return a specialised tree as text, with numbers from outside the function substituted."""
    tree = _Forget().visit(tree)
    scope = functions.scope(function)
    names = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
    stored = stored_names(tree) | {a.arg for a in tree.args.args}
    outside = sorted(names - stored - language.INTRINSICS - given)
    numbers = {name: _plain(scope[name]) for name in outside if functions.is_number(scope.get(name))}
    calls = {name: scope[name] for name in outside if isinstance(scope.get(name), FunctionType)}
    tree = _Substitute(numbers).visit(tree)
    return Copy(tree.name, ast.unparse(tree), calls)


def shared_copy(
    function: Callable[..., Any], fixed: tuple[tuple[str, Any], ...], given: frozenset[str]
) -> Copy:
    """Return the cached copy of a function.

    Scenes are linked anew for every camera; copying is nine tenths of the time.
    """
    return _cached_shared_copy(function, fixed, given, (functions.fingerprint(function), repr(fixed)))


@lru_cache(maxsize=1024)
def _cached_shared_copy(
    function: Callable[..., Any], fixed: tuple[tuple[str, Any], ...], given: frozenset[str], _: object
) -> Copy:
    """Cached copy. The last argument distinguishes values that are equal but not the same: 1 and 1.0, a
    function and its redefinition.
    """

    def make() -> Texts:
        copy = copy_text(specialise(function, dict(fixed)), function, given)
        return copy.name, copy.text, list(copy.calls)

    name, text, calls = cached_copy(function, (repr(fixed), sorted(given)), make)
    scope = functions.scope(function)
    return Copy(name, text, {called: scope[called] for called in calls})


def _plain(value: Any) -> Any:
    """Convert a number of any library to Python's own."""
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    return int(value) if isinstance(value, int) else float(value)


class _Substitute(Folding):
    """Replaces names by constants; unrolls loops over a constant tuple."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.values = values

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if isinstance(node.ctx, ast.Load) and node.id in self.values:
            return _literal(self.values[node.id])
        return node

    def visit_For(self, node: ast.For) -> Any:
        node.iter = self.visit(node.iter)
        if not (isinstance(node.iter, ast.Tuple) and is_literal(node.iter)):
            node.body = self.statements(node.body)
            return node
        names = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
        unrolled: list[ast.stmt] = []
        for value in ast.literal_eval(node.iter):
            values = value if isinstance(node.target, ast.Tuple) else [value]
            inner = dict(zip(map(ast.unparse, names), values, strict=True))
            body = parse(ast.unparse(ast.Module(node.body, []))).body
            unrolled += _Substitute({**self.values, **inner}).statements(body)
        return unrolled


def is_literal(node: ast.expr) -> bool:
    """Return True for a number, or a tuple of literals."""
    if isinstance(node, ast.Tuple):
        return all(map(is_literal, node.elts))
    if isinstance(node, ast.UnaryOp):
        node = node.operand
    return isinstance(node, ast.Constant)


def _literal(value: Any) -> ast.expr:
    """Syntax of a number or of a tuple."""
    if isinstance(value, tuple):
        return ast.Tuple([_literal(v) for v in value], ast.Load())
    return ast.Constant(value)


class _Forget(ast.NodeTransformer):
    """Removes orbit marks, which a field does not use."""

    def visit_Expr(self, node: ast.Expr) -> Any:
        return None if is_mark(node) else node


def is_mark(node: ast.AST) -> bool:
    """Return True for the statement ``orbit(...)``."""
    call = node.value if isinstance(node, ast.Expr) else None
    return isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "orbit"


@dataclass(frozen=True)
class Arguments:
    """Function of a node and its arguments."""

    function: Callable[..., Any]  # function of the formula
    fixed: tuple[tuple[str, Any], ...]  # arguments substituted in a copy of the function
    passed: tuple[str, ...]  # expressions that read the other arguments from P, in the function's order
    numbers: tuple[float, ...]  # numbers in P
    held: tuple[tuple[int, InMemory], ...] = ()  # arguments in memory, by the index of their first word


def arguments(node: Node, leading: int) -> Arguments:
    """Return the function of a node and its arguments."""
    function, values = node.function, node.arguments
    names = functions.parameters(function)[leading:]
    if set(names) != set(values):
        place = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        wanted, given = (", ".join(s) or "nothing" for s in (values, names))
        raise KernelError(
            f"{place}: formula {node.formula.name}: expected {function.__name__} to take {wanted} "
            f"after its points, found {given}"
        )
    fixed = tuple((name, values[name].value) for name in names if isinstance(values[name], Fixed))
    numbers: list[float] = []
    passed, held = [], []
    for value in (values[name] for name in names if not isinstance(values[name], Fixed)):
        if isinstance(value, InMemory):
            held.append((len(numbers), value))
        passed.append(append_numbers(value, numbers, "P0"))
    return Arguments(function, fixed, tuple(passed), tuple(numbers), tuple(held))


def append_numbers(value: Any, numbers: list[float], origin: str = "") -> str:
    """Append a number or a tuple of numbers to a list; of an argument in memory its hash."""
    if isinstance(value, InMemory):
        value = words(value.digest)
    if isinstance(value, tuple):
        return f"({', '.join(append_numbers(v, numbers, origin) for v in value)},)"
    place = f"{origin} + {len(numbers)}" if origin else str(len(numbers))
    numbers.append(float(value))
    return f"int(P[{place}])" if isinstance(value, int) else f"P[{place}]"
