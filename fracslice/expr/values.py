"""Values of a formula's names during compilation: lanes, masks, scalars, addresses and tuples, and the
arithmetic of scalars.

Lanes and masks are `Vec`, a few registers; on cells, pairs of these (`intervals`). A scalar is one LLVM
value, the same for all lanes: see `scalars`.
There is no fast-math: results do not depend on the code around an operation (`lanes` describes how
products are fused), and NaN and infinity are handled.

Scalars mix as NumPy's do: an operation with a float literal is computed in 64 bits, and rounded once where it
meets lanes. Where there is one lane, as on a thread of a GPU, it is a number itself: a float is a lane, and
its condition may be branched on.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from llvmlite import ir

from . import lanes, thread_math
from .graph import MismatchError
from .intervals import TINY, Interval, Numbers, Possible
from .lanes import Vec, splat, vector

BOOL, WHOLE, FLOAT, DOUBLE = ir.IntType(1), ir.IntType(64), ir.FloatType(), ir.DoubleType()


def only_lane(value: Any) -> Any:
    """Return the scalar of the only lane; any other value unchanged."""
    return value.parts[0] if isinstance(value, Vec) and len(value.parts) == value.count == 1 else value


def number(builder: ir.IRBuilder, value: Any, kind: ir.Type) -> Any:
    """Convert a scalar to another type."""
    value = only_lane(value)
    if not isinstance(getattr(value, "type", None), (ir.IntType, ir.FloatType, ir.DoubleType)):
        raise MismatchError("a number is expected")
    given = value.type
    if given == kind:
        return value
    if isinstance(given, ir.IntType):
        if isinstance(kind, ir.IntType):
            return builder.trunc(value, kind) if kind.width < given.width else widen(builder, value, kind)
        return builder.uitofp(value, kind) if given == BOOL else builder.sitofp(_narrow(builder, value), kind)
    if isinstance(kind, ir.IntType):
        return builder.fptosi(value, kind)
    return builder.fpext(value, kind) if kind == DOUBLE else builder.fptrunc(value, kind)


def _narrow(builder: ir.IRBuilder, value: Any) -> Any:
    """Return an integer that a mask limits to 31 bits in 32, of which a GPU's registers are."""
    if isinstance(value, ir.Instruction) and value.opname == "and" and value.type == WHOLE:
        masks = [v.constant for v in value.operands if isinstance(v, ir.Constant)]
        if any(0 <= mask < 1 << 31 for mask in masks):
            return builder.trunc(value, ir.IntType(32))
    return value


def widen(builder: ir.IRBuilder, value: Any, kind: ir.IntType) -> Any:
    """Extend an integer to a wider type; booleans become 0 or 1."""
    return builder.zext(value, kind) if value.type == BOOL else builder.sext(value, kind)


def common(a: ir.Type, b: ir.Type) -> ir.Type:
    """Return the type in which two scalar types are computed.

    `a`, `b`: LLVM types.
    """
    if a == b and a != BOOL:
        return a
    return WHOLE if isinstance(a, ir.IntType) and isinstance(b, ir.IntType) else DOUBLE


def truth(builder: ir.IRBuilder, value: Any) -> Any:
    """Convert a scalar to a condition: True if it is not zero."""
    value = only_lane(value)
    if isinstance(value, (Vec, tuple)):
        raise MismatchError("it may differ from point to point; expected where(...), or if any_of(...)")
    if value.type == BOOL:
        return value
    zero = ir.Constant(value.type, 0)
    if isinstance(value.type, ir.IntType):
        return builder.icmp_signed("!=", value, zero)
    return builder.fcmp_unordered("!=", value, zero)


_COMPARISONS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}
_WHOLE = {
    "add": "add", "sub": "sub", "mul": "mul", "and_": "and_", "or_": "or_", "xor": "xor", "lshift": "shl",
    "rshift": "ashr",
}  # fmt: skip
_REAL = {"add": "fadd", "sub": "fsub", "mul": "fmul", "truediv": "fdiv"}


def operate(builder: ir.IRBuilder, op: str, a: Any, b: Any) -> Any:
    """Emit arithmetic or a comparison of two scalars.

    `op`: name in Python's `operator`.
    """
    if op in ("and_", "or_", "xor") and a.type == b.type == BOOL:
        return getattr(builder, _WHOLE[op])(a, b)
    kind = common(a.type, b.type)
    if op == "truediv" and isinstance(kind, ir.IntType):
        kind = DOUBLE
    a, b = number(builder, a, kind), number(builder, b, kind)
    is_whole = isinstance(kind, ir.IntType)
    if op in _COMPARISONS:
        how = _COMPARISONS[op]
        if is_whole:
            return builder.icmp_signed(how, a, b)
        return (builder.fcmp_unordered if how == "!=" else builder.fcmp_ordered)(how, a, b)
    if is_whole and op in ("floordiv", "mod"):
        return _floor_division(builder, op, a, b)
    name = (_WHOLE if is_whole else _REAL).get(op)
    if name is None:
        raise MismatchError("this is for whole numbers only")
    return getattr(builder, name)(a, b)


def _floor_division(builder: ir.IRBuilder, op: str, a: Any, b: Any) -> Any:
    """Python's floored quotient, or remainder with the sign of b."""
    rest = builder.srem(a, b)
    zero = ir.Constant(WHOLE, 0)
    other = builder.icmp_signed("<", builder.xor(rest, b), zero)
    over = builder.and_(builder.icmp_signed("!=", rest, zero), other)
    if op == "mod":
        return builder.select(over, builder.add(rest, b), rest)
    return builder.sub(builder.sdiv(a, b), builder.zext(over, WHOLE))


Value = Any
"""`Vec`, `Interval`, `Possible`, LLVM value, or tuple of these."""


LANES = {
    32: Numbers(lanes, 2.0**-23, 1e37, TINY[32], Vec.const),
    64: Numbers(lanes, 2.0**-52, 1e300, TINY[64], Vec.const),
}
"""Bounds of intervals by the width of floats."""


@dataclass(frozen=True)
class Lanes:
    """Layout of lanes."""

    bits: int  # width of a float: 32 or 64
    width: int  # number of lanes
    registers: int  # number of registers that hold them
    on_gpu: bool = False  # whether they are the threads of a GPU

    @property
    def one(self) -> bool:
        """True if a lane is a number."""
        return self.width == 1

    @property
    def math(self) -> ModuleType:
        """Elementary functions."""
        return thread_math if self.on_gpu else lanes

    @property
    def scalar(self) -> ir.Type:
        """LLVM type of a float."""
        return FLOAT if self.bits == 32 else DOUBLE

    @property
    def register(self) -> ir.Type:
        """LLVM type of a register of floats."""
        return vector(self.scalar, self.width // self.registers)

    @property
    def mask(self) -> ir.Type:
        """LLVM type of a register of booleans."""
        return vector(BOOL, self.width // self.registers)

    def vec(self, builder: ir.IRBuilder, value: Value) -> Vec:
        """Return lanes unchanged; broadcast a scalar."""
        if isinstance(value, Vec):
            if is_mask(value):
                raise MismatchError(
                    "a condition where a number is expected; where(condition, 1.0, 0.0) makes it one"
                )
            return value
        if isinstance(value, tuple):
            raise MismatchError("several values where one is expected")
        one = splat(builder, number(builder, value, self.scalar), self.register)
        return Vec(builder, (one,) * self.registers)

    def interval(self, builder: ir.IRBuilder, value: Value) -> Interval:
        """Return an interval unchanged; make one of lanes or of a scalar.

        Scalars that are rounded to lanes are enclosed.
        """
        if isinstance(value, Interval):
            return value
        if isinstance(value, Possible):
            raise MismatchError("a condition where a number is expected")
        lanes, of = self.vec(builder, value), LANES[self.bits]
        if isinstance(value, Vec):
            return Interval.at(lanes, of)
        if isinstance(value.type, ir.IntType) or self.bits == 64:
            return Interval.at(lanes, of, value.constant if isinstance(value, ir.Constant) else None)
        number = float(value.constant) if isinstance(value, ir.Constant) else np.nan
        exact = float(np.float32(number)) == number
        return Interval.at(lanes, of, number) if exact else Interval.at(lanes, of).outward()

    def condition(self, builder: ir.IRBuilder, value: Value) -> Vec:
        """Return a mask unchanged; broadcast a boolean."""
        if isinstance(value, Vec):
            if not is_mask(value):
                raise MismatchError("a number where a condition is expected")
            return value
        return Vec(builder, (splat(builder, truth(builder, value), self.mask),) * self.registers)

    def possible(self, builder: ir.IRBuilder, value: Value) -> Possible:
        """Return a condition on cells unchanged; that of a mask or of a boolean is certain."""
        if isinstance(value, Possible):
            return value
        if isinstance(value, Interval):
            raise MismatchError("a number where a condition is expected")
        mask = self.condition(builder, value)
        return Possible(mask, mask)


def is_mask(value: Value) -> bool:
    """Return True for a mask or a condition on cells."""
    return isinstance(value, Possible) or (isinstance(value, Vec) and value.element == BOOL)
