"""Translation of expressions to LLVM IR, on lanes and on scalars."""

from __future__ import annotations

import ast
import operator
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from typing import TYPE_CHECKING, Any

from llvmlite import ir

from ..formulas.vocabulary import OF_CELLS
from . import lanes_math
from .intervals import Interval, Possible
from .kinds import Kind, as_kind, joined, kind_of, made_of, parts_of, types_of
from .registers import Vec
from .scalars import BOOL, DOUBLE, WHOLE, MismatchError, compare, number, operate, truth, widened
from .special_intrinsics import SPECIAL, SpecialIntrinsics
from .values import Value, is_mask

if TYPE_CHECKING:
    from .emitter import Emitter

_ON_LANES: dict[type, Callable[[Vec, Vec], Vec]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip
_INTRINSICS = {
    name: (getattr(lanes_math, name), count)
    for count, names in (
        (1, ("sqrt", "rsqrt", "log", "exp", "sin", "cos", "floor", "absolute", *sorted(OF_CELLS))),
        (2, ("ratio", "atan2", "minimum", "maximum")),
    )
    for name in names
}


class Expressions(SpecialIntrinsics):
    """Emits the expressions of a function at its builder's position."""

    emitter: Emitter
    names: dict[str, Value]
    blocks: dict[str, Any]

    @abstractmethod
    def joined(self, ends: Sequence[tuple[Any, dict[str, Value]]]) -> bool:
        """Join blocks, each with the values of names there."""

    def value(self, node: ast.expr) -> Value:
        """Emit an expression; return its value."""
        match node:
            case ast.Constant(value):
                return self.constant(value)
            case ast.Name(name):
                return self.named(name)
            case ast.Tuple(parts):
                return tuple(map(self.value, parts))
            case ast.UnaryOp(op, operand):
                return self.unary(op, self.value(operand))
            case ast.BinOp(left, op, right):
                return self.binary(op, self.value(left), self.value(right))
            case ast.Compare(left, [op], [right]):
                return self.comparison(op, self.value(left), self.value(right))
            case ast.BoolOp(op, [first, *others]):
                return reduce(
                    lambda a, b: self.short(op, a, b), others, truth(self.builder, self.value(first))
                )
            case ast.IfExp(test, yes, no):
                return self.chosen(self.condition(test), lambda: self.value(yes), lambda: self.value(no))
            case ast.Subscript(place, index):
                return self.element(self.value(place), self.value(index))
            case ast.Call(ast.Name(name), arguments):
                return self.call(name, [self.value(a) for a in arguments])
        raise MismatchError("it is not in the language")

    def constant(self, value: object) -> Value:
        """Emit a constant."""
        if isinstance(value, bool):
            return ir.Constant(BOOL, int(value))
        if isinstance(value, (int, float)):
            return ir.Constant(WHOLE if isinstance(value, int) else DOUBLE, value)
        raise MismatchError("a number is expected")

    def named(self, name: str) -> Value:
        """Value of a name. A product is fused with a sum only in the same basic block."""
        if name not in self.names:
            raise MismatchError(f"{name!r} has no value here")
        value = self.names[name]
        if isinstance(value, Vec) and value.factors and self.blocks.get(name) is not self.builder.block:
            return replace(value, factors=None)
        return value

    def condition(self, node: ast.expr) -> Any:
        """Emit an expression as a scalar condition."""
        return truth(self.builder, self.value(node))

    def unary(self, op: ast.unaryop, value: Value) -> Value:
        """Emit a unary operator."""
        if isinstance(op, ast.Not):
            return self.builder.not_(truth(self.builder, value))
        if isinstance(op, ast.Invert):
            if is_mask(value):
                return ~value
            return self.builder.not_(truth(self.builder, value))
        if isinstance(value, (Vec, Interval)):
            return -self.numbers(value)[0]
        if isinstance(value.type, ir.IntType):
            return self.builder.neg(number(self.builder, value, WHOLE))
        return self.builder.fneg(value)

    def binary(self, op: ast.operator, a: Value, b: Value) -> Value:
        """Emit a binary operator."""
        if isinstance(op, (ast.BitAnd, ast.BitOr)) and any(is_mask(v) for v in (a, b)):
            cells = any(isinstance(v, Possible) for v in (a, b))
            made = self.lanes.possible if cells else self.lanes.condition
            a, b = (made(self.builder, v) for v in (a, b))
            return a & b if isinstance(op, ast.BitAnd) else a | b
        return self.on_lanes(op, a, b) or operate(self.builder, op, a, b)

    def comparison(self, op: ast.cmpop, a: Value, b: Value) -> Value:
        """Emit a comparison."""
        return self.on_lanes(op, a, b) or compare(self.builder, op, a, b)

    def on_lanes(self, op: ast.AST, a: Value, b: Value) -> Value | None:
        """Emit an operator with lanes or intervals as operands; None if both are scalars."""
        if not any(isinstance(v, (Vec, tuple, Interval, Possible)) for v in (a, b)):
            return None
        if type(op) not in _ON_LANES:
            raise MismatchError("this is for numbers that are the same everywhere")
        return _ON_LANES[type(op)](*self.numbers(a, b))

    def short(self, op: ast.boolop, a: Any, node: ast.expr) -> Any:
        """Emit ``and`` or ``or``; evaluate the second operand only if the first does not decide."""

        def second() -> Value:
            return truth(self.builder, self.value(node))

        if isinstance(op, ast.And):
            return self.chosen(a, second, lambda: ir.Constant(BOOL, 0))
        return self.chosen(a, lambda: ir.Constant(BOOL, 1), second)

    def chosen(self, test: Any, yes: Callable[[], Value], no: Callable[[], Value]) -> Value:
        """Emit a choice between two values; only the chosen one is computed."""
        blocks, names, ends = [self.builder.append_basic_block() for _ in range(2)], self.names, []
        self.builder.cbranch(test, *blocks)
        for block, way in zip(blocks, (yes, no), strict=True):
            self.builder.position_at_end(block)
            value = way()
            ends.append((self.builder.block, {"": value}))
        self.joined(ends)
        (value,), self.names = self.names.values(), names
        return value

    def phis(self, kind: Kind, rows: Sequence[tuple[Any, Sequence[Any]]]) -> Value:
        """Emit phis for a value of a given kind, from its parts in each block."""
        phis = [self.builder.phi(t) for t in types_of(kind, self.lanes)]
        for block, parts in rows:
            for phi, part in zip(phis, parts, strict=True):
                phi.add_incoming(part, block)
        return made_of(kind, phis, self.lanes, self.builder)

    def element(self, place: Value, index: Value) -> Value:
        """Emit an access to an array element in memory or to a tuple element."""
        if not isinstance(place, tuple):
            loaded = self.builder.load(self.address(place, index))
            return widened(self.builder, loaded, WHOLE) if isinstance(loaded.type, ir.IntType) else loaded
        if isinstance(index, ir.Constant):
            return place[index.constant]
        kind = reduce(joined, map(kind_of, place))
        value, *others = (as_kind(v, kind, self.lanes, self.builder) for v in place)
        for k, other in enumerate(others, 1):
            here = self.builder.icmp_signed("==", index, ir.Constant(WHOLE, k))
            parts = [
                self.builder.select(here, a, b) for a, b in zip(parts_of(other), parts_of(value), strict=True)
            ]
            value = made_of(kind, parts, self.lanes, self.builder)
        return value

    def call(self, name: str, given: list[Value]) -> Value:
        """Emit a call of a function or an intrinsic."""
        if name in self.emitter.functions:
            count = len(self.emitter.functions[name].args.args)
        elif name in _INTRINSICS or name in SPECIAL:
            count = _INTRINSICS[name][1] if name in _INTRINSICS else SPECIAL[name]
        else:
            raise MismatchError(f"{name!r} is no function")
        if len(given) != count:
            raise MismatchError(f"{name} takes {count} values, found {len(given)}")
        if name in self.emitter.functions:
            return self.called(name, given)
        if name in _INTRINSICS:
            first, *others = self.numbers(*given)
            if isinstance(first, Interval):
                return getattr(first, name)(*others)
            return _INTRINSICS[name][0](first, *others)
        value: Value = getattr(self, f"intrinsic_{name}")(*given)
        return value

    def called(self, name: str, given: Sequence[Value]) -> Value:
        """Emit a call of a function of the text."""
        function, kind = self.emitter.function(name, tuple(map(kind_of, given)))
        result = self.builder.call(function, [part for value in given for part in parts_of(value)])
        count = len(types_of(kind, self.lanes))
        parts = [self.builder.extract_value(result, k) for k in range(count)]
        return made_of(kind, parts, self.lanes, self.builder)
