"""Powers of points in Mandelbulber: the Mandelbulb and its relatives, and squares of quaternions."""

from __future__ import annotations

from .folds import PI, absolute, sector, switched, symmetric
from .step_text import FOUR, LEFT_OUT, OWN, FormulaStep, known

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


@known(3, "Mandelbulb - Power 2", NYLANDER)
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


@known(20, "Benesi - Pwr2", "Benesi 2010, fractalforums.com")
def benesi(s: FormulaStep) -> None:
    """A square about the x axis, whose sign of x depends on the side of a cone and of the start point."""
    side = "0.1" if s.on("transf_function_enabledE_false") else "cx"
    s.write(
        f"ox, oy, oz = {s.point('transf_offset_000')}",
        "cx, cy, cz = c",
        "x, y, z = w",
        "s = maximum(y * y + z * z, 1e-30)",
        "r = sqrt(s)",
        "u = x * x - s + ox",
        f"u = where({side} < 0, u, where(x < r, u, -u))",
        "k = -2 * absolute(x) / r",
        "w = (u, k * (y * y - z * z) + oy, 2 * k * y * z + oz)",
    )


@known(66, "Benesi - Pine Tree", "Benesi 2010, fractalforums.com", OWN)
def benesi_pine_tree(s: FormulaStep) -> None:
    """A square about the x axis; the start point is added with y and z swapped, each with a factor."""
    s.write(
        f"kx, ky, kz = {s.point('transf_constant_multiplier_100')}",
        "cx, cy, cz = c",
        "x, y, z = w",
        "s = maximum(y * y + z * z, 1e-30)",
        "k = 2 * x / sqrt(s)",
        "w = (x * x - s + kx * cx, 2 * k * y * z + kz * cz, k * (y * y - z * z) + ky * cy)",
    )
    if s.value("transf_angle_0"):
        s.write(f"w = turn(w, (1, 0, 0), -{s.number('transf_angle_0')})")


@known(137, "Mandelbulb - Abs Power 2", NYLANDER)
def mandelbulb_abs_2(s: FormulaStep) -> None:
    """The square with absolute values before and after, and turns."""
    if s.on("transf_rotation_enabled") and s.within("R"):
        s.turn("transf_rotation")
    if switched(s, "D_false", "D"):
        s.add("transf_offsetA_000")
    absolute(s, *(f"buffalo_preabs_{axis}" for axis in "xyz"))
    s.square()
    if s.on("buffalo_pos_z"):
        s.write("x, y, z = w", "w = (x, y, -z)")
    absolute(s, *(f"buffalo_abs_{axis}" for axis in "xyz"))
    if switched(s, "M", "M"):
        s.add("transf_offset_000")
    if switched(s, "", "S"):
        s.turn("mandelbox_rotation_main")
    if s.within("E"):
        s.refuse("transf_addCpixel_enabled_false")
    if switched(s, "P_false", "H"):
        absolute(s, *(f"transf_function_enabledC{axis}_false" for axis in "xyz"))


@known(229, "Mandelnest", "Mermelada 2020, fractalforums.org")
def mandelnest(s: FormulaStep) -> None:
    """Cosines of multiples of the angles to the three axes, made as long as a power of the radius."""
    s.refuse("transf_function_enabled_false")
    n, shift = s.number("power"), s.number("transf_offset_0")
    s.write("x, y, z = w", "s = maximum(x * x + y * y + z * z, 1e-30)")
    for p in "xyz":
        s.write(f"u{p} = cos({PI} * {shift} + {n} * atan2(sqrt(maximum(s - {p} * {p}, 1e-30)), {p}))")
    s.write(f"r = exp(0.5 * ({n} - {s.number('transf_offset_1')}) * log(s))")
    if not s.on("transf_function_enabledA_false"):
        s.write("r = r / sqrt(maximum(ux * ux + uy * uy + uz * uz, 1e-30))")
    s.write("w = (r * ux, r * uy, r * uz)")
    if s.within("S"):
        s.add("transf_offsetF_000")


@known(244, "Msltoe - Sym4 Mod1", "Msltoe 2010, fractalforums.com", LEFT_OUT)
def msltoe_sym_4(s: FormulaStep) -> None:
    """Reflections, a polygon's fold about x, a square, and an offset along the radius."""
    if s.within("K"):
        symmetric(s)
    n = s.values.whole("transf_int8_Y")
    if switched(s, "B_false", "B"):
        n += s.values.whole("transf_int_1")
    sector(s, "yz", s.parameter("transf_int8_Y", max(n, 1)), PI)
    flattened_square(s, s.number("transf_scaleB_1"))
    s.add("transf_addition_constant_neg100")
    if s.within("C"):
        s.refuse("transf_addCpixel_enabled_false")
    move_along(s)


def flattened_square(s: FormulaStep, factor: str = "1") -> None:
    """A square whose first two parts are less, the farther the point is from their plane."""
    s.write("x, y, z = w", "s = maximum(x * x + y * y, 1e-30)", "m = 1 - z * z / maximum(s + z * z, 1e-30)")
    first = "(x * x - y * y) * m" if factor == "1" else f"(x * x - y * y) * m * {factor}"
    s.write(f"w = ({first}, 2 * x * y * m * {s.number('transf_scale')}, 2 * z * sqrt(s))")


def move_along(s: FormulaStep) -> None:
    """Move towards the origin, then scale."""
    if s.value("transf_offset"):
        s.write("x, y, z = w", "r = sqrt(maximum(x * x + y * y + z * z, 1e-30))")
        s.write(f"w = (1 - {s.number('transf_offset')} / r) * w")
    s.scale("transf_scale_1")


JULIA_BULB = "Msltoe 2011, fractalforums.com: Julia bulb"


@known(218, "Msltoe - Julia Bulb Mod4", JULIA_BULB, LEFT_OUT)
def julia_bulb_4(s: FormulaStep) -> None:
    """A polygon's fold about x, a square, and a quaternion's square in some iterations."""
    sector(s, "yz", s.parameter("transf_int8_Y", max(s.values.whole("transf_int8_Y"), 1)), PI)
    flattened_square(s)
    s.add("transf_addition_constant_neg100")
    if s.on("transf_addCpixel_enabled_false"):
        add_away(s)
    move_along(s)
    if switched(s, "_false", "A"):
        s.write("x, y, z = w", "w = (x * x - y * y - z * z, 2 * x * y, 2 * x * z)")


@known(219, "Msltoe - Julia Bulb Mod5", JULIA_BULB, LEFT_OUT)
def julia_bulb_5(s: FormulaStep) -> None:
    """As the fourth, with more sides in some iterations, and less z after a quaternion's square."""
    if switched(s, "C_false", "D"):
        s.fold("transf_addition_constant")
    more = switched(s, "B_false", "B")
    sides = s.values.whole("transf_int8_Y") + (s.values.whole("transf_int_1") if more else 0)
    sector(s, "yz", s.parameter("transf_int8_Y", max(sides, 1)), PI)
    flattened_square(s, s.number("transf_scaleB_1"))
    s.add("transf_addition_constant_neg100")
    if s.on("transf_addCpixel_enabled_false") and s.within("C"):
        add_away(s)
    move_along(s)
    if switched(s, "_false", "A"):
        f, o = s.number("transf_scaleF_1"), s.number("transf_offset_0")
        s.write("x, y, z = w", "cx, cy, cz = c")
        s.write(f"w = (x * x - y * y - z * z, 2 * x * y, 2 * x * z - {f} * cz - {o})")


def add_away(s: FormulaStep) -> None:
    """Add the absolute start point, times a vector, away from the planes of the axes."""
    s.write(f"u, v, s = {s.point('transf_constant_multiplier_000')}", "x, y, z = w", "cx, cy, cz = c")
    for p, k in zip("xyz", "uvs", strict=True):
        own = f"absolute(c{p})" if s.on(f"transf_function_enabled{p}") else f"c{p}"
        s.write(f"{p} = {p} + where({p} < 0, -{k}, {k}) * {own}")
    s.write("w = (x, y, z)")


@known(71, "Riemann - Sphere Msltoe V1", "Msltoe 2011, fractalforums.com: Riemann sphere", LEFT_OUT)
def riemann_sphere(s: FormulaStep) -> None:
    """Project from the pole to a plane, which is tiled; the radius less 1.5 is the height."""
    s.write(
        "x, y, z = w",
        "r = sqrt(maximum(x * x + y * y + z * z, 1e-30))",
        f"k = {s.number('transf_scale')} / r",
    )
    s.write("q = 1 - k * z", "q = k / where(absolute(q) < 1e-9, 1e-9, q)", "x, y = q * x, q * y")
    s.write("w = (x, y, (r - 1.5) * (1 + x * x + y * y))")
    if s.on("transf_rotation_enabled"):
        s.turn("transf_rotation")
    s.write("x, y, z = w", "x, y = x - floor(x + 0.5), y - floor(y + 0.5)")
    s.write(f"a, b, d = {s.point('transf_constant_multiplier_441')}", "w = (a * x, b * y, d * z)")
    s.add("transf_addition_constant")


@known(139, "Riemann - Sphere Msltoe V2", "Msltoe 2012, fractalforums.com: Riemann sphere", LEFT_OUT)
def riemann_sphere_2(s: FormulaStep) -> None:
    """Powers of both coordinates of the plane that the sphere is projected to, and of the radius."""
    if s.on("transf_rotation_enabled"):
        s.turn("transf_rotation")
    s.write("x, y, z = w", "r = sqrt(maximum(x * x + y * y + z * z, 1e-30))")
    s.write(
        f"k = {s.number('transf_scale_08')} / r", "q = k * y - 1", "q = where(absolute(q) < 1e-9, -1e-9, q)"
    )
    for p, factor in (("x", "transf_scaleA_1"), ("z", "transf_scaleB_1")):
        s.write(f"{p} = k * {p} / q", f"t = 8 * {s.number(factor)} * atan2(2 * {p}, {p} * {p} - 1)")
        s.write(f"{p} = sin(t) / maximum(1 + cos(t), 1e-12)")
    s.write("s = x * x + z * z", "m = r ** 4 / (s + 1)", "w = (2 * m * x, m * (s - 1), 2 * m * z)")
    s.add("transf_offset_010")


@known(266, "Mandelbulb Pupuku", "Pupukuusikko 2021, fractalforums.org")
def pupuku(s: FormulaStep) -> None:
    """The Mandelbulb with factors of its angles and of their sines and cosines."""
    s.refuse("transf_function_enabledBz_false")
    if switched(s, "P_false", "P"):
        absolute(s, *(f"transf_function_enabledC{axis}_false" for axis in "xyz"))
        s.add("transf_offsetA_000")
    n, a, b = s.number("power"), s.number("transf_scaleA_1"), s.number("transf_scaleB_1")
    own = "sqrt(s), z" if s.on("transf_function_enabledSw_false") else "z, sqrt(s)"
    s.write("x, y, z = w", "s = maximum(x * x + y * y, 1e-30)")
    s.write(f"t = {n} * {a} * (atan2({own}){offset(s, 'beta_angle_offset')})")
    s.write(f"p = {n} * {b} * (atan2(y, x){offset(s, 'alpha_angle_offset')})")
    if switched(s, "X_false", "X"):
        s.write(f"p = p + where(cos(t) < 0, {PI}, 0)")
    sine, cosine = ("cos(t)", "sin(t)") if s.on("transf_function_enabledD_false") else ("sin(t)", "cos(t)")
    s.write(f"u = {cosine}", f"r = exp(0.5 * ({n} - {s.number('transf_offset_1')} + 1) * log(s + z * z))")
    parts = ["u", "u"]
    for k, (letter, name) in enumerate((("B", "transf_scaleB_0"), ("A", "transf_scaleA_0"))):
        now = s.within(letter)
        if s.on(f"transf_function_enabled{letter}_false") and now:
            parts[k] = f"(1 + (u - 1) * {s.number(name)})"
    s.write(f"w = (r * {parts[0]} * cos(p), r * {parts[1]} * sin(p), r * {sine})")
    s.add("transf_offset_000")
    if s.within("S"):
        s.scale("transf_scaleC_1")


@known(282, "Mandelbar V3", "Crowe et al. 1989, after White and Nylander 2009")
def mandelbar_3(s: FormulaStep) -> None:
    """A square with the signs of its coordinates turned about."""
    if s.on("transf_function_enabled_false"):
        absolute(s, *(f"transf_function_enabledA{axis}_false" for axis in "xyz"))
    s.refuse("transf_function_enabledAw_false")
    s.write("x, y, z = w", "s = maximum(x * x + y * y, 1e-30)", "m = 1 - z * z / s")
    s.write("t = 2 * x * y * m", "y = (y * y - x * x) * m", "z = 2 * sqrt(s) * z")
    signs = (
        ("M", "A", "x = -t"),
        ("B_false", "B", "x, z = -t, -z"),
        ("C_false", "C", "x = t"),
        ("D_false", "D", "x, z = t, -z"),
    )
    for switch, letter, line in signs:
        now = s.within(letter)
        if s.on(f"transf_function_enabled{switch}") and now:
            s.write(line)
    s.write("w = (x, y, z)")
    mandelbar_options(s)


def mandelbar_options(s: FormulaStep) -> None:
    """Scales, an offset, a turn and the start point, each in its iterations."""
    on = {p: s.on(f"transf_function_enabled{p}_false") and s.within(p) for p in "PSJRX"}
    if on["P"]:
        s.write("x, y, z = w", f"w = (x, y, {s.number('transf_scale_1')} * z)")
    if on["S"]:
        s.scale("transf_scaleA_1")
    if on["J"]:
        s.add("transf_addition_constant")
    if on["R"]:
        s.turn("transf_rotation")
    if on["X"]:
        s.add_constant("", "transf_constant_multiplier_111")


@known(259, "Mandelnest Full", "Mermelada 2020, fractalforums.org", LEFT_OUT)
def mandelnest_full(s: FormulaStep) -> None:
    """Sines of multiples of the angles to the three planes, with the sign that stays nearer."""
    n, o, k = s.number("power"), s.point("transf_offsetA_000"), s.point("transf_constant_multiplierA_111")
    s.write("x, y, z = w", "s = maximum(x * x + y * y + z * z, 1e-30)")
    for p in "xyz":
        s.write(f"u{p} = sin({n} * atan2({p}, sqrt(maximum(s - {p} * {p}, 1e-30))))")
    s.write(f"r = exp(0.5 * {n} * log(s)) / sqrt(maximum(ux * ux + uy * uy + uz * uz, 1e-30))")
    s.write(f"ox, oy, oz = {o}", f"kx, ky, kz = {k}", "cx, cy, cz = c")
    inside = not s.on("transf_function_enabledA_false")
    for p in "xyz":
        added = f"o{p} + k{p} * c{p}" if inside else f"o{p}"
        s.write(f"a{p} = {added}")
    s.write("d = r * (ux * ax + uy * ay + uz * az)", "r = where(d < 0, r, -r)")
    s.write("w = (r * ux + ax, r * uy + ay, r * uz + az)")
    if not inside:
        s.write("w = w + (kx * cx, ky * cy, kz * cz)")
    if s.on("transf_function_enabled_false"):
        s.write(f"px, py, pz = {s.point('transf_offset_000')}")
        s.write("w = w - (where(cx < 0, -px, px), where(cy < 0, -py, py), where(cz < 0, -pz, pz))")


def kali_angles(s: FormulaStep, beta: str, alpha: str) -> None:
    """Write the angles of a point to the pole and about z, the latter in half of a turn, and its radius."""
    s.write("x, y, z = w", "s = maximum(x * x + y * y, 1e-30)", "q = sqrt(s + z * z)")
    s.write(f"t = atan2(sqrt(s), z){beta}")
    s.write(f"p = atan2(y * where(x < 0, -1, 1), maximum(absolute(x), 1e-30)){alpha}")


def kali_point(s: FormulaStep, radius: str) -> None:
    """Write the point of angles."""
    s.write(f"w = ({radius} * sin(t) * cos(p), {radius} * sin(t) * sin(p), {radius} * cos(t))")


@known(92, "Mandelbulb - Kali", "Kali 2010, fractalforums.com")
def mandelbulb_kali(s: FormulaStep) -> None:
    """A Mandelbulb of two steps: one angle is multiplied, then the other, of the image."""
    if s.on("transf_function_enabled_false"):
        absolute(s, *(f"transf_function_enabledA{axis}_false" for axis in "xyz"))
    n, a, b = s.number("transf_pwr_8"), s.number("transf_scaleA_1"), s.number("transf_scaleB_1")
    kali_angles(s, offset(s, "beta_angle_offset"), offset(s, "alpha_angle_offset"))
    s.write(f"t = {n} * {a} * t")
    kali_point(s, "q")
    kali_angles(s, offset(s, "transf_beta_angle_offset"), "")
    s.write(f"p = {n} * {b} * p", f"r = exp({n} * log(q))")
    kali_point(s, "r")


@known(240, "Mandelbulb - Pow2 V3", NYLANDER)
def mandelbulb_pow2_3(s: FormulaStep) -> None:
    """A square in polar coordinates whose angle is moved."""
    if s.within("B"):
        x, y, z = s.vector("transf_addition_constant_111")
        limits = [
            s.parameter(f"limit_{p}", abs(v)) if s.on(f"transf_function_enabledB{p}_false") else "1e6"
            for p, v in zip("xyz", (x, y, z), strict=True)
        ]
        if limits != ["1e6"] * 3:
            s.write(f"w = fold_to(w, ({', '.join(limits)}))")
    if switched(s, "A_false", "A"):
        absolute(s, *(f"transf_function_enabledA{axis}_false" for axis in "xyz"))
    s.scale("transf_scaleA_1")
    angle = f"t + 1.5 * {PI}"
    for letter, part in (("B", "0.25"), ("C", "0.5"), ("D", "1")):
        angle = f"2 * t + {part} * {PI}" if s.on(f"transf_function_enabled{letter}_false") else angle
    s.write("x, y, z = w", "s = maximum(x * x + y * y, 1e-30)", "r = s + z * z", "t = atan2(z, sqrt(s))")
    s.write(f"t = {angle}", "m = r * sin(t) / s")
    s.write(f"w = (m * (y * y - x * x), -2 * m * x * y, r * cos(t) * {s.number('transf_scale_1')})")
    s.add("transf_offset_000")
    if s.on("transf_rotation2_enabled_false") and s.within("C"):
        s.turn("transf_rotation")


@known(262, "Mandelbulb - Pow2 V1", NYLANDER)
def mandelbulb_pow2_1(s: FormulaStep) -> None:
    """Squares about y and about z, each in its iterations."""
    if switched(s, "Ax_false", "A"):
        absolute(s, *(f"transf_function_enabledC{axis}_false" for axis in "xyz"))
    if switched(s, "Ay", "B"):
        sign = "-" if s.on("transf_function_enabledB_false") else ""
        s.write("x, y, z = w", "s = maximum(x * x + z * z, 1e-30)", "m = y * y / s - 1")
        s.write(f"w = ({sign}2 * x * z * m, {alternate(s, 'D', 'C')}2 * sqrt(s) * y, (z * z - x * x) * m)")
    if switched(s, "Az_false", "C"):
        sign = "-" if s.on("transf_function_enabledA_false") else ""
        s.write("x, y, z = w", "s = maximum(x * x + y * y, 1e-30)", "m = 1 - z * z / s")
        s.write(f"w = ({sign}2 * x * y * m, (y * y - x * x) * m, {alternate(s, 'F', 'E')}2 * sqrt(s) * z)")


def alternate(s: FormulaStep, on: str, stays: str) -> str:
    """A minus each other time, or the opposite each time, if a switch is on."""
    if not s.on(f"transf_function_enabled{on}_false"):
        return ""
    sign = s.state.get("sign", 1.0) * (-1 if s.on(f"transf_function_enabled{stays}_false") else 1)
    s.state["sign"] = -sign
    return "-" if sign < 0 else ""


@known(41, "Buffalo", "Kali 2011, fractalforums.com")
def buffalo(s: FormulaStep) -> None:
    """The square with absolute values before and after."""
    absolute(s, *(f"buffalo_preabs_{axis}" for axis in "xyz"))
    s.square()
    if s.on("buffalo_pos_z"):
        s.write("x, y, z = w", "w = (x, y, -z)")
    absolute(s, *(f"buffalo_abs_{axis}" for axis in "xyz"))


@known(83, "IQ Bulb", "Quilez 2009, iquilezles.org: Mandelbulb")
def iq_bulb(s: FormulaStep) -> None:
    """The power about the y axis, with a number for each angle."""
    n, m = s.number("transf_pwr_8"), s.number("transf_pwr_8a")
    s.write(
        "x, y, z = w",
        "s = maximum(x * x + z * z, 1e-30)",
        f"t = {n} * atan2(sqrt(s), y)",
        f"p = {m} * atan2(x, z)",
        f"r = exp(0.5 * {n} * log(s + y * y))",
        "w = (r * sin(t) * sin(p), r * cos(t), r * sin(t) * cos(p))",
    )


@known(800, "Mandelbulb - Eye", NYLANDER)
def mandelbulb_eye(s: FormulaStep) -> None:
    """A square whose angles are sums of two, each with a factor."""
    absolute(s, *(f"buffalo_preabs_{axis}" for axis in "xyz"))
    other = f"{PI} - p" if s.on("transf_function_enabled_false") else "atan2(-y, x)"
    s.write(
        "x, y, z = w",
        "s = maximum(x * x + y * y, 1e-30)",
        "q, r = sqrt(s), s + z * z",
        f"t = {s.number('transf_scaleB_1')} * atan2(q, z) + {s.number('transf_scaleC_1')} * atan2(q, -z)",
        "p = atan2(y, x)",
        f"p = {s.number('transf_scale_1')} * p + {other}",
        "w = (r * sin(t) * cos(p), r * sin(t) * sin(p), r * cos(t))",
    )
    absolute(s, *(f"buffalo_abs_{axis}" for axis in "xyz"))
    s.add("transf_addition_constantA_000")


def doubled_angle(s: FormulaStep, first: str, second: str) -> None:
    """Double the angle in a plane and keep the length; the coordinates are those of the statement before."""
    s.write(
        f"q = sqrt(maximum({first} * {first} + {second} * {second}, 1e-30))",
        f"{first}, {second} = ({first} * {first} - {second} * {second}) / q, 2 * {first} * {second} / q",
    )


@known(13, "Mandelbulb 2", "Buddhi 2009, fractalforums.com")
def mandelbulb_of_planes(s: FormulaStep) -> None:
    """Angles in three planes are doubled, one after the other."""
    s.write("x, y, z = w", "r = sqrt(x * x + y * y + z * z)")
    doubled_angle(s, "x", "y")
    doubled_angle(s, "y", "z")
    doubled_angle(s, "x", "z")
    s.write("w = (r * x, r * y, r * z)")


@known(14, "Mandelbulb 3", "Buddhi 2009, fractalforums.com")
def mandelbulb_of_signs(s: FormulaStep) -> None:
    """Angles in two planes are doubled, with the signs of x before and between."""
    s.write("x, y, z = w", "r = sqrt(x * x + y * y + z * z)", "a = where(x < 0, -1, 1)")
    doubled_angle(s, "x", "y")
    s.write("b = where(x < 0, -1, 1)")
    doubled_angle(s, "x", "z")
    s.write("w = (r * x * b, r * y, r * z * a)")


@known(70, "Msltoe - Julia Bulb Eiffie", "Eiffie and Msltoe 2011, fractalforums.com")
def eiffie_msltoe(s: FormulaStep) -> None:
    """An octagon's fold about x, a square, and an offset along the radius."""
    s.refuse("transf_addCpixel_enabled_false")
    sector(s, "yz", "8", PI)
    flattened_square(s)
    s.add("transf_addition_constant")
    move_along(s)


@known(49, "Lkmitch", "Mitchell 2009, fractalforums.com")
def lkmitch(s: FormulaStep) -> None:
    """A square of numbers of three parts."""
    s.write("x, y, z = w", "w = (x * x - 2 * y * z, z * z + 2 * x * y, y * y - 2 * x * z)")


@known(4, "Hypercomplex", "Norton 1982, with other signs", distance=FOUR)
def hypercomplex(s: FormulaStep) -> None:
    """A square of numbers of four parts, where a product of two units is minus the third."""
    s.write(
        "g, e = 2 * sqrt(n), 0",
        "u, v = p * p - q * q - r * r - s * s, 2 * (p * q - r * s)",
        "w, t = 2 * (p * r - q * s), 2 * (p * s - q * r)",
    )


@known(19, "Aexion", "Aexion 2009, fractalforums.com", OWN, distance=FOUR)
def aexion(s: FormulaStep) -> None:
    """A square in four dimensions. The start point and the constant are the distances to the planes of a
    tetrahedron, moved.
    """
    k = s.number("cadd")
    s.write(f"a = absolute(x + y + z) + {k}", f"b = absolute(z - x - y) + {k}")
    s.write(f"c = absolute(y - x - z) + {k}", f"d = absolute(x - y - z) + {k}")
    if s.index == 0:
        s.write("p, q, r, s = a, b, c, d", "n = p * p + q * q + r * r + s * s", "m = 2 * m")
    s.write(
        "g, e = 2 * sqrt(2 * n), 2",
        "u, v = p * p - q * q + 2 * r * s + a, q * q - p * p + 2 * r * s + b",
        "w, t = r * r - s * s + 2 * p * q + c, s * s - r * r + 2 * p * q + d",
    )


@known(
    250, "Newton Pow3", "Newton's method of z^3 = 1, by triplex numbers (White and Nylander 2009)", LEFT_OUT
)
def newton(s: FormulaStep) -> None:
    """Newton's method for the cube roots of one, with the root 1 at infinity."""
    s.refuse("transf_function_enabledO_false")
    if s.on("transf_function_enabledA_false"):
        absolute(s, *(f"transf_function_enabledA{axis}_false" for axis in "xyz"))
    s.write("x, y, z = w", f"k = {s.number('transf_scaleA_1')} / maximum(x * x + y * y + z * z, 1e-18)")
    s.write("x, y, z = k * x + 1, -k * y, -k * z", "s = maximum(x * x + y * y, 1e-18)")
    s.write("r = s + z * z", "k = 1 / (3 * r * r)", "m = (1 - z * z / s) * k")
    s.write("a, b, d = m * (x * x - y * y), -2 * m * x * y, -2 * k * z * sqrt(s)")
    s.write("x, y, z = 2 * x / 3 + a - 1, 2 * y / 3 + b, 2 * z / 3 + d")
    s.write(f"k = {s.number('transf_scaleB_1')} / maximum(x * x + y * y + z * z, 1e-18)")
    s.write("w = (k * x, -k * y, -k * z)")
    s.add("transf_offset_000")
