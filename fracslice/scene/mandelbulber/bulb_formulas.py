"""Powers of points in Mandelbulber: the Mandelbulb and its relatives, and squares of quaternions."""

from __future__ import annotations

from .folds import PI
from .step_text import FormulaStep, known

NYLANDER = "White and Nylander 2009, fractalforums.com"


@known(2, "Mandelbulb", NYLANDER)
def mandelbulb(s: FormulaStep) -> None:
    """Angles are counted from the equator, and may have offsets."""
    power, alpha, beta = s.value("power"), s.value("alpha_angle_offset"), s.value("beta_angle_offset")
    if 2 <= power <= 16 and not alpha and not beta:
        s.replace("cosine_bulb", power=power)
    n, a, b = s.number("power"), offset(s, "alpha_angle_offset"), offset(s, "beta_angle_offset")
    s.write(
        "x, y, z = w",
        "s = maximum(x * x + y * y, 1e-30)",
        f"t = {n} * (atan2(z, sqrt(s)){b})",
        f"p = {n} * (atan2(y, x){a})",
        f"r = exp(0.5 * {n} * log(s + z * z))",
        "w = (r * cos(t) * cos(p), r * cos(t) * sin(p), r * sin(t))",
    )


def offset(s: FormulaStep, name: str) -> str:
    """Addition of an angle in degrees; nothing for 0."""
    return f" + {s.number(name)} * 0.017453292519943295" if s.value(name) else ""


@known(3, "Mandelbulb Power 2", NYLANDER)
def mandelbulb_2(s: FormulaStep) -> None:
    """The square by products."""
    s.square()


@known(5, "Quaternion", "Norton 1982")
def quaternion(s: FormulaStep) -> None:
    """The square of a quaternion without k."""
    s.replace("quaternion_mandelbrot")
    s.write("x, y, z = w", "w = (x * x - y * y - z * z, 2 * x * y, 2 * x * z)")


@known(11, "Xenodreambuie", "Xenodreambuie 2010, fractalforums.com")
def xenodreambuie(s: FormulaStep) -> None:
    """Angles are counted from the pole; the one from it is reflected at the equator."""
    n, a, b = s.number("power"), offset(s, "alpha_angle_offset"), offset(s, "beta_angle_offset")
    s.write(
        "x, y, z = w",
        "s = maximum(x * x + y * y, 1e-30)",
        f"p = {n} * (atan2(y, x){b})",
        f"t = atan2(sqrt(s), z){a}",
        f"t = where(absolute(t) > 0.5 * {PI}, where(t < 0, -{PI}, {PI}) - t, t)",
        f"t = {n} * t",
        f"r = exp(0.5 * {n} * log(s + z * z))",
        "w = (r * cos(p) * sin(t), r * sin(p) * sin(t), r * cos(t))",
    )


@known(21, "Bristorbrot", "Bristor 2009, fractalforums.com")
def bristorbrot(s: FormulaStep) -> None:
    """The Bristorbrot."""
    s.replace("bristorbrot")
    s.write("x, y, z = w", "w = (x * x - y * y - z * z, y * (2 * x - z), z * (2 * x + y))")
