"""SIMD lanes for Numba: the vocabulary of the formulas on vectors of 8 to 64 floats.

A `Lanes` value is one LLVM vector, a `Mask` a vector of booleans. Numba types and links the formulas;
everything here is emitted as LLVM IR and becomes one or two instructions per register. The only fast-math
flag is `contract` (fused multiply-add): results do not depend on what surrounds an operation, and NaN and
infinity behave.

Only compiling needs this module (and Numba); a kernel from the cache does not import it.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from . import lanes_math
from .lanes_math import Vec


class Lanes(types.Type):
    def __init__(self, bits: int, width: int) -> None:
        self.bits, self.width = bits, width
        super().__init__(f"lanes_f{bits}x{width}")

    @property
    def llvm(self) -> ir.VectorType:
        return ir.VectorType(ir.FloatType() if self.bits == 32 else ir.DoubleType(), self.width)


class Mask(types.Type):
    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(f"mask_x{width}")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, kind.llvm)


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Mask) -> None:
        super().__init__(manager, kind, ir.VectorType(ir.IntType(1), kind.width))


def _vec(context: Any, builder: Any, kind: Any, value: Any, lanes: Lanes) -> Vec:
    """A value as a vector: lanes as they are, a number in all of them."""
    if not isinstance(kind, Lanes):
        scalar = types.float32 if lanes.bits == 32 else types.float64
        value = lanes_math.splat(builder, context.cast(builder, value, kind, scalar), lanes.llvm)
    return Vec(builder, value)


def _lanes_of(args: tuple[Any, ...]) -> Lanes | None:
    found = [a for a in args if isinstance(a, Lanes)]
    fits = all(isinstance(a, (Lanes, types.Number)) for a in args)
    return found[0] if found and fits else None


def _operator(op: Callable[..., Any], emit: Callable[..., Any], to_mask: bool = False) -> None:
    @infer_global(op)
    class _Template(AbstractTemplate):
        def generic(self, args: tuple[Any, ...], _: Any) -> Any:
            lanes = _lanes_of(args)
            if lanes:
                return signature(Mask(lanes.width) if to_mask else lanes, *args)
            return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = _lanes_of(sig.args)
        vectors = [_vec(context, builder, k, v, lanes) for k, v in zip(sig.args, args, strict=True)]  # type: ignore[arg-type]
        return emit(*vectors).value

    for kinds in ((Lanes, Lanes), (Lanes, types.Number), (types.Number, Lanes)):
        lower_builtin(op, *kinds)(lower)


for _op in (operator.add, operator.sub, operator.mul, operator.truediv):
    _operator(_op, _op)
for _op in (operator.lt, operator.le, operator.gt, operator.ge, operator.eq):
    _operator(_op, _op, to_mask=True)


@infer_global(operator.neg)
class _Negate(AbstractTemplate):
    def generic(self, args: tuple[Any, ...], _: Any) -> Any:
        return signature(args[0], args[0]) if isinstance(args[0], Lanes) else None


@lower_builtin(operator.neg, Lanes)
def _negate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return (-Vec(builder, args[0])).value


def _mask_operator(op: Callable[..., Any], method: str) -> None:
    @infer_global(op)
    class _Template(AbstractTemplate):
        def generic(self, args: tuple[Any, ...], _: Any) -> Any:
            return signature(args[0], *args) if all(isinstance(a, Mask) for a in args) else None

    @lower_builtin(op, Mask, Mask)
    def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, method)(*args)


_mask_operator(operator.and_, "and_")
_mask_operator(operator.or_, "or_")


def _function(emit: Callable[..., Vec]) -> Any:
    """An intrinsic of one or two lanes or numbers."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = _lanes_of(sig.args)
        vectors = [_vec(context, builder, k, v, lanes) for k, v in zip(sig.args, args, strict=True)]  # type: ignore[arg-type]
        return emit(*vectors).value

    def unary(typing: Any, a: Any) -> Any:
        lanes = _lanes_of((a,))
        return (lanes(a), generate) if lanes else None

    def binary(typing: Any, a: Any, b: Any) -> Any:
        lanes = _lanes_of((a, b))
        return (lanes(a, b), generate) if lanes else None

    return intrinsic(binary if emit.__code__.co_argcount == 2 else unary)


sqrt = _function(lanes_math.sqrt)
rsqrt = _function(lanes_math.rsqrt)
inverse = _function(lanes_math.inverse)
log = _function(lanes_math.log)
exp = _function(lanes_math.exp)
sin = _function(lanes_math.sin)
cos = _function(lanes_math.cos)
atan2 = _function(lanes_math.atan2)
floor = _function(lanes_math.floor)
minimum = _function(lanes_math.minimum)
maximum = _function(lanes_math.maximum)
absolute = _function(lanes_math.absolute)


@intrinsic
def where(typing: Any, mask: Any, a: Any, b: Any) -> Any:
    lanes = _lanes_of((a, b))
    if not isinstance(mask, Mask) or lanes is None:
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        x, y = (_vec(context, builder, k, v, lanes) for k, v in zip(sig.args[1:], args[1:], strict=True))
        return builder.select(args[0], x.value, y.value)

    return lanes(mask, a, b), generate


@intrinsic
def any_of(typing: Any, mask: Any) -> Any:
    if not isinstance(mask, Mask):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], ir.IntType(mask.width))
        return builder.icmp_unsigned("!=", bits, bits.type(0))

    return types.boolean(mask), generate


# --- between memory and lanes, for the loops around a field -------------------------------------------------
def loader(lanes: Lanes) -> Any:
    """``load(pointer, index) -> lanes``."""

    @intrinsic
    def load(typing: Any, pointer: Any, index: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            value = builder.load(_address(builder, args, lanes))
            value.align = lanes.bits // 8
            return value

        return lanes(pointer, types.intp), generate

    return load


@intrinsic
def store(typing: Any, pointer: Any, index: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        stored = builder.store(args[2], _address(builder, args, value))
        stored.align = value.bits // 8
        return context.get_dummy_value()

    return types.void(pointer, types.intp, value), generate


def _address(builder: Any, args: Any, lanes: Lanes) -> Any:
    element = builder.gep(args[0], [args[1]])
    return builder.bitcast(element, lanes.llvm.as_pointer())
