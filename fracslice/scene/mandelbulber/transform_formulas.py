"""Transforms of Mandelbulber, which stand between other formulas of a hybrid."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .box_formulas import turned_folds
from .folds import (
    PI,
    absolute,
    absolute_of,
    bulge,
    diagonals,
    differences,
    mandalay,
    polygon,
    switched,
    symmetric,
)
from .sponge_formulas import box_offset
from .step_text import LEFT_OUT, ORDERS, FormulaStep, known

MANDELBULBER = "Mandelbulber 2, formula of this number"


def shift(s: FormulaStep, name: str, switches: Sequence[str]) -> None:
    """|x + a| - a of the coordinates whose switches are on."""
    pairs = zip("xyz", s.vector(name), switches, strict=True)
    parts = [
        f"absolute({p} + {a}) - {a}" if s.on(switch) and (a := s.parameter(f"{name}_{p}", v)) else p
        for p, v, switch in pairs
    ]
    if parts != ["x", "y", "z"]:
        s.write("x, y, z = w", f"w = ({', '.join(parts)})")


@known(1001, "T>Add Constant", MANDELBULBER, LEFT_OUT)
def add_constant(s: FormulaStep) -> None:
    """Move by two vectors."""
    s.add("transf_addition_constant")
    s.add("transf_addition_constantA_000")


@known(1002, "T>Rotation", MANDELBULBER, LEFT_OUT)
def rotation(s: FormulaStep) -> None:
    """Turn about the axes."""
    s.turn("transf_rotation")


@known(1003, "T>Scale", MANDELBULBER, LEFT_OUT)
def scale(s: FormulaStep) -> None:
    """Multiply by a number."""
    s.scale("transf_scale")


@known(1004, "T>Scale 3D", MANDELBULBER, LEFT_OUT)
def scale_3d(s: FormulaStep) -> None:
    """Multiply the coordinates by three numbers."""
    s.multiply("transf_scale3D_111")


@known(1005, "T>Box Offset", MANDELBULBER, LEFT_OUT)
def box_offsets(s: FormulaStep) -> None:
    """Move away from the planes of the axes."""
    box_offset(s, "transf_addition_constant")


@known(1007, "T>Add Cpixel", MANDELBULBER, LEFT_OUT)
def add_cpixel(s: FormulaStep) -> None:
    """Add the start point."""
    s.add_constant("", "transf_constant_multiplier_111")


@known(1020, "T>Box Fold", "Lowe 2010", LEFT_OUT)
def box_fold(s: FormulaStep) -> None:
    """Fold into a box whose height may differ."""
    if s.value("transf_scale_1") == 1:
        s.fold_apart("mandelbox_folding_limit", "mandelbox_folding_value")
        return
    a, b, k = (
        s.number("mandelbox_folding_limit"),
        s.number("mandelbox_folding_value"),
        s.number("transf_scale_1"),
    )
    s.write("x, y, z = w")
    for axis, limit, value in (("x", a, b), ("y", a, b), ("z", f"{a} * {k}", f"{b} * {k}")):
        s.write(
            f"t = where({axis} < -{limit}, -{value} - {axis}, {axis})",
            f"{axis} = where({axis} > {limit}, {value} - {axis}, t)",
        )
    s.write("w = (x, y, z)")


@known(1021, "T>Spherical Fold", "Lowe 2010", LEFT_OUT)
def spherical_fold(s: FormulaStep) -> None:
    """Fold out of a ball."""
    inner, outer = s.value("mandelbox_folding_min_radius"), s.value("mandelbox_folding_fixed_radius")
    s.ball(inner * inner, outer * outer, "mandelbox_offset", "transf_scale")


@known(1022, "T>Zvector Axis Swap", MANDELBULBER, LEFT_OUT)
def axis_swap(s: FormulaStep) -> None:
    """Take the coordinates in another order."""
    word = s.values.one_of("mandelbulbMulti_order_of_xyz", ORDERS)
    if word != "xyz":
        s.write("x, y, z = w", f"w = ({', '.join(word)})")


@known(1023, "T>Abs Add Constant", MANDELBULBER, LEFT_OUT)
def abs_add_constant(s: FormulaStep) -> None:
    """Absolute values between two vectors that are added."""
    s.add("transf_addition_constant")
    absolute(s, *(f"transf_function_enabled{axis}" for axis in "xyz"))
    s.add("transf_offsetA_000")
    if s.during("transf_start_iterations_D", "transf_stop_iterations_D1"):
        s.refuse("transf_addCpixel_enabled_false")


@known(1152, "T>Abs Add Constant V2", MANDELBULBER, LEFT_OUT)
def abs_add_constant_2(s: FormulaStep) -> None:
    """Absolute values, then a - |a - x|."""
    s.add("transf_addition_constant")
    absolute(s, *(f"transf_function_enabledA{axis}" for axis in "xyz"))
    parts = [
        s.parameter(f"transf_offset_000_{p}", v) if s.on(f"transf_function_enabledA{p}") and v else ""
        for p, v in zip("xyz", s.vector("transf_offset_000"), strict=True)
    ]
    if any(parts):
        s.write(
            "x, y, z = w",
            f"w = ({', '.join(f'{p} + {a}' if a else p for p, a in zip('xyz', parts, strict=True))})",
        )
    moved = [
        f"{a} - absolute({a} - {p})"
        if s.on(f"transf_function_enabled{p}") and (a := s.parameter(f"transf_offsetA_000_{p}", v))
        else p
        for p, v in zip("xyz", s.vector("transf_offsetA_000"), strict=True)
    ]
    if moved != ["x", "y", "z"]:
        s.write("x, y, z = w", f"w = ({', '.join(moved)})")
    if s.during("transf_start_iterations_D", "transf_stop_iterations_D1"):
        s.refuse("transf_addCpixel_enabled_false")


@known(1025, "T>Abs Add Tglad Fold", "Glad and Lowe 2010, fractalforums.com", LEFT_OUT)
def tglad_fold(s: FormulaStep) -> None:
    """Fold into a box, and push the coordinates towards its middle."""
    s.fold("transf_addition_constant")
    if switched(s, "_false", "A"):
        bulge(s, "transf_addition_constant", "transf_offset_000")


@known(1027, "T>R^Power", MANDELBULBER, LEFT_OUT)
def r_power(s: FormulaStep) -> None:
    """Multiply by a power of the radius."""
    n = s.number("power")
    s.write("x, y, z = w", f"w = exp(0.5 * ({n} - 1) * log(maximum(x * x + y * y + z * z, 1e-30))) * w")


@known(1036, "T>Rotation VaryV1", MANDELBULBER, LEFT_OUT)
def rotation_vary(s: FormulaStep) -> None:
    """Turn by angles that change over some iterations."""
    start, stop = s.values.whole("transf_start_iterations_250"), s.values.whole("transf_stop_iterations")
    share = 0.0
    if s.index >= start and stop != start:
        share = (s.index - start) / (stop - start) if s.index < stop else 1.0
    turn_by(
        s,
        [
            a + share * b
            for a, b in zip(s.vector("transf_rotation"), s.vector("transf_offset_000"), strict=True)
        ],
    )


def turn_by(s: FormulaStep, angles: Sequence[float]) -> None:
    """Turn about x, y and z by angles in degrees."""
    for axis, text, angle in zip("xyz", ("(1, 0, 0)", "(0, 1, 0)", "(0, 0, 1)"), angles, strict=True):
        if angle:
            s.write(f"w = turn(w, {text}, {s.parameter(f'angle_{axis}', angle)})")


@known(1054, "T>Rpow3", MANDELBULBER, LEFT_OUT)
def r_cubed(s: FormulaStep) -> None:
    """Multiply by the square of the radius."""
    s.write("x, y, z = w", f"w = {s.number('transf_scale')} * (x * x + y * y + z * z) * w")


@known(1052, "T>Menger Fold", "Knighty 2010, fractalforums.com", LEFT_OUT)
def menger_fold(s: FormulaStep) -> None:
    """Sort the absolute coordinates, enlarge and move, or one of both."""
    if s.on("transf_function_enabledx"):
        s.add("transf_addition_constantA_000")
        s.write("w = positive(w)")
        s.sort()
    if s.on("transf_function_enabledy"):
        s.scale("transf_scale_3")
        a, b, d = s.twice("transf_constant_multiplier_111")
        moved = f"where(z > 1, z - {d}, z)" if s.on("transf_function_enabled") else f"z - {d}"
        s.write("x, y, z = w", f"w = (x - {a}, y - {b}, {moved})")


@known(1064, "T>Rotation Folding", MANDELBULBER, LEFT_OUT)
def rotation_folding(s: FormulaStep) -> None:
    """Folds between two turns."""
    s.turn("transf_rotation")
    if s.on("transf_function_enabled"):
        shift(s, "transf_offset_000", [f"transf_function_enabled{axis}" for axis in "xyz"])
    if s.on("transf_function_enabledAy_false"):
        switched_fold(s, "transf_offset_111", [f"transf_function_enabledA{axis}" for axis in "xyz"])
    s.refuse("transf_function_enabledAz_false")
    s.turn("transf_rotation2")


def switched_fold(s: FormulaStep, name: str, switches: Sequence[str]) -> None:
    """Fold into a box the coordinates whose switches are on."""
    on = [s.on(switch) for switch in switches]
    values = [
        s.parameter(f"{name}_{p}", abs(v)) if flag else "1e6"
        for p, v, flag in zip("xyz", s.vector(name), on, strict=True)
    ]
    if any(on):
        s.write(f"w = fold_to(w, ({', '.join(values)}))")


@known(1055, "T>Spherical Invert", MANDELBULBER, LEFT_OUT)
def spherical_inversion(s: FormulaStep) -> None:
    """Invert in the unit sphere about a point."""
    s.refuse("transf_function_enabledy_false")
    s.add("mandelbox_offset")
    s.scale("transf_scale")
    if not s.on("transf_function_enabledz_false"):
        s.write("w = inversion(w, 1)")
    else:
        conditional_inversion(s)
    s.add("mandelbox_offset", "-")
    s.add("transf_addition_constant", "-")


def conditional_inversion(s: FormulaStep) -> None:
    """Invert what is in a ball; near its middle, less."""
    m, f = s.number("transf_minimum_radius_0"), s.number("mandelbox_folding_fixed_radius")
    s.write("x, y, z = w", "s = x * x + y * y + z * z", "t = s")
    if s.on("transf_function_enabled_false"):
        s.write(f"t = where(s < {m}, {m}, t)")
    if s.on("transf_function_enabledx_false"):
        s.write(f"t = where(s < {m}, 2 * {m} - s, t)")
    s.write("k = 1 / maximum(t, 1e-18)")
    o = s.point("transf_offset_000")
    s.write(f"k = where(s < {f}, k, 1)", f"w = k * (w + {o}) - {o}")


@known(1065, "T>Abs Add Conditional", MANDELBULBER, LEFT_OUT)
def abs_conditional(s: FormulaStep) -> None:
    """Turn the coordinates about on their side of zero: a - |x| + b |x|."""
    a, b = s.point("transf_offset_111"), s.point("transf_scale3D_000")
    s.write(f"ax, ay, az = {a}", f"bx, by, bz = {b}", "x, y, z = w")
    for p in "xyz":
        if s.on(f"transf_function_enabled{p}"):
            s.write(f"t = a{p} + (b{p} - 1) * absolute({p})", f"{p} = where({p} < 0, -t, t)")
    s.write("w = (x, y, z)")


@known(1080, "T>Poly Fold Sym XY", "Sandercoe and Luca 2016, fractalforums.com", LEFT_OUT)
def poly_fold_sym(s: FormulaStep) -> None:
    """Turn the sector of a polygon into one of two, and reflect every other."""
    absolute_of(s, [s.on(f"transf_function_enabled{axis}_false") for axis in "xy"] + [False])
    n = s.parameter("transf_int_6", max(s.values.whole("transf_int_6"), 1))
    full = s.on("transf_function_enabled_false")
    s.write("x, y, z = w")
    angle = "atan2(x, y)" if full else "atan2(x * where(y < 0, -1, 1), maximum(absolute(y), 1e-30))"
    s.write(f"k = {n} / (2 * {PI})", f"t = -k * {angle}", "t = where(t < 0, -floor(-t), floor(t))")
    s.write("p = t - 2 * floor(0.5 * t)", "t = t / k")
    s.write("u, v = x * cos(t) - y * sin(t), x * sin(t) + y * cos(t)", "v = where(p > 0.5, -v, v)")
    a, b = s.number("transf_offset_0"), s.number("transf_offsetA_0")
    s.write(f"w = (u + {a}, v + {b}, z)")


@known(1100, "T>Poly Fold Atan2", "Sandercoe and Luca 2016, fractalforums.com", LEFT_OUT)
def poly_fold_atan2(s: FormulaStep) -> None:
    """Fold into sectors of polygons."""
    absolute(
        s, "transf_function_enabledx", "transf_function_enabledy_false", "transf_function_enabledz_false"
    )
    planes = (
        ("Cx", "xy", "transf_int8_X", "Ax"),
        ("Cy_false", "yz", "transf_int8_Y", "Ay"),
        ("Cz_false", "zx", "transf_int8_Z", "Az"),
    )
    for switch, axes, count, mirrored in planes:
        if s.on(f"transf_function_enabled{switch}"):
            if s.on(f"transf_function_enabled{mirrored}_false"):
                first, second = axes[0], axes[1]
                s.write("x, y, z = w", f"{first} = where({second} < 0, -{first}, {first})", "w = (x, y, z)")
            polygon(s, axes, count)
    s.add("transf_addition_constant")
    if s.on("transf_rotation2_enabled_false"):
        s.turn("transf_rotation")


@known(1105, "T>Scale Offset", MANDELBULBER, LEFT_OUT)
def scale_offset(s: FormulaStep) -> None:
    """Scale about a point."""
    s.add("transf_addition_constant", "-")
    s.scale("transf_scale_1")
    s.add("transf_addition_constant")


@known(1108, "T>Mandalay Fold V1", "Knighty and DarkBeam 2015, fractalforums.com", LEFT_OUT)
def mandalay_fold(s: FormulaStep) -> None:
    """Fold of the absolute coordinates along each axis, where the others sort in a gap."""
    mandalay(s, s.on("transf_function_enabledSw_false"))


@known(1129, "T>Rotation M3D", MANDELBULBER, LEFT_OUT)
def rotation_m3d(s: FormulaStep) -> None:
    """Turn about z, then y, then x."""
    s.turn("transf_rotationXYZ", "zyx", "zyx")


@known(1146, "T>Add Spherical Invert", MANDELBULBER, LEFT_OUT)
def add_inverted(s: FormulaStep) -> None:
    """Add the point times a mean of the inverse of its radius and of that squared."""
    a, g, b = s.number("transf_scaleA_1"), s.point("transf_scale3D_111"), s.number("transf_scaleB_1")
    s.write(
        "x, y, z = w", "d = 1 / maximum(x * x + y * y + z * z, 1e-18)", "r = sqrt(d)", f"gx, gy, gz = {g}"
    )
    s.write(f"d = d + (r - d) * {a}" if s.on("transf_function_enabled_false") else f"d = r + (d - r) * {a}")
    s.write(f"w = (x * (1 + gx * d) * {b}, y * (1 + gy * d) * {b}, z * (1 + gz * d) * {b})")


@known(1158, "T>Abs Sym3", MANDELBULBER, LEFT_OUT)
def abs_sym_3(s: FormulaStep) -> None:
    """Absolute values, and reflections in three diagonal planes, in part."""
    if switched(s, "A_false", "A"):
        absolute(s, *(f"transf_function_enabled{axis}" for axis in "xyz"))
        s.add("transf_offset_000")
    if s.within("K"):
        symmetric(s)
    if switched(s, "B_false", "B"):
        absolute(s, *(f"transf_function_enabledC{axis}" for axis in "xyz"))
        s.add("transf_offsetF_000")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")
    if s.within("E"):
        s.scale("transf_scale_1")
    if s.during("transf_start_iterations_C", "transf_stop_iterations_C1"):
        s.refuse("transf_addCpixel_enabled_false")


@known(1155, "T>Spherical Invert V4", MANDELBULBER, LEFT_OUT)
def spherical_inversion_4(s: FormulaStep) -> None:
    """Multiply by the square of the radius or its inverse, as modes say in a shell."""
    square = ("x, y, z = w", "s = x * x + y * y + z * z", "k = s")
    before = s.on("transf_function_enabledy_false")
    if before:
        s.write(*square)
    s.add("mandelbox_offset")
    s.scale("transf_scale")
    if not before:
        s.write(*square)
    if s.on("transf_function_enabledP_false") and s.during(
        "transf_start_iterations_P", "transf_stop_iterations_P1"
    ):
        s.write("k = 1 / maximum(s, 1e-18)", "w = k * w")
    if s.on("transf_function_enabled") and s.during("transf_start_iterations_C", "transf_stop_iterations_C1"):
        s.add("transf_offset_000")
        m, f = s.number("transf_minimum_radius_0"), s.number("mandelbox_folding_fixed_radius")
        inverse_modes(s, m, f)
        s.write("k = 1 / where(absolute(k) < 1e-18, 1e-18, k)", "w = k * w")
        s.add("transf_offset_000", "-")
    s.add("mandelbox_offset", "-")
    s.add("transf_addition_constant", "-")


def inverse_modes(s: FormulaStep, m: str, f: str) -> None:
    """Change the divisor k of an inversion between two squares of radii."""
    modes = {
        "": (f"k = where(s < {m}, {m}, k)",),
        "A": (f"k = where(s < {f}, {m}, k)",),
        "B": (f"k = where(s < {f}, where(s > {m}, {m}, k), where(s > {f}, {f} / s, k))",),
        "F": (f"k = where(s < {f}, where(s > {m}, {m}, k), where(s > {f}, s / {f}, k))",),
        "D": (f"k = where(s > {m}, {m}, k)",),
        "C": (f"k = where(s < {m}, {m}, k)", f"k = where(s > {f}, {f}, k)"),
    }
    for letter, lines in modes.items():
        if s.on(f"transf_function_enabled{letter}_false"):
            s.write(*lines)


@known(1150, "T>Box Tiling V3", MANDELBULBER, LEFT_OUT)
def box_tiling(s: FormulaStep) -> None:
    """Repeat space along the axes, without end."""
    s.add("transf_addition_constantA_000", "-")
    if s.on("transf_addCpixel_enabled_false"):
        s.refuse("transf_addCpixel_enabled_false")
    sizes, offsets = s.vector("transf_offset_222"), s.vector("transf_offset_000")
    for k, (p, own) in enumerate(zip("xyz", ("x", "y_false", "z_false"), strict=True)):
        if s.on(f"transf_function_enabled{own}"):
            s.refuse(f"transf_function_enabledA{p}_false", f"surfBox_enabled{p.upper()}2_false")
            a, o = (
                s.parameter(f"transf_offset_222_{p}", sizes[k]),
                s.parameter(f"transf_offset_000_{p}", offsets[k]),
            )
            start = f"absolute({p})" if s.on(f"transf_function_enabledC{p}_false") else p
            sign = "-" if s.on(f"transf_function_enabledB{p}_false") else ""
            s.write(
                "x, y, z = w",
                f"t = {start} - {o}",
                f"{p} = {sign}(t - {a} * floor(t / {a} + 0.5))",
                "w = (x, y, z)",
            )


@known(1135, "T>Add Cpixel Invert", MANDELBULBER, LEFT_OUT)
def add_cpixel_inverted(s: FormulaStep) -> None:
    """Add the inverses of the coordinates of the start point."""
    s.write("cx, cy, cz = c", "x, y, z = w")
    for p in "xyz":
        small = f"where(absolute(c{p}) < 1e-9, 1e-9, c{p})"
        s.write(f"u{p} = c{p}" if s.on(f"transf_function_enabledA{p}_false") else f"u{p} = 1 / {small}")
        if s.on("transf_function_enabledA_false"):
            s.write(f"u{p} = minimum(absolute(u{p}), {s.number('transf_scale_1')})")
        if s.on("transf_function_enabledB_false"):
            s.write(f"u{p} = where(c{p} < 0, -u{p}, u{p})")
        if s.on("transf_function_enabledC_false"):
            s.write(f"u{p} = where({p} < 0, -u{p}, u{p})")
    m = s.point("transf_constant_multiplier_111")
    s.write(f"mx, my, mz = {m}", "w = (x + mx * ux, y + my * uy, z + mz * uz)")


@known(1068, "T>Spherical OffsetVCL", MANDELBULBER, LEFT_OUT)
def spherical_offset_curve(s: FormulaStep) -> None:
    """Move along the radius."""
    s.refuse("transf_function_enabled")
    s.write("x, y, z = w", "s = maximum(x * x + y * y + z * z, 1e-18)")
    d = "s" if s.on("transf_function_enabled_false") else "sqrt(s)"
    s.write(f"w = (1 - {s.number('transf_offset_0')} / {d}) * w")
    s.scale("transf_scale")


@known(1006, "T>Spherical Offset", MANDELBULBER, LEFT_OUT)
def spherical_offset(s: FormulaStep) -> None:
    """Move along the radius."""
    s.write("x, y, z = w", "r = sqrt(maximum(x * x + y * y + z * z, 1e-18))")
    s.write(f"w = (1 - {s.number('transf_offset')} / r) * w")
    s.scale("transf_scale")


@known(1084, "T>Sin And Cos - Max", MANDELBULBER, LEFT_OUT)
def sine_cosine(s: FormulaStep) -> None:
    """The larger of a sine, a cosine and their product, of each coordinate."""
    f, g = s.point("transf_constant_multiplierA_111"), s.point("transf_constant_multiplierB_111")
    a, b, d = s.number("transf_scaleA_1"), s.number("transf_scaleB_1"), s.number("transf_scaleC_1")
    s.write("x, y, z = w", f"fx, fy, fz = {f}", f"gx, gy, gz = {g}", "ux, uy, uz = x, y, z")
    for p, own in zip("xyz", ("Ax", "Ay_false", "Az_false"), strict=True):
        if s.on(f"transf_function_enabled{own}"):
            s.write(
                f"t = {a} * sin(6.283185307179586 * {p} / f{p})",
                f"m = {b} * cos(6.283185307179586 * {p} / g{p})",
            )
            s.write(f"u{p} = maximum(maximum(t, m), {d} * t * m)")
            if s.on("transf_function_enabled_false"):
                s.write(f"u{p} = u{p} / (absolute({p}) + 1)")
    k = s.number("transf_scale")
    s.write(f"ux, uy, uz = {k} * ux, {k} * uy, {k} * uz")
    if s.on("transf_function_enabledM_false"):
        form = s.values.one_of("combo4", ("type1", "type2", "type3", "type4"))
        rule = {
            "type1": "u{p} + {p}",
            "type2": "u{p} * {p}",
            "type3": "u{p} + absolute({p})",
            "type4": "u{p} * absolute({p})",
        }
        s.write(*(f"u{p} = " + rule[form].format(p=p) for p in "xyz"))
    s.write("w = (ux, uy, uz)")


@known(1098, "T>Diagonal Fold", MANDELBULBER, LEFT_OUT)
def diagonal_fold(s: FormulaStep) -> None:
    """Reflect in the planes between pairs of axes."""
    timed = s.on("transf_function_enabledAx_false")
    planes = (("Ax", "(-1, 1, 0)", "A"), ("Ay_false", "(0, -1, 1)", "B"), ("Az_false", "(1, 0, -1)", "C"))
    for switch, normal, letter in planes:
        now = not timed or s.within(letter)
        if s.on(f"transf_function_enabled{switch}") and now:
            s.write(f"w = mirror(w, {normal})")


@known(1140, "T>Poly XY Fold V1", "Sandercoe and Luca 2016, fractalforums.com", LEFT_OUT)
def poly_fold(s: FormulaStep) -> None:
    """Fold into a sector of a polygon, and mix x and y of the image."""
    if s.during("transf_start_iterations_D", "transf_stop_iterations_D1"):
        absolute(s, "transf_function_enabledx", "transf_function_enabledy", "transf_function_enabledz_false")
        s.add("transf_offset_000")
        polygon(s, "xy", "transf_int8_X")
        a, b = s.number("transf_scaleF_1"), s.number("transf_scaleG_1")
        s.write("x, y, z = w", f"w = (y + (x - y) * {a}, x + (y - x) * {b}, z)")
    if s.on("transf_rotation2_enabled_false") and s.within("R"):
        s.turn("transf_rotation")
    if s.within("A"):
        s.add("transf_addition_constant")


@known(1145, "T>Menger Fold V2", "Knighty 2010, fractalforums.com", LEFT_OUT)
def menger_fold_2(s: FormulaStep) -> None:
    """A sponge's folds, in part, with turns between, a scale and an offset."""
    s.write("w = positive(w)")
    s.add("transf_offset_000")
    if s.on("transf_rotation_enabled_false") and s.within("R"):
        s.turn("transf_rotation")
    diagonals(s)
    if s.on("transf_function_enabled_false"):
        s.turn("transf_rotation2")
    scale = s.value("transf_scale_3")
    if switched(s, "X_false", "X"):
        added = s.state.get("added", 0.0)
        scale += added
        s.state["added"] = -s.value("transf_scale_vary_0") * (abs(added) - s.value("transf_scaleB_1"))
    a = s.parameter("transf_scale_3", scale)
    if s.on("transf_function_enabledSw_false"):
        s.write(f"w = {a} * w")
    else:
        o = s.point("transf_offset_1105")
        s.write(
            f"ox, oy, oz = {o}",
            "x, y, z = w",
            f"k = {a} - 1",
            f"z = oz * k / {a} - absolute(z - oz * k / {a})",
        )
        s.write(f"w = ({a} * x - ox * k, {a} * y - oy * k, {a} * z)")
    s.add("transf_addition_constantA_000")


@known(1151, "T>Dot Fold", "Knighty 2010, fractalforums.com", LEFT_OUT)
def dot_fold(s: FormulaStep) -> None:
    """Reflect the points in front of a plane through the origin behind it."""
    normal = list(s.vector("transf_offset_000"))
    if not s.on("transf_function_enabled_false"):
        a, b = (math.radians(s.value(f"transf_angle_deg_{letter}")) for letter in "AB")
        own = (math.cos(a) * math.sin(b), math.sin(a), math.cos(a) * math.cos(b))
        normal = [p + q for p, q in zip(normal, own, strict=True)]
    absolute(s, *(f"transf_function_enabledA{axis}_false" for axis in "xyz"))
    if any(normal):
        x, y, z = (-v for v in normal)
        s.write(f"w = mirror(w, {s.parameter('normal', (x, y, z))})")
    s.scale("transf_scale_1")
    s.turn("transf_rotation")


@known(1059, "T>Octo Fold", "Knighty 2010, fractalforums.com", LEFT_OUT)
def octo_fold(s: FormulaStep) -> None:
    """An octahedron's folds, a scale and an offset."""
    for normal in ("(1, 1, 0)", "(1, 0, 1)", "(1, -1, 0)", "(1, 0, -1)"):
        s.write(f"w = mirror(w, {normal})")
    a, o = s.number("transf_scale_2"), s.point("transf_offset_100")
    s.write("x, y, z = w", f"w = {a} * (absolute(x), y, z) - ({a} - 1) * {o}")


@known(1048, "T>Rotation Folding Plane", "Lowe 2010", LEFT_OUT)
def folding_planes(s: FormulaStep) -> None:
    """Folds of each coordinate in frames of their own."""
    turned_folds(s)


@known(1029, "T>Abs Add Multi", MANDELBULBER, LEFT_OUT)
def abs_add_multi(s: FormulaStep) -> None:
    """|x + a| - |x - b| - k x, without the terms whose switches are off."""
    vectors = [f"transf_{name}" for name in ("addition_constant", "offset_000", "scale3D_111")]
    differences(s, vectors, "transf_function_enabledA", "transf_function_enabled")
    s.add("transf_offsetA_000")


@known(1082, "T>Sin Or Cos", MANDELBULBER, LEFT_OUT)
def sine_or_cosine(s: FormulaStep) -> None:
    """Sines or cosines of the coordinates; those whose switch is off are 0."""
    f, k = s.point("transf_constant_multiplierC_111"), s.number("transf_scale")
    s.write(f"fx, fy, fz = {f}", "x, y, z = w")
    parts = []
    for p in "xyz":
        function = "cos" if s.on(f"transf_function_enabledA{p}_false") else "sin"
        value = f"{k} * {function}(f{p} * {p})" if s.on(f"transf_function_enabledA{p}") else f"0 * {p}"
        less = s.on("transf_function_enabled_false")
        parts.append(f"{k} * {value} / (absolute({p}) + 1)" if less else value)
    s.write(f"w = ({', '.join(parts)})")


@known(56, "T>Platonic Solid", "Luca 2011, fractalforums.com", LEFT_OUT)
def platonic_solid(s: FormulaStep) -> None:
    """Multiply by a sum of products of sines and cosines, and of a power of the radius."""
    f, a, b = (s.number(f"platonic_solid_{name}") for name in ("frequency", "amplitude", "rhoMul"))
    s.write(
        "x, y, z = w",
        f"p, q, r = {f} * x, {f} * y, {f} * z",
        "t = cos(p) * sin(q) + cos(q) * sin(r) + cos(r) * sin(p)",
        "s = sqrt(maximum(x * x + y * y + z * z, 1e-30))",
    )
    s.write(f"s = {radial(s) if s.on('transf_function_enabled_false') else 'sqrt(s)'}")
    if s.on("transf_function_enabled_false") and s.on("transf_function_enabledAz_false"):
        s.write("t = absolute(t)")
    s.write(f"w = (t * {a} + s * {b}) * w")


def radial(s: FormulaStep) -> str:
    """Root of a radius, the radius and its square: their sum, or a mean of two, without those whose switches
    are off.
    """
    switches = ("x", "y_false", "z_false")
    root, same, square = (
        power if s.on(f"transf_function_enabled{switch}") else "0 * s"
        for power, switch in zip(("sqrt(s)", "s", "s * s"), switches, strict=True)
    )
    share = s.number("transf_scale_1")
    if s.on("transf_function_enabledAx_false"):
        return f"{root} + ({same} - {root}) * {share}"
    if s.on("transf_function_enabledAy_false"):
        return f"{same} + ({square} - {same}) * {share}"
    return f"{root} + {same} + {square}"
