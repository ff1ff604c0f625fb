"""Formulas of Mandelbulber in coordinates that are wound about an axis: helices and rings, and sponges along
them.
"""

from __future__ import annotations

from .distances import absolutes, enlarge_by, move, moved, repeated, turn
from .folds import PI, polygon
from .step_text import LEFT_OUT, OWN_SOLID, FormulaStep, known

TURNS = "0.15915494309189535"
"""1 / (2 pi)."""

HELIX = "McLaren 2021, fractalforums.org: sin cos helix"


# Statements about x, y and z, the angle u about the axis in turns, and the distance r to the axis.


def unroll(d: FormulaStep, radius: str, angle: str = "atan2(y, x)") -> None:
    """Take the angle, and the distance to a circle about the axis as y."""
    d.write(f"u, r = {TURNS} * {angle}, sqrt(maximum(x * x + y * y, 1e-30))", f"y = r - {d.number(radius)}")


def pitch(d: FormulaStep, height: str, starts: str) -> None:
    """Repeat space along z, higher with the angle."""
    a = d.number(height)
    d.write(f"t = z - {a} * u * {d.number(starts)} + 0.5 * {a}", f"z = t - {a} * floor(t / {a}) - 0.5 * {a}")


def along(d: FormulaStep, count: str, flat: bool) -> list[str]:
    """Take the angle, repeated, or a number as x, times another; return how steep that is."""
    n, start, factor = d.number(count), d.number("transf_offset_1"), d.number("transf_scaleG_1")
    if flat:
        d.write(f"x = {factor} * {start} + 0 * x")
        return []
    d.write(*repeat_turns("x", n, start), f"x = {factor} * x")
    return [f"{TURNS} * absolute({n} * {factor}) / r"]


def repeat_turns(axis: str, count: str, start: str) -> tuple[str, str]:
    """Statements for the angle times a number, repeated from -1 to 1."""
    return f"t = {count} * u + {start}", f"{axis} = t - 2 * floor(0.5 * t) - 1"


def twist(d: FormulaStep, on: bool, scale: str, steep: list[str]) -> None:
    """Turn and reflect y or x, and z, with the angle if that is on; g becomes a bound of the stretch."""
    if on:
        steep.append(f"0.5 * absolute({d.number('transf_int_2')}) * sqrt(x * x + y * y + z * z) / r")
    d.write(f"g = {d.number(scale)} * ({' + '.join(steep)})")
    if not on:
        return
    p = "x" if d.on("transf_function_enabledK_false") else "y"
    a, b = ("z", p) if d.on("transf_function_enabledSw_false") else (p, "z")
    d.write(f"t = {PI} * {d.number('transf_int_2')} * u", "k, m = cos(t), sin(t)")
    d.write(f"{p}, z = k * {b} + m * {a}, k * {a} - m * {b}")
    if d.on("transf_function_enabledP_false"):
        d.write("x = z")


def sponge(d: FormulaStep) -> None:
    """A sponge's folds and scale."""
    s, o = d.number("transf_scale_3"), d.number("transf_offsetA_0")
    d.write("x, y, z = absolute(x), absolute(y), absolute(z)")
    turn(d, "transf_rotation")
    for p, q in ("xy", "xz", "yz"):
        d.write(f"{p}, {q} = maximum({p}, {q}), minimum({p}, {q})")
    d.write(f"a, b, c = {d.point('transf_offsetA_111')}", f"k = {s} - 1", f"m = k * c + {o}")
    d.write(
        f"x, y, z = {s} * x - k * a, {s} * y - k * b, {s} * z - k * c", "z = where(z < -0.5 * m, z + m, z)"
    )
    d.write(f"g = {s} * g")


def is_thin(s: FormulaStep) -> bool:
    """True if what is measured has no inside: distances outside a box, without a thickness."""
    return s.value("transf_offset_0005") <= 0


def outside(d: FormulaStep) -> None:
    """Coordinates p, q, s outside a box."""
    names = ("transf_offsetA_1", "transf_offset_01", "transf_offset_p1")
    for p, x, name in zip("pqs", "xyz", names, strict=True):
        d.write(f"{p} = maximum(absolute({x}) - {d.number(name)}, 0)")


def flat_root(d: FormulaStep) -> str:
    """Root of two coordinates or of their squares."""
    inner = "p + q" if d.on("transf_function_enabledB_false") else "p * p + q * q"
    return f"sqrt({inner}) - {d.number('transf_offset_0')}"


def wired(d: FormulaStep) -> None:
    """Distance to a box, or to an edge along z of it."""
    outside(d)
    if not d.on("transf_function_enabledC_false"):
        round_ = d.on("transf_function_enabledT_false")
        d.write(f"m = {'sqrt(p * p + q * q + s * s)' if round_ else 'maximum(p, maximum(q, s))'}")
    else:
        d.write(f"m = {flat_root(d)}")
        if d.on("transf_function_enabledM_false"):
            d.write("m = maximum(absolute(m), s)")
        if d.on("transf_function_enabledS_false"):
            d.write("m = sqrt(m * m + s * s)")
    d.write(f"return (m - {d.number('transf_offset_0005')}) / g")


def reflected(d: FormulaStep) -> None:
    """A vector less the absolute coordinates."""
    if d.on("transf_function_enabled_false"):
        d.write(f"a, b, c = {d.point('transf_offset_000')}")
        d.write("x, y, z = a - absolute(x), b - absolute(y), c - absolute(z)")


def sponge_coil(s: FormulaStep, pitched: bool, twisted: bool, count: str) -> None:
    """A sponge in coordinates wound about the z axis; g is the stretch."""
    d = s.measure(thin=is_thin(s))
    d.write("g = 1")
    with moved(s, d) as t:
        if s.on("transf_function_enabledF_false") and not pitched:
            absolutes(t, "Bx", "By_false", "Bz_false")
            move(t, "transf_offsetA_000")
        enlarge_by(t, "transf_scale_2")
        unroll(t, "transf_scale_main_2")
        steep = ["1"]
        if pitched:
            pitch(t, "transf_offset_4", "transf_int_1")
            steep.append(f"{TURNS} * absolute(transf_offset_4 * transf_int_1) / r")
        if s.on("transf_function_enabledAy"):
            steep += along(t, "transf_scale_16", s.on("transf_function_enabledAy_false"))
        else:
            t.write(f"x = {t.number('transf_scaleG_1')} * x")
        twist(t, twisted, "transf_scale_2", steep)
        if twisted and pitched and s.on("transf_function_enabledE_false"):
            t.write("x = y")
        reflected(t)
        repeated(t, s.values.whole(count), sponge)
    wired(d)


@known(1638, "T>DIFS Helix Menger", HELIX, LEFT_OUT, distance=OWN_SOLID)
def helix_menger(s: FormulaStep) -> None:
    """A sponge along a helix."""
    s.refuse("transf_function_enabledJ_false")
    pitched, twisted = s.on("transf_function_enabledAx"), s.on("transf_function_enabledAz")
    sponge_coil(s, pitched, twisted, "transf_int_16")


@known(1640, "T>DIFS Torus Menger", HELIX, LEFT_OUT, distance=OWN_SOLID)
def torus_menger(s: FormulaStep) -> None:
    """A sponge along a ring."""
    sponge_coil(s, False, s.on("transf_function_enabledAz_false"), "transf_int8_X")


@known(1636, "T>DIFS Helix V2", HELIX, LEFT_OUT, distance=OWN_SOLID)
def helix_2(s: FormulaStep) -> None:
    """A box along a helix."""
    clipped = s.on("transf_function_enabledJ_false")
    if clipped and s.index:
        s.refuse("transf_function_enabledJ_false")
    d = s.measure(clipped, s.on("analyticDE_enabled_false"), is_thin(s), slope=2)
    if clipped:
        s.refuse("transf_function_enabledZc_false")
        e, h = d.number("transf_offsetE_0"), d.number("transf_offset_2")
        d.write(f"clip = absolute(z - {e}) - {h}")
    d.write("g = 1")
    with moved(s, d) as t:
        enlarge_by(t, "transf_scale_1")
        unroll(t, "transf_radius_1")
        t.write(f"y = y + {t.number('transf_scaleC_0')} * z")
        steep = [f"1 + absolute({t.number('transf_scaleC_0')})"]
        if s.on("transf_function_enabledAx"):
            pitch(t, "transf_offsetA_2", "transf_int_1")
            steep.append(f"{TURNS} * absolute(transf_offseta_2 * transf_int_1) / r")
        if s.on("transf_function_enabledAy"):
            steep += along(t, "transf_scaleA_2", not s.on("transf_function_enabledAy_false"))
        else:
            t.write(f"x = {t.number('transf_scaleG_1')} * x")
        twist(t, s.on("transf_function_enabledAz"), "transf_scale_1", steep)
        if s.on("transf_function_enabledD_false"):
            t.write("x, z = z, x")
        reflected(t)
    m = f"({box_or_edge(d)} - {d.number('transf_offset_0005')}) / g"
    d.write(f"return maximum(clip, {m})" if clipped else f"return {m}")


def box_or_edge(d: FormulaStep) -> str:
    """Distance to a box, or to an edge along z of it, with ends of several forms."""
    outside(d)
    if not d.on("transf_function_enabledC_false"):
        sharp = d.on("transf_function_enabledT_false")
        return "maximum(p, maximum(q, s))" if sharp else "sqrt(p * p + q * q + s * s)"
    d.write(f"m = {flat_root(d)}")
    ends = {
        "N": "sqrt(m * m + s)",
        "O": "sqrt(m * m + s * s)",
        "M": "maximum(absolute(m), absolute(z))",
        "S": "maximum(absolute(m), z * z)",
    }
    for letter, text in ends.items():
        if d.on(f"transf_function_enabled{letter}_false"):
            d.write(f"m = {text}")
    return "m"


@known(1149, "T>SinCos Helix", HELIX, LEFT_OUT)
def sincos_helix(s: FormulaStep) -> None:
    """Take the angle about an axis, the distance to a circle, and the height, which may rise by the angle."""
    if s.on("transf_function_enabledP_false"):
        helix_folds(s)
    s.write("x, y, z = w")
    if s.on("transf_function_enabledSw_false"):
        s.write("x, y = y, x")
    if s.on("transf_function_enabledS_false"):
        s.write("x, z = z, x")
    enlarge_by(s, "transf_scale_1")
    axes = "y, x" if s.on("transf_function_enabledO_false") else "x, y"
    s.write(f"u = {TURNS} * {s.number('transf_scaleA_1')} * atan2({axes})")
    if s.on("transf_function_enabled"):
        s.write(f"y = sqrt(maximum(x * x + y * y, 1e-30)) - {s.number('transf_scale_015')}")
    if s.on("transf_function_enabledA_false"):
        s.write(f"x, y = x + {s.number('transf_scaleB_0')} * z, y + {s.number('transf_scaleC_0')} * z")
    if s.on("transf_function_enabledAx"):
        pitch(s, "transf_offset_4", "transf_int_1")
    if s.on("transf_function_enabledAw"):
        n, start = s.number("transf_scale_16"), s.number("transf_offsetR_1")
        s.write(
            *(repeat_turns("x", n, start) if s.on("transf_function_enabledAy") else [f"x = {start} + 0 * x"])
        )
    s.refuse("transf_function_enabledAz_false")
    if s.on("transf_function_enabledM_false") and s.during(
        "transf_start_iterationsTM", "transf_stop_iterationsTM_1"
    ):
        tile_heights(s)
    if s.on("transf_function_enabledJ_false") and s.during(
        "transf_start_iterations_T", "transf_stop_iterationsT_1"
    ):
        s.write("cx, cy, cz = c")
        if s.on("transf_function_enabledE_false"):
            s.write(f"z = maximum(cz - {s.number('transf_offsetE_0')}, z)")
        if s.on("transf_function_enabledF_false"):
            s.write(f"z = minimum(cz + {s.number('transf_offsetF_0')}, -z)")
    s.write("w = (x, y, z)")


def helix_folds(s: FormulaStep) -> None:
    """Absolute values, polygons' folds and a turn, in their iterations."""
    if s.during("transf_start_iterations_P", "transf_stop_iterations_P1"):
        s.write("x, y, z = w")
        for axis in "xyz":
            sign = "-" if s.on(f"transf_function_enabledB{axis}_false") else ""
            if s.on(f"transf_function_enabled{axis}_false"):
                s.write(f"{axis} = {sign}absolute({axis})")
        s.write("w = (x, y, z)")
        s.add("transf_addition_constantA_000")
    if s.during("transf_start_iterations_C", "transf_stop_iterations_C1"):
        for axis, axes in zip("xyz", ("xy", "yz", "zx"), strict=True):
            if s.on(f"transf_function_enabledC{axis}_false"):
                polygon(s, axes, f"transf_int8_{axis.upper()}")
        s.add("transf_addition_constant")
    if s.during("transf_start_iterations_R", "transf_stop_iterations_R1"):
        s.turn("transf_rotation")


def tile_heights(s: FormulaStep) -> None:
    """Repeat the height between two limits, as absolute values up to another."""
    a, b = s.number("transf_offset_2"), s.number("transf_offset_1")
    high, low = s.number("transf_scaleA_1"), s.number("transf_offsetT_1")
    s.write(f"t = z - {a} * floor(z / {a} + 0.5)", f"t = maximum(minimum(absolute(t), {b}), -{b})")
    s.write(f"z = where((z < ({high} + 0.5) * {a}) & (z > -({low} + 0.5) * {a}), t, z)")
