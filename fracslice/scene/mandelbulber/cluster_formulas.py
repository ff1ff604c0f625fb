"""Formulas of Mandelbulber whose solid is a loop of its own at each point: clusters of balls by reflections
and inversions (Lowe 2021), and a sponge of nearest corners.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .distances import repeated, turn
from .step_text import LEFT_OUT, OWN_SOLID, FormulaStep, UnknownError, known

LOWE = "Lowe 2021, github.com/TGlad: sphere clusters"


def window(d: FormulaStep, count: int, start: str, stop: str) -> str | None:
    """Condition that the iteration i is in some iterations of a loop; "" if all are, None if none is."""
    first, last = d.values.whole(start), d.values.whole(stop)
    if first >= min(last, count):
        return None
    parts = [f"(i > {first - 0.5})"] * (first > 0) + [f"(i < {last - 0.5})"] * (last < count)
    return " & ".join(parts)


def lettered(d: FormulaStep, count: int, letter: str) -> str | None:
    """`window` of the iterations of a letter."""
    own = f"_{letter}" if letter else ""
    return window(d, count, f"transf_start_iterations{own}", f"transf_stop_iterations{own}")


def both(*conditions: str) -> str:
    """All of some conditions, of which "" is none."""
    return " & ".join(condition for condition in conditions if condition)


def either(condition: str | None, first: str, second: str) -> str:
    """One of two texts by a `window`."""
    if condition is None or first == second:
        return second
    return first if condition == "" else f"where({condition}, {first}, {second})"


def once(s: FormulaStep) -> None:
    """Raise an error where a formula that moves the point is taken twice."""
    if not s.on("analyticDE_enabled_false"):
        if s.state.get("looped"):
            raise UnknownError(f"{s.values.place('formula')}: the loop of a formula in several iterations")
        s.state["looped"] = 1.0


class Packing(NamedTuple):
    """Balls around a unit ball at the middles of the faces of a dodecahedron or an icosahedron."""

    mirrors: list[np.ndarray]  # normals of the planes through the origin and the sides of a face
    middle: np.ndarray  # direction to the middle of the face
    distance: float  # of the centres of the balls
    radius: float  # of the balls
    free: float  # radius of the ball that is left in the middle


def planes(corners: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Normals of the planes through the origin and the sides of a polygon."""
    normals = [np.cross(p, q - p) for p, q in zip(corners, [*corners[1:], corners[0]], strict=True)]
    return [normal / np.linalg.norm(normal) for normal in normals]


def packing(s: FormulaStep, pentagons: bool) -> Packing:
    """Balls on the faces of a dodecahedron or of an icosahedron, by the golden ratio or another number."""
    ratio = s.value("transf_scale_2")
    if ratio <= 0:
        raise UnknownError(f"{s.values.place('transf_scale_2')}: transf_scale_2 {ratio:g}")
    phi = (1 + math.sqrt(5)) / ratio
    if pentagons:
        five = (1 / phi, 0, phi), (1, -1, 1), (phi, -1 / phi, 0), (phi, 1 / phi, 0), (1, 1, 1)
        corners, slack, size = [np.array(v) for v in five], "transf_scaleD_1", "transf_scaleB_1"
        middle = np.sum(corners, axis=0)
        angle, most = math.atan(middle[2] / middle[0]), 2.0
    else:
        three = (0, 1, phi), (0, -1, phi), (phi, 0, 1)
        corners, slack, size = [np.array(v) for v in three], "transf_scaleC_1", "transf_scaleA_1"
        middle = np.sum(corners, axis=0)
        angle, most = math.atan(phi / (1 + 2 * phi)), 4.0
    under = 1 / math.sin(angle) ** 2 - most
    if under <= 0:
        raise UnknownError(f"{s.values.place('transf_scale_2')}: transf_scale_2 {ratio:g}")
    radius = math.sqrt(most / under)
    distance = math.sqrt(1 + radius * radius)
    free = (distance - radius * s.value(slack)) * s.value(size)
    return Packing(planes(corners), middle / np.linalg.norm(middle), distance, radius, free)


def literal(value: float) -> str:
    """Text of a number that the geometry gives."""
    return repr(round(float(value), 15) + 0.0)


def reflect(d: FormulaStep, balls: Packing, letter: str, rounds: int, share: str) -> None:
    """Reflect into the pyramid over a face, a share of 0 or 1 of the way; `letter`: of the normals."""

    def body(inner: FormulaStep) -> None:
        for k in range(len(balls.mirrors)):
            a, b, c = (f"{letter}{axis}{k}" for axis in "xyz")
            inner.write(f"t = 2 * {share} * minimum({a} * x + {b} * y + {c} * z, 0)")
            inner.write(f"x, y, z = x - {a} * t, y - {b} * t, z - {c} * t")

    repeated(d, rounds, body)


def normals(d: FormulaStep, balls: Packing, letter: str) -> None:
    """Write the normals of the mirrors."""
    for k, normal in enumerate(balls.mirrors):
        d.write(f"{letter}x{k}, {letter}y{k}, {letter}z{k} = {', '.join(map(literal, normal))}")


def enlarge_all(d: FormulaStep, condition: str, factor: str) -> None:
    """Multiply the point and its stretch where a condition holds."""
    d.write(f"t = where({condition}, {factor}, 1)", "x, y, z, g = t * x, t * y, t * z, t * g")


def invert_at_face(d: FormulaStep, last: str, mixed: bool) -> None:
    """Invert in the ball of radius l around (e, f, h) what is in it, and the last point; `hit`: what was."""
    power = f"(l * l + (m - l * l) * {d.number('transf_scale_0')})" if mixed else "l * l"
    d.write("x, y, z = x - e, y - f, z - h", "s = maximum(x * x + y * y + z * z, 1e-30)")
    d.write(f"hit = (on > 0.5) & ((s < l * l) | ({last}))", f"t = where(hit, {power} / s, 1)")
    d.write("x, y, z, g = t * x + e, t * y + f, t * z + h, t * g", "s = x * x + y * y + z * z")


START = ("g, on, back, free, i = 1 + 0 * x, 1 + 0 * x, 1 + 0 * x, 0 * x, 0 * x",)
"""Stretch, 1 if the point is on its way, 1 if it is to be inverted, the radius left in the middle, and the
number of the iteration.
"""


def finish_cluster(s: FormulaStep, d: FormulaStep, size: str) -> None:
    """Distance to a ball, or within another ball around the start."""
    if s.on("transf_function_enabledC_false"):
        d.write(f"return maximum({size} / g, sqrt(p * p + q * q + r * r) - {d.number('transf_offsetR_1')})")
    else:
        d.write(f"return {size} / g")


@known(267, "Sphere Cluster", LOWE, LEFT_OUT, distance=OWN_SOLID)
def sphere_cluster(s: FormulaStep) -> None:
    """Balls in the gaps of balls on the faces of a polyhedron, and so on."""
    once(s)
    s.refuse(
        "transf_function_enabledO_false", "transf_function_enabledSw_false", "transf_function_enabledT_false"
    )
    d = s.measure(first=True, last=s.on("transf_function_enabledX_false"), slope=6)
    pentagons = s.on("transf_function_enabledD_false")
    balls, whole = packing(s, pentagons), s.on("transf_function_enabledK_false")
    count = s.values.whole("transf_int8_X")
    d.write("p, q, r = x, y, z", *START, f"k = {d.number('transf_scale_08')} + 0 * x")
    d.write(f"e, f, h = {', '.join(literal(balls.distance * v) for v in balls.middle)}")
    d.write(f"l, m = {literal(balls.radius)}, {literal(balls.free)}")
    normals(d, balls, "n")

    def body(inner: FormulaStep) -> None:
        inner.write(f"k = where(on > 0.5, {inner.number('transf_scale_1')} * k, k)")
        excess = inner.number("transf_offset_105")
        inner.write("s = x * x + y * y + z * z", f"far = (back * on > 0.5) & (s > {excess} * {excess})")
        if s.on("transf_function_enabledY_false"):
            inner.write("on = where(far, 0, on)")
        else:
            inner.write("x, y, z = where(far, 0, x), where(far, 0, y), where(far, 1e-15, z)")
            inner.write("s = where(far, 1e-30, s)")
        inner.write("free = where(on > 0.5, m, free)")
        if not whole:
            enlarge_all(inner, "back * on > 0.5", "m / maximum(s, 1e-30)")
            inner.write("back = where(on > 0.5, 0, back)")
        reflect(inner, balls, "n", 2 if pentagons else 3, "on")
        invert_at_face(inner, f"i > {count - 1.5}", False)
        inner.write("near = on > 0.5" if whole else "near = hit & (s < m * m)")
        enlarge_all(inner, "near", "1 / (m * k)")
        if not whole:
            inner.write("back = where(near, 1, back)")
        enlarge_all(inner, "on > 0.5", inner.number("transf_scaleF_1"))
        inner.write("i = i + 1")

    repeated(d, count, body)
    size = "minimum(k, 1)" if s.on("transf_function_enabledE_false") else "k"
    finish_cluster(s, d, f"(sqrt(x * x + y * y + z * z) - free * {d.number('transf_scaleE_1')} * {size})")


def later_cluster(s: FormulaStep) -> FormulaStep:
    """Loop of the second and third kind, in which each iteration has a polyhedron of its own."""
    once(s)
    s.refuse("transf_function_enabledO_false", "transf_function_enabledA_false")
    mixed = s.on("transf_function_enabledM_false")
    d = s.measure(first=True, last=s.on("transf_function_enabledX_false"), slope=9 if mixed else 6)
    count = s.values.whole("transf_int_16")
    five, three = packing(s, True), packing(s, False)
    triangles = lettered(s, count, "A")
    d.write("p, q, r = x, y, z", *START, f"k = {d.number('transf_scale_08')} + 0 * x")
    enlarge_all(d, "on > 0.5", d.number("transf_scaleG_1"))
    if triangles != "":
        normals(d, five, "n")
    if triangles is not None:
        normals(d, three, "m")

    def body(inner: FormulaStep) -> None:
        fold_and_move(inner, count)
        polyhedron(inner, five, three, triangles)
        check(inner, count)
        inner.write("free = where(on > 0.5, m, free)")
        if triangles != "":
            reflect(inner, five, "n", 2, either(triangles, "0", "on"))
        if triangles is not None:
            reflect(inner, three, "m", 3, either(triangles, "on", "0"))
        invert_at_face(inner, f"i > {count - 1.5}", mixed)
        back_to_middle(inner, count)
        inner.write(f"k = where(on > 0.5, {inner.number('transf_scale_1')} * k, k)")
        enlarge_all(inner, "on > 0.5", inner.number("transf_scaleF_1"))
        inner.write("i = i + 1")

    repeated(d, count, body)
    return d


def polyhedron(d: FormulaStep, five: Packing, three: Packing, triangles: str | None) -> None:
    """Centre, radius and gap of the balls of an iteration."""
    pairs = zip(five.distance * five.middle, three.distance * three.middle, strict=True)
    d.write(
        *(
            f"{p} = {either(triangles, literal(b), literal(a))}"
            for p, (a, b) in zip("efh", pairs, strict=True)
        )
    )
    d.write(f"l = {either(triangles, literal(three.radius), literal(five.radius))}")
    d.write(f"m = {either(triangles, literal(three.free), literal(five.free))}")


def fold_and_move(d: FormulaStep, count: int) -> None:
    """Absolute values, each with an offset."""
    now = window(d, count, "transf_start_iterations_P", "transf_stop_iterations_P1")
    if now is None or not d.on("transf_function_enabledP_false"):
        return
    d.write(f"a, b, c = {d.point('transf_offsetA_000')}")
    for p, a in zip("xyz", "abc", strict=True):
        if d.on(f"transf_function_enabledC{p}_false"):
            d.write(f"{p} = where({both('(on > 0.5)', now)}, absolute({p}) + {a}, {p})")


def check(d: FormulaStep, count: int) -> None:
    """End the way of points that are far out where they are to be inverted, and invert the others."""
    now, inverts = lettered(d, count, "C"), lettered(d, count, "B")
    if now is None:
        return
    d.write("s = x * x + y * y + z * z")
    if not d.on("transf_function_enabledB_false"):
        excess = d.number("transf_offset_105")
        d.write(f"on = where({both('(back * on > 0.5)', f'(s > {excess} * {excess})', now)}, 0, on)")
    if inverts is not None:
        enlarge_all(d, both("(back * on > 0.5)", now, inverts), "m / maximum(s, 1e-30)")
        d.write(f"back = where({both('(on > 0.5)', now, inverts)}, 0, back)")


def back_to_middle(d: FormulaStep, count: int) -> None:
    """Enlarge the gap in the middle to the unit ball where the point is in it, or always."""
    inverts, scales = lettered(d, count, "B"), lettered(d, count, "D")
    if inverts is not None:
        size = "m" if d.on("transf_function_enabledT_false") else "m * k"
        near = f"(sqrt(s) < {size} * {d.number('transf_radius_1')})"
        d.write(f"near = {both('hit', near, inverts)}")
        enlarge_all(d, "near", "1 / (m * k)")
        d.write("back = where(near, 1, back)")
    if scales is None:
        return
    if d.on("transf_function_enabledI_false"):
        enlarge_all(d, both("(back * on > 0.5)", scales), "1 / (m * k)")
    elif inverts != "":
        most = [] if inverts is None else [f"({either(inverts, '0', '1')} > 0.5)"]
        enlarge_all(d, both("(on > 0.5)", scales, *most), "1 / (m * k)")


@known(268, "Sphere Cluster V2", LOWE, LEFT_OUT, distance=OWN_SOLID)
def sphere_cluster_2(s: FormulaStep) -> None:
    """As the first, with a polyhedron for each iteration."""
    d = later_cluster(s)
    size = "minimum(k, 1)" if s.on("transf_function_enabledE_false") else "k"
    finish_cluster(s, d, f"(sqrt(x * x + y * y + z * z) - free * {d.number('transf_scaleE_1')} * {size})")


@known(275, "Sphere Cluster V3", LOWE, LEFT_OUT, distance=OWN_SOLID)
def sphere_cluster_3(s: FormulaStep) -> None:
    """As the second, measured with a box."""
    d = later_cluster(s)
    d.write(f"a, b, c = {d.point('transf_offset_000')}", "x, y, z = x - a, y - b, z - c")
    if not s.on("transf_function_enabledF_false"):
        d.write("x, y, z = absolute(x), absolute(y), absolute(z)")
    d.write(f"r = r + {d.number('transf_offsetF_0')}")
    finish_cluster(s, d, f"(maximum(x, maximum(y, z)) - {d.number('transf_offset_0')} - free * k)")


CORNERS = (
    ("transf_offsetA_111", "A", "transf_offsetA_000"),
    ("transf_offset_101", "E", "transf_offsetA_200"),
    ("transf_offset_110", "D", "transf_offsetF_000"),
    ("", "F", "transf_offset_200"),
)
"""Corners of the sponge: names of vectors, and of those that stand for them in the iterations of a letter."""


@known(
    271,
    "Menger V7",
    "Menger 1926; nearest corners by McLaren 2021, fractalforums.org",
    LEFT_OUT,
    distance=OWN_SOLID,
)
def menger_7(s: FormulaStep) -> None:
    """A sponge in a loop, which subtracts the nearest of four vectors."""
    once(s)
    d = s.measure(first=True, last=s.on("transf_function_enabledX_false"))
    k, count = d.number("transf_scale_015"), s.values.whole("transf_int8_X")
    d.write(
        "p, q, r, on, i = x, y, z, 1 + 0 * x, 0 * x", f"g, x, y, z = {k} + 0 * x, {k} * x, {k} * y, {k} * z"
    )
    repeated(d, count, lambda inner: nearest_corner(inner, count))
    cube, ball = "maximum(absolute(x), maximum(absolute(y), absolute(z)))", "sqrt(x * x + y * y + z * z)"
    if s.on("transf_function_enabledO_false"):
        a, b, t = (d.number(name) for name in ("transf_offsetA_0", "transf_offsetB_0", "transf_scale_0"))
        d.write(f"m = {ball} - {a}", f"m = m + ({cube} - {b} - m) * {t}")
    else:
        size = ball if s.on("transf_function_enabledSw_false") else cube
        d.write(f"m = {size} - {d.number('transf_offset_0')}")
    if s.on("transf_function_enabledY_false"):
        d.write(f"return maximum(m / g, sqrt(p * p + q * q + r * r) - {d.number('transf_offsetR_1')})")
    else:
        d.write("return m / g")


def nearest_corner(d: FormulaStep, count: int) -> None:
    """One iteration of the sponge, of points on their way."""

    def on(letter: str) -> str | None:
        return lettered(d, count, letter) if d.on(f"transf_function_enabled{letter}_false") else None

    d.write("u, v, w = x, y, z", "x, y, z = absolute(x), absolute(y), absolute(z)")
    sorted_corner(d, count)
    d.write(*(f"{p} = where(on > 0.5, {p}, {q})" for p, q in zip("xyz", "uvw", strict=True)))
    if (stops := on("I")) is not None:
        d.write(f"on = where({both('(x < 1.5)', stops)}, 0, on)")
    for k, (name, letter, other) in enumerate(CORNERS):
        first, second = d.vector(other), d.vector(name) if name else (0.0, 0.0, 0.0)
        pairs = zip(first, second, strict=True)
        for p, (a, b) in zip("xyz", pairs, strict=True):
            d.write(f"{p}{k} = {p} - {either(on(letter), literal(a), literal(b))}")
        d.write(f"d{k} = x{k} * x{k} + y{k} * y{k} + z{k} * z{k}")
    d.write("m = minimum(minimum(d0, d1), minimum(d2, d3))")
    inner, ends = on("G"), on("J")
    for p in "xyz":
        rest = either(inner, f"{p}3", either(ends, f"{p}3", p))
        d.write(f"u = where(d0 > m, where(d1 > m, where(d2 > m, {rest}, {p}2), {p}1), {p}0)")
        d.write(f"{p} = where(on > 0.5, u, {p})")
    if any(d.vector("transf_rotation2")):
        if ends is not None or lettered(d, count, "T") != "":
            raise UnknownError(f"{d.values.place('transf_rotation2')}: transf_rotation2 in some iterations")
        turn(d, "transf_rotation2")
    d.write(
        f"t = where(on > 0.5, {d.number('transf_scale_3')}, 1)", "x, y, z, g = t * x, t * y, t * z, t * g"
    )
    if ends is not None and inner != "":
        d.write(f"on = where({both('(d0 > m) & (d1 > m) & (d2 > m)', ends)}, 0, on)")
    d.write("i = i + 1")


def sorted_corner(d: FormulaStep, count: int) -> None:
    """An offset, a turn, and the coordinates in order; in some iterations not y and z."""
    moves = window(d, count, "transf_start_iterations_P", "transf_stop_iterations_P1")
    if moves is not None and d.on("transf_function_enabledP_false"):
        d.write(f"a, b, c = {d.point('transf_offset_000')}")
        d.write(*(f"{p} = {p} + {either(moves, a, '0')}" for p, a in zip("xyz", "abc", strict=True)))
    if any(d.vector("transf_rotation")):
        if lettered(d, count, "R") != "":
            raise UnknownError(f"{d.values.place('transf_rotation')}: transf_rotation in some iterations")
        turn(d, "transf_rotation")
    for p, q in ("xy", "xz"):
        d.write(f"{p}, {q} = maximum({p}, {q}), minimum({p}, {q})")
    sorts = lettered(d, count, "") if d.on("transf_function_enabled") else None
    if sorts is not None:
        first, second = either(sorts, "maximum(y, z)", "y"), either(sorts, "minimum(y, z)", "z")
        d.write(f"y, z = {first}, {second}")
