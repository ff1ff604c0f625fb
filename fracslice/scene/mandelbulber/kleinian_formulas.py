"""The Kleinian groups of Mandelbulber: folds and inversions whose last point is measured with a surface."""

from __future__ import annotations

from .box_formulas import fold_with_height
from .folds import PI, bulge, differences
from .step_text import JOS, KLEINIAN, LEFT_OUT, OWN_SOLID, SQUARE, FormulaStep, known

KNIGHTY = "Knighty 2011, fractalforums.com: pseudo-Kleinian"
LEYS = "Leys and Knighty 2017, fractalforums.org, after Jorgensen 1977"

SLOPE, ROOT_3 = "0.8660254037844386", "1.7320508075688772"
"""sqrt(3) / 2 and sqrt(3)."""


def inverted_first(s: FormulaStep, radius2: str, back: str, stop: str = "transf_stop_iterations_1") -> bool:
    """Invert in a sphere in the first iterations; whether it was."""
    on = s.on("transf_sphere_inversion_enabled_false") and s.during("transf_start_iterations_X", stop)
    if on:
        s.invert("transf_offset_000", radius2, back)
    return on


def fold_into_box(s: FormulaStep) -> None:
    """Reflect into a box, and invert in a ball what is in it, without an inner radius."""
    s.fold("transf_addition_constant_0777")
    spread(s)


def spread(s: FormulaStep) -> None:
    """Invert in a ball what is in it."""
    s.write("x, y, z = w", f"k = {s.number('transf_minimum_radius_05')}")
    s.write(f"w = maximum(k / maximum({SQUARE}, 1e-18), 1) * w")


def prism(s: FormulaStep) -> None:
    """Folds of a cross in a prism, with a gap; behind it the point falls to the axis."""
    if not (
        s.on("transf_function_enabledP_false")
        and s.during("transf_start_iterations_P", "transf_stop_iterations_P1")
    ):
        return
    s.write("x, y, z = w", "y, z = absolute(y), absolute(z)")
    s.write(f"t = {s.number('transf_scale')} * maximum(0.5 * y - {SLOPE} * x, 0)")
    s.write(f"x, y = x + {ROOT_3} * t, absolute(y - t)", "y, z = minimum(y, z), maximum(y, z)")
    if any(s.vector("transf_constant_multiplier_000")):
        s.write(f"a, b, d = {s.point('transf_constant_multiplier_000')}")
        s.write(f"x, y, z = x - {SLOPE} * a, y - 1.5 * b, z - 1.5 * d")
    s.write("x, z = maximum(x, z), minimum(x, z)")
    s.write("y, z = where(x > 0, maximum(y, 0), y), where(x > 0, maximum(z, 0), z)", "w = (x, y, z)")


def turned(s: FormulaStep) -> None:
    """Turn in the iterations of R."""
    if s.on("transf_function_enabledR_false") and s.within("R"):
        s.turn("transf_rotation")


@known(103, "Pseudo Kleinian", KNIGHTY, LEFT_OUT, distance=KLEINIAN)
def pseudo_kleinian(s: FormulaStep) -> None:
    """Folds into a box and out of a ball."""
    inverted_first(s, "transf_maxR2_1", "transf_addition_constantA_000")
    prism(s)
    if s.on("transf_function_enabledBy_false") and s.within("E"):
        fold = s.fold if s.on("transf_function_enabledBy") else s.fold_flat
        fold("transf_addition_constant_111")
    if s.on("transf_function_enabledBx_false") and s.within("A"):
        fold_with_height(s)
    if s.within("C"):
        fold_into_box(s)
        if s.on("transf_function_enabledN_false"):
            s.write("x, y, z = w", "w = (x, y, -z)")
    turned(s)
    s.add("transf_addition_constant")


@known(117, "Pseudo Kleinian - Mod 2", KNIGHTY, LEFT_OUT, distance=KLEINIAN)
def pseudo_kleinian_2(s: FormulaStep) -> None:
    """More folds before and behind those of the group."""
    if s.on("transf_function_enabledS_false") and s.within("S"):
        s.refuse("transf_function_enabledy_false")
        s.ball(s.value("transf_minR2_p25"), s.value("transf_maxR2_1"), "mandelbox_offset")
        s.scale("transf_scale_1")
    prism(s)
    turned(s)
    benesi(s, "transf_start_iterations_T")
    box_and_balls(s, "transf_function_enabledAy")
    s.add("transf_addition_constant")
    if s.on("transf_function_enabledF_false") and s.within("F"):
        s.fold("transf_offsetA_000")
        if s.on("transf_function_enabled_false") and s.within("A"):
            bulge(s, "transf_offsetA_000", "transf_scale3D_000")
    s.refuse("transf_addCpixel_enabled_false")


def benesi(s: FormulaStep, start: str) -> None:
    """A turn to the diagonal of a cube, absolute values, a scale, and the turn back."""
    if s.on("transf_function_enabledx_false") and s.during(
        "transf_start_iterations_D", "transf_stop_iterationsTM_1"
    ):
        s.refuse("transf_function_enabledx_false")
    if not (s.on("transf_benesi_T1_enabled_false") and s.during(start, "transf_stop_iterationsT_1")):
        return
    to_diagonal(s)
    s.write("w = positive(w)")
    s.multiply("transf_scale3D_222")
    from_diagonal(s)
    s.add("transf_offset_200", "-")


THIRD, TWO_THIRDS, HALF = "0.5773502691896258", "0.816496580927726", "0.7071067811865476"
"""Square roots of 1/3, 2/3 and 1/2."""


def to_diagonal(s: FormulaStep) -> None:
    """Turn the x axis about y, then z: Benesi's frame."""
    s.write("x, y, z = w", f"t = {TWO_THIRDS} * x - {THIRD} * z")
    s.write(f"w = ({HALF} * (t - y), {HALF} * (t + y), {THIRD} * x + {TWO_THIRDS} * z)")


def from_diagonal(s: FormulaStep) -> None:
    """Undo `to_diagonal`."""
    s.write("x, y, z = w", f"t = {HALF} * (x + y)")
    s.write(f"w = ({THIRD} * z + {TWO_THIRDS} * t, {HALF} * (y - x), {TWO_THIRDS} * z - {THIRD} * t)")


def box_and_balls(s: FormulaStep, first: str) -> None:
    """The folds of the group, of which there may be two in a row."""
    if s.on(first) and s.within("C"):
        fold_into_box(s)
    if s.on("transf_function_enabledAy_false") and s.within("B"):
        fold_into_box(s)


@known(101, "Pseudo Kleinian - StdDE", KNIGHTY, LEFT_OUT, distance=OWN_SOLID)
def pseudo_kleinian_std(s: FormulaStep) -> None:
    """The group measured with the z axis, and a sponge's folds before it."""
    prism(s)
    turned(s)
    benesi(s, "transf_start_iterations")
    if s.on("transf_function_enabledF_false") and s.within("F"):
        shifted_differences(s)
    if s.on("transf_function_enabled") and s.within("M"):
        s.write("w = positive(w)")
        s.menger("transf_scale_3", "transf_constant_multiplierA_111")
        s.add("transf_addition_constantA_000")
    if s.on("transf_function_enabledN_false"):
        s.write("x, y, z = w", "w = (x, y, -z)")
    if s.on("transf_function_enabledAw") and s.within("C"):
        s.scale("transf_scaleB_1")
    box_and_balls(s, "transf_function_enabledAw")
    s.add("transf_addition_constant")
    s.measure(last=True, thin=True).write("return sqrt(maximum(x * x + y * y, 1e-30))")


def shifted_differences(s: FormulaStep) -> None:
    """|x + a| - |x - b| - k x, without the terms whose switches are off."""
    one, two = "transf_function_enabledA", "transf_function_enabled"
    differences(s, ("transf_offsetF_000", "transf_offset_000", "transf_scale3D_111"), one, two)


@known(217, "Pseudo Kleinian - Mod 4", KNIGHTY, LEFT_OUT, distance=KLEINIAN)
def pseudo_kleinian_4(s: FormulaStep) -> None:
    """An inversion, a gap, the folds of the group, and reflections of x and y."""
    if inverted_first(s, "transf_scaleG_1", "transf_addition_constantP_000"):
        s.scale("transf_scaleA_1")
    if s.within("M") and any(s.vector("transf_constant_multiplier_000")):
        s.write(f"a, b, d = {s.point('transf_constant_multiplier_000')}", "x, y, z = w")
        s.write("w = (x - where(x < 0, -a, a), y - where(y < 0, -b, b), z - where(z < 0, -d, d))")
    fold_into_box(s)
    s.add("transf_addition_constant")
    if s.on("transf_function_enabledG_false") and s.within("G"):
        alternating(s, "transf_addition_constantA_000", "transf_scale_neg1")
    if s.on("transf_function_enabledF_false") and s.within("F"):
        s.fold("transf_offsetA_000")
    if s.on("transf_function_enabledN_false") and s.within("N"):
        crossed(s)


def alternating(s: FormulaStep, name: str, factor: str) -> None:
    """Add a vector whose factor changes with each time."""
    sign = s.state.get("sign", 1.0)
    s.state["sign"] = sign * s.value(factor)
    x, y, z = s.vector(name)
    s.write(f"w = w + {s.parameter(name, (sign * x, sign * y, sign * z))}")


def crossed(s: FormulaStep) -> None:
    """Turn the absolute values of x and y by an eighth, reflect, and turn back."""
    a, b = s.number("transf_offset_0"), s.number("transf_offsetA_0")
    sides = "y, x" if s.on("transf_function_enabledA_false") else "x, y"
    s.write("x, y, z = w", f"{sides} = absolute(x), absolute(y)")
    s.write(f"x, y = x + y - {a}, x - y - {b}")
    if s.on("transf_function_enabledBx_false") and s.within("O"):
        s.write("x = -absolute(x)")
    if s.on("transf_function_enabledBx") and s.within("P"):
        s.write("y = -absolute(y)")
    s.write("x, y = 0.5 * (x + y), 0.5 * (x - y)")
    for switch, letter, axis, name in (
        ("Ax", "R", "x", "transf_offset_1"),
        ("Ax_false", "RV", "y", "transf_offsetA_1"),
    ):
        if s.on(f"transf_function_enabled{switch}") and s.within(letter):
            o = s.number(name)
            s.write(f"{axis} = {o} - absolute({axis} + {o})")
    for axis in "xyz":
        if s.on(f"transf_function_enabled{axis}_false"):
            s.write(f"{axis} = -{axis}")
    s.write("w = (x, y, z)")


@known(122, "Jos Kleinian", LEYS, LEFT_OUT, distance=JOS)
def jos_kleinian(s: FormulaStep) -> None:
    """A group of translations and an inversion between planes; y is the height."""
    if s.on("transf_sphere_inversion_enabled_false") and s.index < 1:
        s.invert("transf_offset_000", "transf_maxR2_1", "transf_addition_constant")
    if not s.within("C"):
        return
    a, b = s.number("transf_folding_value"), s.number("transf_offset")
    side = (s.value("transf_offset") > 0) - (s.value("transf_offset") < 0)
    s.write(f"u, v, s = {s.point('transf_offset_111')}", "x, y, z = w")
    s.write("x = x - 2 * u * floor((x + u) / (2 * u))", "z = z - 2 * s * floor((z + s) / (2 * s))")
    s.write(f"y = y - {a} * v * floor((y + v - 1) / ({a} * v))")
    s.write(f"m = {a} * (0.5 + 0.2 * sin({side} * {PI} * (x + 0.5 * {b}) / u))", "above = y >= m")
    s.write(f"x, y, z = where(above, -{b} - x, x), where(above, {a} - y, y), where(above, -z, z)")
    s.write(f"r = maximum({SQUARE}, 1e-18)", f"w = (x / r - {b}, {a} - y / r, -z / r)")
