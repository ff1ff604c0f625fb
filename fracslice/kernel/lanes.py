"""SIMD lanes for Numba: the vocabulary of the formulas on vectors of 8 to 64 floats.

A `Lanes` value is a few registers of floats, a `Mask` of booleans. Numba types and links the formulas;
everything here is emitted as LLVM IR and becomes one or two instructions per register. There is no fast-math:
results do not depend on what surrounds an operation (`registers` says how products are fused), and NaN and
infinity behave.

Only compiling needs this module (and Numba); a kernel from the cache does not import it.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import reduce
from typing import Any
from weakref import WeakKeyDictionary

from llvmlite import ir
from numba.core import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from . import lanes_math
from .registers import Vec, splat


class Lanes(types.Type):
    """So many floats of 32 or 64 bits, in so many registers."""

    def __init__(self, bits: int, width: int, registers: int) -> None:
        self.bits, self.width, self.registers = bits, width, registers
        super().__init__(f"lanes_f{bits}x{width}")

    @property
    def register(self) -> ir.VectorType:
        element = ir.FloatType() if self.bits == 32 else ir.DoubleType()
        return ir.VectorType(element, self.width // self.registers)

    @property
    def mask(self) -> Mask:
        return Mask(self.width, self.registers)


class Mask(types.Type):
    def __init__(self, width: int, registers: int) -> None:
        self.width, self.registers = width, registers
        super().__init__(f"mask_x{width}")

    @property
    def register(self) -> ir.VectorType:
        return ir.VectorType(ir.IntType(1), self.width // self.registers)


@register_model(Lanes)
@register_model(Mask)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.ArrayType(kind.register, kind.registers))


def _unpacked(builder: Any, kind: Lanes | Mask, value: Any) -> Vec:
    parts = tuple(builder.extract_value(value, k) for k in range(kind.registers))
    return Vec(builder, parts, _FACTORS.get(value))


_FACTORS: WeakKeyDictionary[Any, tuple[Vec, Vec]] = WeakKeyDictionary()
"""Of each product of lanes that LLVM may see added to something."""


def _packed(vec: Vec) -> Any:
    value = ir.Constant(ir.ArrayType(vec.register, len(vec.parts)), ir.Undefined)
    for k, part in enumerate(vec.parts):
        value = vec.builder.insert_value(value, part, k)
    if vec.factors:
        _FACTORS[value] = vec.factors
    return value


def _vec(context: Any, builder: Any, kind: Any, value: Any, lanes: Lanes) -> Vec:
    """A value as registers: lanes as they are, a number in all of them."""
    if isinstance(kind, Lanes):
        return _unpacked(builder, kind, value)
    scalar = types.float32 if lanes.bits == 32 else types.float64
    register = splat(builder, context.cast(builder, value, kind, scalar), lanes.register)
    return Vec(builder, (register,) * lanes.registers)


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
                return signature(lanes.mask if to_mask else lanes, *args)
            return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = _lanes_of(sig.args)
        vectors = [_vec(context, builder, k, v, lanes) for k, v in zip(sig.args, args, strict=True)]  # type: ignore[arg-type]
        return _packed(emit(*vectors))

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
    return _packed(-_unpacked(builder, sig.args[0], args[0]))


def _mask_operator(op: Callable[..., Any], method: str) -> None:
    @infer_global(op)
    class _Template(AbstractTemplate):
        def generic(self, args: tuple[Any, ...], _: Any) -> Any:
            return signature(args[0], *args) if all(isinstance(a, Mask) for a in args) else None

    @lower_builtin(op, Mask, Mask)
    def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pairs = zip(*(_unpacked(builder, sig.args[0], a).parts for a in args), strict=True)
        return _packed(Vec(builder, tuple(getattr(builder, method)(*pair) for pair in pairs)))


_mask_operator(operator.and_, "and_")
_mask_operator(operator.or_, "or_")


def _function(emit: Callable[..., Vec]) -> Any:
    """An intrinsic of one or two lanes or numbers."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = _lanes_of(sig.args)
        vectors = [_vec(context, builder, k, v, lanes) for k, v in zip(sig.args, args, strict=True)]  # type: ignore[arg-type]
        return _packed(emit(*vectors))

    def unary(typing: Any, a: Any) -> Any:
        lanes = _lanes_of((a,))
        return (lanes(a), generate) if lanes else None

    def binary(typing: Any, a: Any, b: Any) -> Any:
        lanes = _lanes_of((a, b))
        return (lanes(a, b), generate) if lanes else None

    return intrinsic(binary if emit.__code__.co_argcount == 2 else unary)


sqrt = _function(lanes_math.sqrt)
rsqrt = _function(lanes_math.rsqrt)
ratio = _function(lanes_math.ratio)
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
        return _packed(_unpacked(builder, mask, args[0]).choose(x, y))

    return lanes(mask, a, b), generate


@intrinsic
def any_of(typing: Any, mask: Any) -> Any:
    if not isinstance(mask, Mask):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        word = ir.IntType(mask.width // mask.registers)
        bits = [builder.bitcast(part, word) for part in _unpacked(builder, mask, args[0]).parts]
        return builder.icmp_unsigned("!=", reduce(builder.or_, bits), word(0))

    return types.boolean(mask), generate


# --- between memory and lanes, for the loops around a field -------------------------------------------------
def loader(lanes: Lanes) -> Any:
    """``load(pointer, index) -> lanes``."""

    @intrinsic
    def load(typing: Any, pointer: Any, index: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            values = [
                builder.load(place, align=lanes.bits // 8) for place in _addresses(builder, args, lanes)
            ]
            return _packed(Vec(builder, tuple(values)))

        return lanes(pointer, types.intp), generate

    return load


@intrinsic
def store(typing: Any, pointer: Any, index: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        registers = _unpacked(builder, value, args[2]).parts
        for place, register in zip(_addresses(builder, args, value), registers, strict=True):
            builder.store(register, place, align=value.bits // 8)
        return context.get_dummy_value()

    return types.void(pointer, types.intp, value), generate


def _addresses(builder: Any, args: Any, lanes: Lanes) -> list[Any]:
    """Where each register lies, from element args[1] of args[0] on."""
    first = builder.gep(args[0], [args[1]])
    steps = (ir.Constant(ir.IntType(64), k * lanes.register.count) for k in range(lanes.registers))
    return [builder.bitcast(builder.gep(first, [step]), lanes.register.as_pointer()) for step in steps]
