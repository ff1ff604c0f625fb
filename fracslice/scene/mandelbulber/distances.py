"""Texts of distances that formulas of Mandelbulber measure with, and turns and folds before them: statements
about x, y and z, and d the step that they are written to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .folds import sector_lines, switched
from .kleinian_formulas import SLOPE
from .step_text import FormulaStep

RADIANS = "0.017453292519943295"
"""A degree."""


def repeated(d: FormulaStep, count: int, body: Callable[[FormulaStep], None]) -> None:
    """Write statements that are repeated."""
    inner = FormulaStep(d.values, d.index, parameters=d.parameters)
    body(inner)
    if count:
        d.write(f"for n in range({count}):", *("  " + line for line in inner.lines))


@contextmanager
def moved(s: FormulaStep, d: FormulaStep) -> Iterator[FormulaStep]:
    """What changes the coordinates that are measured: the step if the file says so, else the distance."""
    if not switched(s, "Zc_false", "Zc"):
        yield d
        return
    s.write("x, y, z = w")
    yield s
    s.write("w = (x, y, z)")


def absolutes(d: FormulaStep, *switches: str) -> None:
    """Absolute values of the coordinates whose switches are on."""
    for axis, switch in zip("xyz", switches, strict=True):
        if d.on(f"transf_function_enabled{switch}"):
            d.write(f"{axis} = absolute({axis})")


def move(d: FormulaStep, name: str, sign: str = "+") -> None:
    """Add a vector."""
    if any(d.vector(name)):
        d.write(f"a, b, c = {d.point(name)}", f"x, y, z = x {sign} a, y {sign} b, z {sign} c")


def enlarge_by(d: FormulaStep, name: str) -> None:
    """Multiply by a number."""
    if d.value(name) != 1:
        d.write(f"k = {d.number(name)}", "x, y, z = k * x, k * y, k * z")


def turn(d: FormulaStep, name: str) -> None:
    """Turn about x, then y, then z, by the components of a vector in degrees; see `FormulaStep.turn`."""
    planes = (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y"))
    for (axis, p, q), angle in zip(planes, d.vector(name), strict=True):
        if angle:
            d.write(f"t = {RADIANS} * {d.parameter(f'{name}_{axis}', angle)}", "ct, st = cos(t), sin(t)")
            d.write(f"{p}, {q} = ct * {p} - st * {q}, st * {p} + ct * {q}")


def box_distance(d: FormulaStep, size: tuple[str, str, str], round_: str = "0") -> None:
    """Distance to a box of half sizes."""
    a, b, c = size
    d.write(f"x, y, z = absolute(x) - {a}, absolute(y) - {b}, absolute(z) - {c}")
    d.write(
        "m = minimum(maximum(x, maximum(y, z)), 0)", "x, y, z = maximum(x, 0), maximum(y, 0), maximum(z, 0)"
    )
    d.write(f"return sqrt(x * x + y * y + z * z) + m - {round_}")


def ring(d: FormulaStep, radius: str, tube: str, square: bool, axes: str = "xyz") -> str:
    """Distance to a torus about the last of the axes; the tube may be square."""
    x, y, z = tuple(axes)
    t = f"sqrt({x} * {x} + {y} * {y}) - {radius}"
    if square:
        return f"maximum(absolute({t}), absolute({z})) - {tube}"
    d.write(f"t = {t}")
    return f"sqrt(t * t + {z} * {z}) - {tube}"


def rounded_cylinder(d: FormulaStep, radius: str, tube: bool = False) -> str:
    """Distance to a cylinder or a tube whose radius falls with the height or its square."""
    height = "z" if switched(d, "M_false", "M") else "absolute(z)"
    d.write(f"t, h = {height}, absolute(z) - {d.number('transf_offsetA_1')}")
    if switched(d, "T_false", "T"):
        d.write("t = t * t")
    d.write("r = sqrt(x * x + y * y)", f"k = r - {d.number(radius)}")
    if tube:
        d.write(f"k = absolute(k) - {d.number('transf_offset_0')}")
    d.write(f"k = k + {d.number('transf_scale_0')} * t")
    beyond = "r" if switched(d, "N_false", "N") else "maximum(k, 0)"
    d.write(f"m = minimum(maximum(k, h) - {d.number('transf_offsetR_0')}, 0)")
    if switched(d, "O_false", "O"):
        return "sqrt(k * k + h * h) + m"
    d.write(f"u, h = {beyond}, maximum(h, 0)")
    return "sqrt(u * u + h * h) + m"


def hexagons(d: FormulaStep, square: bool) -> None:
    """Distance to a grid of hexagons, in the plane of x and y, of square or round wires."""
    a = d.number("transf_scale_1")
    d.write(f"z = z / {d.number('transf_scaleF_1')}", f"v = absolute(y - {a} * floor(y / {a} + 0.5))")
    d.write(f"k = 1.5 * {a} / {SLOPE}", "u = absolute(x - k * floor(x / k + 0.5))")
    d.write(f"t = minimum(maximum(v, u * {SLOPE} + 0.5 * v) - 0.5 * {a}, v)")
    wire = "maximum(absolute(t), absolute(z))" if square else "sqrt(t * t + z * z)"
    d.write(f"return {wire} - {d.number('transf_offset_0005')}")


def frame(d: FormulaStep, hollow: bool) -> None:
    """Distance to the edges of a box, with a thickness along each axis; x, y and z count from its faces."""
    for p, q, name in (("x", "u", "p01"), ("y", "v", "A_p01"), ("z", "s", "B_p01")):
        e = d.number(f"transf_offset{'_' if name == 'p01' else ''}{name}")
        d.write(f"{q} = absolute({p}) - {e}" if hollow else f"{q} = absolute({p} + {e}) - {e}")
    parts = []
    for k, (p, q, r) in enumerate((("x", "v", "s"), ("u", "y", "s"), ("u", "v", "z"))):
        d.write(f"l, m, n = maximum({p}, 0), maximum({q}, 0), maximum({r}, 0)")
        d.write(f"d{k} = sqrt(l * l + m * m + n * n) + minimum(maximum({p}, maximum({q}, {r})), 0)")
        parts.append(f"d{k}")
    d.write(f"return minimum(minimum({parts[0]}, {parts[1]}), {parts[2]})")


def meridians(d: FormulaStep, count: str) -> None:
    """Fold the angle about z, from the y axis on, into half of a sector."""
    d.write("x = absolute(x)", *sector_lines("yx", d.parameter(count, max(d.values.whole(count), 1))))


def globe(d: FormulaStep, axes: str) -> None:
    """Distance to a ring about the last of the axes, an equator and two circles of latitude."""
    r = d.number("transf_offsetR_1")
    square = d.on("transf_function_enabledJ_false")
    d.write(f"m = {ring(d, r, d.number('transf_offset_p01'), square, axes)}")
    if d.on("transf_function_enabledM_false"):
        square = d.on("transf_function_enabledN_false")
        d.write(f"m = minimum(m, {ring(d, r, d.number('transf_offsetA_p01'), square)})")
    if d.on("transf_function_enabledO_false"):
        h = d.number("transf_offset_05")
        d.write(f"z = absolute(z) - {h}", f"r = sqrt(maximum({r} * {r} - {h} * {h}, 0))")
        square = d.on("transf_function_enabledP_false")
        d.write(f"m = minimum(m, {ring(d, 'r', d.number('transf_offsetB_p01'), square)})")
    d.write("return m")
