"""Elementary functions on LLVM vectors, float32 and float64, without a mathematics library.

Polynomials and argument reductions are those of fdlibm (Sun Microsystems 1993, "Freely Distributable LIBM")
evaluated without branches, so every machine gives the same bits. Errors are a few units in the last place
over the range that formulas use; tests hold them to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from llvmlite import ir

FLAGS = ("contract",)


def splat(builder: Any, scalar: Any, vector: ir.VectorType) -> Any:
    """A scalar in every lane."""
    undefined = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(
        first, undefined, ir.Constant(ir.VectorType(ir.IntType(32), vector.count), None)
    )


@dataclass(frozen=True, eq=False)
class Vec:
    """An LLVM vector of floats (or the integers of the same width) with Python's operators."""

    builder: Any
    value: Any

    @property
    def bits(self) -> int:
        element = self.value.type.element
        return (
            element.width
            if isinstance(element, ir.IntType)
            else 32
            if isinstance(element, ir.FloatType)
            else 64
        )

    @property
    def whole(self) -> ir.VectorType:
        return ir.VectorType(ir.IntType(self.bits), self.value.type.count)

    @property
    def real(self) -> ir.VectorType:
        return ir.VectorType(ir.FloatType() if self.bits == 32 else ir.DoubleType(), self.value.type.count)

    def const(self, number: float) -> Vec:
        return Vec(self.builder, ir.Constant(self.value.type, [number] * self.value.type.count))

    def _with(self, value: Any) -> Vec:
        return Vec(self.builder, value)

    def _other(self, other: Vec | float) -> Any:
        return other.value if isinstance(other, Vec) else self.const(other).value

    def __add__(self, other: Vec | float) -> Vec:
        return self._with(self.builder.fadd(self.value, self._other(other), flags=FLAGS))

    def __sub__(self, other: Vec | float) -> Vec:
        return self._with(self.builder.fsub(self.value, self._other(other), flags=FLAGS))

    def __mul__(self, other: Vec | float) -> Vec:
        return self._with(self.builder.fmul(self.value, self._other(other), flags=FLAGS))

    def __truediv__(self, other: Vec | float) -> Vec:
        return self._with(self.builder.fdiv(self.value, self._other(other), flags=FLAGS))

    def __neg__(self) -> Vec:
        return self._with(self.builder.fneg(self.value))

    def _compare(self, how: str, other: Vec | float) -> Vec:
        return self._with(self.builder.fcmp_ordered(how, self.value, self._other(other)))

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

    def choose(self, yes: Vec | float, no: Vec | float) -> Vec:
        """With self a mask: yes where it holds, else no; at least one of them a vector."""
        like = yes if isinstance(yes, Vec) else no
        assert isinstance(like, Vec)
        return self._with(self.builder.select(self.value, like._other(yes), like._other(no)))

    def call(self, name: str, *others: Vec) -> Vec:
        """An LLVM intrinsic on vectors of this type."""
        kind = self.value.type
        full = f"llvm.{name}.v{kind.count}f{self.bits}"
        function = ir.FunctionType(kind, [kind] * (1 + len(others)))
        declared = _declare(self.builder.module, function, full)
        return self._with(self.builder.call(declared, [self.value, *(o.value for o in others)]))

    def as_whole(self) -> Vec:
        """The same bits as integers."""
        return self._with(self.builder.bitcast(self.value, self.whole))

    def as_real(self) -> Vec:
        """The same bits as floats."""
        return self._with(self.builder.bitcast(self.value, self.real))

    def to_real(self) -> Vec:
        """Integers as floats."""
        return self._with(self.builder.sitofp(self.value, self.real))

    def to_whole(self) -> Vec:
        """Floats, already whole, as integers."""
        return self._with(self.builder.fptosi(self.value, self.whole))

    def plus(self, n: int | Vec) -> Vec:
        return self._with(self.builder.add(self.value, self._other(n)))

    def masked(self, n: int) -> Vec:
        return self._with(self.builder.and_(self.value, self.const(n).value))

    def left(self, n: int) -> Vec:
        return self._with(self.builder.shl(self.value, self.const(n).value))

    def right(self, n: int) -> Vec:
        return self._with(self.builder.ashr(self.value, self.const(n).value))

    def is_set(self) -> Vec:
        return self._with(self.builder.icmp_signed("!=", self.value, self.const(0).value))


def _declare(module: Any, function: ir.FunctionType, name: str) -> Any:
    known = module.globals.get(name)
    return known if known is not None else ir.Function(module, function, name)


def _polynomial(x: Vec, coefficients: Sequence[float]) -> Vec:
    """Horner's rule, the highest power first."""
    total = x.const(coefficients[0])
    for c in coefficients[1:]:
        total = total * x + c
    return total


def sqrt(a: Vec) -> Vec:
    return a.call("sqrt")


def floor(a: Vec) -> Vec:
    return a.call("floor")


def absolute(a: Vec) -> Vec:
    return a.call("fabs")


def minimum(a: Vec, b: Vec) -> Vec:
    return (a < b).choose(a, b)


def maximum(a: Vec, b: Vec) -> Vec:
    return (a > b).choose(a, b)


def rsqrt(a: Vec) -> Vec:
    """1/sqrt(a): the hardware's 14-bit estimate and Newton steps where there is one, else a division."""
    if not _has_estimate(a):
        return a.const(1.0) / sqrt(a)
    y = _estimate(a, "rsqrt14")
    half = a * 0.5
    for _ in range(1 if a.bits == 32 else 2):
        y = y * (a.const(1.5) - half * y * y)
    return y


def inverse(a: Vec) -> Vec:
    """1/a: as `rsqrt`."""
    if not _has_estimate(a):
        return a.const(1.0) / a
    y = _estimate(a, "rcp14")
    for _ in range(1 if a.bits == 32 else 2):
        y = y + y * (a.const(1.0) - a * y)
    return y


HOST_FEATURES: frozenset[str] = frozenset()
"""CPU features that code may use; set by the back end before it compiles."""


def _has_estimate(a: Vec) -> bool:
    return "avx512f" in HOST_FEATURES and a.value.type.count * a.bits % 512 == 0


def _estimate(a: Vec, instruction: str) -> Vec:
    """AVX-512's rsqrt14 or rcp14 on each 512-bit part."""
    count = 512 // a.bits
    part = ir.VectorType(a.value.type.element, count)
    mask = ir.IntType(count)
    name = f"llvm.x86.avx512.{instruction}.p{'s' if a.bits == 32 else 'd'}.512"
    function = _declare(a.builder.module, ir.FunctionType(part, [part, part, mask]), name)
    zero = ir.Constant(part, None)
    parts = []
    for start in range(0, a.value.type.count, count):
        piece = _slice(a.builder, a.value, start, count)
        parts.append(a.builder.call(function, [piece, zero, ir.Constant(mask, (1 << count) - 1)]))
    return Vec(a.builder, _joined(a.builder, parts))


def _slice(builder: Any, value: Any, start: int, count: int) -> Any:
    if value.type.count == count:
        return value
    index = ir.Constant(ir.VectorType(ir.IntType(32), count), list(range(start, start + count)))
    return builder.shuffle_vector(value, ir.Constant(value.type, ir.Undefined), index)


def _joined(builder: Any, parts: list[Any]) -> Any:
    while len(parts) > 1:
        count = 2 * parts[0].type.count
        index = ir.Constant(ir.VectorType(ir.IntType(32), count), list(range(count)))
        parts = [builder.shuffle_vector(a, b, index) for a, b in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


_LN2_HI, _LN2_LO = (
    {32: 6.9313812256e-01, 64: 6.93147180369123816490e-01},
    {32: 9.0580006145e-06, 64: 1.90821492927058770002e-10},
)
_LOG = {
    32: [0.24279078841, 0.28498786688, 0.40000972152, 0.66666662693],
    64: [
        1.479819860511658591e-01,
        1.531383769920937332e-01,
        1.818357216161805012e-01,
        2.222219843214978396e-01,
        2.857142874366239149e-01,
        3.999999999940941908e-01,
        6.666666666666735130e-01,
    ],
}


def log(x: Vec) -> Vec:
    """Natural logarithm of a positive, normal number; infinity and NaN pass through."""
    mantissa, one, root_half = (
        (23, 0x3F800000, 0x3F3504F3) if x.bits == 32 else (52, 0x3FF << 52, 0x3FE6A09E << 32)
    )
    shifted = x.as_whole().plus(one - root_half)
    exponent = shifted.right(mantissa).plus(-(one >> mantissa)).to_real()
    f = shifted.masked((1 << mantissa) - 1).plus(root_half).as_real() - 1.0
    s = f * inverse(f + 2.0)
    z = s * s
    half_square = f * f * 0.5
    r = z * _polynomial(z, _LOG[x.bits])
    small = s * (half_square + r) + exponent * _LN2_LO[x.bits]
    result = exponent * _LN2_HI[x.bits] - ((half_square - small) - f)
    return (x < math.inf).choose(result, x)


def exp(x: Vec) -> Vec:
    """e^x, saturating at the ends of the range of normal numbers."""
    mantissa, bias, top, terms = (23, 127, 87.0, 7) if x.bits == 32 else (52, 1023, 708.0, 13)
    x = minimum(maximum(x, x.const(-top)), x.const(top))
    n = floor(x * (1 / math.log(2)) + 0.5)
    r = (x - n * _LN2_HI[x.bits]) - n * _LN2_LO[x.bits]
    value = _polynomial(r, [1 / math.factorial(k) for k in range(terms, -1, -1)])
    return value * n.to_whole().plus(bias).left(mantissa).as_real()


_HALF_PI = {
    32: (1.5703125, 4.837512969970703125e-4, 7.549789954891882e-8),
    64: (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21),
}
_SIN = [
    1.58969099521155010221e-10,
    -2.50507602534068634195e-08,
    2.75573137070700676789e-06,
    -1.98412698298579493134e-04,
    8.33333333332248946124e-03,
    -1.66666666666666324348e-01,
]
_COS = [
    -1.13596475577881948265e-11,
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
]


def _sine(x: Vec, quarter_turns: int) -> Vec:
    """sin(x + quarter_turns pi/2) for |x| up to about 10^4."""
    turns = floor(x * (2 / math.pi) + 0.5)
    r = x
    for part in _HALF_PI[x.bits]:
        r = r - turns * part
    z = r * r
    sine = r + r * z * _polynomial(z, _SIN)
    cosine = (z * z * _polynomial(z, _COS) - z * 0.5) + 1.0
    quadrant = turns.to_whole().plus(quarter_turns)
    value = quadrant.masked(1).is_set().choose(cosine, sine)
    return quadrant.masked(2).is_set().choose(-value, value)


def sin(x: Vec) -> Vec:
    return _sine(x, 0)


def cos(x: Vec) -> Vec:
    return _sine(x, 1)


_ATAN = [
    1.62858201153657823623e-02,
    -3.65315727442169155270e-02,
    4.97687799461593236017e-02,
    -5.83357013379057348645e-02,
    6.66107313738753120669e-02,
    -7.69187620504482999495e-02,
    9.09088713343650656196e-02,
    -1.11111104054623557880e-01,
    1.42857142725034663711e-01,
    -1.99999999998764832476e-01,
    3.33333333333329318027e-01,
]


def atan2(y: Vec, x: Vec) -> Vec:
    """The angle of (x, y), in (-pi, pi]; 0 at the origin."""
    ax, ay = absolute(x), absolute(y)
    steep = ay > ax
    low, high = steep.choose(ax, ay), steep.choose(ay, ax)
    t = low / maximum(high, high.const(1e-30))
    far = t > math.sqrt(2) - 1
    u = far.choose((t - 1.0) / (t + 1.0), t)
    z = u * u
    angle = u - u * z * _polynomial(z, _ATAN)
    angle = far.choose(angle + math.pi / 4, angle)
    angle = steep.choose(angle.const(math.pi / 2) - angle, angle)
    angle = (x < 0.0).choose(angle.const(math.pi) - angle, angle)
    return (y < 0.0).choose(-angle, angle)
