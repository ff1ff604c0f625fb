"""Arithmetic of scalars: booleans, 64-bit integers and floats of 32 or 64 bits, the same for all lanes.

Scalars mix as NumPy's do: an operation with a float literal is computed in 64 bits, and rounded once where it
meets lanes.
"""

from __future__ import annotations

import ast
from typing import Any

from llvmlite import ir

from .registers import Vec

BOOL, WHOLE, FLOAT, DOUBLE = ir.IntType(1), ir.IntType(64), ir.FloatType(), ir.DoubleType()


class MismatchError(Exception):
    """Incompatible values; the message names them."""


def number(builder: ir.IRBuilder, value: Any, kind: ir.Type) -> Any:
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


def truth(builder: ir.IRBuilder, value: Any) -> Any:
    """Convert a scalar to a condition: True if it is not zero.

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
