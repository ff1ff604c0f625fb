"""The sponges and kaleidoscopes of Mandelbulber: reflections, a scale and an offset."""

from __future__ import annotations

import math

from .folds import absolute, absolute_of, polygon, switched
from .step_text import LEFT_OUT, FormulaStep, known

MENGER = "Menger 1926; folds by Knighty 2010, fractalforums.com"

PLANES = 9
"""Reflections of a kaleidoscope, numbered from 0."""


@known(7, "Menger sponge", MENGER, LEFT_OUT, even=True)
def menger_sponge(s: FormulaStep) -> None:
    """Menger's sponge by folds."""
    s.write("w = positive(w)")
    s.menger("transf_scale_3")


@known(207, "Menger3", MENGER, LEFT_OUT, even=True)
def menger_3(s: FormulaStep) -> None:
    """A sponge with two turns."""
    s.write("w = positive(w)")
    s.turn("transf_rotation")
    s.sort()
    s.turn("transf_rotation2")
    third = s.parameter("third", s.vector("transf_offset_111")[2] / 3)
    s.write("x, y, z = w", f"w = (x, y, absolute(z - {third}) + {third})")
    a, o = s.number("transf_scale_3"), s.point("transf_offset_111")
    s.write(f"w = {a} * w - ({a} - 1) * {o}")


@known(61, "Menger - Mod 1", MENGER, LEFT_OUT, even=True)
def menger_mod_1(s: FormulaStep) -> None:
    """A sponge that is turned, moved, and moved away from the planes of the axes."""
    s.write("w = positive(w)")
    s.symmetric = False
    s.menger("transf_scale_3", "transf_constant_multiplier_111")
    if s.on("transf_rotation_enabled") and s.within(""):
        s.turn("transf_rotation")
    s.add("transf_addition_constant")
    if switched(s, "x_false", "A"):
        box_offset(s, "transf_addition_constantA_000")
    weigh(s, "transf_function_enabled_false", "transf_offset", "transf_offset_0")


def box_offset(s: FormulaStep, name: str) -> None:
    """Move every coordinate away from zero."""
    x, y, z = s.vector(name)
    if not (x or y or z):
        return
    s.write(f"a, b, d = {s.point(name)}", "x, y, z = w")
    s.write("w = (x + where(x < 0, -a, a), y + where(y < 0, -b, b), z + where(z < 0, -d, d))")


def weigh(s: FormulaStep, switch: str, first: str, second: str) -> None:
    """Scale the point, with additions in two iterations."""
    if s.on(switch):
        scale = s.value("transf_scale_1")
        for number, added in (("transf_int_A", first), ("transf_int_B", second)):
            scale += s.value(added) if s.index == s.values.whole(number) else 0
        s.write(f"w = {s.parameter('weight', scale)} * w")


@known(113, "Menger - Smooth", "Knighty 2010 and Eiffie 2012, fractalforums.com", LEFT_OUT)
def menger_smooth(s: FormulaStep) -> None:
    """A sponge whose folds are round."""
    a, e = s.number("transf_scale_3"), s.number("transf_offset_0005")
    s.write("x, y, z = w")
    s.write(*(f"{p} = sqrt({p} * {p} + {e})" for p in "xyz"))
    for p, q in ("xy", "xz", "yz"):
        s.write(f"t = {p} - {q}", f"t = 0.5 * (t - sqrt(t * t + {e}))", f"{p} = {p} - t", f"{q} = {q} + t")
    b, d, f = (
        s.parameter(f"transf_offset_1105_{p}", v)
        for p, v in zip("xyz", s.vector("transf_offset_1105"), strict=True)
    )
    s.write(f"t = {f} * ({a} - 1) / {a}", "z = z - t", f"z = t - sqrt(z * z + {e})")
    s.write(f"w = ({a} * x - ({a} - 1) * {b}, {a} * y - ({a} - 1) * {d}, {a} * z)")
    if s.on("transf_rotation_enabled") and s.within("R"):
        s.turn("transf_rotation")
    weigh(s, "transf_function_enabledz_false", "transf_offsetA_0", "transf_offsetB_0")


@known(10, "Kaleidoscopic IFS", "Knighty 2010, fractalforums.com", LEFT_OUT)
def kaleidoscope(s: FormulaStep) -> None:
    """Reflections in up to nine planes, each after a turn, then a turn, a scale and an offset."""
    flags = [s.on(f"IFS_abs_{axis}") for axis in "xyz"]
    if all(flags):
        s.write("w = positive(w)")
    elif any(flags):
        parts = (f"absolute({p})" if flag else p for p, flag in zip("xyz", flags, strict=True))
        s.write("x, y, z = w", f"w = ({', '.join(parts)})")
    for k in range(PLANES):
        if s.on(f"IFS_enabled_{k}"):
            plane(s, k)
    offset, scale = s.vector("IFS_offset"), s.number("IFS_scale")
    o = s.parameter("IFS_offset", offset)
    if s.on("IFS_rotation_enabled") and any(s.vector("IFS_rotation")):
        s.write(f"w = w - {o}")
        s.turn("IFS_rotation", "xyz", "zyx")
        s.write(f"w = w + {o}")
    if s.on("IFS_edge_enabled"):
        edge(s)
    if s.on("IFS_menger_sponge_mode"):
        s.write(f"a, b, d = {o}", f"w = {scale} * w", "x, y, z = w", f"k = {scale} - 1")
        s.write("w = (x - a * k, y - b * k, where(z > 0.5 * d * k, z - d * k, z))")
    else:
        s.write(f"w = {scale} * w - ({scale} - 1) * {o}")


def plane(s: FormulaStep, k: int) -> None:
    """Turn, and reflect the points behind a plane to its front; with an intensity other than 1, part of the
    way.
    """
    s.turn(f"IFS_rotations_{k}", "xyz", "zyx")
    length = math.hypot(*s.vector(f"IFS_direction_{k}")) or 1.0
    x, y, z = (v / length for v in s.vector(f"IFS_direction_{k}"))
    n = s.parameter(f"IFS_direction_{k}", (x, y, z))
    distance, intensity = s.value(f"IFS_distance_{k}"), s.value(f"IFS_intensity_{k}")
    if intensity == 1 and distance == 0:
        s.write(f"w = mirror(w, {n})")
    elif intensity == 1:
        d = s.parameter(f"IFS_distance_{k}", distance)
        s.write(f"w = mirror(w - {d} * {n}, {n}) + {d} * {n}")
    else:
        d, i = s.parameter(f"IFS_distance_{k}", distance), s.parameter(f"IFS_intensity_{k}", intensity)
        s.write(f"a, b, d = {n}", "x, y, z = w", f"t = 2 * {i} * minimum(a * x + b * y + d * z - {d}, 0)")
        s.write("w = (x - t * a, y - t * b, z - t * d)")


def edge(s: FormulaStep) -> None:
    """Reflect the coordinates beyond an edge back; none where the edge is not positive."""
    values = dict(zip("xyz", s.vector("IFS_edge"), strict=True))
    parts = []
    for axis, value in values.items():
        e = s.parameter(f"IFS_edge_{axis}", value) if value > 0 else ""
        parts.append(f"{e} - absolute({e} - {axis})" if e else axis)
    if any(value > 0 for value in values.values()):
        s.write("x, y, z = w", f"w = ({', '.join(parts)})")


@known(110, "Sierpinski 3D", "Sierpinski 1915; folds by Knighty 2010, fractalforums.com", LEFT_OUT)
def sierpinski(s: FormulaStep) -> None:
    """Reflections in the planes of a tetrahedron, a scale and an offset."""
    if s.on("transf_function_enabled"):
        s.write("w = mirror(w, (1, 1, 0))", "w = mirror(w, (1, 0, 1))", "w = mirror(w, (0, 1, 1))")
    if s.on("transf_function_enabled_false"):
        s.sort()
    s.scale("transf_scaleA_2")
    if s.within("C"):
        s.add("transf_offset_111", "-")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")


@known(228, "Ifs - Gen", "Sandercoe 2020, fractalforums.org", LEFT_OUT)
def ifs(s: FormulaStep) -> None:
    """Absolute values, an offset, a scale, a ball and turns."""
    absolute(s, *(f"transf_function_enabledA{axis}" for axis in "xyz"))
    s.add("transf_offset_111", "-")
    added = s.state.get("added", 0.0)
    s.write(f"w = {s.parameter('transf_scale_2', s.value('transf_scale_2') - added)} * w")
    if switched(s, "K_false", "K"):
        s.state["added"] = s.value("transf_scale_vary_0") * (abs(added) - s.value("transf_offsetA_1"))
    s.turn("transf_rotation")
    if s.within("O"):
        s.add("transf_offset_000")
    if switched(s, "S_false", "S"):
        s.ball(s.value("transf_minR2_p25"), s.value("transf_maxR2_1"))
    if s.within("R"):
        s.turn("transf_rotation2")


def koch(s: FormulaStep) -> None:
    """The snowflake's folds, in space: two reflections of x and z about thirds, a scale and an offset."""
    names = (("Ax", "Cx"), ("Ay", "Cy"), ("Az_false", "Cz"))
    switches = [switched(s, switch, letter) for switch, letter in names]
    absolute_of(s, switches)
    if switched(s, "Cx", "D"):
        s.write("w = mirror(w, (1, -1, 0))")
    if switched(s, "C_false", "C"):
        s.add("transf_offsetA_000", "-")
    if s.on("transf_function_enabled_false") and s.during(
        "transf_start_iterations", "transf_stop_iterations"
    ):
        koch_options(s)
    if switched(s, "G_false", "G"):
        s.ball(s.value("transf_minimum_radius_0"), s.value("transf_maxR2_1"), "mandelbox_offset")
    y = s.parameter("third", s.value("transf_scale_1") / 3)
    s.write("x, y, z = w", f"w = (x, {y} - absolute(y - {y}), z)")
    third = (
        "(-0.3333333333333333, 0, 0)"
        if s.on("transf_function_enabledN_false")
        else "(0.3333333333333333, 0, 0)"
    )
    if s.within("A"):
        s.write(f"w = mirror(w + {third}, (1, 0, -1)) - {third}")
    if s.within("B"):
        s.write(f"w = mirror(w - {third}, (1, 0, -1)) + {third}")
    if s.within("P"):
        s.add("transf_offset_100", "-")
    o, scale = s.point("transf_addition_constant_neg100"), s.value("transf_scale_2")
    if s.on("transf_function_enabledK_false"):
        added = s.state.get("added", 0.0)
        scale += added
        s.state["added"] = -s.value("transf_scale_vary_0") * (abs(added) - s.value("transf_scaleC_1"))
    s.write(f"w = {s.parameter('transf_scale_2', scale)} * (w - {o})")
    if switched(s, "H_false", "H"):
        s.write("x, y, z = w", "w = (x, y, -z)")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")
    s.write(f"w = w + {o}")


def koch_options(s: FormulaStep) -> None:
    """A polygon's fold, and reflections of x and y."""
    if s.on("transf_function_enabledCx_false"):
        s.write("w = mirror(w, (-1, 1, 0))")
    if s.on("transf_function_enabledP_false"):
        s.write("x, y, z = w", "w = (absolute(x), y, z)")
        polygon(s, "xy", "transf_int8_X")
    for switch, axis, name in (("M", "x", "transf_offsetC_0"), ("D", "y", "transf_offsetD_0")):
        if s.on(f"transf_function_enabled{switch}_false"):
            a = s.number(name)
            s.write("x, y, z = w", f"{axis} = {a} + absolute({axis} - {a})", "w = (x, y, z)")


@known(279, "Koch IFS", "von Koch 1904; folds by Knighty 2010, fractalforums.com", LEFT_OUT)
def koch_ifs(s: FormulaStep) -> None:
    """The snowflake's folds, with the radius for its field."""
    koch(s)


@known(114, "Menger - Smooth Mod1", "Knighty 2010 and Eiffie 2012, fractalforums.com", LEFT_OUT)
def menger_smooth_mod_1(s: FormulaStep) -> None:
    """A sponge whose folds are round, each by its own measure."""
    if s.on("transf_function_enabled"):
        a = s.number("transf_offset_0")
        s.write("x, y, z = w", *(f"{p} = sqrt({p} * {p} + {a})" for p in "xyz"), "w = (x, y, z)")
    if s.on("transf_function_enabledF_false"):
        t = s.number("transf_offset")
        s.write(f"w = positive(w) + ({t}, {t}, {t})")
    e, k, m = (
        s.number("transf_offset_0005"),
        s.number("transf_scale_05"),
        s.point("transf_constant_multiplier_111"),
    )
    s.write(f"mx, my, mz = {m}", "x, y, z = w")
    for p, q, of in (("x", "y", "mx"), ("x", "z", "my"), ("y", "z", "mz")):
        s.write(
            f"t = {p} - {q}", f"t = {k} * (t - sqrt(t * t + {e} * {of}))", f"{p} = {p} - t", f"{q} = {q} + t"
        )
    x, y, z = s.vector("transf_constant_multiplier_221")
    a, b = (
        s.parameter("transf_constant_multiplier_221_x", x),
        s.parameter("transf_constant_multiplier_221_y", y),
    )
    third, scale = s.parameter("third", z / 3), s.number("transf_scale_3")
    s.write(f"z = z - {third}", f"z = {third} - sqrt(z * z + {e} + {s.number('transf_offsetA_0')})")
    s.write(f"w = ({scale} * x - {a}, {scale} * y - {b}, {scale} * z)")
    if s.on("transf_rotation_enabled") and s.within("R"):
        s.turn("transf_rotation")
    if switched(s, "x_false", "A"):
        box_offset(s, "transf_addition_constantA_000")
    weigh(s, "transf_function_enabledz_false", "transf_offsetA_0", "transf_offsetB_0")


SLOPE = "0.8660254037844386"
"""sqrt(3) / 2."""


@known(98, "Menger - Cross KIFS", "Knighty 2010, fractalforums.com", LEFT_OUT)
def menger_cross(s: FormulaStep) -> None:
    """Reflections of a prism's cross, a scale and an offset."""
    if s.during("transf_start_iterations", "transf_stop_iterations_1"):
        s.refuse("transf_function_enabled_false")
    if not (switched(s, "", "A")):
        return
    absolute_of(s, [s.on("transf_function_enabledz_false"), True, True])
    s.write(f"w = mirror(w, ({SLOPE}, -0.5, 0))", "w = mirror(w, (0, 1, 0))", "w = mirror(w, (0, -1, 1))")
    s.write("w = mirror(w - (0, 0.5, 0), (0, 1, 0)) + (0, 0.5, 0)")
    if s.on("transf_function_enabledx_false"):
        s.write(f"w = {s.point('transf_offset_222')} - w")
    k = s.number("transf_scale_3")
    s.write(f"w = {k} * w - ({k} - 1) * ({SLOPE}, 1.5, 1.5)")
    s.add("transf_offset_000")
    if s.on("transf_function_enabledP_false"):
        a, b = s.number("transf_offset"), s.number("transf_offset_0")
        s.write("x, y, z = w", f"w = (absolute(x + {a}) + {b}, y, z)")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation2")


@known(239, "Amazing Ifs", "Knighty 2010 and Sandercoe 2020, fractalforums.org", LEFT_OUT)
def amazing_ifs(s: FormulaStep) -> None:
    """A polygon's fold, folds into a box, an offset, and a scale that the radius divides."""
    if s.on("transf_sphere_inversion_enabled_false") and s.during(
        "transf_start_iterations_X", "transf_stop_iterations_1"
    ):
        s.invert("transf_offset_000", "transf_scaleG_1", "transf_addition_constant")
        s.scale("transf_scaleA_1")
    if s.on("transf_function_enabledA_false"):
        absolute(s, *(f"transf_function_enabledA{axis}_false" for axis in "xyz"))
        s.add("transf_offsetA_000")
    if s.on("transf_function_enabledP_false") and s.during(
        "transf_start_iterations_P", "transf_stop_iterations_P1"
    ):
        s.write("x, y, z = w", "w = (x, absolute(y), z)")
        polygon(s, "xy", "transf_int_6")
    folded = [s.on(f"transf_function_enabled{name}") for name in ("Cx", "Cy", "Cz_false")]
    limits = zip("xyz", folded, s.vector("transf_addition_constant_0555"), strict=True)
    sides = (s.parameter(f"limit_{axis}", abs(limit)) if on else "1e6" for axis, on, limit in limits)
    s.write(f"w = fold_to(w, ({', '.join(sides)}))")
    if s.on("transf_function_enabledI_false"):
        moved_absolutes(s)
    s.add("transf_addition_constantA_000")
    if s.within("B"):
        added = s.state.get("added", 0.0)
        k = s.parameter("transf_scale_2", s.value("transf_scale_2") + added)
        m = s.number("transf_minR2_p25")
        s.write(
            "x, y, z = w", "r = x * x + y * y + z * z", f"w = {k} / where(r < {m}, {m}, minimum(r, 1)) * w"
        )
    if s.on("transf_function_enabledK_false"):
        added = s.state.get("added", 0.0)
        s.state["added"] = added - s.value("transf_scale_vary_0") * (abs(added) - s.value("transf_scaleC_1"))
    s.turn("transf_rotation2")
    if s.on("transf_function_enabledG_false"):
        last = s.on("analyticDE_enabled_false") or not s.within("C")
        s.measure(last=last, thin=True).write("return sqrt(maximum(x * x + y * y + z * z, 1e-30))")


def moved_absolutes(s: FormulaStep) -> None:
    """Absolute values of some coordinates, and an offset of them."""
    s.write(f"a, b, d = {s.point('transf_addition_constantP_000')}", "x, y, z = w")
    for axis, moved in zip("xyz", "abd", strict=True):
        if s.on(f"transf_function_enabledB{axis}_false"):
            own = axis if s.on(f"transf_function_enabled{axis}_false") else f"absolute({axis})"
            s.write(f"{axis} = {own} - {moved}")
    s.write("w = (x, y, z)")
