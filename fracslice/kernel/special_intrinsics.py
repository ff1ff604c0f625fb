"""Intrinsics that are more than functions of lanes: choices, conversions, bounds of intervals, memory."""

from __future__ import annotations

import ast
from functools import reduce
from typing import Any

from llvmlite import ir

from .intervals import Interval, Possible
from .registers import Vec
from .scalars import WHOLE, MismatchError, common, compare, number, truth
from .values import LANES, Lanes, Value

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
        if not isinstance(mask, Vec):
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
        like = self.lanes.register
        parts = []
        for register in self.lanes.vec(self.builder, index).to_whole().parts:
            loaded = ir.Constant(like, ir.Undefined)
            for k in range(like.count):
                lane = ir.Constant(ir.IntType(32), k)
                address = self.builder.gep(place, [self.builder.extract_element(register, lane)])
                loaded = self.builder.insert_element(loaded, self.builder.load(address), lane)
            parts.append(loaded)
        return Vec(self.builder, tuple(parts))

    def registers(self, place: Any, index: Value) -> list[Any]:
        """Addresses of the registers of lanes, starting at an array element."""
        first, kind = self.address(place, index), self.lanes.register
        steps = (ir.Constant(WHOLE, k * kind.count) for k in range(self.lanes.registers))
        return [self.builder.bitcast(self.builder.gep(first, [step]), kind.as_pointer()) for step in steps]
