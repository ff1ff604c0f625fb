"""Folds that formulas of several families have in common."""

from __future__ import annotations

from collections.abc import Sequence

from .step_text import FormulaStep

PI = "3.141592653589793"


def switched(s: FormulaStep, name: str, letter: str) -> bool:
    """True if a switch is on in the iterations of a letter."""
    return s.on(f"transf_function_enabled{name}") and s.within(letter)


def absolute(s: FormulaStep, *switches: str) -> None:
    """Absolute value of the coordinates whose switches are on."""
    absolute_of(s, [s.on(switch) for switch in switches])


def absolute_of(s: FormulaStep, on: Sequence[bool]) -> None:
    """Absolute value of some coordinates."""
    if all(on):
        s.write("w = positive(w)")
    elif any(on):
        parts = (f"absolute({axis})" if flag else axis for axis, flag in zip("xyz", on, strict=True))
        s.write("x, y, z = w", f"w = ({', '.join(parts)})")


def differences(s: FormulaStep, vectors: Sequence[str], one: str, two: str) -> None:
    """|x + a| - |x - b| - k x of three vectors by name, without the terms whose switches are off.

    `one`, `two`: beginnings of the names of the switches.
    """
    parts = []
    for p, a, b, k in zip("xyz", *map(s.vector, vectors), strict=True):
        first = f"absolute({p} + {s.parameter(f'a_{p}', a)})" if s.on(one + p) else "0"
        second = f"absolute({p} - {s.parameter(f'b_{p}', b)})" if s.on(two + p) else "0"
        parts.append(f"{first} - {second} - {s.parameter(f'k_{p}', k)} * {p}")
    s.write("x, y, z = w", f"w = ({', '.join(parts)})")


def polygon(s: FormulaStep, axes: str, count: str) -> None:
    """Fold the angle in the plane of two axes into a sector of a polygon."""
    sector(s, axes, s.parameter(count, max(s.values.whole(count), 1)), "0")


def sector(s: FormulaStep, axes: str, count: str, turn: str) -> None:
    """Fold an angle in a plane, which is turned before, into half of a sector."""
    s.write("x, y, z = w", *sector_lines(axes, count, turn), "w = (x, y, z)")


def sector_lines(axes: str, count: str, turn: str = "0") -> Sequence[str]:
    """Statements for |fmod(angle + k, 2 k) - k| of an angle in a plane."""
    first, second = axes[0], axes[1]
    start = f"atan2({second}, {first})" if turn == "0" else f"atan2({second}, {first}) + {turn}"
    return (
        f"k = {PI} / {count}",
        f"t = {start} + k",
        "t = t - 2 * k * where(t < 0, -floor(-t / (2 * k)), floor(t / (2 * k)))",
        "t = absolute(t - k)",
        f"r = sqrt(maximum({first} * {first} + {second} * {second}, 1e-30))",
        f"{first} = r * cos(t)",
        f"{second} = r * sin(t)",
    )


def symmetric(s: FormulaStep) -> None:
    """Absolute values, reflections in three diagonal planes, in part, and an offset."""
    absolute(s, *(f"transf_function_enabledB{axis}" for axis in "xyz"))
    diagonals(s)
    s.add("transf_offsetA_000")


def diagonals(s: FormulaStep) -> None:
    """Reflections in three diagonal planes, in part."""
    shares = dict(zip("xyz", s.vector("transf_addition_constant_0555"), strict=True))
    for name, first, second in (("x", "x", "z"), ("y", "x", "y"), ("z", "y", "z")):
        if s.on(f"transf_function_enabledA{name}"):
            k = s.parameter(f"transf_addition_constant_0555_{name}", shares[name])
            s.write("x, y, z = w", f"t = 2 * {k} * minimum({first} - {second}, 0)")
            s.write(f"{first} = {first} - t", f"{second} = {second} + t", "w = (x, y, z)")


MANDALAY = (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y"))
"""Order of the coordinates in each of the three parts of a Mandalay fold."""


def mandalay(s: FormulaStep, serial: bool) -> None:
    """Folds of a Mandalay box; serial ones take the coordinates of those before."""
    f, g = s.point("transf_addition_constant_0555"), s.point("transf_offsetA_000")
    s.write(f"fx, fy, fz = {f}", f"gx, gy, gz = {g}", "x, y, z = w")
    s.write("ax, ay, az = absolute(x), absolute(y), absolute(z)", "qx, qy, qz = ax, ay, az")
    for p, q, r in MANDALAY:
        a = "q" if serial else "a"
        s.write(f"u, v = {a}{p}, maximum({a}{q}, {a}{r})")
        s.write(f"t, m = u - 2 * f{p}, v - 4 * f{p}", f"m = maximum(absolute(t + f{p}) - f{p}, m)")
        s.write(f"q{p} = minimum(minimum(m, maximum(t - g{p}, v)), u)")
    s.write(*(f"{p} = where({p} < 0, -q{p}, q{p})" for p in "xyz"), "w = (x, y, z)")


def bulge(s: FormulaStep, limits: str, shares: str) -> None:
    """Push coordinates that were folded at limits towards the middle, by shares of their squares."""
    s.write(f"a, b, d = {s.point(limits)}", f"u, v, r = {s.point(shares)}")
    s.write("x, y, z = w")
    for p, a, k in (("x", "a", "u"), ("y", "b", "v"), ("z", "d", "r")):
        s.write(f"t, q = absolute({p}), 2 * absolute({a}) - absolute({p})")
        s.write(f"m = where(t < {a}, t * t, where((t > {a}) & (q > 0), q * q, 0)) / maximum(2 * {a}, 1e-18)")
        s.write(f"{p} = {p} - where({p} < 0, -1, 1) * {k} * m")
    s.write("w = (x, y, z)")


def diagonal_scale(s: FormulaStep, scale: str, limits: str = "") -> None:
    """Turn to the diagonal of a cube, take absolute values, scale, fold into a box, and turn back."""
    to_diagonal(s)
    s.write("w = positive(w)")
    s.multiply(scale)
    if limits:
        s.fold(limits)
    from_diagonal(s)


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


def alternating(s: FormulaStep, name: str, factor: str, sign_of: int = 1) -> None:
    """Add a vector whose factor changes with each time."""
    sign = s.state.get("sign", 1.0)
    s.state["sign"] = sign_of * sign * s.value(factor)
    x, y, z = s.vector(name)
    s.write(f"w = w + {s.parameter(name, (sign * x, sign * y, sign * z))}")


def crossed(s: FormulaStep) -> None:
    """Turn the absolute values of x and y by an eighth, reflect, and turn back."""
    a, b = s.number("transf_offset_0"), s.number("transf_offsetA_0")
    sides = "y, x" if s.on("transf_function_enabledA_false") else "x, y"
    s.write("x, y, z = w", f"{sides} = absolute(x), absolute(y)")
    s.write(f"x, y = x + y - {a}, x - y - {b}")
    if switched(s, "Bx_false", "O"):
        s.write("x = -absolute(x)")
    if switched(s, "Bx", "P"):
        s.write("y = -absolute(y)")
    s.write("x, y = 0.5 * (x + y), 0.5 * (x - y)")
    for switch, letter, axis, name in (
        ("Ax", "R", "x", "transf_offset_1"),
        ("Ax_false", "RV", "y", "transf_offsetA_1"),
    ):
        if switched(s, switch, letter):
            o = s.number(name)
            s.write(f"{axis} = {o} - absolute({axis} + {o})")
    for axis in "xyz":
        if s.on(f"transf_function_enabled{axis}_false"):
            s.write(f"{axis} = -{axis}")
    s.write("w = (x, y, z)")
