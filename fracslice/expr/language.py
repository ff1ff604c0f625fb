"""Language of formulas: what of Python a formula may use, where it goes wrong, and the identity of a
function by its lines and all that it sees.

A formula is plain Python over points: arithmetic, comparisons, the intrinsics of `expr.vocabulary`,
``for`` over a range or a tuple of numbers, and ``if not any_of(...): break``. Functions of Python and NumPy
with the same meaning (abs, min, max, pow, ``math.sqrt``, ``np.sqrt``) stand for intrinsics. Everything else
is rejected here, by file and line, before anything is compiled.
"""

from __future__ import annotations

import ast
import builtins
import linecache
import math
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from enum import Enum
from functools import lru_cache
from operator import itemgetter
from threading import Lock
from types import CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ..common.messages import hint
from ..errors import KernelError
from . import vocabulary


def parameters(function: Callable[..., Any]) -> list[str]:
    """Return the names of a function's parameters."""
    code = function.__code__
    return list(code.co_varnames[: code.co_argcount])


def scope(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the names visible to a function from outside: builtins, its module's globals and its
    closure.
    """
    assert isinstance(function, FunctionType)
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    return {**vars(builtins), **function.__globals__, **{name: cell.cell_contents for name, cell in cells}}


def is_number(value: Any) -> bool:
    """Return True for a number, or a tuple of numbers, that a function takes from outside."""
    if isinstance(value, tuple):
        return all(map(is_number, value))
    return isinstance(value, (int, float))


def fingerprint(function: Callable[..., Any]) -> Hashable:
    """Return a fingerprint, equal while a function's code and all values it uses from outside are the same.

    In a notebook, the values that a function's text depends on may change.
    """
    assert isinstance(function, FunctionType)
    code, names = function.__code__, outer_names(function.__code__)
    cells = zip(code.co_freevars, function.__closure__ or (), strict=True)
    around = {name: cell.cell_contents for name, cell in cells}
    return code, tuple(_mark(around.get(n, function.__globals__.get(n)), names) for n in names)


@lru_cache(maxsize=4096)
def outer_names(code: CodeType) -> tuple[str, ...]:
    """Return the names that a function uses from outside, and their attributes."""
    names, waiting = set[str](), [code]
    while waiting:
        part = waiting.pop()
        names.update(part.co_names, part.co_freevars)
        waiting += [inner for inner in part.co_consts if isinstance(inner, CodeType)]
    return tuple(sorted(names))


def _mark(value: Any, attributes: tuple[str, ...] = ()) -> Hashable:
    """Fingerprint of a value: functions by identity, numbers by type and every digit."""
    if isinstance(value, FunctionType):
        return value
    if isinstance(value, ModuleType):
        return value, tuple(_mark(vars(value).get(name)) for name in attributes)
    if is_dataclass(value) and not isinstance(value, type):
        return value  # type: ignore[return-value]
    return type(value), repr(value) if isinstance(value, (int, float, tuple)) else None


def identity(*values: Any) -> str:
    """Describe functions, the functions that they call, and all values that these use from outside."""
    described = _Described()
    for value in values:
        described.add(value)
    described.follow()
    described.add_records()
    return "\n".join(described.lines)


class _Described:
    """Lines on values, then on everything that they refer to, each once."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.seen: dict[tuple[int, tuple[str, ...]], Any] = {}
        self.waiting = deque[tuple[Any, tuple[str, ...]]]()  # values whose parts are not described yet
        self.names = set[str]()  # names that the functions use
        self.records: list[Any] = []  # those whose attributes of these names are used

    def add(self, value: Any, names: tuple[str, ...] = ()) -> None:
        """Add a value; of a module or a class the attributes with some names."""
        if value is None or isinstance(value, (bool, int, float, str, Enum)):
            self.lines.append(repr(value))
            return
        self.lines.append(_label(value))
        if isinstance(value, FunctionType):
            names = outer_names(value.__code__)
        if (id(value), names) not in self.seen:
            self.seen[id(value), names] = value
            self.waiting.append((value, names))

    def follow(self) -> None:
        """Describe the parts of all values."""
        while self.waiting:
            self.describe(*self.waiting.popleft())

    def describe(self, value: Any, names: tuple[str, ...]) -> None:
        """Add the parts of a value."""
        if isinstance(value, FunctionType):
            outside = scope(value)
            self.names.update(names)
            self.lines += _source(value.__code__)
            self.add_named({name: outside[name] for name in names if name in outside}, names)
        elif type(value) is tuple:
            self.lines.append(str(len(value)))
            for item in value:
                self.add(item, names)
        elif isinstance(value, (ModuleType, type)):
            self.add_named({name: getattr(value, name) for name in names if hasattr(value, name)}, names)
        elif known := getattr(value, "identity", None):
            self.lines.append(known)
        elif isinstance(value, tuple) or is_dataclass(value):
            self.records.append(value)

    def add_named(self, values: dict[str, Any], names: tuple[str, ...]) -> None:
        """Add values with their names."""
        for name, value in values.items():
            self.lines.append(name)
            self.add(value, names)

    def add_records(self) -> None:
        """Add the attributes of records that functions use, now that all functions are known."""
        known = None
        while known != len(self.names):  # attributes may be functions
            known, names = len(self.names), tuple(sorted(self.names))
            for record in self.records:
                self.lines.append(_label(record))
                self.add_named(
                    {name: getattr(record, name) for name in names if hasattr(record, name)}, names
                )
            self.follow()


def _label(value: Any) -> str:
    """Kind and name of a value, without its address."""
    name = getattr(value, "__qualname__", getattr(value, "__name__", ""))
    return f"{type(value).__qualname__} {getattr(value, '__module__', '')}.{name}"


def _source(code: CodeType) -> list[str]:
    """Lines of a function; its instructions if it has none."""
    linecache.checkcache(code.co_filename)
    lines, first = linecache.getlines(code.co_filename), code.co_firstlineno
    if not lines:
        return [code.co_code.hex(), repr(code.co_consts), repr(code.co_names), repr(code.co_varnames)]
    return [line.rstrip() for line in lines[first - 1 : _last_line(code)]]


def _last_line(code: CodeType) -> int:
    """Last line of a function with an instruction."""
    inner = [_last_line(c) for c in code.co_consts if isinstance(c, CodeType)]
    lines: Iterator[int] = filter(None, map(itemgetter(2), code.co_lines()))
    return max([code.co_firstlineno, *lines, *inner])


EVALUATED: set[Callable[..., Any]] = set()
"""Functions of numbers that are evaluated where a step is read: their values are constants of the code."""


@dataclass(frozen=True)
class Fixed:
    """An argument that is compiled into the kernel instead of being passed to it, because the code depends on
    it.

    Attributes
    ----------
    value : object
        The constant.
    """

    value: Any


@dataclass(frozen=True)
class OfPoint:
    """An argument that differs from point to point.

    Attributes
    ----------
    function : callable
        Function of x, y and z in the language of formulas.
    """

    function: Callable[..., Any]


WORDS = 4
"""Numbers of P that an address takes, of 16 bits each: every float holds them."""


@dataclass(frozen=True, eq=False)
class InMemory:
    """An argument that lies in memory, where native code reads it. In P stands the hash of its contents, and
    in its place, in a loaded kernel, its address.

    Attributes
    ----------
    digest : int
        64 bits of a hash of the contents.
    native : object
        Native object that owns them, with `address`, where they are, and `distances` of points [n, axes].
    """

    digest: int
    native: Any

    @property
    def address(self) -> int:
        """Where the contents are, while this object exists."""
        address: int = self.native.address
        return address

    def distances(self, *coordinates: np.ndarray) -> np.ndarray:
        """Signed distances of points, by their coordinates along each axis, arrays of one shape."""
        points = np.stack([np.asarray(a, np.float64).ravel() for a in coordinates], 1)
        return np.asarray(self.native.distances(points)).reshape(np.shape(coordinates[0]))


def words(number: int) -> tuple[float, ...]:
    """Words of a number of 64 bits, the lowest first."""
    return tuple(float(number >> 16 * k & 0xFFFF) for k in range(WORDS))


def evaluated(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a function that is evaluated where a step is read."""
    EVALUATED.add(function)
    return function


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
