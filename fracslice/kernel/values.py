"""Values of a formula's names during compilation: lanes, masks, scalars, memory addresses and tuples.

Lanes and masks are `Vec`, a few registers; on cells, pairs of these (`intervals`). A scalar is one LLVM
value, the same for all lanes: see `scalars`.
There is no fast-math: results do not depend on the code around an operation (`registers` describes how
products are fused), and NaN and infinity are handled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from llvmlite import ir

from . import lanes_math
from .interval_numbers import TINY, Numbers
from .intervals import Interval, Possible
from .registers import Vec, splat
from .scalars import BOOL, DOUBLE, FLOAT, MismatchError, number, truth

Value = Any
"""`Vec`, `Interval`, `Possible`, LLVM value, or tuple of these."""


LANES = {
    32: Numbers(lanes_math, 2.0**-23, 1e37, TINY[32], Vec.const),
    64: Numbers(lanes_math, 2.0**-52, 1e300, TINY[64], Vec.const),
}
"""Bounds of intervals by the width of floats."""


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
