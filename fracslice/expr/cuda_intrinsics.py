"""Intrinsics of formulas on one CUDA thread, for the modules that `cuda_source` writes.

No fast-math flag is set: these flags let the compiler assume that there is no NaN and no infinity, and
reorder sums (a Mandelbulb rendered that way loses its normals). Instead each intrinsic names its instruction.
In float32 most are the GPU's own approximations, accurate to about 2 units in the last place (NVIDIA, "PTX
ISA": rsqrt, rcp, sqrt, lg2, div.full), with denormal arguments flushed to zero; NaN and infinity are handled.
Multiply-add is fused, as on the lanes. In float64 results are accurate to one or two units in the last place.

On Numba's CUDA simulator the intrinsics are those of the reference, on scalars.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from . import vocabulary

if not hasattr(np, "row_stack"):  # NumPy 2.5 removed it, but numba-cuda 0.30 still imports it
    np.row_stack = np.vstack

from llvmlite import ir

cuda: Any = import_module("numba.cuda")
SIMULATED = bool(cuda.config.ENABLE_CUDASIM)
types: Any = np if SIMULATED else import_module("numba.cuda.types")
float32, float64, int32 = types.float32, types.float64, int if SIMULATED else types.int32
device = cuda.jit(device=True) if SIMULATED else cuda.jit(device=True, forceinline=True)
called = cuda.jit(device=True)
kernel = cuda.jit


@device
def thread():  # type: ignore[no-untyped-def]
    """Return the global index of this thread."""
    return cuda.grid(1)


@device
def gather(i, P):  # type: ignore[no-untyped-def]
    """Load the element of P at a whole index, a real."""
    return P[int32(i)]


Instruction = str | Callable[..., Any]


def _intrinsic(arity: int, single: Instruction, double: Instruction) -> Any:
    """Define an intrinsic on reals, in float32 and float64.

    Each implementation is a PTX instruction, a function of NVIDIA's libdevice if the name begins with
    ``__nv_``, or a Python function.
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        wide = sig.return_type.bitwidth == 64
        real, meaning = (ir.DoubleType(), double) if wide else (ir.FloatType(), single)
        if not isinstance(meaning, str):
            return context.compile_internal(builder, meaning, sig, args)
        kind = ir.FunctionType(real, [real] * arity)
        if meaning.startswith("__nv_"):
            known = builder.module.globals.get(meaning)
            return builder.call(
                known if known is not None else ir.Function(builder.module, kind, meaning), args
            )
        operands, letter = ", ".join(f"${i}" for i in range(arity + 1)), "d" if wide else "f"
        return builder.asm(
            kind, f"{meaning} {operands};", ",".join(["=" + letter, *[letter] * arity]), args, False
        )

    def unary(typing: Any, a: Any) -> Any:
        return a(a), generate

    def binary(typing: Any, a: Any, b: Any) -> Any:
        return a(a, a), generate

    return intrinsic(unary if arity == 1 else binary)


if SIMULATED:
    globals().update({name: getattr(vocabulary, name) for name in vocabulary.NAMES})
    divide = np.divide

    @device
    def together():  # type: ignore[no-untyped-def]
        """Synchronise the threads of the warp; in the simulator each runs alone."""
else:
    intrinsic = import_module("numba.cuda.extending").intrinsic
    LOG_2 = float32(math.log(2))
    _log2 = _intrinsic(1, "lg2.approx.ftz.f32", "__nv_log2")

    def _log(a):  # type: ignore[no-untyped-def]
        return _log2(a) * LOG_2

    _inverse = _intrinsic(1, "rcp.approx.ftz.f32", "rcp.approx.ftz.f64")

    def _ratio(a, b):  # type: ignore[no-untyped-def]
        return a * _inverse(b)

    def _ratio_in_double(a, b):  # type: ignore[no-untyped-def]
        """The reciprocal estimate is accurate to 20 bits; one third-order step makes it accurate to all."""
        y = _inverse(b)
        e = 1.0 - b * y
        return a * (y + y * (e + e * e))

    @device
    def _sine(x, quarter_turns):  # type: ignore[no-untyped-def]
        """Argument reduction by parts of pi/2 (fdlibm), as on the lanes: libdevice reduces in float64."""
        turns = floor(x * float32(2 / math.pi) + float32(0.5))
        r = x - turns * float32(1.5703125)
        r = r - turns * float32(4.837512969970703125e-4)
        r = r - turns * float32(7.549789954891882e-8)
        z = r * r
        quadrant = int32(turns) + quarter_turns
        s = z * float32(2.75573137e-06) - float32(1.98412698e-04)
        s = r + r * z * (z * (z * s + float32(8.33333333e-03)) - float32(1.66666667e-01))
        c = z * float32(2.48015873e-05) - float32(1.38888889e-03)
        c = (z * z * (z * c + float32(4.16666667e-02)) - z * float32(0.5)) + float32(1.0)
        value = c if quadrant & int32(1) else s
        return -value if quadrant & int32(2) else value

    def _sin(x):  # type: ignore[no-untyped-def]
        return _sine(x, int32(0))

    def _cos(x):  # type: ignore[no-untyped-def]
        return _sine(x, int32(1))

    # Plain min.f32 and max.f32 drop NaN: a point at infinity would be inside.
    def _minimum(a, b):  # type: ignore[no-untyped-def]
        return a if a < b else b

    def _maximum(a, b):  # type: ignore[no-untyped-def]
        return a if a > b else b

    def _ampere() -> bool:
        """True if the GPU supports min.NaN; also without a GPU, where code is only inspected."""
        return not cuda.is_available() or cuda.get_current_device().compute_capability >= (8, 0)

    sqrt = _intrinsic(1, "sqrt.approx.ftz.f32", "sqrt.rn.f64")
    rsqrt = _intrinsic(1, "rsqrt.approx.ftz.f32", "__nv_rsqrt")
    ratio = _intrinsic(2, _ratio, _ratio_in_double)
    divide = _intrinsic(2, "div.full.ftz.f32", "div.rn.f64")
    log = _intrinsic(1, _log, "__nv_log")
    exp = _intrinsic(1, "__nv_expf", "__nv_exp")
    sin = _intrinsic(1, _sin, "__nv_sin")
    cos = _intrinsic(1, _cos, "__nv_cos")
    atan2 = _intrinsic(2, "__nv_atan2f", "__nv_atan2")
    floor = _intrinsic(1, "__nv_floorf", "__nv_floor")
    minimum = _intrinsic(2, "min.NaN.f32" if _ampere() else _minimum, _minimum)
    maximum = _intrinsic(2, "max.NaN.f32" if _ampere() else _maximum, _maximum)
    absolute = _intrinsic(1, "__nv_fabsf", "__nv_fabs")

    @device
    def where(mask, a, b):  # type: ignore[no-untyped-def]
        """Return a where the mask is set, else b."""
        return a if mask else b

    @device
    def any_of(mask):  # type: ignore[no-untyped-def]
        """Return the mask: a thread has one point."""
        return mask

    @device
    def together():  # type: ignore[no-untyped-def]
        """Synchronise the threads of the warp."""
        cuda.syncwarp()
