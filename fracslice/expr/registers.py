"""LLVM vectors with Python's operators: the registers that hold lanes.

A product is fused with a sum in the same expression here, not by LLVM, which may fuse the other of two
products elsewhere: a value does not depend on the code around it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from llvmlite import ir


def vector(element: ir.Type, count: int) -> ir.Type:
    """Return the type of a register; of one element it is a scalar."""
    return element if count == 1 else ir.VectorType(element, count)


def splat(builder: Any, scalar: Any, vector: ir.Type) -> Any:
    """Broadcast a scalar to every element of a register."""
    if not isinstance(vector, ir.VectorType):
        return scalar
    undefined = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(
        first, undefined, ir.Constant(ir.VectorType(ir.IntType(32), vector.count), None)
    )


@dataclass(frozen=True, eq=False)
class Vec:
    """LLVM vectors of floats, of integers of the same width, or of booleans, with Python's operators.

    Each vector is one register. An operator acts on one register after the other, so that several are in
    flight.
    """

    builder: Any  # LLVM IR builder
    parts: tuple[Any, ...]  # one LLVM value per register
    # factors of a product, or None. Adding to it or subtracting is one instruction with one rounding
    factors: tuple[Vec, Vec] | None = None

    @property
    def register(self) -> ir.Type:
        """LLVM type of a register."""
        return self.parts[0].type

    @property
    def element(self) -> ir.Type:
        """LLVM type of an element."""
        return self.register.element if isinstance(self.register, ir.VectorType) else self.register

    @property
    def count(self) -> int:
        """Elements of a register."""
        return self.register.count if isinstance(self.register, ir.VectorType) else 1

    @property
    def bits(self) -> int:
        """Width of an element: 1, 32 or 64."""
        sizes = {ir.FloatType: 32, ir.DoubleType: 64}
        return sizes.get(type(self.element)) or self.element.width

    @property
    def whole(self) -> ir.Type:
        """LLVM type of a register of integers of the same width."""
        return vector(ir.IntType(self.bits), self.count)

    @property
    def real(self) -> ir.Type:
        """LLVM type of a register of floats of the same width."""
        return vector(ir.FloatType() if self.bits == 32 else ir.DoubleType(), self.count)

    def const(self, number: float) -> Vec:
        """Return a constant of this type."""
        constant = ir.Constant(self.register, number if self.count == 1 else [number] * self.count)
        return Vec(self.builder, (constant,) * len(self.parts))

    def each(self, emit: Callable[..., Any], *others: Vec | float) -> Vec:
        """Emit an instruction on each register of self and the others."""
        rows = [o.parts if isinstance(o, Vec) else self.const(o).parts for o in others]
        return Vec(self.builder, tuple(emit(*p) for p in zip(self.parts, *rows, strict=True)))

    def __add__(self, other: Vec | float) -> Vec:
        theirs = other.factors if isinstance(other, Vec) else None
        if theirs is self.factors:  # no products, or a product added to itself, which needs no fusing
            return self.each(self.builder.fadd, other)
        if self.factors:
            return self._fused(1, other)
        assert isinstance(other, Vec)
        return other._fused(1, self)

    def __sub__(self, other: Vec | float) -> Vec:
        if self.factors:
            return self._fused(1, -other)
        if isinstance(other, Vec) and other.factors:
            return other._fused(-1, self)
        return self.each(self.builder.fsub, other)

    def __rsub__(self, other: float) -> Vec:
        return self.const(other) - self

    def __mul__(self, other: Vec | float) -> Vec:
        product = self.each(self.builder.fmul, other)
        return replace(product, factors=(self, other if isinstance(other, Vec) else self.const(other)))

    def _fused(self, sign: int, other: Vec | float) -> Vec:
        """sign * self + other, where self is a product."""
        assert self.factors
        a, b = self.factors
        return (a if sign > 0 else -a).call("fmuladd", b, other)

    def __truediv__(self, other: Vec | float) -> Vec:
        return self.each(self.builder.fdiv, other)

    def __neg__(self) -> Vec:
        return self.each(self.builder.fneg)

    def _compare(self, how: str, other: Vec | float) -> Vec:
        return self.each(partial(self.builder.fcmp_ordered, how), other)

    def __lt__(self, other: Vec | float) -> Vec:
        return self._compare("<", other)

    def __le__(self, other: Vec | float) -> Vec:
        return self._compare("<=", other)

    def __gt__(self, other: Vec | float) -> Vec:
        return self._compare(">", other)

    def __ge__(self, other: Vec | float) -> Vec:
        return self._compare(">=", other)

    def __eq__(self, other: object) -> Vec:  # type: ignore[override]
        return self._compare("==", other)  # type: ignore[arg-type]

    def __ne__(self, other: object) -> Vec:  # type: ignore[override]
        return self.each(partial(self.builder.fcmp_unordered, "!="), other)  # type: ignore[arg-type]

    def __and__(self, other: Vec) -> Vec:
        return self.each(self.builder.and_, other)

    def __or__(self, other: Vec) -> Vec:
        return self.each(self.builder.or_, other)

    def __invert__(self) -> Vec:
        return self.each(self.builder.not_)

    def choose(self, yes: Vec | float, no: Vec | float) -> Vec:
        """Select `yes` where the mask self is set, else `no`; at least one of them is a vector."""
        like = yes if isinstance(yes, Vec) else no
        assert isinstance(like, Vec)
        yes, no = (v if isinstance(v, Vec) else like.const(v) for v in (yes, no))
        return self.each(self.builder.select, yes, no)

    def call(self, name: str, *others: Vec | float) -> Vec:
        """Call an LLVM intrinsic on vectors of this type."""
        kind = self.register
        function = ir.FunctionType(kind, [kind] * (1 + len(others)))
        of = f"f{self.bits}" if self.count == 1 else f"v{self.count}f{self.bits}"
        declared = declare(self.builder.module, function, f"llvm.{name}.{of}")
        return self.each(lambda *registers: self.builder.call(declared, registers), *others)

    def as_whole(self) -> Vec:
        """Reinterpret the bits as integers."""
        return self._to(self.builder.bitcast, self.whole)

    def as_real(self) -> Vec:
        """Reinterpret the bits as floats."""
        return self._to(self.builder.bitcast, self.real)

    def to_real(self) -> Vec:
        """Convert integers to floats."""
        return self._to(self.builder.sitofp, self.real)

    def to_whole(self) -> Vec:
        """Convert floats with integer values to integers."""
        return self._to(self.builder.fptosi, self.whole)

    def _to(self, conversion: Callable[[Any, ir.Type], Any], kind: ir.Type) -> Vec:
        return self.each(lambda register: conversion(register, kind))

    def plus(self, n: int | Vec) -> Vec:
        """Add integers."""
        return self.each(self.builder.add, n)

    def masked(self, n: int) -> Vec:
        """Bitwise and of integers."""
        return self.each(self.builder.and_, n)

    def left(self, n: int) -> Vec:
        """Shift integers left."""
        return self.each(self.builder.shl, n)

    def right(self, n: int) -> Vec:
        """Shift integers right, arithmetically."""
        return self.each(self.builder.ashr, n)

    def is_set(self) -> Vec:
        """Return a mask of the non-zero integers."""
        return self.each(partial(self.builder.icmp_signed, "!="), 0)


def declare(module: Any, function: ir.FunctionType, name: str) -> Any:
    """Return the declaration of an external function in a module; add it if missing."""
    known = module.globals.get(name)
    return known if known is not None else ir.Function(module, function, name)
