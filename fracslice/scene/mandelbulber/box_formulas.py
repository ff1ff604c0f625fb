"""The Mandelbox of Mandelbulber and its relatives: folds into boxes, out of balls, and scales."""

from __future__ import annotations

import math

from .folds import (
    absolute,
    absolute_of,
    alternating,
    bulge,
    crossed,
    diagonal_scale,
    differences,
    mandalay,
    polygon,
    switched,
)
from .step_text import CYLINDER, LEFT_OUT, ORDERS, SQUARE, SWAPPED, FormulaStep, UnknownError, known

LOWE = "Lowe 2010, fractalforums.com: Amazing Fractal"


def is_plain(s: FormulaStep) -> bool:
    """True if a Mandelbox has the box and the ball of ours."""
    values = [
        s.value(f"mandelbox_{name}") for name in ("folding_limit", "folding_value", "folding_fixed_radius")
    ]
    inner, scale = s.value("mandelbox_folding_min_radius"), s.value("mandelbox_scale")
    return values == [1, 2, 1] and 0 < inner <= 1 and 1 < abs(scale) <= 10


def mandelbox_ball(s: FormulaStep, offset: str | None) -> None:
    """Ball of the values of a Mandelbox."""
    inner, outer = s.value("mandelbox_folding_min_radius"), s.value("mandelbox_folding_fixed_radius")
    s.ball(inner * inner, outer * outer, offset)


@known(8, "Mandelbox", LOWE)
def mandelbox(s: FormulaStep) -> None:
    """Folds may be turned, each on its own, as may be the whole."""
    turned = s.on("mandelbox_rotations_enabled")
    main = s.on("mandelbox_main_rotation_enabled") and any(s.vector("mandelbox_rotation_main"))
    if is_plain(s) and not turned and not main and not any(s.vector("mandelbox_offset")):
        s.replace(
            "mandelbox", scale=s.value("mandelbox_scale"), inner=s.value("mandelbox_folding_min_radius")
        )
    if turned and any(
        any(s.vector(f"mandelbox_rotation_{sign}_{k}")) for sign in ("neg", "pos") for k in (1, 2, 3)
    ):
        turned_folds(s)
    else:
        s.fold_apart("mandelbox_folding_limit", "mandelbox_folding_value")
    mandelbox_ball(s, "mandelbox_offset")
    if main:
        s.turn("mandelbox_rotation_main")
    s.scale("mandelbox_scale")


def turned_folds(s: FormulaStep) -> None:
    """Fold each coordinate in a frame of its own, above and below."""
    limit, value = s.number("mandelbox_folding_limit"), s.number("mandelbox_folding_value")
    for k, axis in enumerate("xyz", 1):
        s.write("x, y, z = w", "before = w")
        s.turn(f"mandelbox_rotation_neg_{k}")
        s.write("x, y, z = w", f"above = {axis} > {limit}", f"{axis} = {value} - {axis}", "w = (x, y, z)")
        turn_back(s, f"mandelbox_rotation_neg_{k}")
        s.write("u, v, t = w", "w = before")
        s.turn(f"mandelbox_rotation_pos_{k}")
        s.write("x, y, z = w", f"below = {axis} < -{limit}", f"{axis} = -{value} - {axis}", "w = (x, y, z)")
        turn_back(s, f"mandelbox_rotation_pos_{k}")
        s.write("x, y, z = w", "a, b, d = before")
        parts = (
            f"where(above, {p}, where(below, {q}, {r}))" for p, q, r in zip("uvt", "xyz", "abd", strict=True)
        )
        s.write(f"w = ({', '.join(parts)})")


def turn_back(s: FormulaStep, name: str) -> None:
    """Undo `FormulaStep.turn`."""
    for axis, text, angle in (("z", "(0, 0, 1)", 2), ("y", "(0, 1, 0)", 1), ("x", "(1, 0, 0)", 0)):
        if s.vector(name)[angle]:
            s.write(f"w = turn(w, {text}, -{name.lower()}_{axis})")


@known(9, "Mandelbox Fast", LOWE)
def mandelbox_fast(s: FormulaStep) -> None:
    """The box is that of the unit."""
    main = s.on("mandelbox_main_rotation_enabled") and any(s.vector("mandelbox_rotation_main"))
    if is_plain(s) and not main:
        s.replace(
            "mandelbox", scale=s.value("mandelbox_scale"), inner=s.value("mandelbox_folding_min_radius")
        )
    s.write("w = fold(w, 1)")
    mandelbox_ball(s, None)
    if main:
        s.turn("mandelbox_rotation_main")
    s.scale("mandelbox_scale")


def vary_scale(s: FormulaStep) -> float:
    """Scale that changes from step to step: scale + vary (|last| - 1)."""
    scale, vary = s.value("mandelbox_scale"), s.value("mandelbox_vary_scale_vary")
    last = s.state.get("scale", scale)
    s.state["scale"] = scale + vary * (abs(last) - 1)
    return s.state["scale"]


def add_vary(s: FormulaStep, base: str, toward: str, switch: bool, resets: bool) -> float:
    """Scale with an addition that changes from step to step towards a size."""
    added = s.state.get("added", 0.0)
    if switch:
        vary = s.value("transf_scale_vary_0") * (abs(added) - s.value(toward))
        s.state["added"] = -vary if resets else added - vary
    return s.value(base) + added


def scale_by(s: FormulaStep, value: float) -> None:
    """Multiply by a number of this iteration."""
    if value != 1:
        s.write(f"w = {s.parameter('scale', value)} * w")


def fold_with_height(s: FormulaStep) -> None:
    """Fold into a box of another height; of folds that tear, none is known."""
    limit, image, share = (
        s.value(name) for name in ("mandelbox_folding_limit", "mandelbox_folding_value", "transf_scale_1")
    )
    if image != 2 * limit or share <= 0:
        s.refuse_values("mandelbox_folding_value")
    flat, height = s.number("mandelbox_folding_limit"), s.parameter("folding_height", limit * share)
    s.write(f"w = fold_to(w, ({flat}, {flat}, {height}))")


def bulged(s: FormulaStep, name: str) -> None:
    """Push the coordinates of a folded box towards its middle, by squares, in the iterations of D."""
    if s.on("transf_function_enabled_false") and s.during(
        "transf_start_iterations_D", "transf_stop_iterations_D1"
    ):
        bulge(s, name, "transf_scale3D_000")


def fold_ball(s: FormulaStep, offset: str | None) -> None:
    """Ball whose radii are squared in the file."""
    s.ball(s.value("transf_minR2_p25"), s.value("transf_maxR2_1"), offset)


def swap(s: FormulaStep, switch: str, image: str) -> None:
    """Swap coordinates if a switch is on."""
    if s.on(switch):
        s.write("x, y, z = w", f"w = {image}")


@known(119, "Abox - Mod 11", "Sandercoe after Lowe 2010, fractalforums.org")
def abox_mod_11(s: FormulaStep) -> None:
    """A Mandelbox with a box of three sizes and a scale that varies."""
    scale = vary_scale(s)
    if s.within("B"):
        s.fold("transf_addition_constant_111") if s.on("transf_function_enabled") else s.fold_flat(
            "transf_addition_constant_111"
        )
        bulged(s, "transf_addition_constant_111")
    swap(s, "transf_function_enabledSw_false", "(z, y, x)")
    if s.within("S"):
        s.refuse("transf_function_enabledy_false")
        fold_ball(s, "mandelbox_offset")
    if s.within("A"):
        scale_by(s, scale)
    s.add("transf_addition_constant")
    if s.on("transf_addCpixel_enabled_false") and s.within("E"):
        s.add_constant(
            "mandelbulbMulti_order_of_xyz", "transf_constant_multiplier_111", "transf_alternate_enabled_false"
        )
    if s.on("transf_rotation_enabled") and s.within("R"):
        s.turn("transf_rotation")
    if s.during("transf_start_iterations_C", "transf_stop_iterations_C1"):
        s.scale("transf_scaleG_1")


@known(132, "Amazing Surf - Mod 2", "Kali 2011 after Lowe 2010, fractalforums.com")
def amazing_surf_mod_2(s: FormulaStep) -> None:
    """Folds along x and y in turn, a ball or a cylinder, and a scale that varies."""
    if s.on("transf_addCpixel_enabled_false") and s.within("H"):
        if s.within("G"):
            s.refuse("transf_rotation_enabled")
        s.add_constant(
            "mandelbulbMulti_order_of_xyz", "transf_constant_multiplier_111", "transf_alternate_enabled_false"
        )
    if switched(s, "Cx_false", "F"):
        add_inverse(s, "transf_function_enabledCy_false")
    switches = (
        "transf_function_enabledAx",
        "transf_function_enabledAy_false",
        "transf_function_enabledAz_false",
    )
    for k, (switch, letter) in enumerate(zip(switches, "ABC", strict=True), 1):
        during = s.within(letter)
        if s.on(switch) and during:
            surf_fold(s, f"aSurf3Folds_order_of_folds_{k}")
    if s.on("transf_function_enabledAx_false"):
        x, y, z = s.vector("transf_addition_constant_111")
        s.write(f"w = fold_to(w, (1e6, 1e6, {s.parameter('transf_addition_constant_111_z', z)}))")
    swap(s, "transf_function_enabledSw_false", "(y, x, z)")
    if switched(s, "Bz_false", "X"):
        soft_offset(s)
    else:
        s.add("transf_addition_constant")
    if switched(s, "Ay", "M"):
        weight = f"(1 - {s.number('transf_scaleB_1')})" if s.on("transf_function_enabled_false") else "1"
        square = SQUARE if weight == "1" else f"{CYLINDER} + {weight} * z * z"
        s.ball(s.value("transf_minR2_p25"), s.value("transf_maxR2_1"), "mandelbox_offset", square=square)
    resets = s.on("transf_function_enabledM_false")
    vary = switched(s, "F_false", "Y")
    scaled = s.within("S")
    scale = add_vary(s, "mandelbox_scale", "transf_scaleC_1", vary, resets)
    if scaled:
        scale_by(s, scale)
    if s.on("mandelbox_main_rotation_enabled") and s.within("R"):
        s.turn("mandelbox_rotation_main")


def soft_offset(s: FormulaStep) -> None:
    """Add 2 a less a^3 / (x^2 + a^2) of a vector, or less a^2 / (x^2 + a^2)."""
    cubes, squares = (s.on(f"transf_function_enabledB{axis}_false") for axis in "xy")
    if not (cubes or squares):
        return
    k = s.number("transf_scale_1")
    s.write(f"a, b, d = {s.point('transf_addition_constant')}", "x, y, z = w")
    for p, q in zip("xyz", "abd", strict=True):
        s.write(f"t = {q} * {q} / maximum({p} * {p} + {q} * {q}, 1e-18)")
        s.write(f"{p} = {p} + {k} * (2 * {q} - {f'{q} * t' if cubes else 't'})")
    s.write("w = (x, y, z)")


def add_inverse(s: FormulaStep, alternates: str) -> None:
    """Add the start point, its coordinates scaled, inverted in the unit sphere."""
    s.refuse(alternates)
    s.write(f"kx, ky, kz = {s.point('transf_scale3D_111')}", "cx, cy, cz = c")
    s.write("cx, cy, cz = kx * cx, ky * cy, kz * cz", "t = maximum(cx * cx + cy * cy + cz * cz, 1e-18)")
    s.write("w = w + (cx / t, cy / t, cz / t)")


def surf_fold(s: FormulaStep, name: str) -> None:
    """One of the folds of an Amazing Surf along x and y."""
    word = s.values.one_of(name, ("type1", "type2", "type3"))
    if word == "type1":
        s.fold_flat("transf_addition_constant_111")
        if s.during("transf_start_iterations_T", "transf_stop_iterationsT_1"):
            s.refuse("transf_function_enabledCz_false")
    elif word == "type2":
        fold_back(s, "transf_offset_111")
    else:
        fold_moved(s, "transf_offsetA_111")


def fold_back(s: FormulaStep, name: str) -> None:
    """Fold of the absolute x and y at a limit: a - ||x| - a|."""
    x, y, _ = s.vector(name)
    a, b = s.parameter(f"{name}_x", x), s.parameter(f"{name}_y", y)
    s.write("x, y, z = w", f"w = ({a} - absolute(absolute(x) - {a}), {b} - absolute(absolute(y) - {b}), z)")


def fold_moved(s: FormulaStep, name: str) -> None:
    """Fold of x and y about another point: d - ||x + a| - d| - a."""
    x, y, _ = s.vector(name)
    a, b, d = s.parameter(f"{name}_x", x), s.parameter(f"{name}_y", y), s.number("transf_offset_2")
    first, second = (f"{d} - absolute(absolute({p} + {q}) - {d}) - {q}" for p, q in (("x", a), ("y", b)))
    s.write("x, y, z = w", f"w = ({first}, {second}, z)")


@known(186, "Amazing Surf - Mod 4", "Kali 2011 after Lowe 2010, fractalforums.com")
def amazing_surf_mod_4(s: FormulaStep) -> None:
    """An Amazing Surf whose scale is divided by the square of the radius."""
    inversion(s, "transf_start_iterations_X", "transf_stop_iterations_1")
    if s.on("transf_function_enabledJ_false"):
        s.fold("transf_addition_constant_111")
    else:
        s.fold_flat("transf_addition_constant_111")
    s.add("transf_offsetA_000")
    scale = add_vary(s, "transf_scale_2", "transf_scaleC_1", s.on("transf_function_enabledK_false"), False)
    s.ball(s.value("transf_minR2_p25"), 1.0)
    scale_by(s, scale)
    if s.on("transf_rotation2_enabled_false"):
        s.turn("transf_rotation")
    if s.on("transf_addCpixel_enabled_false"):
        add_swapped(s)
    s.add("transf_addition_constantA_000")
    s.turn("transf_rotation2")


def add_swapped(s: FormulaStep) -> None:
    """Add the constant with x and y swapped."""
    own = s.point("transf_constant_multiplier_111")
    s.write("cx, cy, cz = c", f"u, v, t = {own}", "w = w + (u * cy, v * cx, t * cz)")


def inversion(s: FormulaStep, start: str, stop: str) -> None:
    """Invert in a sphere, in some iterations, if the file says so."""
    if s.on("transf_sphere_inversion_enabled_false") and s.during(start, stop):
        s.invert("transf_offset_000", "transf_scaleG_1", "transf_addition_constant")
        s.scale("transf_scaleA_1")


@known(226, "Abox - Mod 15", "Sandercoe after Lowe 2010, fractalforums.org")
def abox_mod_15(s: FormulaStep) -> None:
    """A Mandelbox after an inversion, between two turns."""
    if s.on("transf_function_enabled_false"):
        if s.within(""):
            absolute(s, *("transf_function_enabled" + axis for axis in "xyz"))
        if s.within("T"):
            word = s.values.one_of("mandelbulbMulti_order_of_xyz", ORDERS)
            signs = [s.on(f"transf_function_enabled{axis}_false") for axis in "xyz"]
            parts = (f"-{axis}" if minus else axis for axis, minus in zip(word, signs, strict=True))
            s.write("x, y, z = w", f"w = ({', '.join(parts)})")
    inversion(s, "transf_start_iterations_X", "transf_stop_iterations_1")
    if s.within("B"):
        if s.on("transf_function_enabled"):
            s.fold("transf_addition_constant_111")
        else:
            s.fold_flat("transf_addition_constant_111")
    if s.within("M"):
        s.add("transf_offsetA_000")
    if s.within("S"):
        fold_ball(s, None)
    if s.within("E"):
        scale_by(
            s, add_vary(s, "transf_scale_2", "transf_scaleC_1", s.on("transf_function_enabledK_false"), True)
        )
    if s.on("transf_rotation2_enabled_false") and s.within("C"):
        s.turn("transf_rotation")
    if s.on("transf_addCpixel_enabled_false") and s.within("G"):
        s.add_constant("", "transf_constant_multiplier_111")
    if s.within("F"):
        s.add("transf_addition_constantA_000")
    if s.within("R"):
        s.turn("transf_rotation2")
    if switched(s, "N_false", "N"):
        crossed(s)


@known(77, "Amazing Surf - Mod 1", "Kali 2011 after Lowe 2010, fractalforums.com")
def amazing_surf_mod_1(s: FormulaStep) -> None:
    """Folds along x and y of several kinds, a ball, and a scale that varies."""
    scale = vary_scale(s)
    s.refuse("transf_function_enabledx_false")
    if s.on("transf_function_enabledAx"):
        s.fold_flat("transf_addition_constant_111")
    if s.on("transf_function_enabledAy_false"):
        fold_back(s, "transf_addition_constant_111")
    if s.on("transf_function_enabledAz_false"):
        x, y, _ = s.vector("transf_addition_constant_111")
        a, b = (s.parameter(f"transf_addition_constant_111_{p}", v) for p, v in (("x", x), ("y", y)))
        s.write("x, y, z = w", f"w = (absolute(x + {a}), absolute(y + {b}), z)")
    if s.on("transf_function_enabledy_false"):
        fold_moved(s, "transf_addition_constant_111")
    s.add("transf_addition_constant")
    inner = s.value("transf_minimum_radius_05")
    s.ball(math.sqrt(max(inner, 0.0)), 1.0, square=radius(s))
    share = s.value("transf_scale_1")
    scale_by(s, scale * share + (1 - share))
    s.turn("transf_rotation")


@known(16, "Box Fold Bulb Pow 2", "Buddhi 2010 after Lowe and White, fractalforums.com")
def box_fold_bulb(s: FormulaStep) -> None:
    """A Mandelbox and a square in turn."""
    s.write(f"w = fold(w, {s.number('boxfold_bulbpow2_folding_factor')})", "w = 2 * ball(w, 0.5)")
    s.square("boxfold_bulbpow2_z_factor")


def box_ball_scale(s: FormulaStep) -> None:
    """Box, ball and scale of the second and third kind of a box with a square."""
    if s.within("B"):
        s.fold("transf_addition_constant_111")
    if s.within("S"):
        fold_ball(s, "mandelbox_offset")
    if s.within("C"):
        vary = s.within("X")
        resets = s.on("transf_function_enabledM_false")
        scale_by(s, add_vary(s, "transf_scale", "transf_scaleB_1", vary, resets))


def doubled_square(s: FormulaStep) -> None:
    """Square of twice the point."""
    if s.within("A"):
        s.write("w = 2 * w")
        s.square("boxfold_bulbpow2_z_factor")


@known(125, "Box Fold Bulb Pow 2 V2", "Buddhi 2010 after Lowe and White, fractalforums.com")
def box_fold_bulb_2(s: FormulaStep) -> None:
    """Box, ball, scale and square, each in its iterations."""
    box_ball_scale(s)
    doubled_square(s)


@known(126, "Box Fold Bulb Pow 2 V3", "Buddhi 2010 after Lowe and White, fractalforums.com")
def box_fold_bulb_3(s: FormulaStep) -> None:
    """As the second kind, with an inversion, a tetrahedron's fold and a sponge's."""
    inversion(s, "transf_start_iterations", "transf_stop_iterations_1")
    box_ball_scale(s)
    if s.on("transf_function_enabledX_false") and s.during(
        "transf_start_iterationsTM", "transf_stop_iterationsTM_1"
    ):
        diagonal_scale(s, "transf_scale3D_333", "transf_addition_constantA_111")
    if switched(s, "D_false", "D"):
        s.write("w = mirror(w, (1, 1, 0))", "w = mirror(w, (1, 0, 1))")
        s.write(
            "w = mirror(w, (1, -1, 0))", "w = mirror(w, (1, 0, -1))", "x, y, z = w", "w = (absolute(x), y, z)"
        )
        a, o = s.number("transf_scaleA_2"), s.point("transf_offset_100")
        s.write(f"w = {a} * w - ({a} - 1) * {o}")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")
    if switched(s, "F_false", "M"):
        s.add("transf_addition_constantA_000")
        s.write("w = positive(w)")
        if s.on("transf_function_enabled"):
            s.menger("transf_scale_3", "transf_constant_multiplier_111")
        else:
            s.sort()
            s.scale("transf_scale_3")
            s.write(f"w = w - 2 * {s.point('transf_constant_multiplier_111')}")
    doubled_square(s)


def radius(s: FormulaStep) -> str:
    """Square of a radius, that of a cylinder if a switch is on."""
    return CYLINDER if s.on("transf_function_enabled_false") else SQUARE


def own_ball(s: FormulaStep, inner: str = "transf_minimum_radius_0") -> None:
    """Ball of radius 1 whose inner radius is squared in the file."""
    s.ball(s.value(inner), 1.0)


@known(60, "Abox - Mod Kali", "Kali 2010, fractalforums.com: Kaliset")
def abox_mod_kali(s: FormulaStep) -> None:
    """Absolute values that are subtracted, and a ball."""
    if s.on("mandelbox_main_rotation_enabled"):
        s.refuse("transf_function_enabledP_false")
        s.turn("mandelbox_rotation_main")
    s.write(f"w = {s.point('transf_addition_constant_0555')} - positive(w)")
    own_ball(s, "transf_minimum_radius_06")
    s.scale("transf_scale_015")


@known(135, "Abox - Mod Kali-V2", "Kali 2010, fractalforums.com: Kaliset")
def abox_mod_kali_2(s: FormulaStep) -> None:
    """Absolute values that are subtracted, and a ball with an outer radius."""
    a = s.point("transf_addition_constant_0555")
    if s.on("transf_function_enabledM"):
        s.write(f"w = {a} - positive(w)")
    else:
        s.write(f"a, b, d = {a}", "x, y, z = w", "w = (a - absolute(x), b - absolute(y), z)")
    fold_ball(s, None)
    s.scale("transf_scale_015")
    s.add("transf_addition_constant")
    if s.on("transf_rotation_enabled") and s.within(""):
        s.turn("transf_rotation")
    s.add("transf_addition_constant")
    if s.within("C"):
        s.refuse("transf_addCpixel_enabled_false")
    if s.within("D"):
        s.refuse("transf_function_enabledS_false")


@known(136, "Abox - Mod Kali-V3", "Kali 2010, fractalforums.com: Kaliset", LEFT_OUT)
def abox_mod_kali_3(s: FormulaStep) -> None:
    """Absolute values that are subtracted, and a ball turned about."""
    if s.during("transf_start_iterations_A", "transf_stop_iterations_15"):
        s.write(f"w = {s.point('transf_offset_111')} - positive(w)")
    own_ball(s)
    s.write(f"w = -{s.number('transf_scale_015')} * w")
    if s.within("B"):
        s.add("transf_offsetA_111")


@known(64, "Abox - Mod 1", "DarkBeam 2010, fractalforums.com", SWAPPED)
def abox_mod_1(s: FormulaStep) -> None:
    """Folds about a point, a ball, and a scale that varies."""
    scale = vary_scale(s)
    v, k = s.number("mandelbox_folding_value"), s.number("transf_scale_1")
    parts = []
    for p, a in zip("xyz", s.vector("transf_addition_constant"), strict=True):
        own = s.parameter(f"transf_addition_constant_{p}", a)
        most = f"{v} * {k}" if p == "z" else v
        parts.append(f"{most} - absolute(absolute({p} + {own}) - {most}) - absolute({own})")
    if not s.on("transf_function_enabledz"):
        parts[2] = "z"
    s.write("x, y, z = w", f"w = ({', '.join(parts)})")
    square = SQUARE
    if switched(s, "_false", "K"):
        square = f"exp({s.number('mandelbox_vary_rpower')} * log(maximum({SQUARE}, 1e-30)))"
    s.ball(s.value("transf_minimum_radius_0"), s.value("transf_maxR2_1"), square=square)
    scale_by(s, scale)
    if s.on("transf_addCpixel_enabled_false") and s.within("E"):
        s.add_constant(
            "mandelbulbMulti_order_of_xyz", "transf_constant_multiplier_111", "transf_alternate_enabled_false"
        )
    if s.on("transf_rotation_enabled") and s.within("R"):
        s.turn("transf_rotation")


@known(73, "Amazing Surf", "Kali 2011, fractalforums.com", SWAPPED)
def amazing_surf(s: FormulaStep) -> None:
    """Folds along x and y, a ball, and a scale that varies."""
    scale = vary_scale(s)
    s.fold_flat("transf_addition_constant_111")
    share, inner = s.value("transf_scale_1"), math.sqrt(max(s.value("transf_minimum_radius_05"), 0.0))
    if share == 1:
        s.ball(inner, 1.0, square=radius(s))
        scale_by(s, scale)
    else:
        a, b, m = s.parameter("scale", scale), s.number("transf_scale_1"), s.parameter("inner", inner)
        s.write("x, y, z = w", f"s = {radius(s)}", f"s = where(s < {m}, {m}, minimum(s, 1))")
        s.write(f"w = (({a} / s - 1) * {b} + 1) * w")
    if s.on("transf_addCpixel_enabled_false"):
        add_swapped(s)
    s.turn("transf_rotation")


@known(76, "Abox - VS icen1", "Icen 2011, fractalforums.com", LEFT_OUT)
def abox_icen(s: FormulaStep) -> None:
    """A Mandelbox with additions before and after the ball."""
    scale = vary_scale(s)
    s.fold("transf_addition_constant_111")
    m, j = s.point("transf_constant_multiplier_111"), s.point("transf_constant_julia_c")
    s.write(f"mx, my, mz = {m}", "cx, cy, cz = c", "t = (mx * cx, my * cy, mz * cz)")
    own = s.on("transf_constant_julia_mode")
    s.write("w = w + t" if own else f"w = w + {j}")
    mandelbox_ball(s, None)
    scale_by(s, scale)
    if s.on("transf_rotation_enabled") and s.within(""):
        s.turn("transf_rotation")
    s.write("cx, cy, cz = c", "t = (mx * cx, my * cy, mz * cz)", f"w = w {'-' if own else '+'} t + {j}")


@known(127, "Abox - Mod 13", "Sandercoe after Lowe 2010, fractalforums.org")
def abox_mod_13(s: FormulaStep) -> None:
    """A Mandelbox with a box of three sizes, and a vector that is added in some iterations."""
    if switched(s, "Az_false", "E"):
        add_inverse(s, "transf_function_enabledAy_false")
    if s.within("A"):
        if s.on("transf_function_enabled"):
            s.fold("transf_addition_constant_111")
        else:
            s.fold_flat("transf_addition_constant_111")
    bulged(s, "transf_addition_constant_111")
    swap(s, "transf_function_enabledSw_false", "(z, y, x)")
    if s.within("S"):
        fold_ball(s, "mandelbox_offset")
    vary = switched(s, "X_false", "X")
    added = s.state.get("added", 0.0)
    scale = add_vary(s, "mandelbox_scale", "transf_scaleB_1", vary, s.on("transf_function_enabledM_false"))
    scale_by(s, scale if vary else scale - added)
    if s.within("B"):
        if s.on("transf_function_enabledAx_false"):
            alternating(s, "transf_addition_constant", "transf_scale_1", -1)
        else:
            s.add("transf_addition_constant")
    if s.on("transf_addCpixel_enabled_false") and s.within("C"):
        s.add_constant(
            "mandelbulbMulti_order_of_xyz", "transf_constant_multiplier_111", "transf_alternate_enabled_false"
        )
    if s.on("transf_rotation_enabled") and s.within("R"):
        s.turn("transf_rotation")


@known(59, "Fold Box - Mod 1", "Lowe 2010, fractalforums.com")
def fold_box_mod_1(s: FormulaStep) -> None:
    """A Mandelbox whose fold is a difference of two absolute values, each with its own limit."""
    if s.within(""):
        vectors = [f"transf_{name}_111" for name in ("addition_constant", "addition_constantA", "scale3D")]
        differences(s, vectors, "transf_function_enabled", "transf_function_enabledA")
    if switched(s, "_false", "A"):
        fold_with_height(s)
    if s.within("B"):
        mandelbox_ball(s, None)
    if s.within("D"):
        s.refuse("transf_function_enabledX_false")
    s.scale("mandelbox_scale")
    if s.on("mandelbox_main_rotation_enabled") and s.within("C"):
        s.turn("mandelbox_rotation_main")


@known(91, "Mandelbox - Menger", "Lowe 2010 and Menger 1926")
def mandelbox_menger(s: FormulaStep) -> None:
    """A Mandelbox and a sponge in each step."""
    s.refuse("mandelbox_rotations_enabled", "transf_addCpixel_enabled_false")
    if s.within("A"):
        if s.value("transf_scale_1") != 1:
            raise UnknownError(f"{s.values.place('transf_scale_1')}: transf_scale_1")
        s.fold_apart("mandelbox_folding_limit", "mandelbox_folding_value")
    if s.within("B"):
        mandelbox_ball(s, "mandelbox_offset")
    if s.on("mandelbox_main_rotation_enabled") and s.within("R"):
        s.turn("mandelbox_rotation_main")
    if s.within("S"):
        s.scale("mandelbox_scale")
    if switched(s, "", "M"):
        for _ in range(min(s.values.whole("transf_int_1"), 4)):
            s.write("w = positive(w)")
            s.menger("transf_scale_3", "transf_constant_multiplierA_111")
            s.add("transf_addition_constantA_000")
            if s.on("transf_function_enabledx_false"):
                s.add_constant("mandelbulbMulti_order_of_xyz_C", "transf_constant_multiplierB_111")


@known(198, "Mandalay Box V1", "Knighty and DarkBeam 2015, fractalforums.com")
def mandalay_box(s: FormulaStep) -> None:
    """A Mandalay fold, a ball and a scale."""
    if s.on("transf_function_enabledA_false"):
        s.fold("transf_addition_constant_111")
    mandalay(s, s.on("transf_function_enabledSw_false"))
    s.ball(s.value("transf_minR2_p25"), 1.0)
    s.scale("transf_scale_2")
    s.turn("transf_rotation")


def after_klein(s: FormulaStep) -> None:
    """A box and a scale, after the last inversion."""
    if s.on("transf_function_enabled"):
        s.fold("transf_offset_110")
    s.scale("transf_scale_2")
    s.add("transf_offsetA_000")


def klein_ball(s: FormulaStep, vary: bool) -> None:
    """A ball, a scale that may vary, and a turn."""
    own_ball(s)
    scale_by(s, add_vary(s, "transf_scale_1", "transf_scaleC_1", vary, False))
    if s.on("transf_rotation2_enabled_false"):
        s.turn("transf_rotation")


@known(221, "Amazing Surf - Klein", "Kali 2011, fractalforums.com", LEFT_OUT)
def amazing_surf_klein(s: FormulaStep) -> None:
    """An Amazing Surf for some iterations, then a box and a scale."""
    inversion(s, "transf_start_iterations_X", "transf_stop_iterations_1")
    if s.index >= s.values.whole("transf_int8_X"):
        after_klein(s)
        return
    s.fold_flat("transf_addition_constant_111")
    swap(s, "transf_function_enabledSw_false", "(y, x, z)")
    if s.on("transf_function_enabledJ_false"):
        z = s.parameter("transf_addition_constant_111_z", s.vector("transf_addition_constant_111")[2])
        s.write(f"w = fold_to(w, (1e6, 1e6, {z}))")
    swap(s, "transf_function_enabledCz", "(x, z, y)")
    klein_ball(s, s.on("transf_function_enabledK_false"))
    s.add("transf_addition_constantA_000")


@known(222, "Abox- Klein", "Lowe 2010 and Theli-at 2011, fractalforums.com", LEFT_OUT)
def abox_klein(s: FormulaStep) -> None:
    """A Mandelbox for some iterations, then a box and a scale."""
    inversion(s, "transf_start_iterations_X", "transf_stop_iterations_1")
    if s.index >= s.values.whole("transf_stop_iterations_15"):
        after_klein(s)
        return
    s.fold("transf_addition_constant_111")
    swap(s, "transf_function_enabledSw_false", "(y, x, z)")
    klein_ball(s, s.on("transf_function_enabledK_false"))
    s.add("transf_addition_constantA_000")


@known(199, "Mandalay Box V2", "Knighty and DarkBeam 2015, fractalforums.com")
def mandalay_box_2(s: FormulaStep) -> None:
    """A box, a Mandalay fold, a ball and a scale, in their iterations."""
    if switched(s, "A_false", "A"):
        if s.on("transf_function_enabled"):
            s.fold("transf_addition_constant_111")
        else:
            s.fold_flat("transf_addition_constant_111")
    if s.within("P"):
        s.refuse("transf_function_enabledP_false")
    mandalay(s, s.on("transf_function_enabledSw_false"))
    if s.within("S"):
        fold_ball(s, None)
    vary = switched(s, "K_false", "K")
    scale_by(s, add_vary(s, "transf_scale_2", "transf_scaleC_1", vary, False))
    if s.on("transf_rotation_enabled") and s.within("R"):
        s.turn("transf_rotation")


@known(224, "Amazing Surf - Klein V2", "Kali 2011, fractalforums.com", LEFT_OUT)
def amazing_surf_klein_2(s: FormulaStep) -> None:
    """As the first, with a polygon's fold before, and swaps in their iterations."""
    if s.on("transf_function_enabledP_false") and s.during(
        "transf_start_iterations_P", "transf_stop_iterations_P1"
    ):
        absolute_of(s, [True, s.on("transf_function_enabledCy"), False])
        polygon(s, "xy", "transf_int8_Y")
        s.add("transf_offsetF_000")
    inversion(s, "transf_start_iterations_X", "transf_stop_iterations_1")
    if s.index >= s.values.whole("transf_int8_X"):
        after_klein(s)
        return
    s.fold_flat("transf_addition_constant_111")
    if s.within("I"):
        swap(s, "transf_function_enabledI_false", "(y, x, z)")
    if switched(s, "J_false", "J"):
        z = s.parameter("transf_addition_constant_111_z", s.vector("transf_addition_constant_111")[2])
        s.write(f"w = fold_to(w, (1e6, 1e6, {z}))")
    else:
        s.write("x, y, z = w", "w = (x, z, y)")
    if s.within("H"):
        swap(s, "transf_function_enabledSw_false", "(y, x, z)")
    klein_ball(s, switched(s, "K_false", "K"))
    if s.within("O"):
        s.add("transf_addition_constantA_000")


@known(233, "Amazing Surf - M3D", "Kali 2011, fractalforums.com", LEFT_OUT)
def amazing_surf_m3d(s: FormulaStep) -> None:
    """An Amazing Surf as Mandelbulb3D has it: the start point is added before the turn."""
    if s.during("transf_start_iterations", "transf_stop_iterations_1"):
        s.refuse("transf_function_enabledSw_false")
    base, vary = s.value("transf_scale_015"), s.value("mandelbox_vary_scale_vary")
    s.state["scale"] = base + vary * (abs(s.state.get("scale", s.value("mandelbox_scale"))) - 1)
    s.fold_flat("transf_addition_constant_111")
    s.add("transf_offset_000")
    if s.within("C"):
        s.refuse("transf_function_enabled_false")
    inner = s.value("mandelbox_folding_min_radius")
    s.ball(inner * inner, 1.0)
    scale_by(s, s.state["scale"])
    if s.on("transf_addCpixel_enabled"):
        s.add_constant("", "transf_constant_multiplier_111")
    s.add("transf_offsetA_000")
    s.turn("transf_rotationXYZ", "zyx", "zyx")
