"""Values of a formula's names during compilation: lanes, masks, scalars, memory addresses and tuples.

Lanes and masks are `Vec`, a few registers. A scalar is one LLVM value, the same for all lanes: a boolean, a
64-bit integer, a float of 32 or 64 bits. Scalars mix as NumPy's do: an operation with a float literal is
computed in 64 bits, and rounded once where it meets lanes. There is no fast-math: results do not depend on
the code around an operation (`registers` describes how products are fused), and NaN and infinity are
handled.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from llvmlite import ir

from .registers import Vec, splat

BOOL, WHOLE, FLOAT, DOUBLE = ir.IntType(1), ir.IntType(64), ir.FloatType(), ir.DoubleType()

Value = Any
"""`Vec`, LLVM value, or tuple of these."""


class MismatchError(Exception):
    """Incompatible values; the message names them."""


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


def is_mask(value: Value) -> bool:
    """Return True for a mask."""
    return isinstance(value, Vec) and value.register.element == BOOL


def number(builder: ir.IRBuilder, value: Value, kind: ir.Type) -> Any:
    """Convert a scalar to another type.

    Parameters
    ----------
    builder
        LLVM IR builder.
    value
        Scalar.
    kind
        LLVM type.

    Returns
    -------
    Any
        LLVM value of that type.

    Raises
    ------
    MismatchError
        If the value is no scalar.
    """
    if not isinstance(getattr(value, "type", None), (ir.IntType, ir.FloatType, ir.DoubleType)):
        raise MismatchError("a number is expected")
    given = value.type
    if given == kind:
        return value
    if isinstance(given, ir.IntType):
        if isinstance(kind, ir.IntType):
            return builder.trunc(value, kind) if kind.width < given.width else widened(builder, value, kind)
        return builder.uitofp(value, kind) if given == BOOL else builder.sitofp(value, kind)
    if isinstance(kind, ir.IntType):
        return builder.fptosi(value, kind)
    return builder.fpext(value, kind) if kind == DOUBLE else builder.fptrunc(value, kind)


def widened(builder: ir.IRBuilder, value: Any, kind: ir.IntType) -> Any:
    """Extend an integer to a wider type; booleans become 0 or 1."""
    return builder.zext(value, kind) if value.type == BOOL else builder.sext(value, kind)


def common(a: ir.Type, b: ir.Type) -> ir.Type:
    """Return the type in which two scalar types are computed.

    Parameters
    ----------
    a, b
        LLVM types.

    Returns
    -------
    ir.Type
        The type itself if both are equal and not boolean, else a 64-bit integer or float.
    """
    if a == b and a != BOOL:
        return a
    return WHOLE if isinstance(a, ir.IntType) and isinstance(b, ir.IntType) else DOUBLE


def truth(builder: ir.IRBuilder, value: Value) -> Any:
    """Convert a scalar to a condition: True if it is not zero.

    Parameters
    ----------
    builder
        LLVM IR builder.
    value
        Scalar.

    Returns
    -------
    Any
        LLVM boolean.

    Raises
    ------
    MismatchError
        For lanes, a mask or a tuple.
    """
    if isinstance(value, (Vec, tuple)):
        raise MismatchError("it may differ from point to point; expected where(...), or if any_of(...)")
    if value.type == BOOL:
        return value
    zero = ir.Constant(value.type, 0)
    if isinstance(value.type, ir.IntType):
        return builder.icmp_signed("!=", value, zero)
    return builder.fcmp_unordered("!=", value, zero)


_COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_WHOLE = {
    ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.BitAnd: "and_", ast.BitOr: "or_", ast.BitXor: "xor",
    ast.LShift: "shl", ast.RShift: "ashr",
}  # fmt: skip
_REAL = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}


def operate(builder: ir.IRBuilder, op: ast.operator, a: Any, b: Any) -> Any:
    """Emit arithmetic on two scalars.

    Parameters
    ----------
    builder
        LLVM IR builder.
    op
        Operator.
    a, b
        Scalars.

    Returns
    -------
    Any
        LLVM value.

    Raises
    ------
    MismatchError
        For an integer operator on floats.
    """
    if isinstance(op, (ast.BitAnd, ast.BitOr, ast.BitXor)) and a.type == b.type == BOOL:
        return getattr(builder, _WHOLE[type(op)])(a, b)
    kind = common(a.type, b.type)
    if isinstance(op, ast.Div) and kind == WHOLE:
        kind = DOUBLE
    a, b = number(builder, a, kind), number(builder, b, kind)
    if kind == WHOLE and isinstance(op, (ast.FloorDiv, ast.Mod)):
        return _floored(builder, op, a, b)
    name = (_WHOLE if kind == WHOLE else _REAL).get(type(op))
    if name is None:
        raise MismatchError("this is for whole numbers only")
    return getattr(builder, name)(a, b)


def _floored(builder: ir.IRBuilder, op: ast.operator, a: Any, b: Any) -> Any:
    """Python's floored quotient, or remainder with the sign of b."""
    rest = builder.srem(a, b)
    zero = ir.Constant(WHOLE, 0)
    other = builder.icmp_signed("<", builder.xor(rest, b), zero)
    over = builder.and_(builder.icmp_signed("!=", rest, zero), other)
    if isinstance(op, ast.Mod):
        return builder.select(over, builder.add(rest, b), rest)
    return builder.sub(builder.sdiv(a, b), builder.zext(over, WHOLE))


def compare(builder: ir.IRBuilder, op: ast.cmpop, a: Any, b: Any) -> Any:
    """Emit a comparison of two scalars.

    Parameters
    ----------
    builder
        LLVM IR builder.
    op
        Operator.
    a, b
        Scalars.

    Returns
    -------
    Any
        LLVM boolean.
    """
    kind = common(a.type, b.type)
    a, b = number(builder, a, kind), number(builder, b, kind)
    how = _COMPARISONS[type(op)]
    if kind == WHOLE:
        return builder.icmp_signed(how, a, b)
    return (builder.fcmp_unordered if how == "!=" else builder.fcmp_ordered)(how, a, b)


# --- as LLVM values, between functions and where paths join ---
Kind = Any
"""Kind of a value: an LLVM type, "lanes", "mask", or a tuple of kinds."""


def kind_of(value: Value) -> Kind:
    """Return the kind of a value."""
    if isinstance(value, tuple):
        return tuple(map(kind_of, value))
    return ("mask" if is_mask(value) else "lanes") if isinstance(value, Vec) else value.type


def types_of(kind: Kind, lanes: Lanes) -> list[ir.Type]:
    """Return the LLVM types of the parts of a value of this kind."""
    if isinstance(kind, tuple):
        return [t for part in kind for t in types_of(part, lanes)]
    if kind == "lanes":
        return [lanes.register] * lanes.registers
    return [lanes.mask] * lanes.registers if kind == "mask" else [kind]


def parts_of(value: Value) -> list[Any]:
    """Return the LLVM values that a value consists of."""
    if isinstance(value, tuple):
        return [p for part in value for p in parts_of(part)]
    return list(value.parts) if isinstance(value, Vec) else [value]


def made_of(kind: Kind, parts: Sequence[Any], lanes: Lanes, builder: ir.IRBuilder) -> Value:
    """Assemble a value of a kind from LLVM values."""
    left = list(parts)

    def taken(kind: Kind) -> Value:
        if isinstance(kind, tuple):
            return tuple(map(taken, kind))
        if kind in ("lanes", "mask"):
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
    if kind == "lanes":
        return lanes.vec(builder, value)
    if kind == "mask":
        return lanes.condition(builder, value)
    return value if value.type == kind else number(builder, value, kind)
