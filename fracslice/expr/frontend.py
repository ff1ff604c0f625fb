"""Reader of the language: from functions of Python to graphs.

What a function takes from outside is known when it is read: numbers become constants, functions are called,
branches on what is known are resolved, loops over tuples that are known are unrolled. An argument may be
known, too. The text is structured: names are assigned, and branches and loops end where they began. Every
name therefore has one value at every place, and a value that differs where two ways join becomes a parameter
of the block there (Braun et al. 2013, "Simple and Efficient Construction of Static Single Assignment Form",
has the general case).
"""

from __future__ import annotations

import ast
import linecache
import operator
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from functools import lru_cache, reduce
from types import FunctionType
from typing import Any, NoReturn

from ..errors import KernelError
from . import vocabulary
from .graph import (
    Block,
    Entry,
    FlowGraph,
    Function,
    MismatchError,
    Names,
    Value,
    Width,
    Writer,
    identified,
)
from .language import (
    HIGHEST,
    body_of,
    check,
    depends_on_points,
    fingerprint,
    identity,
    intrinsic_name,
    is_number,
    parameters,
    parse,
    scope,
    stored_names,
)
from .loops import OPERATIONS, Loop, is_inline, is_intrinsic

OPERATORS: dict[type, str] = {
    ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "truediv", ast.FloorDiv: "floordiv",
    ast.Mod: "mod", ast.BitAnd: "and_", ast.BitOr: "or_", ast.BitXor: "xor", ast.LShift: "lshift",
    ast.RShift: "rshift", ast.Lt: "lt", ast.LtE: "le", ast.Gt: "gt", ast.GtE: "ge", ast.Eq: "eq",
    ast.NotEq: "ne", ast.USub: "neg", ast.Invert: "invert", ast.Not: "not_",
}  # fmt: skip
"""Names in Python's `operator` of its operators."""

Fixed = tuple[tuple[str, Any], ...]
"""Arguments that are known when a function is read, by name."""

_UNKNOWN = object()


@dataclass(frozen=True, eq=False)
class Source:
    """Text of a function, and what it sees outside."""

    name: str
    names: tuple[str, ...]  # of its arguments
    identity: str
    place: str  # file and kind, for errors, with braces for the line
    tree: Callable[[], ast.FunctionDef]
    scope: Callable[[], Mapping[str, Any]]
    is_own: bool = False  # whether it is code of a kernel, which may use records, and is no formula of a user
    known: Fixed = ()  # arguments that are known

    @classmethod
    def of(cls, function: Callable[..., Any], kind: str, *known: Any) -> Source:
        """Source of a function of Python; `known`: arguments that are part of its identity."""
        names, about = tuple(parameters(function)), identity(function, *known)
        place = cls.place_of(function, kind)
        return cls(function.__name__, names, about, place, lambda: syntax(function), lambda: scope(function))

    @staticmethod
    def place_of(function: Callable[..., Any], kind: str) -> str:
        """Place of a function, for errors."""
        return f"{function.__code__.co_filename}:{{}}: {kind} {function.__name__}: "

    def error(self, node: Any, message: str) -> KernelError:
        """Error about a statement or an expression."""
        shown = (
            f"{ast.unparse(node).splitlines()[0]!r} cannot be compiled: "
            if isinstance(node, ast.stmt)
            else ""
        )
        return KernelError(f"{self.place.format(getattr(node, 'lineno', 1))}{shown}{message}")


def syntax(function: Callable[..., Any]) -> ast.FunctionDef:
    """Return the syntax tree of a function, with the line numbers of its file.

    Raises
    ------
    KernelError
        If its source cannot be read.
    """
    import inspect  # which takes as long as loading a small scene

    name = function.__name__
    linecache.checkcache(function.__code__.co_filename)
    try:
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError):
        raise KernelError(
            f"formula {name}: its source cannot be read; expected a def in a file or a notebook"
        ) from None
    tree = parse(textwrap.dedent("".join(lines))).body[0]
    ast.increment_lineno(tree, max(first, 1) - 1)
    if not isinstance(tree, ast.FunctionDef):
        raise KernelError(f"{function.__code__.co_filename}:{first}: formula {name}: expected a def")
    return tree


def formula(function: Callable[..., Any] | Function, fixed: Fixed = ()) -> Function:
    """Return a function in the language of formulas with some arguments fixed.

    When it is compiled or evaluated, it is read, and refused with a `KernelError` if it is not in the
    language.
    """
    if isinstance(function, Function):
        return _read_again(FormulaReader, function, fixed, repr(fixed)) if fixed else function
    return _function(FormulaReader, function, fixed, function.__name__, _mark(function, fixed))


def own_formula(function: Callable[..., Any], fixed: Fixed) -> Function:
    """Return a formula of ours, unchecked, with some arguments fixed: records of what it computes.

    Unlike a kernel function, it is read again by the readers of formulas, such as those of orbit traps.
    """
    source = Source.of(function, "formula", *(value for _, value in fixed))
    return source_function(FormulaReader, replace(source, is_own=True), fixed)


def loop_function(loop: Loop) -> Function:
    """Return the function of a loop."""
    return _loop(Reader, loop.function, loop.fixed, loop.name, _mark(loop.function, loop.fixed))


def kernel_function(function: Callable[..., Any], fixed: Fixed = ()) -> Function:
    """Return a function of a kernel with some arguments fixed: records of which `repr` says everything."""
    # all of it is ours: only another process sees other values around it, unlike a formula of a notebook
    plain = _function(KernelReader, function, (), function.__name__, None)
    return _read_again(KernelReader, plain, fixed, repr(fixed)) if fixed else plain


def _mark(function: Callable[..., Any], fixed: Fixed) -> object:
    """What differs of values that are equal but not the same: 1 and 1.0, a function and its redefinition."""
    return fingerprint(function), tuple(repr(value) for _, value in fixed if is_number(value))


def _read(kind: type[Reader], function: Callable[..., Any], fixed: Fixed, name: str, _: object) -> Function:
    """Function that a reader reads."""
    source = Source.of(function, kind.kind, *(value for _, value in fixed))
    return source_function(kind, replace(source, name=name), fixed)


_function = lru_cache(maxsize=2048)(_read)
# Few: what is fixed in a loop holds its scene, and each edit makes another one.
_loop = lru_cache(maxsize=32)(_read)


@lru_cache(maxsize=256)
def _read_again(kind: type[Reader], function: Function, fixed: Fixed, text: str) -> Function:
    """Function with some arguments fixed, which a text tells apart; see `_mark`."""
    about = identified(function.source.identity, text)
    return source_function(kind, replace(function.source, identity=about), fixed)


def source_function(kind: type[Reader], source: Source, fixed: Fixed, **given: Any) -> Function:
    """Return the function of a source.

    `kind`: its reader, which takes what is `given`, of text identities.
    """
    known = {**dict(source.known), **dict(fixed)}
    names = tuple(name for name in source.names if name not in known)
    source = replace(source, known=tuple(known.items()))

    def read(width: Width) -> FlowGraph:
        reader = kind(width, source=source, fixed=known, **given)
        reader.begin(names)
        return reader.read()

    about = identified(kind.__name__, source.identity, *known, *map(str, given.values()))
    return Function(source.name, names, about, read, source.error, source)


_VOCABULARY = vocabulary.ALL | {"int"}


@dataclass
class Reader(Writer):
    """Reads the statements of a function."""

    source: Source = field(kw_only=True)
    fixed: dict[str, Any] = field(default_factory=dict)  # what is known, by name
    exits: list[list[tuple[Block, Names]]] = field(default_factory=list)  # of the loops around
    returns: int = 0

    kind = "loop"

    def fail(self, node: ast.AST, message: str) -> NoReturn:
        raise self.source.error(node, message)

    def read(self) -> FlowGraph:
        """Read the body."""
        body = self.opened()
        if self.statements(body):
            self.give(None)
            if self.returns:
                self.fail(body[-1], "not every way through the function returns a value")
        return self.graph

    def opened(self) -> list[ast.stmt]:
        """Statements of the body, before the first is read."""
        self.tree, self.scope = self.source.tree(), self.source.scope()
        self.local = {*(a.arg for a in self.tree.args.args), *stored_names(self.tree)}
        self.names["WIDTH"] = Value("constant", data=self.width.lanes)
        return body_of(self.tree)

    # --- what is known ---
    def outside(self, name: str) -> Any:
        """What a name stands for outside the function."""
        return self.scope.get(name, _UNKNOWN)

    def known(self, node: ast.expr) -> Any:
        """Value of an expression that is known when the function is read; operators on whole numbers are."""
        match node:
            case ast.Constant(value):
                return value
            case ast.Name("WIDTH"):
                return _UNKNOWN
            case ast.Name(name) if name in self.fixed:
                return self.fixed[name]
            case ast.Name(name):
                return _UNKNOWN if name in self.local else self.outside(name)
            case ast.Attribute(record, name):
                return getattr(self.known(record), name, _UNKNOWN)
            case ast.Tuple(parts):
                values = tuple(map(self.known, parts))
                return _UNKNOWN if any(value is _UNKNOWN for value in values) else values
            case ast.Subscript(place, index):
                place, index = self.known(place), self.known(index)
                return place[index] if type(place) is tuple and type(index) is int else _UNKNOWN
            case ast.UnaryOp(ast.USub(), ast.Constant(float(number))):
                return -number
            case ast.UnaryOp(ast.Not(), operand):
                operand = self.known(operand)
                return not operand if _decides(operand) else _UNKNOWN
            case ast.UnaryOp(op, operand):
                return self.folded(op, operand)
            case ast.BinOp(left, op, right) if not isinstance(op, ast.Pow):
                return self.folded(op, left, right)
            case ast.BoolOp(op, parts):
                terms = [self.known(part) for part in parts]
                decide = all if isinstance(op, ast.And) else any
                return decide(terms) if all(map(_decides, terms)) else _UNKNOWN
            case ast.Compare(left, [ast.Eq()], [ast.Constant(str(word))]):
                left = self.known(left)
                return left == word if isinstance(left, str) else _UNKNOWN
            case ast.Compare(left, [op], [right]):
                return self.folded(op, left, right)
            case ast.IfExp(test, yes, no):
                test = self.known(test)
                return _UNKNOWN if not _decides(test) else self.known(yes if test else no)
        return _UNKNOWN

    def folded(self, op: ast.AST, *operands: ast.expr) -> Any:
        values = [self.known(operand) for operand in operands]
        if not all(isinstance(value, int) for value in values) or type(op) not in OPERATORS:
            return _UNKNOWN
        return getattr(operator, OPERATORS[type(op)])(*map(int, values))

    # --- expressions ---
    def value(self, node: ast.expr) -> Value:
        """Read an expression."""
        known = self.known(node)
        if is_number(known):
            return self.constant(_plain(known))
        if _is_stored(known):
            return self.stored(known)
        match node:
            case ast.Name(name) if name in self.names:
                return self.names[name]
            case ast.Name() | ast.Attribute():
                raise MismatchError(f"{ast.unparse(node)!r} has no value here")
            case ast.Tuple(parts):
                return self.add("tuple", *self.each(parts))
            case ast.UnaryOp(ast.UAdd(), operand):
                return self.value(operand)
            case ast.UnaryOp(op, operand):
                return self.add(OPERATORS[type(op)], self.value(operand))
            case ast.BinOp(left, ast.Pow(), right):
                return self.power(self.value(left), self.known(right))
            case ast.BinOp(left, op, right):
                return self.binary(node, OPERATORS[type(op)], self.value(left), self.value(right))
            case ast.Compare(left, ops, others):
                terms = list(map(self.value, (left, *others)))
                pairs = zip(ops, terms, terms[1:], strict=False)
                compared = [self.comparison(OPERATORS[type(op)], a, b) for op, a, b in pairs]
                return reduce(lambda a, b: self.add("and_", a, b), compared)
            case ast.BoolOp(op, [first, *others]):
                return reduce(lambda a, b: self.short(op, a, b), others, self.truth(first))
            case ast.IfExp(test, yes, no):
                return self.choice(test, yes, no)
            case ast.Subscript(place, index):
                return self.element(self.value(place), self.value(index))
            case ast.Call(function, arguments):
                return self.calling(node, function, arguments)
        raise MismatchError("it is not in the language")

    def stored(self, known: Any) -> Value:
        """Read numbers from P."""
        if isinstance(known, tuple):
            return self.add("tuple", *map(self.stored, known))
        return self.entry(known) if isinstance(known, Entry) else self.constant(_plain(known))

    def each(self, nodes: Sequence[ast.expr]) -> list[Value]:
        """Values of expressions; ``*`` stands for the parts of a tuple."""
        return [value for node in nodes for value in self.parts_of(node)]

    def parts_of(self, node: ast.expr) -> Sequence[Value]:
        """Value of an expression, or the parts of a tuple behind ``*``."""
        if not isinstance(node, ast.Starred):
            return [self.value(node)]
        value = self.value(node.value)
        if value.op != "tuple":
            raise MismatchError(f"{ast.unparse(node.value)!r} is no tuple of known length")
        return value.operands

    def truth(self, node: ast.expr) -> Value:
        return self.add("truth", self.value(node))

    def binary(self, node: ast.expr, op: str, a: Value, b: Value) -> Value:
        return self.add(op, a, b)

    def power(self, base: Value, exponent: Any) -> Value:
        """A root, or a product."""
        if exponent == 0.5:
            return self.add("sqrt", base)
        if exponent not in range(1, HIGHEST + 1):
            raise MismatchError(f"a whole exponent from 1 to {HIGHEST}, or 0.5, is expected")
        return reduce(lambda product, _: self.add("mul", product, base), range(int(exponent) - 1), base)

    def comparison(self, op: str, a: Value, b: Value) -> Value:
        """A comparison; of whole constants, such as WIDTH, it is one."""
        if type(a.known) is int and type(b.known) is int:
            return self.constant(bool(getattr(operator, op)(a.known, b.known)))
        return self.add(op, a, b)

    def element(self, place: Value, index: Value) -> Value:
        if place.op == "tuple" and type(index.known) is int:
            return place.operands[index.known]
        return self.add("element", place, index)

    def choice(self, test: ast.expr, yes: ast.expr, no: ast.expr) -> Value:
        known = self.known(test)
        if _decides(known):
            return self.value(yes if known else no)
        condition = self.value(test)
        if isinstance(condition.known, bool):
            return self.value(yes if condition.known else no)
        return self.chosen(condition, lambda: self.value(yes), lambda: self.value(no))

    def short(self, op: ast.boolop, a: Value, node: ast.expr) -> Value:
        """``and`` or ``or``: the second operand is evaluated only if the first does not decide."""
        if isinstance(op, ast.And):
            return self.chosen(a, lambda: self.truth(node), lambda: self.constant(False))
        return self.chosen(a, lambda: self.constant(True), lambda: self.truth(node))

    def chosen(self, test: Value, yes: Callable[[], Value], no: Callable[[], Value]) -> Value:
        """A choice between two values; only the chosen one is computed."""
        names, ends = self.names, []
        for block, way in zip(self.fork(test), (yes, no), strict=True):
            self.block = block
            value = way()
            ends.append((self.block, {"": value}))
        self.joined(ends)
        (value,), self.names = self.names.values(), names
        return value

    # --- calls ---
    def calling(self, node: ast.Call, function: ast.expr, arguments: list[ast.expr]) -> Value:
        """A call of an intrinsic, of a function from outside, or of one of the scene."""
        if node.keywords:
            self.fail(node, f"{ast.unparse(node)!r}: expected arguments by their place")
        match node:
            case ast.Call(ast.Name("tuple"), [ast.GeneratorExp(element, [generator])]):
                return self.unrolled_tuple(node, element, generator)
        called = self.known(function)
        name = self.operation(function, called)
        if name is not None:
            return self.intrinsic(name, self.each(arguments))
        if is_intrinsic(called):
            return self.call(called.__name__, *self.each(arguments))
        if isinstance(called, Function):
            return self.call_counted(called, self.each(arguments))
        if not isinstance(called, FunctionType):
            raise MismatchError(f"{ast.unparse(function)!r} is no function")
        return self.call_function(called, arguments)

    def call_counted(self, function: Function, given: list[Value]) -> Value:
        """A call with as many values as the function takes."""
        if len(given) != len(function.parameters):
            count = len(function.parameters)
            raise MismatchError(f"{function.name} takes {count} values, found {len(given)}")
        return self.call(function, *given)

    def operation(self, node: ast.expr, called: Any) -> str | None:
        """The operation that a function stands for."""
        if called in (min, max, int):
            return str(called.__name__)
        if is_intrinsic(called):
            return called.__name__ if called.__name__ in OPERATIONS else None
        return intrinsic_name(called)

    def intrinsic(self, name: str, given: list[Value]) -> Value:
        if name == "pow":
            return self.power(given[0], given[1].known)
        if name in ("minimum", "maximum") and len(given) > 2:
            return reduce(lambda a, b: self.add(name, a, b), given)
        return self.add(name, *given)

    def call_function(self, called: Callable[..., Any], arguments: list[ast.expr]) -> Value:
        """A call of a function from outside; what is known and no number is fixed in it."""
        fixed, passed, names = [], [], parameters(called)
        for name, argument in zip(names, arguments, strict=False):
            value = self.known(argument)
            if value is _UNKNOWN or isinstance(value, (int, float)):
                passed.append(self.value(argument))
            else:
                fixed.append((name, value))
        passed += map(self.value, arguments[len(names) :])
        kept = tuple(fixed)
        return self.call_counted(
            _function(Reader, called, kept, called.__name__, _mark(called, kept)), passed
        )

    def unrolled_tuple(self, node: ast.Call, element: ast.expr, generator: ast.comprehension) -> Value:
        """A tuple of known length."""
        match generator:
            case ast.comprehension(ast.Name(counter), ast.Call(ast.Name("range"), [limit]), []):
                count = self.known(limit)
                values = tuple(range(count)) if type(count) is int else _UNKNOWN
            case ast.comprehension(ast.Name(counter), iterated, []):
                values = self.known(iterated)
            case _:
                values = _UNKNOWN
        if not isinstance(values, tuple):
            self.fail(node, "expected a range or a tuple that is known when the loop is compiled")
        return self.add("tuple", *(self.with_known({counter: value}, element) for value in values))

    def with_known(self, values: Mapping[str, Any], node: ast.expr) -> Value:
        outer, self.fixed = self.fixed, {**self.fixed, **values}
        value = self.value(node)
        self.fixed = outer
        return value

    # --- statements: each returns True if the next statement is reachable ---
    def statements(self, body: Sequence[ast.stmt]) -> bool:
        for statement in body:
            self.statement = statement
            try:
                reached = self.read_statement(statement)
            except MismatchError as error:
                self.fail(statement, str(error))
            if not reached:
                return False
        return True

    def read_statement(self, node: ast.stmt) -> bool:
        match node:
            case ast.Assign([target], value):
                self.assign(target, self.value(value))
            case ast.AugAssign(target, op, value):
                self.assign(target, self.value(ast.BinOp(_loaded(target), op, value)))
            case ast.Expr(value):
                self.expression(value)
            case ast.Return(value):
                self.returned(self.value(value) if value else self.add("tuple"))
                return False
            case ast.Break():
                self.exits[-1].append((self.block, dict(self.names)))
                return False
            case ast.If(test, body, orelse):
                return self.condition(test, body, orelse)
            case ast.While(ast.Constant(True)):
                return self.repeated(node, lambda: None)
            case ast.While(test):
                return self.repeated(node, lambda: self.value(test))
            case ast.For(ast.Name(counter), ast.Call(ast.Name("range"), limits)):
                return self.ranged(node, counter, list(map(self.value, limits)))
            case ast.For(ast.Name(counter), ast.Call(ast.Name("shares"), [count, step])):
                return self.shared(node, counter, self.value(count), self.value(step))
            case ast.For(target, iterated):
                return self.over(node, target, iterated)
            case ast.Pass():
                pass
            case _:
                raise MismatchError("it is not in the language")
        return True

    def expression(self, node: ast.expr) -> None:
        """A statement that is an expression."""
        self.value(node)

    def returned(self, value: Value) -> None:
        """The end of the function."""
        self.give(value)
        self.returns += 1

    def assign(self, target: ast.expr, value: Value) -> None:
        match target:
            case ast.Name(name):
                self.names[name] = value
            case ast.Tuple(parts):
                for part, item in zip(parts, self.items(value, len(parts)), strict=True):
                    self.assign(part, item)
            case ast.Subscript(place, index):
                self.add("set", self.value(place), self.value(index), value)
            case _:
                raise MismatchError("a name is expected to assign to")

    def condition(self, test: ast.expr, body: Sequence[ast.stmt], orelse: Sequence[ast.stmt]) -> bool:
        known = self.known(test)
        if _decides(known):
            return self.statements(body if known else orelse)
        condition = self.value(test)
        if isinstance(condition.known, bool):
            return self.statements(body if condition.known else orelse)
        return self.branch(condition, body, orelse)

    def branch(self, test: Value, body: Sequence[ast.stmt], orelse: Sequence[ast.stmt]) -> bool:
        names, ends, statement = dict(self.names), [], self.statement
        for block, part in zip(self.fork(test), (body, orelse), strict=True):
            self.block, self.names = block, dict(names)
            if self.statements(part):
                ends.append((self.block, self.names))
        self.statement = statement
        return self.joined(ends)

    def ranged(self, node: ast.For, counter: str, limits: list[Value]) -> bool:
        """A loop over a range."""
        ends = [limit.known for limit in limits]
        if self.width.lanes == 1 and all(type(end) is int for end in ends) and _fills_array(node.body):
            return self.rounds(node.body, ({counter: k} for k in range(*ends)))
        return self.within(lambda exits: self.counted(counter, limits, *self.parts(node), exits))

    def repeated(self, node: ast.While, test: Callable[[], Value | None]) -> bool:
        """A loop while a condition holds."""
        changed, body = self.parts(node)
        return self.within(lambda exits: self.loop(changed, {}, test, body, exits))

    def within(self, loop: Callable[[list[tuple[Block, Names]]], bool]) -> bool:
        """Read a loop; statements in it may leave it."""
        self.exits.append([])
        reached = loop(self.exits[-1])
        self.exits.pop()
        return reached

    def parts(self, node: ast.For | ast.While) -> tuple[set[str], Callable[[], bool]]:
        """Names that the body of a loop assigns, and its reader."""
        return self.assigned(node.body), lambda: self.statements(node.body)

    def assigned(self, body: Sequence[ast.stmt]) -> set[str]:
        """Names that statements assign, without those that are known to be passed over."""
        names = set[str]()
        for statement in body:
            match statement:
                case ast.If(test, then, orelse) if _decides(known := self.known(test)):
                    names |= self.assigned(then if known else orelse)
                case ast.If(_, then, orelse):
                    names |= self.assigned([*then, *orelse])
                case ast.For(_, _, inner) | ast.While(_, inner):
                    names |= self.assigned(inner)
                case _:
                    names |= stored_names(statement)
        return names

    def over(self, node: ast.For, target: ast.expr, iterated: ast.expr) -> bool:
        """A loop over a tuple of numbers: its rounds one after the other."""
        values = self.known(iterated)
        if type(values) is not tuple:
            raise MismatchError("it is not in the language")
        names = [target] if isinstance(target, ast.Name) else getattr(target, "elts", [])
        rows = (value if isinstance(target, ast.Tuple) else (value,) for value in values)
        return self.rounds(node.body, (dict(zip(map(ast.unparse, names), row, strict=True)) for row in rows))

    def rounds(self, body: Sequence[ast.stmt], values: Iterator[dict[str, Any]]) -> bool:
        """The rounds of a loop one after the other; the names of its counters are known in each."""
        outer = self.fixed
        for known in values:
            self.fixed = {**outer, **known}
            if not self.statements(body):
                return False
        self.fixed = outer
        return True

    def shared(self, node: ast.For, counter: str, count: Value, step: Value) -> bool:
        """A loop that the threads of a GPU share, one round each; elsewhere it is a loop over a range.

        Where there is one lane, a round is of one.
        """
        if not self.width.on_gpu:
            step = self.constant(1) if self.width.lanes == 1 else step
            return self.ranged(node, counter, [self.constant(0), count, step])
        self.names[counter] = thread = self.add("thread")
        return self.branch(self.add("lt", thread, count), node.body, ())


def _decides(value: Any) -> bool:
    """True for a known value on which a branch is resolved."""
    return value is not _UNKNOWN


def _is_stored(value: Any) -> bool:
    """True for numbers that are read from P."""
    return isinstance(value, Entry) or (type(value) is tuple and any(map(_is_stored, value)))


def is_record(value: Any) -> bool:
    """Return True for a record, or a tuple of records, that is known when a function is read."""
    if type(value) is tuple:
        return bool(value) and all(map(is_record, value))
    return is_dataclass(value) and not isinstance(value, (type, Function))


def _plain(value: Any) -> Any:
    """Convert a number of any library to Python's own."""
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    return value if isinstance(value, bool) else int(value) if isinstance(value, int) else float(value)


def _loaded(target: ast.expr) -> ast.expr:
    """The expression of what is assigned to."""
    match target:
        case ast.Name(name):
            return ast.copy_location(ast.Name(name, ast.Load()), target)
        case ast.Subscript(place, index):
            return ast.copy_location(ast.Subscript(place, index, ast.Load()), target)
    return target


def _fills_array(body: Sequence[ast.stmt]) -> bool:
    """True if statements, which no break leaves, assign elements of an array."""
    nodes = [node for statement in body for node in ast.walk(statement)]
    stores = any(isinstance(n, ast.Subscript) and isinstance(n.ctx, ast.Store) for n in nodes)
    return stores and not any(isinstance(n, ast.Break) for n in nodes)


@dataclass
class FormulaReader(Reader):
    """Reads functions in the language of formulas."""

    kind = "formula"

    def read(self) -> FlowGraph:
        source = self.source
        self.points = set() if source.is_own else check(source.tree(), source.scope(), source.error)
        return super().read()

    def binary(self, node: ast.expr, op: str, a: Value, b: Value) -> Value:
        """An operator; remainders and floored quotients of points are those of Python."""
        if op not in ("mod", "floordiv") or not depends_on_points(node, self.points):
            return self.add(op, a, b)
        whole = self.add("floor", self.add("truediv", a, b))
        return whole if op == "floordiv" else self.add("sub", a, self.add("mul", b, whole))

    def operation(self, node: ast.expr, called: Any) -> str | None:
        if called is _UNKNOWN and isinstance(node, ast.Name) and node.id in _VOCABULARY:
            return node.id
        if called is int or is_intrinsic(called):
            return super().operation(node, called)
        return intrinsic_name(called)

    def call_function(self, called: Callable[..., Any], arguments: list[ast.expr]) -> Value:
        """A call of a function from outside; records that are known are fixed in it."""
        known = [self.known(argument) for argument in arguments]
        pairs = zip(parameters(called), known, strict=False)
        fixed = tuple((name, value) for name, value in pairs if is_record(value))
        given = [self.value(a) for a, value in zip(arguments, known, strict=True) if not is_record(value)]
        return self.call_counted(own_formula(called, fixed) if fixed else formula(called), given)

    def expression(self, node: ast.expr) -> None:
        """The mark of a step of an orbit, which only some readers use."""


class KernelReader(Reader):
    """Reads functions of a kernel: they call formulas, and each other with records that are known."""

    kind = "kernel function"

    def call_function(self, called: Callable[..., Any], arguments: list[ast.expr]) -> Value:
        if not is_inline(called):
            return self.call_counted(formula(called), self.each(arguments))
        given = [value for argument in arguments for value in self.given(argument)]
        names = parameters(called)
        if len(names) != len(given):
            raise MismatchError(f"{called.__name__} takes {len(names)} values, found {len(given)}")
        passed = dict(zip(names, given, strict=True))
        known = {name: value for name, value in passed.items() if not isinstance(value, Value)}
        inner = _InlineReader(self.width, source=_inline_source(called), fixed=known, graph=self.graph)
        inner.names = {name: value for name, value in passed.items() if name not in known}
        inner.block = self.block
        value = inner.result()
        self.block = inner.block
        return value

    def given(self, node: ast.expr) -> Sequence[Any]:
        """An argument of an inline function: what it is if it is known and no number, else its value."""
        known = self.known(node)
        if known is _UNKNOWN or isinstance(known, (int, float)) or _is_stored(known):
            return self.parts_of(node)
        return [known]


class _InlineReader(KernelReader):
    """Reads a function into the graph of its caller."""

    def result(self) -> Value:
        """Read the body; return its value."""
        self.ends: list[tuple[Block, Names]] = []  # with the values that are returned there
        body = self.opened()
        if self.statements(body):
            self.fail(body[-1], "not every way through the function returns a value")
        if len(self.ends) > 1:
            self.joined(self.ends)
        else:
            ((self.block, self.names),) = self.ends
        return self.names[""]

    def returned(self, value: Value) -> None:
        self.ends.append((self.block, {"": value}))


@lru_cache(maxsize=256)
def _inline_source(function: Callable[..., Any]) -> Source:
    """Source of a function that is read with its callers, into whose identity it goes."""
    tree = syntax(function)
    place = Source.place_of(function, KernelReader.kind)
    return Source(function.__name__, (), "", place, lambda: tree, lambda: scope(function))
