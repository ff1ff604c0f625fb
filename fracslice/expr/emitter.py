"""Translation of a linked scene's text to LLVM IR, in one pass over its syntax tree: statements,
expressions and intrinsics.

The text is structured: names are assigned, and branches and loops end where they began. Every name therefore
has one value at every place, and a value that differs where two paths join becomes a phi there (Braun et al.
2013, "Simple and Efficient Construction of Static Single Assignment Form", has the general case). A function
is emitted once for each combination of argument kinds.
"""

from __future__ import annotations

import ast
import operator
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from ctypes import c_float
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

from llvmlite import ir

from ..errors import KernelError
from .intervals import Interval, Possible, enclosed
from .language import assigned_names, parse_expression
from .registers import Vec, declare
from .values import (
    BOOL,
    DOUBLE,
    LANES,
    WHOLE,
    Lanes,
    MismatchError,
    Value,
    common,
    compare,
    is_mask,
    number,
    operate,
    truth,
    widen,
)
from .vocabulary import OF_CELLS

Kind = Any
"""Kind of a value: an LLVM type, one of `REGISTERS`, or a tuple of kinds."""

REGISTERS = {"lanes": 1, "mask": 1, "interval": 2, "possible": 2}
"""Lanes that a value consists of."""

ON_CELLS = {"lanes": "interval", "mask": "possible"}
"""Kinds on cells by those on points."""


def kind_of(value: Value) -> Kind:
    """Return the kind of a value."""
    if isinstance(value, tuple):
        return tuple(map(kind_of, value))
    if isinstance(value, (Interval, Possible)):
        return "interval" if isinstance(value, Interval) else "possible"
    return ("mask" if is_mask(value) else "lanes") if isinstance(value, Vec) else value.type


def types_of(kind: Kind, lanes: Lanes) -> list[ir.Type]:
    """Return the LLVM types of the parts of a value of this kind."""
    if isinstance(kind, tuple):
        return [t for part in kind for t in types_of(part, lanes)]
    if kind not in REGISTERS:
        return [kind]
    one = lanes.mask if kind in ("mask", "possible") else lanes.register
    return [one] * lanes.registers * REGISTERS[kind]


def parts_of(value: Value) -> list[Any]:
    """Return the LLVM values that a value consists of."""
    if isinstance(value, tuple):
        return [p for part in value for p in parts_of(part)]
    if isinstance(value, Interval):
        return [*value.lo.parts, *value.hi.parts]
    if isinstance(value, Possible):
        return [*value.must.parts, *value.may.parts]
    return list(value.parts) if isinstance(value, Vec) else [value]


def made_of(kind: Kind, parts: Sequence[Any], lanes: Lanes, builder: ir.IRBuilder) -> Value:
    """Assemble a value of a kind from LLVM values."""
    left = list(parts)

    def taken(kind: Kind) -> Value:
        if isinstance(kind, tuple):
            return tuple(map(taken, kind))
        if kind == "interval":
            return Interval(taken("lanes"), taken("lanes"), LANES[lanes.bits])
        if kind == "possible":
            return Possible(taken("mask"), taken("mask"))
        if kind in REGISTERS:
            registers, left[:] = tuple(left[: lanes.registers]), left[lanes.registers :]
            return Vec(builder, registers)
        return left.pop(0)

    return taken(kind)


def join_kinds(a: Kind, b: Kind) -> Kind:
    """Return the common kind of two kinds."""
    if a == b:
        return a
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        return tuple(join_kinds(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, tuple) or isinstance(b, tuple):
        raise MismatchError("it has one value here and several there")
    if {a, b} & {*ON_CELLS.values()}:
        wide, other = (a, b) if a in ON_CELLS.values() else (b, a)
        if ON_CELLS.get(join_kinds(other, "mask" if wide == "possible" else "lanes")) == wide:
            return wide
    numbers = [k for k in (a, b) if isinstance(k, ir.Type)]
    if "mask" in (a, b) and (numbers == [BOOL]):
        return "mask"
    if "lanes" in (a, b) and numbers and numbers != [BOOL]:
        return "lanes"
    if len(numbers) == 2 and not any(isinstance(k, ir.PointerType) for k in numbers):
        return common(a, b)
    raise MismatchError("it is a number here and a condition there")


def as_kind(value: Value, kind: Kind, lanes: Lanes, builder: ir.IRBuilder) -> Value:
    """Convert a value to another kind."""
    if isinstance(kind, tuple):
        return tuple(as_kind(v, k, lanes, builder) for v, k in zip(value, kind, strict=True))
    made = {
        "lanes": lanes.vec,
        "mask": lanes.condition,
        "interval": lanes.interval,
        "possible": lanes.possible,
    }
    if kind in made:
        return made[kind](builder, value)
    return value if value.type == kind else number(builder, value, kind)


SPECIAL = {
    "where": 3,
    "any_of": 1,
    "int": 1,
    "min": 2,
    "max": 2,
    "load": 2,
    "store": 3,
    "around": 2,
    "lower": 1,
    "upper": 1,
    "gather": 2,
    "solid_distance": 4,
    "together": 0,
    "outline_distance": 3,
}
"""Special intrinsics and their numbers of arguments."""

_EXTREMES = {"min": ast.Lt(), "max": ast.Gt()}


class SpecialIntrinsics:
    """Emits special intrinsics at its builder's position."""

    lanes: Lanes
    builder: Any

    def numbers(self, *values: Value) -> list[Value]:
        """Values as lanes; as intervals if one of them is an interval."""
        cells = any(isinstance(v, (Interval, Possible)) for v in values)
        made = self.lanes.interval if cells else self.lanes.vec
        return [made(self.builder, value) for value in values]

    def address(self, place: Any, index: Value) -> Any:
        """Emit the address of an array element."""
        return self.builder.gep(place, [number(self.builder, index, WHOLE)])

    def intrinsic_where(self, mask: Value, yes: Value, no: Value) -> Value:
        """Emit `where`."""
        if any(isinstance(v, (Interval, Possible)) for v in (mask, yes, no)):
            yes, no = (self.lanes.interval(self.builder, v) for v in (yes, no))
            return self.lanes.possible(self.builder, mask).where(yes, no)
        yes, no = (self.lanes.vec(self.builder, v) for v in (yes, no))
        return self.lanes.condition(self.builder, mask).choose(yes, no)

    def intrinsic_any_of(self, mask: Value) -> Any:
        """Emit `any_of`: one bit test of the joined mask registers."""
        if isinstance(mask, Possible):
            return self.intrinsic_any_of(mask.may)
        if self.lanes.one or not isinstance(mask, Vec):
            return truth(self.builder, mask)
        parts = self.lanes.condition(self.builder, mask).parts
        word = ir.IntType(parts[0].type.count)
        bits = reduce(self.builder.or_, [self.builder.bitcast(part, word) for part in parts])
        return self.builder.icmp_unsigned("!=", bits, word(0))

    def intrinsic_int(self, value: Value) -> Any:
        """Emit a conversion to an integer."""
        return number(self.builder, value, WHOLE)

    def intrinsic_min(self, a: Value, b: Value) -> Any:
        """Emit the minimum of two scalars."""
        return self.extreme("min", a, b)

    def intrinsic_max(self, a: Value, b: Value) -> Any:
        """Emit the maximum of two scalars."""
        return self.extreme("max", a, b)

    def extreme(self, which: str, a: Any, b: Any) -> Any:
        """Emit the minimum or maximum of two scalars."""
        if self.lanes.one and any(isinstance(v, Vec) for v in (a, b)):
            lane: Vec = getattr(self.lanes.math, f"{which}imum")(*self.numbers(a, b))
            return lane
        if any(isinstance(v, (Vec, tuple)) for v in (a, b)):
            raise MismatchError("this is for numbers that are the same everywhere")
        kind = common(a.type, b.type)
        a, b = number(self.builder, a, kind), number(self.builder, b, kind)
        return self.builder.select(compare(self.builder, _EXTREMES[which], b, a), b, a)

    def intrinsic_around(self, centre: Value, half: Value) -> Interval:
        """Emit the interval around a centre."""
        middle, reach = self.numbers(centre, half)
        of = LANES[self.lanes.bits]
        return Interval(middle - reach, middle + reach, of).outward()

    def intrinsic_lower(self, value: Value) -> Vec:
        """Emit the lower bound of an interval."""
        end: Vec = self.lanes.interval(self.builder, value).lo
        return end

    def intrinsic_upper(self, value: Value) -> Vec:
        """Emit the upper bound of an interval."""
        end: Vec = self.lanes.interval(self.builder, value).hi
        return end

    def intrinsic_load(self, place: Any, index: Value) -> Vec:
        """Load lanes from memory."""
        align = self.lanes.bits // 8
        return Vec(
            self.builder,
            tuple(self.builder.load(a, align=align) for a in self.registers(place, index)),
        )

    def intrinsic_store(self, place: Any, index: Value, value: Value) -> None:
        """Store lanes to memory."""
        parts = self.lanes.vec(self.builder, value).parts
        for address, part in zip(self.registers(place, index), parts, strict=True):
            self.builder.store(part, address, align=self.lanes.bits // 8)

    def intrinsic_gather(self, index: Value, place: Any) -> Vec:
        """Load an element from memory for each lane."""
        if self.lanes.one:
            return self.lanes.vec(self.builder, self.builder.load(self.address(place, index)))
        like, parts = self.lanes.register, []
        for register in self.lanes.vec(self.builder, index).to_whole().parts:
            loaded = ir.Constant(like, ir.Undefined)
            for k in range(like.count):
                lane = ir.Constant(ir.IntType(32), k)
                address = self.builder.gep(place, [self.builder.extract_element(register, lane)])
                loaded = self.builder.insert_element(loaded, self.builder.load(address), lane)
            parts.append(loaded)
        return Vec(self.builder, tuple(parts))

    def intrinsic_solid_distance(self, x: Value, y: Value, z: Value, solid: Value) -> Value:
        """Emit `solid_distance`."""
        return self.distance(solid, x, y, z)

    def intrinsic_outline_distance(self, x: Value, y: Value, outline: Value) -> Value:
        """Emit `outline_distance`."""
        return self.distance(outline, x, y)

    def distance(self, place: Value, *at: Value) -> Value:
        """Emit a question to the native code at an address, given as words, about all lanes."""
        words = [number(self.builder, word, WHOLE) for word in place]
        shifted = (self.builder.shl(word, ir.Constant(WHOLE, 16 * k)) for k, word in enumerate(words))
        address, point = reduce(self.builder.or_, shifted), self.numbers(*at)
        if isinstance(point[0], Interval):
            return enclosed(lambda *middle: self.asked(address, middle), *point)
        return self.asked(address, point)

    def asked(self, address: Any, point: Sequence[Vec]) -> Vec:
        """Emit the call of a function of `native/mesh/distances.h`: values at the points of all lanes."""
        real, size, builder = self.lanes.scalar, self.lanes.width, self.builder
        with builder.goto_entry_block():  # in a loop, the stack would grow
            rows = builder.alloca(real, (len(point) + 1) * size)
        rows.align = 64
        for k, coordinate in enumerate(point):
            self.intrinsic_store(rows, ir.Constant(WHOLE, k * size), coordinate)
        result, place = builder.gep(rows, [ir.Constant(WHOLE, len(point) * size)]), ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [place, rows.type, rows.type, WHOLE]).as_pointer()
        entries = builder.inttoptr(address, kind.as_pointer())
        function = builder.load(builder.gep(entries, [ir.Constant(WHOLE, self.lanes.bits // 64)]))
        builder.call(function, [builder.inttoptr(address, place), rows, result, ir.Constant(WHOLE, size)])
        return self.intrinsic_load(result, ir.Constant(WHOLE, 0))

    def intrinsic_together(self) -> None:
        """Wait for the other threads of the warp."""
        if self.lanes.on_gpu:
            kind = ir.FunctionType(ir.VoidType(), [ir.IntType(32)])
            barrier = declare(self.builder.module, kind, "llvm.nvvm.bar.warp.sync")
            self.builder.call(barrier, [ir.Constant(ir.IntType(32), -1)])

    def thread(self) -> Any:
        """Emit the index of this thread in the grid."""
        kind = ir.FunctionType(ir.IntType(32), [])

        def register(name: str) -> Any:
            read = declare(self.builder.module, kind, f"llvm.nvvm.read.ptx.sreg.{name}.x")
            return self.builder.zext(self.builder.call(read, []), WHOLE)

        return self.builder.add(self.builder.mul(register("ctaid"), register("ntid")), register("tid"))

    def registers(self, place: Any, index: Value) -> list[Any]:
        """Addresses of the registers of lanes, starting at an array element."""
        first, kind = self.address(place, index), self.lanes.register
        size = self.lanes.width // self.lanes.registers
        steps = (ir.Constant(WHOLE, k * size) for k in range(self.lanes.registers))
        return [self.builder.bitcast(self.builder.gep(first, [step]), kind.as_pointer()) for step in steps]


_ON_LANES: dict[type, Callable[[Vec, Vec], Vec]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip
_INTRINSICS = {
    name: count
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
                known = self.condition(test)
                if isinstance(known, ir.Constant):
                    return self.value(yes if known.constant else no)
                return self.chosen(known, lambda: self.value(yes), lambda: self.value(no))
            case ast.Subscript(place, index):
                return self.element(self.value(place), self.value(index))
            case ast.Call(ast.Name(name), arguments):
                return self.call(name, [self.value(a) for a in arguments])
        raise MismatchError("it is not in the language")

    def constant(self, value: object) -> Value:
        """Emit a constant."""
        if isinstance(value, bool):
            return ir.Constant(BOOL, int(value))
        if isinstance(value, float) and self.lanes.one:
            rounded = c_float(value).value if self.lanes.bits == 32 else value
            return Vec(self.builder, (ir.Constant(self.lanes.register, rounded),))
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
        if self.lanes.one and isinstance(op, ast.Div):
            a, b = self.numbers(a, b)
        return self.on_lanes(op, a, b) or operate(self.builder, op, a, b)

    def comparison(self, op: ast.cmpop, a: Value, b: Value) -> Value:
        """Emit a comparison; of constants, such as WIDTH, it is one."""
        if all(isinstance(v, ir.Constant) and v.type == WHOLE for v in (a, b)):
            return ir.Constant(BOOL, bool(_ON_LANES[type(op)](a.constant, b.constant)))
        return self.on_lanes(op, a, b) or compare(self.builder, op, a, b)

    def on_lanes(self, op: ast.AST, a: Value, b: Value) -> Value | None:
        """Emit an operator with lanes or intervals as operands; None if both are scalars."""
        if not any(isinstance(v, (Vec, tuple, Interval, Possible)) for v in (a, b)):
            return None
        if type(op) not in _ON_LANES:
            raise MismatchError("this is for numbers that are the same everywhere")
        left, right = self.numbers(a, b)
        if isinstance(op, ast.Div) and isinstance(left, Vec):
            return self.lanes.math.divide(left, right)
        return _ON_LANES[type(op)](left, right)

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
            if self.lanes.one and loaded.type == self.lanes.scalar:
                return self.lanes.vec(self.builder, loaded)
            return widen(self.builder, loaded, WHOLE) if isinstance(loaded.type, ir.IntType) else loaded
        if isinstance(index, ir.Constant):
            return place[index.constant]
        kind = reduce(join_kinds, map(kind_of, place))
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
            count = _INTRINSICS[name] if name in _INTRINSICS else SPECIAL[name]
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
            return getattr(self.lanes.math, name)(first, *others)
        value: Value = getattr(self, f"intrinsic_{name}")(*given)
        return value

    def called(self, name: str, given: Sequence[Value]) -> Value:
        """Emit a call of a function of the text."""
        function, kind = self.emitter.function(name, tuple(map(kind_of, given)))
        result = self.builder.call(function, [part for value in given for part in parts_of(value)])
        count = len(types_of(kind, self.lanes))
        parts = [self.builder.extract_value(result, k) for k in range(count)]
        return made_of(kind, parts, self.lanes, self.builder)


Names = dict[str, Value]


def _fills_array(body: Sequence[ast.stmt]) -> bool:
    """True if statements, which no break leaves, assign elements of an array."""
    nodes = [node for statement in body for node in ast.walk(statement)]
    stores = any(isinstance(n, ast.Subscript) and isinstance(n.ctx, ast.Store) for n in nodes)
    return stores and not any(isinstance(n, ast.Break) for n in nodes)


@dataclass
class Emitter:
    """LLVM module under construction."""

    lanes: Lanes  # layout of the lanes
    functions: Mapping[str, ast.FunctionDef]  # syntax trees of the text's functions
    called: frozenset[str]  # names of the functions that are not inlined
    files: Mapping[str, str]  # files that contain the lines of loops and of the functions they call
    module: ir.Module = field(default_factory=ir.Module)  # LLVM module
    # functions emitted so far
    made: dict[tuple[str, str], tuple[ir.Function, Kind]] = field(default_factory=dict)

    def function(self, name: str, kinds: tuple[Kind, ...]) -> tuple[ir.Function, Kind]:
        """Emit a function of the text for arguments of given kinds; return it and the kind of its result."""
        key = name, repr(kinds)
        if key not in self.made:
            body = Body(self, name)
            function = body.written(kinds, f"{name}.{len(self.made)}", {})
            function.linkage = "internal"
            function.attributes.add("noinline" if name in self.called else "alwaysinline")
            self.made[key] = function, body.returned
        return self.made[key]

    def entry(self, name: str, kinds: tuple[Kind, ...], own: Mapping[int, int]) -> None:
        """Emit an exported function under its own name.

        `own`: sizes of the arrays, by the places of the arguments, that are a GPU thread's own.
        """
        function = Body(self, name).written(kinds, name, own if self.lanes.on_gpu else {})
        if self.lanes.on_gpu:
            function.calling_convention = "ptx_kernel"


class _WiderError(Exception):
    """Names have wider kinds at the end of a loop than at its beginning."""

    def __init__(self, kinds: dict[str, Kind]) -> None:
        self.kinds = kinds


class Body(Expressions):
    """Body of one function for one combination of argument kinds."""

    def __init__(self, emitter: Emitter, name: str) -> None:
        self.emitter, self.lanes = emitter, emitter.lanes
        self.name, self.tree = name, emitter.functions[name]
        self.returned: Kind = ()
        self.returns: list[tuple[Any, Value]] = []
        self.exits: list[list[tuple[Any, Names]]] = []  # of the loops around: a block and the names there
        self.blocks: dict[str, Any] = {}

    def written(self, kinds: Sequence[Kind], name: str, own: Mapping[int, int]) -> ir.Function:
        """Emit the function under a name of the module; see `Emitter.entry`."""
        types = [t for k, kind in enumerate(kinds) if k not in own for t in types_of(kind, self.lanes)]
        function = ir.Function(self.emitter.module, ir.FunctionType(ir.VoidType(), types), name)
        function.attributes.add("nounwind")
        self.builder = ir.IRBuilder(function.append_basic_block())
        passed = iter(function.args)
        parts = [
            self.builder.alloca(kind.pointee, own[k]) if k in own else next(passed)
            for k, kind in enumerate(kinds)
            for _ in types_of(kind, self.lanes)
        ]
        given = made_of(tuple(kinds), parts, self.lanes, self.builder)
        if self.lanes.one:
            given = tuple(
                self.lanes.vec(self.builder, v) if getattr(v, "type", None) == self.lanes.scalar else v
                for v in given
            )
        width = {"WIDTH": ir.Constant(WHOLE, self.lanes.width)}
        self.names: Names = width | dict(zip((a.arg for a in self.tree.args.args), given, strict=True))
        if self.statements(self.tree.body):
            self.builder.ret_void()
            if self.returns:
                raise self.fail(self.tree.body[-1], "not every way through the function returns a value")
        elif self.returns:
            self.finish(function, types)
        return function

    def finish(self, function: ir.Function, types: list[ir.Type]) -> None:
        """Emit the return instructions, now that their kind is known, and set the function's type."""
        self.returned = reduce(join_kinds, (kind_of(value) for _, value in self.returns))
        result = ir.LiteralStructType(types_of(self.returned, self.lanes))
        for block, value in self.returns:
            self.builder.position_at_end(block)
            whole = ir.Constant(result, ir.Undefined)
            for k, part in enumerate(parts_of(as_kind(value, self.returned, self.lanes, self.builder))):
                whole = self.builder.insert_value(whole, part, k)
            self.builder.ret(whole)
        function.ftype = ir.FunctionType(result, types)
        function.type = function.ftype.as_pointer()
        function.return_value.type = result

    def fail(self, node: ast.AST, message: str) -> KernelError:
        """Return an error with the place of a node."""
        line, file = ast.unparse(node).splitlines()[0], self.emitter.files.get(self.name)
        name = self.name.removeprefix("f_").removeprefix("l_")
        where = f"{file}:{getattr(node, 'lineno', 1)}: loop" if file else "formula"
        return KernelError(f"{where} {name}: {line!r} cannot be compiled: {message}")

    # --- statements: each returns True if the next statement is reachable ---
    def statements(self, body: Sequence[ast.stmt]) -> bool:
        """Emit statements; return True if the next statement is reachable."""
        for statement in body:
            try:
                reached = self.statement(statement)
            except MismatchError as error:
                raise self.fail(statement, str(error)) from None
            if not reached:
                return False
        return True

    def statement(self, node: ast.stmt) -> bool:
        """Emit a statement; return True if the next one is reachable."""
        match node:
            case ast.Assign([target], value):
                self.assign(target, self.value(value))
            case ast.AugAssign(target, op, value):
                before = self.value(parse_expression(ast.unparse(target)))
                self.assign(target, self.binary(op, before, self.value(value)))
            case ast.Expr(value):
                self.value(value)
            case ast.Return(value):
                given = self.value(value) if value else ()
                self.returns.append((self.builder.block, given))
                return False
            case ast.Break():
                self.exits[-1].append((self.builder.block, dict(self.names)))
                return False
            case ast.If(test, body, orelse):
                known = self.condition(test)
                if isinstance(known, ir.Constant):
                    return self.statements(body if known.constant else orelse)
                return self.branch(known, body, orelse)
            case ast.While(ast.Constant(True)):
                return self.loop(node, (), lambda: None)
            case ast.While(test):
                return self.loop(node, (), lambda: self.condition(test))
            case ast.For(ast.Name(counter), ast.Call(ast.Name("range"), limits)):
                ends = [number(self.builder, self.value(v), WHOLE) for v in limits]
                return self.counted(node, counter, ends)
            case ast.For(ast.Name(counter), ast.Call(ast.Name("shares"), [count, step])):
                ends = [number(self.builder, self.value(v), WHOLE) for v in (count, step)]
                return self.shared(node, counter, *ends)
            case ast.Pass():
                pass
            case _:
                raise MismatchError("it is not in the language")
        return True

    def assign(self, target: ast.expr, value: Value) -> None:
        """Emit an assignment."""
        match target:
            case ast.Name(name):
                self.names[name], self.blocks[name] = value, self.builder.block
            case ast.Tuple(parts):
                if not isinstance(value, tuple) or len(value) != len(parts):
                    raise MismatchError(f"{len(parts)} values are expected")
                for part, one in zip(parts, value, strict=True):
                    self.assign(part, one)
            case ast.Subscript(place, index):
                address = self.address(self.value(place), self.value(index))
                self.builder.store(number(self.builder, value, address.type.pointee), address)
            case _:
                raise MismatchError("a name is expected to assign to")

    def branch(self, test: Any, body: Sequence[ast.stmt], orelse: Sequence[ast.stmt]) -> bool:
        """Emit an ``if`` statement; return True if the next statement is reachable."""
        names, ends = dict(self.names), []
        blocks = [self.builder.append_basic_block() for _ in range(2)]
        self.builder.cbranch(test, *blocks)
        for block, part in zip(blocks, (body, orelse), strict=True):
            self.builder.position_at_end(block)
            self.names = dict(names)
            if self.statements(part):
                ends.append((self.builder.block, self.names))
        return self.joined(ends)

    def joined(self, ends: Sequence[tuple[Any, Names]]) -> bool:
        """Join blocks and continue with the names that all of them have; return False without blocks."""
        if not ends:
            return False
        first, *others = (names for _, names in ends)
        common = [name for name in first if all(name in names for names in others)]
        same = {name: first[name] for name in common if all(n[name] is first[name] for n in others)}
        differ = [name for name in common if name not in same]
        kinds = {name: reduce(join_kinds, (kind_of(names[name]) for _, names in ends)) for name in differ}
        into, rows = self.builder.append_basic_block(), []
        for block, names in ends:
            self.builder.position_at_end(block)
            parts = {n: parts_of(as_kind(names[n], kinds[n], self.lanes, self.builder)) for n in differ}
            rows.append((block, parts))
            self.builder.branch(into)
        self.builder.position_at_end(into)
        merged = {n: self.phis(kinds[n], [(block, parts[n]) for block, parts in rows]) for n in differ}
        self.names = same | merged
        return True

    def counted(self, node: ast.For, counter: str, limits: Sequence[Any]) -> bool:
        """Emit a loop over a range with a positive step. After the loop its counter has no value."""
        if self.lanes.one and all(isinstance(v, ir.Constant) for v in limits) and _fills_array(node.body):
            return self.unrolled(node.body, counter, range(*(v.constant for v in limits)))
        kind = ir.IntType(32) if self.lanes.on_gpu else WHOLE  # of which a GPU's registers are
        zero, one = ir.Constant(kind, 0), ir.Constant(kind, 1)
        limits = [number(self.builder, limit, kind) for limit in limits]
        first, end, step = [zero, *limits, one] if len(limits) == 1 else [*limits, one][:3]
        place = f"{counter} of {node.lineno}"
        self.names[place] = first

        def test() -> Any:
            here = self.names[place]
            self.names[counter] = number(self.builder, here, WHOLE)
            inside = self.builder.icmp_signed("<", here, end)
            self.names[place] = self.builder.add(here, step)
            return inside

        return self.loop(node, (place, counter), test)

    def unrolled(self, body: Sequence[ast.stmt], counter: str, rounds: range) -> bool:
        """Emit the rounds of a loop one after the other: an array with known indices becomes registers."""
        for k in rounds:
            self.names[counter] = ir.Constant(WHOLE, k)
            if not self.statements(body):
                return False
        return True

    def shared(self, node: ast.For, counter: str, count: Any, step: Any) -> bool:
        """Emit a loop that the threads of a GPU share, one round each; elsewhere it is a loop over a range.

        Where there is one lane, a round is of one.
        """
        if not self.lanes.on_gpu:
            step = ir.Constant(WHOLE, 1) if self.lanes.one else step
            return self.counted(node, counter, [ir.Constant(WHOLE, 0), count, step])
        self.names[counter] = thread = self.thread()
        return self.branch(self.builder.icmp_signed("<", thread, count), node.body, ())

    def loop(self, node: ast.For | ast.While, own: tuple[str, ...], test: Callable[[], Any]) -> bool:
        """Emit a loop, again if names turn out to be of wider kinds than at its beginning."""
        function, start = self.builder.function, self.builder.block
        names, blocks, size = dict(self.names), len(function.blocks), len(start.instructions)
        returns, depth = len(self.returns), len(self.exits)
        changed = assigned_names(node.body) | set(own)
        kinds: dict[str, Kind] = {}
        while True:
            try:
                return self.looped(node.body, test, sorted(changed & names.keys()), own, kinds)
            except _WiderError as wider:
                kinds = wider.kinds
            del (
                function.blocks[blocks:],
                start.instructions[size:],
                self.returns[returns:],
                self.exits[depth:],
            )
            start.terminator = None
            self.builder.position_at_end(start)
            self.names = dict(names)

    def looped(
        self,
        body: Sequence[ast.stmt],
        test: Callable[[], Any],
        changed: Sequence[str],
        own: tuple[str, ...],
        kinds: dict[str, Kind],
    ) -> bool:
        """Emit a loop once, with given kinds for some names; raise `_WiderError` if others are needed."""
        for name, kind in kinds.items():
            self.names[name] = as_kind(self.names[name], kind, self.lanes, self.builder)
        start, head = self.builder.block, self.builder.append_basic_block()
        before = {name: self.names[name] for name in changed}
        self.builder.branch(head)
        self.builder.position_at_end(head)
        rows = {n: [(start, parts_of(value))] for n, value in before.items()}
        phis = {n: [self.builder.phi(p.type) for p in rows[n][0][1]] for n in changed}
        for name in changed:
            self.names[name] = made_of(kind_of(before[name]), phis[name], self.lanes, self.builder)
        self.exits.append([])
        inside, more = self.builder.append_basic_block(), test()
        if more is None:
            self.builder.branch(inside)
        else:
            out = self.builder.append_basic_block()
            self.exits[-1].append((out, {n: v for n, v in self.names.items() if n not in own}))
            self.builder.cbranch(more, inside, out)
        self.builder.position_at_end(inside)
        if self.statements(body):
            after = {n: join_kinds(kind_of(before[n]), kind_of(self.names[n])) for n in changed}
            wider = {n: kind for n, kind in after.items() if kind != kind_of(before[n])}
            if wider:
                raise _WiderError(kinds | wider)
            for name in changed:
                value = as_kind(self.names[name], after[name], self.lanes, self.builder)
                rows[name].append((self.builder.block, parts_of(value)))
            self.builder.branch(head)
        for name in changed:
            for block, parts in rows[name]:
                for phi, part in zip(phis[name], parts, strict=True):
                    phi.add_incoming(part, block)
        return self.joined(self.exits.pop())
