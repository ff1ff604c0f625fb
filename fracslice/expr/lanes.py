"""Lanes: LLVM vectors with Python's operators, and elementary functions on them without a mathematics
library.

A product is fused with a sum in the same expression here, not by LLVM, which may fuse the other of two
products elsewhere: a value does not depend on the code around it.

Polynomials and argument reductions are those of fdlibm (Sun Microsystems 1993, "Freely Distributable LIBM"),
evaluated without branches, so every machine computes the same bits. Errors are a few units in the last place
over the range that formulas use, as the tests verify.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
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


def polynomial(x: Vec, coefficients: Sequence[float]) -> Vec:
    """Evaluate a polynomial by Horner's rule, highest power first."""
    total = x.const(coefficients[0])
    for c in coefficients[1:]:
        total = total * x + c
    return total


def _polynomial_in_pairs(x: Vec, coefficients: Sequence[float]) -> Vec:
    """Horner's rule in x^2 on pairs of an even number of terms: half the latency for one more product."""
    x2 = x * x
    pairs = [x * a + b for a, b in zip(coefficients[::2], coefficients[1::2], strict=True)]
    return reduce(lambda total, pair: x2 * total + pair, pairs)


def sqrt(a: Vec) -> Vec:
    """Return the square root."""
    return a.call("sqrt")


def floor(a: Vec) -> Vec:
    """Return the largest integer not above a."""
    return a.call("floor")


def absolute(a: Vec) -> Vec:
    """Return the absolute value."""
    return a.call("fabs")


def cell_middle(a: Vec) -> Vec:
    """Return the number: a point is its own middle."""
    return a


def cell_extent(a: Vec) -> Vec:
    """Return 0."""
    return a * 0.0


def where(mask: Vec, yes: Vec, no: Vec) -> Vec:
    """Return `yes` where the mask is set, else `no`."""
    return mask.choose(yes, no)


def minimum(a: Vec, b: Vec) -> Vec:
    """Return a where a < b, else b."""
    return _extreme(a, b, "min") if _is_avx512(a) else (a < b).choose(a, b)


def maximum(a: Vec, b: Vec) -> Vec:
    """Return a where a > b, else b."""
    return _extreme(a, b, "max") if _is_avx512(a) else (a > b).choose(a, b)


def _extreme(a: Vec, b: Vec, which: str) -> Vec:
    """Minimum or maximum as one instruction that LLVM can merge with the mask of an enclosing `where`."""
    kind, current = a.register, ir.Constant(ir.IntType(32), 4)
    function = _avx512(a, which, [kind, kind, current.type])
    return a.each(lambda x, y: a.builder.call(function, [x, y, current]), b)


def divide(a: Vec, b: Vec) -> Vec:
    """Return a/b."""
    return a / b


def ratio(a: Vec, b: Vec) -> Vec:
    """Return a/b by division.

    The divider is mostly idle, while an estimate with Newton steps takes multiplications.
    """
    return divide(a, b)


def rsqrt(a: Vec) -> Vec:
    """Return 1/sqrt(a): the hardware's 14-bit estimate and Newton steps on AVX-512, else a division."""
    if not _is_avx512(a):
        return a.const(1.0) / sqrt(a)
    kind, mask = a.register, ir.IntType(a.register.count)
    estimate = _avx512(a, "rsqrt14", [kind, kind, mask])
    rest = ir.Constant(kind, None), ir.Constant(mask, (1 << kind.count) - 1)
    y = a.each(lambda register: a.builder.call(estimate, [register, *rest]))
    half = a * 0.5
    for _ in range(1 if a.bits == 32 else 2):
        y = y * (1.5 - half * y * y)
    return y


HOST_FEATURES: frozenset[str] = frozenset()
"""CPU features that code may use; the back end sets them before it compiles."""


def _is_avx512(a: Vec) -> bool:
    return "avx512f" in HOST_FEATURES and a.count * a.bits == 512


def _avx512(a: Vec, instruction: str, arguments: list[ir.Type]) -> Any:
    name = f"llvm.x86.avx512.{instruction}.p{'s' if a.bits == 32 else 'd'}.512"
    return declare(a.builder.module, ir.FunctionType(a.register, arguments), name)


LN2_HI, LN2_LO = (
    {32: 6.9313812256e-01, 64: 6.93147180369123816490e-01},
    {32: 9.0580006145e-06, 64: 1.90821492927058770002e-10},
)
_LOG = {
    32: [0.29870937079782827, 0.39977574022900132, 0.66666776085428965],
    64: [
        0.16819300426202444, 0.18123687851888652, 0.22223370220198587,
        0.28571417153125120, 0.40000000052136257, 0.66666666666587495,
    ],
}  # fmt: skip
"""Coefficients of fdlibm's series with one term less; minimax in the relative error, 8e-10 and 2e-16."""


def log(x: Vec) -> Vec:
    """Return the natural logarithm of a positive, normal number; undefined for others."""
    mantissa, root_half = (23, 0x3F3504F3) if x.bits == 32 else (52, 0x3FE6A09E << 32)
    above = x.as_whole().plus(-root_half)
    exponent = above.right(mantissa).to_real()
    m = above.masked((1 << mantissa) - 1).plus(root_half).as_real()
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    series = (polynomial if x.bits == 32 else _polynomial_in_pairs)(z, _LOG[x.bits])
    return exponent * math.log(2) + s * (z * series + 2.0)


def exp(x: Vec) -> Vec:
    """Return e^x, saturated at the ends of the range of normal numbers."""
    mantissa, bias, top, terms = (23, 127, 87.0, 7) if x.bits == 32 else (52, 1023, 708.0, 13)
    x = minimum(maximum(x, x.const(-top)), x.const(top))
    n = floor(x * (1 / math.log(2)) + 0.5)
    r = (x - n * LN2_HI[x.bits]) - n * LN2_LO[x.bits]
    value = polynomial(r, [1 / math.factorial(k) for k in range(terms, -1, -1)])
    return value * n.to_whole().plus(bias).left(mantissa).as_real()


_HALF_PI = {
    32: (1.5703125, 4.837512969970703125e-4, 7.549789954891882e-8),
    64: (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21),
}
_SIN = [
    1.58969099521155010221e-10, -2.50507602534068634195e-08, 2.75573137070700676789e-06,
    -1.98412698298579493134e-04, 8.33333333332248946124e-03, -1.66666666666666324348e-01,
]  # fmt: skip
_COS = [
    -1.13596475577881948265e-11, 2.08757232129817482790e-09, -2.75573143513906633035e-07,
    2.48015872894767294178e-05, -1.38888888888741095749e-03, 4.16666666666666019037e-02,
]  # fmt: skip


def sine(x: Vec, quarter_turns: int, sines: Sequence[float] = _SIN, cosines: Sequence[float] = _COS) -> Vec:
    """Return sin(x + quarter_turns pi/2) for |x| up to about 10^4, by two polynomials up to pi/4."""
    turns = floor(x * (2 / math.pi) + 0.5)
    r = x
    for part in _HALF_PI[x.bits]:
        r = r - turns * part
    z = r * r
    sine = r + r * z * polynomial(z, sines)
    cosine = (z * z * polynomial(z, cosines) - z * 0.5) + 1.0
    quadrant = turns.to_whole().plus(quarter_turns)
    value = quadrant.masked(1).is_set().choose(cosine, sine)
    return quadrant.masked(2).is_set().choose(-value, value)


def sin(x: Vec) -> Vec:
    """Return the sine for |x| up to about 10^4."""
    return sine(x, 0)


def cos(x: Vec) -> Vec:
    """Return the cosine for |x| up to about 10^4."""
    return sine(x, 1)


_ATAN = [
    1.62858201153657823623e-02, -3.65315727442169155270e-02, 4.97687799461593236017e-02,
    -5.83357013379057348645e-02, 6.66107313738753120669e-02, -7.69187620504482999495e-02,
    9.09088713343650656196e-02, -1.11111104054623557880e-01, 1.42857142725034663711e-01,
    -1.99999999998764832476e-01, 3.33333333333329318027e-01,
]  # fmt: skip


def atan2(y: Vec, x: Vec) -> Vec:
    """Return the angle of (x, y), in (-pi, pi]; 0 at the origin."""
    ax, ay = absolute(x), absolute(y)
    steep = ay > ax
    low, high = steep.choose(ax, ay), steep.choose(ay, ax)
    t = low / maximum(high, high.const(1e-30))
    far = t > math.sqrt(2) - 1
    u = far.choose((t - 1.0) / (t + 1.0), t)
    z = u * u
    angle = u - u * z * polynomial(z, _ATAN)
    angle = far.choose(angle + math.pi / 4, angle)
    angle = steep.choose(math.pi / 2 - angle, angle)
    angle = (x < 0.0).choose(math.pi - angle, angle)
    return (y < 0.0).choose(-angle, angle)
