"""Check of a formula's text on its syntax tree, before anything of it is executed.

A text that passes is straight-line arithmetic: assignments, loops over constants and a return of numbers,
points and calls of named functions. It holds no attribute, no text, no other call and no import; its size,
its powers and its loops are bounded, so that no text is expensive to compile.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable
from keyword import iskeyword
from typing import NoReturn

from ..common.suggestions import hint
from ..providers import provider
from .verbs import NAMES as VERBS
from .vocabulary import NAMES

LONGEST, DEEPEST, MOST = 4000, 24, 600
"""Characters of a text, levels of its tree, and operations with its powers and loops written out."""

HIGHEST, LARGEST = 16, 1e9
"""Largest exponent and largest number."""

PYTHON = frozenset({"abs", "min", "max"})

_OPERATORS = (
    ast.Add,
    ast.Sub,
    ast.Mult,
    ast.Div,
    ast.Mod,
    ast.Pow,
    ast.BitAnd,
    ast.BitOr,
    ast.USub,
    ast.UAdd,
)
_COMPARED = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
RESERVED = frozenset({*NAMES, *PYTHON, *VERBS, "orbit", "range", "int", "child"})
"""Names that a text cannot define."""

Fail = Callable[[int, str], Exception]
"""Makes the error to raise from a line of the text and a message."""


def is_name(text: str) -> bool:
    """True for a name that a text may define: lower-case letters, digits and underscores."""
    return _NAME.fullmatch(text) is not None and text not in RESERVED and not iskeyword(text)


def checked(text: str, given: Iterable[str], functions: Iterable[str], fail: Fail) -> list[ast.stmt]:
    """Parse a text and check it.

    Parameters
    ----------
    text : str
        Statements, the last of which returns.
    given : iterable of str
        Names that have a value before the first statement.
    functions : iterable of str
        Names that may be called.
    fail : callable
        Makes the error to raise from a line of the text and a message.

    Returns
    -------
    list of ast.stmt
        Statements; numbers other than exponents and counts of loops are floats.

    Raises
    ------
    Exception
        Made by `fail`, at the first line that is not in the white list.
    """
    if len(text) > LONGEST:
        raise fail(1, f"has a text of {len(text)} characters: expected at most {LONGEST}")
    try:
        body: list[ast.stmt] = provider("parsing").parse(text).body
    except SyntaxError as error:
        raise fail(error.lineno or 1, f"is not written in Python: {error.msg}") from None
    except (RecursionError, MemoryError, ValueError):
        raise fail(1, "has a text that is nested too deeply") from None
    check = _Check(set(given), frozenset(functions) | PYTHON, fail)
    check.depth(body)
    check.body(body)
    if not body or not isinstance(body[-1], ast.Return):
        raise fail(getattr(body[-1], "lineno", 1) if body else 1, "expected a return as the last statement")
    if check.cost(body) > MOST:
        raise fail(1, f"has more than {MOST} operations with its loops and powers written out")
    return body


class _Check:
    """Goes through statements in order, and knows the names that have a value."""

    def __init__(self, known: set[str], functions: frozenset[str], fail: Fail) -> None:
        self.known, self.functions, self.fail = known, functions, fail

    def refuse(self, node: ast.AST, expected: str) -> NoReturn:
        shown = " ".join(ast.unparse(node).split())
        shown = shown if len(shown) <= 40 else shown[:37] + "..."
        raise self.fail(getattr(node, "lineno", 1), f"{shown!r} is not allowed: expected {expected}")

    def depth(self, body: list[ast.stmt]) -> None:
        """Refuse deep trees, level by level: the other checks are recursive."""
        level: list[ast.AST] = [*body]
        for _ in range(DEEPEST):
            level = [child for node in level for child in ast.iter_child_nodes(node)]
        if level:
            raise self.fail(body[0].lineno, f"has a text nested more than {DEEPEST} levels deep")

    def body(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            match statement:
                case ast.Assign([target], value):
                    statement.value = self.value(value)
                    self.assign(target)
                case ast.AugAssign(ast.Name(name) as target, op, value):
                    self.operator(statement, op)
                    self.value(ast.copy_location(ast.Name(name, ast.Load()), target))
                    statement.value = self.value(value)
                case ast.For(target, iterated, body, [], None):
                    statement.iter = self.iterated(iterated)
                    self.assign(target)
                    self.body(body)
                case ast.Return(ast.expr() as value):
                    statement.value = self.value(value)
                case _:
                    self.refuse(statement, "assignments, for over constants, and return")

    def assign(self, target: ast.expr) -> None:
        if isinstance(target, ast.Tuple):
            for part in target.elts:
                self.assign(part)
        elif not isinstance(target, ast.Name):
            self.refuse(target, "a name to assign to")
        elif not is_name(target.id):
            self.refuse(target, "a name of lower-case letters that is not that of a function")
        else:
            self.known.add(target.id)

    def iterated(self, node: ast.expr) -> ast.expr:
        match node:
            case ast.Call(ast.Name("range"), [ast.Constant(int(n))], []) if 0 < n <= MOST:
                return node
            case ast.Tuple():
                return self.value(node)
        self.refuse(node, f"range of a number up to {MOST}, or a tuple")

    def value(self, node: ast.expr) -> ast.expr:
        """Check an expression; return it with numbers as floats."""
        match node:
            case ast.Constant(value):
                if isinstance(value, bool) or not isinstance(value, (int, float)) or abs(value) > LARGEST:
                    self.refuse(node, f"numbers up to {LARGEST:g}")
                return ast.copy_location(ast.Constant(float(value)), node)
            case ast.Name(name):
                if name not in self.known:
                    near = hint(name, self.known | self.functions, "{}")
                    raise self.fail(node.lineno, f"{name!r} has no value here; {near}")
            case ast.Tuple(elements) if elements:
                node.elts = [self.value(element) for element in elements]
            case ast.UnaryOp(op, operand):
                self.operator(node, op)
                node.operand = self.value(operand)
            case ast.BinOp(left, ast.Pow(), right):
                node.left = self.value(left)
                self.exponent(right)
            case ast.BinOp(left, op, right):
                self.operator(node, op)
                node.left, node.right = self.value(left), self.value(right)
            case ast.Compare(left, [op], [right]) if isinstance(op, _COMPARED):
                node.left, node.comparators = self.value(left), [self.value(right)]
            case ast.Call(ast.Name(name), arguments, []):
                if name not in self.functions:
                    near = hint(name, self.functions, "{}")
                    raise self.fail(node.lineno, f"{name!r} is no function here; {near}")
                node.args = [self.value(argument) for argument in arguments]
            case _:
                self.refuse(node, "numbers, points, arithmetic, comparisons and calls of functions by name")
        return node

    def operator(self, node: ast.AST, op: ast.AST) -> None:
        if not isinstance(op, _OPERATORS) or (isinstance(node, ast.AugAssign) and isinstance(op, ast.Pow)):
            self.refuse(node, "+, -, *, /, %, **, & and |")

    def exponent(self, node: ast.expr) -> None:
        match node:
            case ast.Constant(int(n)) if type(n) is int and 1 <= n <= HIGHEST:
                return
            case ast.Constant(0.5):
                return
        self.refuse(node, f"a whole exponent from 1 to {HIGHEST}, or 0.5")

    def cost(self, node: ast.AST | list[ast.stmt]) -> int:
        """Operations of a tree whose loops and powers are written out."""
        match node:
            case list():
                return sum(map(self.cost, node))
            case ast.BinOp(base, ast.Pow(), ast.Constant(int(n))):
                return n * (1 + self.cost(base))
            case ast.For(_, ast.Call(_, [ast.Constant(int(n))]), body):
                return n * self.cost(body)
            case ast.For(_, ast.Tuple(elements) as values, body):
                return self.cost(values) + len(elements) * self.cost(body)
        own = 8 if isinstance(node, ast.Call) else isinstance(node, (ast.operator, ast.Compare))
        return own + sum(map(self.cost, ast.iter_child_nodes(node)))
