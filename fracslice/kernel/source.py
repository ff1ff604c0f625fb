"""Copies of formulas as text: fixed arguments substituted, dead branches dropped, outside names resolved."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import FunctionType
from typing import Any

from . import functions, language
from .kept_copies import Texts, kept
from .parsing import parse
from .syntax import Folding, stored_names


@dataclass(frozen=True)
class Copy:
    """Text of a function.

    Attributes
    ----------
    name
        Name of the function in the text.
    text
        Source text.
    calls
        Functions that it calls, by the names used in the text.
    """

    name: str
    text: str
    calls: Mapping[str, Callable[..., Any]]

    def renamed(self, names: Mapping[str, str]) -> str:
        """Return the text with other names for the function and for those it calls."""
        changed = {old: new for old, new in names.items() if old != new}
        if not changed:
            return self.text
        return re.sub(rf"\b({'|'.join(map(re.escape, changed))})\b", lambda m: changed[m[0]], self.text)


def specialised(function: Callable[..., Any], fixed: Mapping[str, Any]) -> ast.FunctionDef:
    """Return a function's tree with its fixed arguments substituted.

    Decorators, docstring and annotations are removed.

    Parameters
    ----------
    function
        Formula.
    fixed
        Values of the fixed arguments.

    Raises
    ------
    KernelError
        If the function is not in the language.
    """
    tree = parse(language.text(function)).body[0]
    assert isinstance(tree, ast.FunctionDef)
    tree.args.args = [a for a in tree.args.args if a.arg not in fixed]
    pruned: ast.FunctionDef = _Substitute(fixed).visit(tree)
    return pruned


def copied(tree: ast.FunctionDef, function: Callable[..., Any], given: frozenset[str] = frozenset()) -> Copy:
    """Return a specialised tree as text, with numbers from outside the function substituted.

    Parameters
    ----------
    tree
        Specialised tree.
    function
        Formula that the tree comes from.
    given
        Names that the text gets from elsewhere.

    Returns
    -------
    Copy
        Text and called functions.
    """
    tree = _Forget().visit(tree)
    scope = functions.scope(function)
    names = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
    stored = stored_names(tree) | {a.arg for a in tree.args.args}
    outside = sorted(names - stored - language.INTRINSICS - given)
    numbers = {name: _plain(scope[name]) for name in outside if functions.is_number(scope.get(name))}
    calls = {name: scope[name] for name in outside if isinstance(scope.get(name), FunctionType)}
    tree = _Substitute(numbers).visit(tree)
    return Copy(tree.name, ast.unparse(tree), calls)


def shared(function: Callable[..., Any], fixed: tuple[tuple[str, Any], ...], given: frozenset[str]) -> Copy:
    """Return the cached copy of a function.

    Scenes are linked anew for every camera; copying is nine tenths of the time.

    Parameters
    ----------
    function
        Formula.
    fixed
        Names and values of the fixed arguments.
    given
        Names that the text gets from elsewhere.

    Returns
    -------
    Copy
        Text and called functions.

    Raises
    ------
    KernelError
        If the function is not in the language.
    """
    return _shared(function, fixed, given, (functions.fingerprint(function), repr(fixed)))


@lru_cache(maxsize=1024)
def _shared(
    function: Callable[..., Any], fixed: tuple[tuple[str, Any], ...], given: frozenset[str], _: object
) -> Copy:
    """Cached copy. The last argument distinguishes values that are equal but not the same: 1 and 1.0, a
    function and its redefinition.
    """

    def make() -> Texts:
        copy = copied(specialised(function, dict(fixed)), function, given)
        return copy.name, copy.text, list(copy.calls)

    name, text, calls = kept(function, (repr(fixed), sorted(given)), make)
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
