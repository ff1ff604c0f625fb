"""Kinds of values: their LLVM types between functions, and the common kind where paths join."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir

from .intervals import Interval, Possible
from .registers import Vec
from .scalars import BOOL, MismatchError, common, number
from .values import LANES, Lanes, Value, is_mask

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
