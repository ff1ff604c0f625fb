"""Values of a formula's names during compilation: lanes, masks, scalars, memory addresses and tuples.

Lanes and masks are `Vec`, a few registers; on cells, pairs of these (`intervals`). A scalar is one LLVM
value, the same for all lanes: see `scalars`.
There is no fast-math: results do not depend on the code around an operation (`registers` describes how
products are fused), and NaN and infinity are handled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from llvmlite import ir

from .intervals import LANES, Interval, Possible
from .registers import Vec, splat
from .scalars import BOOL, DOUBLE, FLOAT, MismatchError, common, number, truth

Value = Any
"""`Vec`, `Interval`, `Possible`, LLVM value, or tuple of these."""


@dataclass(frozen=True)
class Lanes:
    """Layout of lanes.

    Attributes
    ----------
    bits
        Width of a float: 32 or 64.
    width
        Number of lanes.
    registers
        Number of registers that hold them.
    """

    bits: int
    width: int
    registers: int

    @property
    def scalar(self) -> ir.Type:
        """LLVM type of a float."""
        return FLOAT if self.bits == 32 else DOUBLE

    @property
    def register(self) -> ir.VectorType:
        """LLVM type of a register of floats."""
        return ir.VectorType(self.scalar, self.width // self.registers)

    @property
    def mask(self) -> ir.VectorType:
        """LLVM type of a register of booleans."""
        return ir.VectorType(BOOL, self.width // self.registers)

    def vec(self, builder: ir.IRBuilder, value: Value) -> Vec:
        """Return lanes unchanged; broadcast a scalar.

        Parameters
        ----------
        builder
            LLVM IR builder.
        value
            Lanes or scalar.

        Returns
        -------
        Vec
            Lanes.

        Raises
        ------
        MismatchError
            For a mask or a tuple.
        """
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

        Parameters
        ----------
        builder
            LLVM IR builder.
        value
            Interval, lanes or scalar.

        Returns
        -------
        Interval
            Interval.

        Raises
        ------
        MismatchError
            For a condition or a tuple.
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
        """Return a mask unchanged; broadcast a boolean.

        Parameters
        ----------
        builder
            LLVM IR builder.
        value
            Mask or scalar.

        Returns
        -------
        Vec
            Mask.

        Raises
        ------
        MismatchError
            For lanes of numbers or a tuple.
        """
        if isinstance(value, Vec):
            if not is_mask(value):
                raise MismatchError("a number where a condition is expected")
            return value
        return Vec(builder, (splat(builder, truth(builder, value), self.mask),) * self.registers)

    def possible(self, builder: ir.IRBuilder, value: Value) -> Possible:
        """Return a condition on cells unchanged; that of a mask or of a boolean is certain.

        Parameters
        ----------
        builder
            LLVM IR builder.
        value
            Condition on cells, mask or scalar.

        Returns
        -------
        Possible
            Condition on cells.

        Raises
        ------
        MismatchError
            For numbers or a tuple.
        """
        if isinstance(value, Possible):
            return value
        if isinstance(value, Interval):
            raise MismatchError("a number where a condition is expected")
        mask = self.condition(builder, value)
        return Possible(mask, mask)


def is_mask(value: Value) -> bool:
    """Return True for a mask or a condition on cells."""
    return isinstance(value, Possible) or (isinstance(value, Vec) and value.register.element == BOOL)


# --- as LLVM values, between functions and where paths join ---
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


def joined(a: Kind, b: Kind) -> Kind:
    """Return the common kind of two kinds.

    Parameters
    ----------
    a, b
        Kinds.

    Returns
    -------
    Kind
        Kind that values of both can be converted to.

    Raises
    ------
    MismatchError
        If there is none.
    """
    if a == b:
        return a
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        return tuple(joined(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, tuple) or isinstance(b, tuple):
        raise MismatchError("it has one value here and several there")
    if {a, b} & {*ON_CELLS.values()}:
        wide, other = (a, b) if a in ON_CELLS.values() else (b, a)
        if ON_CELLS.get(joined(other, "mask" if wide == "possible" else "lanes")) == wide:
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
    """Convert a value to another kind.

    Parameters
    ----------
    value
        Value.
    kind
        Kind that the value can be converted to.
    lanes
        Layout of the lanes.
    builder
        LLVM IR builder.

    Returns
    -------
    Value
        Value of that kind.

    Raises
    ------
    MismatchError
        If the value cannot be converted.
    """
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
