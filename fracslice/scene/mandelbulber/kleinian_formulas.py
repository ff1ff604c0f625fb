"""The Kleinian groups of Mandelbulber: folds and inversions whose last point is measured with a surface."""

from __future__ import annotations

from .box_formulas import fold_with_height
from .folds import PI, absolute, alternating, bulge, crossed, diagonal_scale, differences, polygon, switched
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
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")


@known(103, "Pseudo Kleinian", KNIGHTY, LEFT_OUT, distance=KLEINIAN)
def pseudo_kleinian(s: FormulaStep) -> None:
    """Folds into a box and out of a ball."""
    inverted_first(s, "transf_maxR2_1", "transf_addition_constantA_000")
    prism(s)
    if switched(s, "By_false", "E"):
        fold = s.fold if s.on("transf_function_enabledBy") else s.fold_flat
        fold("transf_addition_constant_111")
    if switched(s, "Bx_false", "A"):
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
    if switched(s, "S_false", "S"):
        s.refuse("transf_function_enabledy_false")
        s.ball(s.value("transf_minR2_p25"), s.value("transf_maxR2_1"), "mandelbox_offset")
        s.scale("transf_scale_1")
    prism(s)
    turned(s)
    benesi(s, "transf_start_iterations_T")
    box_and_balls(s, "transf_function_enabledAy")
    s.add("transf_addition_constant")
    if switched(s, "F_false", "F"):
        s.fold("transf_offsetA_000")
        if switched(s, "_false", "A"):
            bulge(s, "transf_offsetA_000", "transf_scale3D_000")
    s.refuse("transf_addCpixel_enabled_false")


def benesi(s: FormulaStep, start: str) -> None:
    """In the frame of a cube's diagonal: absolute values and a scale; then the same with a fold."""
    if s.on("transf_benesi_T1_enabled_false") and s.during(start, "transf_stop_iterationsT_1"):
        diagonal_scale(s, "transf_scale3D_222")
        s.add("transf_offset_200", "-")
    if s.on("transf_function_enabledx_false") and s.during(
        "transf_start_iterations_D", "transf_stop_iterationsTM_1"
    ):
        diagonal_scale(s, "transf_scale3D_333", "transf_addition_constant_111")


def box_and_balls(s: FormulaStep, first: str) -> None:
    """The folds of the group, of which there may be two in a row."""
    if s.on(first) and s.within("C"):
        fold_into_box(s)
    if switched(s, "Ay_false", "B"):
        fold_into_box(s)


@known(101, "Pseudo Kleinian - StdDE", KNIGHTY, LEFT_OUT, distance=OWN_SOLID)
def pseudo_kleinian_std(s: FormulaStep) -> None:
    """The group measured with the z axis, and a sponge's folds before it."""
    before_folds(s)
    if switched(s, "", "M"):
        s.write("w = positive(w)")
        s.menger("transf_scale_3", "transf_constant_multiplierA_111")
        s.add("transf_addition_constantA_000")
    if s.on("transf_function_enabledN_false"):
        s.write("x, y, z = w", "w = (x, y, -z)")
    if switched(s, "Aw", "C"):
        s.scale("transf_scaleB_1")
    box_and_balls(s, "transf_function_enabledAw")
    s.add("transf_addition_constant")
    s.measure(last=True, thin=True).write("return sqrt(maximum(x * x + y * y, 1e-30))")


def before_folds(s: FormulaStep) -> None:
    """A cross in a prism, a turn, folds in the frame of a diagonal, and differences, where they are on."""
    prism(s)
    turned(s)
    benesi(s, "transf_start_iterations")
    if switched(s, "F_false", "F"):
        shifted_differences(s)


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
    if switched(s, "G_false", "G"):
        alternating(s, "transf_addition_constantA_000", "transf_scale_neg1")
    if switched(s, "F_false", "F"):
        s.fold("transf_offsetA_000")
    if switched(s, "N_false", "N"):
        crossed(s)


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


@known(104, "Pseudo Kleinian - Mod 1", KNIGHTY, LEFT_OUT, distance=KLEINIAN)
def pseudo_kleinian_1(s: FormulaStep) -> None:
    """Two folds of the group in a row, with other folds before and a sponge's behind."""
    before_folds(s)
    if switched(s, "Aw", "C"):
        if s.value("transf_scaleB_1") == 1:
            s.fold("transf_addition_constant_0777")
        else:
            s.write("before = w")
            s.fold("transf_addition_constant_0777")
            s.write(f"w = w + (1 - {s.number('transf_scaleB_1')}) * before")
        spread(s)
        if s.on("transf_function_enabledN_false"):
            s.write("x, y, z = w", "w = (x, y, -z)")
    if switched(s, "Ay_false", "B"):
        fold_into_box(s)
        if s.on("transf_function_enabledK_false"):
            s.write("x, y, z = w", "w = (-x, y, z)")
    s.add("transf_addition_constant")
    if switched(s, "M_false", "M"):
        s.write("w = positive(w)")
        s.menger("transf_scale_3", "transf_constant_multiplierA_111")
        s.add("transf_addition_constantA_000")


def jos_inversion(s: FormulaStep, after: bool) -> None:
    """Invert in a sphere and scale, before the polygons or after them."""
    now = s.during("transf_start_iterations_D", "transf_stop_iterations_D1")
    if (
        s.on("transf_sphere_inversion_enabled_false")
        and s.on("transf_function_enabledI_false") == after
        and now
    ):
        s.invert("transf_offset_000", "transf_maxR2_1", "transf_addition_constant")
        s.scale("transf_scaleA_1")


def jos_polygons(s: FormulaStep) -> None:
    """A turn, absolute values and polygons' folds, in their iterations."""
    if s.on("transf_function_enabledP_false") and s.during(
        "transf_start_iterations_P", "transf_stop_iterations_P1"
    ):
        s.turn("transf_rotation")
        absolute(s, *(f"transf_function_enabled{axis}" for axis in "xyz"))
        for switch, axes in (("Cx", "xy"), ("Cy_false", "yz"), ("Cz_false", "zx")):
            if s.on(f"transf_function_enabled{switch}"):
                polygon(s, axes, f"transf_int8_{switch[1].upper()}")
        s.add("transf_offsetF_000")


def jos_options(s: FormulaStep) -> None:
    """A reflection of x and y, and their largest or their root, in their iterations."""
    if s.on("transf_function_enabledC_false") and s.during(
        "transf_start_iterations_C", "transf_stop_iterations_C1"
    ):
        s.write("w = mirror(w, (1, -1, 0))")
    if s.on("transf_function_enabled_false") and s.during(
        "transf_start_iterations", "transf_stop_iterations_1"
    ):
        s.write("x, y, z = w")
        if s.on("transf_function_enabledBx"):
            s.write("x = maximum(absolute(x), absolute(y))")
        if s.on("transf_function_enabledO_false"):
            s.write("x = sqrt(maximum(x * x + y * y, 1e-30))")
        s.write("w = (x, y, z)")


def jos_step(s: FormulaStep, wave: str, tiled: bool) -> None:
    """Translations of x, y and z, the higher of two sides, a scale, and an inversion; z is the height."""
    a, b = s.number("transf_folding_value"), s.number("transf_offset")
    side = (s.value("transf_offset") > 0) - (s.value("transf_offset") < 0)
    s.write(f"u, v, s = {s.point('transf_offset_111')}", "x, y, z = w")
    if tiled:
        s.write("x = x - 2 * u * floor(0.5 * u * (x + u))", "y = y - 2 * v * floor(0.5 * v * (y + v))")
    s.write(f"z = z - {a} * s * floor((z + s - 1) * s / {a})")
    s.write(f"m = {a} * (0.5 + {wave} * sin({side} * {PI} * (x + 0.5 * {b}) / u))", "above = z >= m")
    s.write(f"x, z = where(above, -{b} - x, x), where(above, {a} - z, z)")
    added = s.state.get("added", 0.0)
    if s.on("transf_function_enabledK_false"):
        s.state["added"] = s.value("transf_scale_vary_0") * (abs(added) + 1)
    scale = s.parameter("transf_scale_1", s.value("transf_scale_1") - added)
    s.write(f"r = {scale} * maximum({SQUARE}, 1e-18)", f"w = (x / r - {b}, -y / r, {a} - z / r)")


def jos_end(s: FormulaStep, doubled: bool) -> None:
    """Turn y about, and measure with a plane or the space between two."""
    if switched(s, "E_false", "E"):
        a, b = s.number("transf_offset_1"), s.number("transf_scale_0")
        s.write("x, y, z = w", f"t = {a} + ({b} - 1) * absolute(y)", "w = (x, where(y < 0, -t, t), z)")
    a = s.number("transf_folding_value")
    kept = switched(s, "T_false", "T")
    if kept and doubled:
        s.write("x, y, z = w", f"w = (x, y, minimum(z, {a} - z))")
    if s.index >= s.values.whole("transf_start_iterations_G"):
        d = s.measure(last=True)
        height = f"minimum(z, {d.number('transf_folding_value')} - z)" if doubled and not kept else "z"
        more, most = d.number("analyticDE_offset_0"), d.number("analyticDE_tweak_005")
        d.write(f"return minimum({height} + {more}, {most})")


@known(225, "JosLeys-Kleinian V3", LEYS, LEFT_OUT, distance=OWN_SOLID)
def jos_kleinian_3(s: FormulaStep) -> None:
    """The group with z as the height, and polygons' folds before."""
    jos_inversion(s, False)
    jos_polygons(s)
    jos_inversion(s, True)
    jos_options(s)
    if s.within("F"):
        jos_step(s, "0.2", True)
    jos_end(s, s.on("transf_spheres_enabled"))


@known(230, "JosLeys-Kleinian V4", LEYS, LEFT_OUT, distance=OWN_SOLID)
def jos_kleinian_4(s: FormulaStep) -> None:
    """As the third, with translations before the polygons and a wave of another height."""
    jos_inversion(s, False)
    if switched(s, "N_false", "O"):
        s.write("x, y, z = w")
        for axis, switch, name in (("x", "Aw_false", "transf_offset_2"), ("y", "Aw", "transf_offsetA_2")):
            if s.on(f"transf_function_enabled{switch}"):
                k = s.number(name)
                s.write(f"{axis} = {axis} - {k} * floor({axis} / {k} + 0.5)")
        s.write("w = (x, y, z)")
    jos_polygons(s)
    jos_inversion(s, True)
    jos_options(s)
    if s.within("F"):
        jos_step(s, s.number("transf_offset_02"), not s.on("transf_function_enabledX_false"))
    jos_end(s, s.on("transf_spheres_enabled") and s.within("A"))
