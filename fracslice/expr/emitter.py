"""Translation of graphs to LLVM IR, block after block, and its compilation to machine code of the CPU or
to PTX, the text that NVIDIA's driver assembles. Imported only if a kernel is not cached.

A function is emitted once for each combination of argument kinds. From them follow the kinds of all values; a
parameter of a block has the kind that holds all values passed to it.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Mapping, Sequence
from ctypes import c_float
from dataclasses import dataclass, field, replace
from functools import lru_cache, reduce
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir

from . import graph as graphs
from . import lanes
from .frontend import loop_function
from .graph import (
    ARITHMETIC,
    BINARY,
    COMPARISONS,
    UNARY,
    Block,
    Branch,
    Function,
    Jump,
    MismatchError,
    Program,
    Return,
    Width,
)
from .intervals import Interval, Possible, enclosed
from .lanes import Vec, declare
from .loops import OWN, Loop, element_type, is_array
from .values import (
    BOOL,
    DOUBLE,
    FLOAT,
    LANES,
    WHOLE,
    Lanes,
    Value,
    common,
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


_EXTREMES = {"min": "lt", "max": "gt"}


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
        return self.builder.select(operate(self.builder, _EXTREMES[which], b, a), b, a)

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

    def intrinsic_near(self, x: Value, y: Value, z: Value, place: Value) -> Any:
        """Emit a question for the elements of a long union that matter at all lanes: the address of their
        number and of these, int32.
        """
        address, point = self.address_of(place), self.numbers(x, y, z)
        cells = isinstance(point[0], Interval)
        ends = [v.lo for v in point] + [v.hi for v in point] if cells else point
        found = ir.IntType(32).as_pointer()
        return self.asked(address, 2 * cells, self.rows(ends), found)

    def distance(self, place: Value, *at: Value) -> Value:
        """Emit a question to the native code at an address, given as words, about all lanes."""
        address, point = self.address_of(place), self.numbers(*at)
        if isinstance(point[0], Interval):
            return enclosed(lambda *middle: self.distance_at(address, middle), *point)
        return self.distance_at(address, point)

    def distance_at(self, address: Any, point: Sequence[Vec]) -> Vec:
        """Emit the call of a function of `native/mesh/distances.h`: values at the points of all lanes."""
        rows, result = self.rows(point), self.rows([None])
        self.asked(address, 0, rows, ir.VoidType(), result)
        return self.intrinsic_load(result, ir.Constant(WHOLE, 0))

    def address_of(self, place: Value) -> Any:
        """Emit the address that some words make."""
        words = [number(self.builder, word, WHOLE) for word in place]
        shifted = (self.builder.shl(word, ir.Constant(WHOLE, 16 * k)) for k, word in enumerate(words))
        return reduce(self.builder.or_, shifted)

    def rows(self, values: Sequence[Vec | None]) -> Any:
        """Emit memory for rows of lanes, with some values."""
        size, builder = self.lanes.width, self.builder
        with builder.goto_entry_block():  # in a loop, the stack would grow
            rows = builder.alloca(self.lanes.scalar, len(values) * size)
        rows.align = 64
        for k, value in enumerate(values):
            if value is not None:
                self.intrinsic_store(rows, ir.Constant(WHOLE, k * size), value)
        return rows

    def asked(self, address: Any, first: int, rows: Any, result: ir.Type, *into: Any) -> Any:
        """Emit the call of native code by the table of functions at an address: the one of floats, whose
        number is `first`, or that of doubles, which follows.
        """
        builder, place = self.builder, ir.IntType(8).as_pointer()
        given = [builder.inttoptr(address, place), rows, *into, ir.Constant(WHOLE, self.lanes.width)]
        kind = ir.FunctionType(result, [value.type for value in given]).as_pointer()
        entries = builder.inttoptr(address, kind.as_pointer())
        at = builder.gep(entries, [ir.Constant(WHOLE, first + self.lanes.bits // 64)])
        return builder.call(builder.load(at), given)

    def intrinsic_together(self) -> None:
        """Wait for the other threads of the warp."""
        if self.lanes.on_gpu:
            kind = ir.FunctionType(ir.VoidType(), [ir.IntType(32)])
            barrier = declare(self.builder.module, kind, "llvm.nvvm.bar.warp.sync")
            self.builder.call(barrier, [ir.Constant(ir.IntType(32), -1)])

    def intrinsic_thread(self) -> Any:
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


_COUNTS = {
    name: count
    for count, names in (
        (0, ("together", "thread")),
        (1, ("sqrt", "rsqrt", "log", "exp", "sin", "cos", "floor", "absolute", *sorted(OF_CELLS))),
        (1, ("any_of", "int", "lower", "upper", "truth")),
        (2, ("ratio", "atan2", "minimum", "maximum", "min", "max", "load", "around", "gather", "element")),
        (3, ("where", "store", "outline_distance", "set")),
        (4, ("solid_distance", "near")),
    )
    for name in names
}
"""Numbers of operands."""

_OF_LANES = frozenset(("sqrt", "rsqrt", "log", "exp", "sin", "cos", "floor", "absolute", *OF_CELLS)) | {
    "ratio", "atan2", "minimum", "maximum"
}  # fmt: skip
"""Functions of lanes, and methods of intervals."""


class Operations(SpecialIntrinsics):
    """Emits the operations of a function at its builder's position."""

    emitter: Emitter

    def constant(self, number: float) -> Value:
        """Emit a constant."""
        if isinstance(number, bool):
            return ir.Constant(BOOL, int(number))
        if isinstance(number, float) and self.lanes.one:
            rounded = c_float(number).value if self.lanes.bits == 32 else number
            return Vec(self.builder, (ir.Constant(self.lanes.register, rounded),))
        return ir.Constant(WHOLE if isinstance(number, int) else DOUBLE, number)

    def operation(self, op: str, given: list[Value], data: Any) -> Value:
        """Emit an operation of a graph."""
        if op in BINARY:
            return self.binary(op, *given)
        if op in UNARY:
            return self.unary(op, *given)
        if op in _COUNTS and len(given) != _COUNTS[op]:
            raise MismatchError(f"{op} takes {_COUNTS[op]} values, found {len(given)}")
        if op in _OF_LANES:
            first, *others = self.numbers(*given)
            if isinstance(first, Interval):
                return getattr(first, op)(*others)
            return getattr(self.lanes.math, op)(first, *others)
        if hasattr(self, f"intrinsic_{op}"):
            value: Value = getattr(self, f"intrinsic_{op}")(*given)
            return value
        return getattr(self, f"operation_{op}")(given, data)

    def operation_call(self, given: list[Value], data: Function | str) -> Value:
        function = self.emitter.named.get(data) if isinstance(data, str) else data
        if function is None:
            raise MismatchError(f"{data!r} is no function")
        return self.called(function, given)

    def operation_tuple(self, given: list[Value], _: None) -> Value:
        return tuple(given)

    def operation_item(self, given: list[Value], data: tuple[int, int]) -> Value:
        (whole,), (index, count) = given, data
        if not isinstance(whole, tuple) or len(whole) != count:
            raise MismatchError(f"{count} values are expected")
        return whole[index]

    def intrinsic_set(self, place: Value, index: Value, value: Value) -> None:
        """Emit an assignment to an array element."""
        address = self.address(place, index)
        self.builder.store(number(self.builder, value, address.type.pointee), address)

    def intrinsic_truth(self, value: Value) -> Value:
        """Emit whether a number is not zero."""
        return truth(self.builder, value)

    def operation_index(self, given: list[Value], data: int | None) -> Value:
        kind = ir.IntType(32) if self.lanes.on_gpu else WHOLE  # of which a GPU's registers are
        if data is not None:
            return ir.Constant(kind, data)
        (value,) = given
        return number(self.builder, number(self.builder, value, WHOLE), kind)

    def unary(self, op: str, value: Value) -> Value:
        """Emit a unary operator."""
        if op == "not_":
            return self.builder.not_(truth(self.builder, value))
        if op == "invert":
            return ~value if is_mask(value) else self.builder.not_(truth(self.builder, value))
        if isinstance(value, (Vec, Interval)):
            return -self.numbers(value)[0]
        if isinstance(value.type, ir.IntType):
            return self.builder.neg(number(self.builder, value, WHOLE))
        return self.builder.fneg(value)

    def binary(self, op: str, a: Value, b: Value) -> Value:
        """Emit a binary operator or a comparison."""
        if op in ("and_", "or_") and any(is_mask(v) for v in (a, b)):
            cells = any(isinstance(v, Possible) for v in (a, b))
            made = self.lanes.possible if cells else self.lanes.condition
            a, b = (made(self.builder, v) for v in (a, b))
            return a & b if op == "and_" else a | b
        if self.lanes.one and op == "truediv":
            a, b = self.numbers(a, b)
        if not any(isinstance(v, (Vec, tuple, Interval, Possible)) for v in (a, b)):
            return operate(self.builder, op, a, b)
        if op not in ARITHMETIC | COMPARISONS:
            raise MismatchError("this is for numbers that are the same everywhere")
        left, right = self.numbers(a, b)
        if op == "truediv" and isinstance(left, Vec):
            return self.lanes.math.divide(left, right)
        value: Value = getattr(operator, op)(left, right)
        return value

    def intrinsic_element(self, place: Value, index: Value) -> Value:
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

    def called(self, called: Function, given: Sequence[Value]) -> Value:
        """Emit a call of a function."""
        function, kind = self.emitter.function(called, tuple(map(kind_of, given)))
        result = self.builder.call(function, [part for value in given for part in parts_of(value)])
        count = len(types_of(kind, self.lanes))
        parts = [self.builder.extract_value(result, k) for k in range(count)]
        return made_of(kind, parts, self.lanes, self.builder)


@dataclass
class Emitter:
    """LLVM module under construction."""

    lanes: Lanes  # layout of the lanes
    named: Mapping[str, Function]  # functions that are called by name
    called: frozenset[Function]  # functions that are not inlined
    module: ir.Module = field(default_factory=ir.Module)  # LLVM module
    # functions emitted so far, and the kinds of their results
    made: dict[tuple[Function, str], tuple[ir.Function, Kind]] = field(default_factory=dict)

    @property
    def width(self) -> Width:
        """What the functions are read for."""
        return Width(self.lanes.width, self.lanes.on_gpu)

    def function(self, function: Function, kinds: tuple[Kind, ...]) -> tuple[ir.Function, Kind]:
        """Emit a function for arguments of given kinds; return it and the kind of its result."""
        key = function, repr(kinds)
        if key not in self.made:
            body = Body(self, function)
            made = body.written(kinds, f"{function.name}.{len(self.made)}", {})
            made.linkage = "internal"
            made.attributes.add("noinline" if function in self.called else "alwaysinline")
            self.made[key] = made, body.returned
        return self.made[key]

    def entry(self, function: Function, kinds: tuple[Kind, ...], own: Mapping[int, int]) -> None:
        """Emit an exported function under its own name.

        `own`: sizes of the arrays, by the places of the arguments, that are a GPU thread's own.
        """
        made = Body(self, function).written(kinds, function.name, own if self.lanes.on_gpu else {})
        if self.lanes.on_gpu:
            made.calling_convention = "ptx_kernel"


class _WiderError(Exception):
    """Parameters of the head of a loop have wider kinds than those that enter it."""


class Body(Operations):
    """Body of one function for one combination of argument kinds."""

    def __init__(self, emitter: Emitter, function: Function) -> None:
        self.emitter, self.lanes, self.function = emitter, emitter.lanes, function
        self.graph = function.graph(emitter.width)
        self.returned: Kind = ()
        self.widened: dict[graphs.Value, Kind] = {}  # kinds of parameters of loops that turned out wider

    def written(self, kinds: Sequence[Kind], name: str, own: Mapping[int, int]) -> ir.Function:
        """Emit the function under a name of the module; see `Emitter.entry`."""
        types = [t for k, kind in enumerate(kinds) if k not in own for t in types_of(kind, self.lanes)]
        function = ir.Function(self.emitter.module, ir.FunctionType(ir.VoidType(), types), name)
        function.attributes.add("nounwind")
        while True:
            try:
                self.begin(function, kinds, own)
                self.walk()
                break
            except _WiderError:
                function.blocks.clear()
        if self.returns:
            self.finish(function, types)
        return function

    def begin(self, function: ir.Function, kinds: Sequence[Kind], own: Mapping[int, int]) -> None:
        """Make the blocks, and the values of the arguments."""
        self.builder = ir.IRBuilder()
        self.blocks = {block: function.append_basic_block() for block in self.graph.blocks}
        self.builder.position_at_end(self.blocks[self.graph.blocks[0]])
        self.values: dict[graphs.Value, Value] = {}
        self.places: dict[graphs.Value, Any] = {}  # blocks of the values
        self.heads: dict[Block, tuple[list[Kind], list[Any]]] = {}  # of loops: kinds and phis
        self.waiting: dict[Block, list[tuple[Any, list[graphs.Value]]]] = {}
        self.returns: list[tuple[Any, graphs.Value]] = []
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
        self.values.update(zip(self.graph.arguments, given, strict=True))

    def walk(self) -> None:
        """Emit the blocks, each after those that lead to it."""
        ready = [self.graph.blocks[0]]
        while ready:
            block = ready.pop()
            self.join(block)
            for value in block.body:
                self.values[value] = self.emit(value)
                self.places[value] = self.builder.block
            ready += self.leave(block)

    def emit(self, value: graphs.Value) -> Value:
        """Emit an operation."""
        try:
            return self.operation(value.op, [self.get(operand) for operand in value.operands], value.data)
        except MismatchError as error:
            raise self.function.fail(value.origin, str(error)) from None

    def get(self, value: graphs.Value) -> Value:
        """What is emitted of a value. A product is fused with a sum only in the same block."""
        if value not in self.values:  # a constant
            return self.constant(value.data)
        made = self.values[value]
        if isinstance(made, Vec) and made.factors and self.places.get(value) is not self.builder.block:
            return replace(made, factors=None)
        return made

    def leave(self, block: Block) -> list[Block]:
        """Emit the exit of a block; return the blocks to which all ways are emitted now."""
        match block.exit:
            case Return(None):
                self.builder.ret_void()
            case Return(graphs.Value() as value):
                self.returns.append((self.builder.block, value))
            case Branch(test, yes, no, origin):
                try:
                    known = truth(self.builder, self.get(test))
                except MismatchError as error:
                    raise self.function.fail(origin, str(error)) from None
                self.builder.cbranch(known, self.blocks[yes], self.blocks[no])
                return [no, yes]
            case Jump(target, passed):
                if target in self.heads:
                    self.come_back(target, passed)
                    return []
                waiting = self.waiting.setdefault(target, [])
                waiting.append((self.builder.block, passed))
                return [target] if len(waiting) == target.ways else []
        return []

    def join(self, block: Block) -> None:
        """Emit the jumps to a block, and its parameters."""
        waiting = self.waiting.pop(block, [])
        kinds = [
            self.kind(name, [passed[k] for _, passed in waiting]) for k, name in enumerate(block.parameters)
        ]
        ends = [(place, self.pass_on(block, place, passed, kinds)) for place, passed in waiting]
        self.builder.position_at_end(self.blocks[block])
        phis = [self.builder.phi(part) for kind in kinds for part in types_of(kind, self.lanes)]
        for place, parts in ends:
            _receive(phis, place, parts)
        made = made_of(tuple(kinds), phis, self.lanes, self.builder)
        self.values.update(zip(block.parameters, made, strict=True))
        if block.is_head:
            self.heads[block] = kinds, phis

    def pass_on(
        self, block: Block, place: Any, passed: Sequence[graphs.Value], kinds: Sequence[Kind]
    ) -> list[Any]:
        """Emit a jump; return the parts of what it passes."""
        self.builder.position_at_end(place)
        pairs = zip(map(self.get, passed), kinds, strict=True)
        parts = parts_of(tuple(as_kind(value, kind, self.lanes, self.builder) for value, kind in pairs))
        self.builder.branch(self.blocks[block])
        return parts

    def kind(self, name: graphs.Value, passed: Sequence[graphs.Value]) -> Kind:
        """Kind of a parameter."""
        known = [self.widened[name]] if name in self.widened else []
        try:
            return reduce(join_kinds, [*known, *(kind_of(self.get(value)) for value in passed)])
        except MismatchError as error:
            raise self.function.fail(name.origin, str(error)) from None

    def come_back(self, head: Block, passed: Sequence[graphs.Value]) -> None:
        """Emit the jump from the end of a loop; begin the function again if its names are of wider kinds."""
        kinds, phis = self.heads[head]
        after = [self.kind(name, [name, value]) for name, value in zip(head.parameters, passed, strict=True)]
        wider = {n: a for n, a, k in zip(head.parameters, after, kinds, strict=True) if a != k}
        if wider:
            self.widened |= wider
            raise _WiderError
        place = self.builder.block
        _receive(phis, place, self.pass_on(head, place, passed, kinds))

    def finish(self, function: ir.Function, types: list[ir.Type]) -> None:
        """Emit the return instructions, now that their kind is known, and set the function's type."""
        self.returned = reduce(join_kinds, (kind_of(self.get(value)) for _, value in self.returns))
        result = ir.LiteralStructType(types_of(self.returned, self.lanes))
        for block, value in self.returns:
            self.builder.position_at_end(block)
            whole = ir.Constant(result, ir.Undefined)
            for k, part in enumerate(
                parts_of(as_kind(self.get(value), self.returned, self.lanes, self.builder))
            ):
                whole = self.builder.insert_value(whole, part, k)
            self.builder.ret(whole)
        function.ftype = ir.FunctionType(result, types)
        function.type = function.ftype.as_pointer()
        function.return_value.type = result


def _receive(phis: Sequence[Any], place: Any, parts: Sequence[Any]) -> None:
    """Let phis have parts from a block."""
    for phi, part in zip(phis, parts, strict=True):
        phi.add_incoming(part, place)


@dataclass(frozen=True)
class Target:
    """Compilation target."""

    bits: int  # width of a float: 32 or 64
    width: int  # lanes
    registers: int  # vector registers per value
    cpu: str  # CPU name and features, as LLVM spells them
    features: str


LONG = 250_000
"""Characters of code from which it is optimised once.

A second run makes fields faster by 2 %, up to 15 %. Kernels of pictures, of 400,000, are no faster by it, and
compile in half the time without.
"""


def compile_object(program: Program, target: Target, loops: Sequence[Loop]) -> bytes:
    """Compile loops over a scene's field to an object file with one C function per loop.

    `program`: linked scene; an empty one for loops without a field.
    """
    lanes.HOST_FEATURES = frozenset(f[1:] for f in target.features.split(",") if f.startswith("+"))
    kinds = Lanes(target.bits, target.width, target.registers)
    text = _text(program, kinds, llvm.get_process_triple(), loops)
    # Stack frames are aligned to whole registers; otherwise registers spilled to the stack would straddle two
    # cache lines.
    module = llvm.parse_assembly(re.sub(r"(?m)^define .*$", r'\g<0> "stackrealign"', text))
    _optimise(module, _target_machine(target), 1 if len(text) >= LONG else 2)
    return bytes(_machine(target).emit_object(module))


GPU = "nvptx64-nvidia-cuda"
ARCHITECTURES = {50: 15, 60: 15, 70: 15, 75: 15, 80: 15, 86: 15, 89: 16, 90: 16, 100: 20, 120: 20}
"""Compute capabilities, tenfold, that LLVM knows from a version on. Code for one runs on newer GPUs, too."""


def compile_ptx(program: Program, bits: int, capability: tuple[int, int], loops: Sequence[Loop]) -> bytes:
    """Compile loops over a scene's field to PTX with one kernel per loop.

    `program`: see `compile_object`; `capability`: compute capability of the GPU.
    """
    module = llvm.parse_assembly(_text(program, Lanes(bits, 1, 1, on_gpu=True), GPU, loops))
    version, most = llvm.llvm_version_info[0], 10 * capability[0] + capability[1]
    chosen = max(number for number, since in ARCHITECTURES.items() if since <= version and number <= most)
    features = "+ptx60" if chosen < 70 else ""  # has the barrier of a warp
    machine = _gpu_target().create_target_machine(cpu=f"sm_{chosen}", features=features, opt=3)
    _optimise(module, machine, 2)
    return str(machine.emit_assembly(module)).encode()


@lru_cache(maxsize=1)
def _gpu_target() -> llvm.Target:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    llvm.set_option("", "-nvptx-fma-level=1")  # lets the GPU's assembler fuse products with sums
    return llvm.Target.from_triple(GPU)


def _text(program: Program, lanes: Lanes, triple: str, loops: Sequence[Loop]) -> str:
    """LLVM IR of the loops and of the scene's functions that they call."""
    emitter = Emitter(lanes, program.functions, program.called)
    for part in program.parts:  # innermost elements first, so that the recursion is not as deep as the scene
        for points in sorted({loop.points for loop in loops}):
            emitter.function(part, (points, points, points, lanes.scalar.as_pointer(), WHOLE))
    for loop in loops:
        own_arrays = {k: loop.own for k, letter in enumerate(loop.arguments) if letter in OWN}
        kinds = tuple(_kind(letter, lanes) for letter in loop.arguments)
        emitter.entry(loop_function(loop), kinds, own_arrays)
    emitter.module.triple = triple
    return str(emitter.module)


def _kind(letter: str, lanes: Lanes) -> ir.Type:
    """LLVM type of a loop's argument."""
    element = element_type(letter, np.dtype(f"float{lanes.bits}"))
    if element.kind == "f":
        number = FLOAT if element.itemsize == 4 else DOUBLE
    else:
        number = ir.IntType(8 * element.itemsize)
    return number.as_pointer() if is_array(letter) else number


def _optimise(module: llvm.ModuleRef, machine: llvm.TargetMachine, runs: int) -> None:
    module.data_layout = str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.slp_vectorization = True, False
    builder = llvm.create_pass_builder(machine, options)
    for _ in range(runs):
        builder.getModulePassManager().run(module, builder)


def _target_machine(target: Target) -> llvm.TargetMachine:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple = llvm.Target.from_triple(llvm.get_process_triple())
    return triple.create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, reloc="pic", codemodel="jitdefault", jit=True
    )


def _machine(target: Target) -> Any:
    """Target machine that emits the object file."""
    return _target_machine(target)
