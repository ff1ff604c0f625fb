"""Elementary functions on one thread of an NVIDIA GPU, as those of `lanes` on lanes.

No fast-math flag is set: these flags let the compiler assume that there is no NaN and no infinity, and
reorder sums (a Mandelbulb rendered that way loses its normals). Instead each function names its instruction.
In float32 most are the GPU's own approximations, accurate to about 2 units in the last place (NVIDIA, "PTX
ISA": rsqrt, rcp, sqrt, lg2, ex2, div.full), with denormal arguments flushed to zero; NaN and infinity are
handled. In float64 they are the functions of the lanes, but for reciprocals.
"""

from __future__ import annotations

import math

from llvmlite import ir

from . import lanes
from .lanes import Vec
from .lanes import absolute as absolute
from .lanes import cell_extent as cell_extent
from .lanes import cell_middle as cell_middle
from .lanes import floor as floor


def _instruction(name: str, a: Vec, *others: Vec) -> Vec:
    """Emit an instruction of the GPU on floats."""
    kind, count = a.register, 1 + len(others)
    operands, letter = ", ".join(f"${k}" for k in range(count + 1)), "f" if a.bits == 32 else "d"
    constraint, function = ",".join([f"={letter}", *[letter] * count]), ir.FunctionType(kind, [kind] * count)
    return a.each(
        lambda *given: a.builder.asm(function, f"{name} {operands};", constraint, given, False), *others
    )


def sqrt(a: Vec) -> Vec:
    """Return the square root."""
    return _instruction("sqrt.approx.ftz.f32", a) if a.bits == 32 else lanes.sqrt(a)


def rsqrt(a: Vec) -> Vec:
    """Return 1/sqrt(a): in float64 the estimate and a step of third order."""
    if a.bits == 32:
        return _instruction("rsqrt.approx.ftz.f32", a)
    y = _instruction("rsqrt.approx.ftz.f64", a)
    e = 1.0 - a * y * y
    better = y + y * e * (e * 0.375 + 0.5)
    return (e == e).choose(better, y)  # 0 and infinity are exact


def divide(a: Vec, b: Vec) -> Vec:
    """Return a/b."""
    if a.bits == 64:
        return a / b
    if isinstance(b.parts[0], ir.Constant) and b.parts[0].constant:
        inverse: float = 1.0 / b.parts[0].constant
        return a * inverse
    return _instruction("div.full.ftz.f32", a, b)


def ratio(a: Vec, b: Vec) -> Vec:
    """Return a times the reciprocal of b: in float64 the estimate, of 20 bits, and a step of third order."""
    if a.bits == 32:
        return a * _instruction("rcp.approx.ftz.f32", b)
    y = _instruction("rcp.approx.ftz.f64", b)
    e = 1.0 - b * y
    return a * (y + y * (e + e * e))


def minimum(a: Vec, b: Vec) -> Vec:
    """Return the smaller number, or NaN: a point at infinity is not inside."""
    return a.call("minimum", b) if a.bits == 32 else lanes.minimum(a, b)


def maximum(a: Vec, b: Vec) -> Vec:
    """Return the larger number, or NaN."""
    return a.call("maximum", b) if a.bits == 32 else lanes.maximum(a, b)


def log(x: Vec) -> Vec:
    """Return the natural logarithm."""
    return _instruction("lg2.approx.ftz.f32", x) * math.log(2) if x.bits == 32 else lanes.log(x)


def exp(x: Vec) -> Vec:
    """Return e^x: 2^n by the exponent, and a power of 2 up to a half in size."""
    if x.bits == 64:
        return lanes.exp(x)
    n = floor(x * (1 / math.log(2)) + 0.5)
    rest = (x - n * lanes.LN2_HI[32]) - n * lanes.LN2_LO[32]
    return _instruction("ex2.approx.ftz.f32", rest * (1 / math.log(2))) * _instruction(
        "ex2.approx.ftz.f32", n
    )


_SIN = [2.75573137e-06, -1.98412698e-04, 8.33333333e-03, -1.66666667e-01]
_COS = [2.48015873e-05, -1.38888889e-03, 4.16666667e-02]
"""Coefficients of fdlibm's polynomials, as far as float32 needs them."""


def sin(x: Vec) -> Vec:
    """Return the sine for |x| up to about 10^4."""
    return lanes.sine(x, 0, _SIN, _COS) if x.bits == 32 else lanes.sin(x)


def cos(x: Vec) -> Vec:
    """Return the cosine for |x| up to about 10^4."""
    return lanes.sine(x, 1, _SIN, _COS) if x.bits == 32 else lanes.cos(x)


_ATAN = [
    2.9206823e-03, -1.6367888e-02, 4.3211805e-02, -7.5522100e-02, 1.0666002e-01, -1.4211055e-01,
    1.9993773e-01, -3.3333153e-01,
]  # fmt: skip
"""Coefficients of atan(t) / t - 1 in t^2 up to t = 1, minimax in the relative error, 2e-8."""


def atan2(y: Vec, x: Vec) -> Vec:
    """Return the angle of (x, y), in (-pi, pi]; 0 at the origin."""
    if x.bits == 64:
        return lanes.atan2(y, x)
    ax, ay = absolute(x), absolute(y)
    steep = ay > ax
    low, high = steep.choose(ax, ay), steep.choose(ay, ax)
    t = divide(low, maximum(high, high.const(1e-30)))
    z = t * t
    angle = t + t * (z * lanes.polynomial(z, _ATAN))
    angle = steep.choose(math.pi / 2 - angle, angle)
    angle = (x < 0.0).choose(math.pi - angle, angle)
    return (y < 0.0).choose(-angle, angle)
