"""Formulas of Mandelbulber that measure the distance to a solid in each iteration (dIFS)."""

from __future__ import annotations

from .box_formulas import add_vary, scale_by
from .folds import absolute_of, polygon
from .kleinian_formulas import SLOPE, inverted_first
from .sponge_formulas import koch
from .step_text import LEFT_OUT, OWN_SOLID, FormulaStep, known

IFS = "Knighty 2010 and McLaren 2018, fractalforums.org: distances in iterations"


# Folds that the family has in common.


def switched(s: FormulaStep, name: str, letter: str) -> bool:
    """True if a switch is on in the iterations of a letter."""
    return s.on(f"transf_function_enabled{name}") and s.within(letter)


def absolutes(s: FormulaStep, x: bool, y: bool, z: str) -> None:
    """Absolute values of x and y where they are meant, and of z if its switch is on."""
    absolute_of(s, [x and s.within("X"), y and s.within("Y"), bool(z) and switched(s, z, "Z")])


def move_flat(s: FormulaStep, name: str) -> None:
    """Subtract from x and y."""
    s.write(f"a, b, d = {s.point(name)}", "w = w - (a, b, 0)")


def swapped(s: FormulaStep, order: str) -> None:
    """Sort two coordinates upwards."""
    normal = {"xy": "(-1, 1, 0)", "xz": "(-1, 0, 1)", "yx": "(1, -1, 0)"}[order]
    s.write(f"w = mirror(w, {normal})")


def offsets(s: FormulaStep) -> None:
    """Reflect x and y to the far side of a plane."""
    for switch, letter, axis, name in (
        ("C_false", "C", "x", "transf_offsetC_0"),
        ("D_false", "D", "y", "transf_offsetD_0"),
    ):
        if switched(s, switch, letter):
            a = s.number(name)
            s.write("x, y, z = w", f"{axis} = {a} + absolute({axis} - {a})", "w = (x, y, z)")


def polygon_fold(s: FormulaStep) -> None:
    """A polygon's fold in the plane of x and y."""
    if switched(s, "P_false", "P"):
        s.write("x, y, z = w", "w = (absolute(x), y, z)")
        polygon(s, "xy", "transf_int_6")


def enlarge(s: FormulaStep, x: str, y: str) -> None:
    """Scale about a point of x and y, then move and turn."""
    flat = [
        s.number(name) if s.within(letter) and s.value(name) else "0" for letter, name in (("E", x), ("F", y))
    ]
    if flat != ["0", "0"]:
        s.write(f"w = w - ({flat[0]}, {flat[1]}, 0)")
    if s.within("S"):
        scale_by(s, add_vary(s, "transf_scale_2", "transf_scaleC_1", switched(s, "K_false", "K"), False))
    if flat != ["0", "0"]:
        s.write(f"w = w + ({flat[0]}, {flat[1]}, 0)")
    if s.within("H"):
        s.add("transf_offset_001")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")


# Distances.


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


def sides(s: FormulaStep, d: FormulaStep, shear: bool = True) -> tuple[str, str, str]:
    """Half sizes of a box, which may grow with z and its square."""
    d.write(f"a, b, c = {d.point('transf_addition_constant_111')}")
    if switched(s, "T_false", "T"):
        d.write(f"t = {d.number('transf_scale_0')} * z * z", "a, b = a + t, b + t")
    if switched(s, "M_false", "M"):
        d.write(f"t = {d.number('transf_scaleA_0')} * z", "a, b = a - t, b - t")
    return "a", "b", "c"


def measured_box(s: FormulaStep) -> None:
    """Measure with a box, before the step or after it."""
    if s.during("transf_start_iterations", "transf_stop_iterations"):
        varies = s.on("transf_function_enabledT_false") or s.on("transf_function_enabledM_false")
        d = s.measure(first=s.on("transf_function_enabledY_false"), slope=2 if varies else 1)
        box_distance(d, sides(s, d))


@known(600, "DIFS - Box Diagonal V1", IFS, LEFT_OUT, distance=OWN_SOLID)
def box_diagonal_1(s: FormulaStep) -> None:
    """Reflections in a diagonal and the axes, and a box."""
    if s.within("Cx"):
        swapped(s, "xy")
    absolutes(s, True, True, "")
    if s.within("A"):
        move_flat(s, "transf_addition_constantA_111")
    offsets(s)
    enlarge(s, "transf_offsetE_0", "transf_offsetF_0")
    measured_box(s)


@known(601, "DIFS - Box V1", IFS, LEFT_OUT, distance=OWN_SOLID)
def box_1(s: FormulaStep) -> None:
    """Folds of x and y, a polygon's fold, and a box."""
    absolutes(s, s.on("transf_function_enabledAx_false"), s.on("transf_function_enabledAy_false"), "Az_false")
    if switched(s, "Cx", "A"):
        s.fold_flat("transf_addition_constantA_111")
    if switched(s, "B_false", "B"):
        s.add("transf_addition_constantA_111", "-")
    polygon_fold(s)
    if switched(s, "Cx_false", "Cx"):
        swapped(s, "xy")
    offsets(s)
    if switched(s, "Cy_false", "Cy"):
        swapped(s, "xy")
    enlarge(s, "transf_offsetE_0", "transf_offsetF_0")
    s.refuse("transf_function_enabledE_false")
    measured_box(s)


@known(602, "DIFS - Box Diagonal V3", IFS, LEFT_OUT, distance=OWN_SOLID)
def box_diagonal_3(s: FormulaStep) -> None:
    """Reflections in a diagonal and the axes, and a box, with more folds."""
    if switched(s, "A_false", "A"):
        s.add("surfBox_offset1A_111", "-")
    absolutes(s, s.on("transf_function_enabledAx"), s.on("transf_function_enabledAy"), "Az_false")
    polygon_fold(s)
    if switched(s, "Cx_false", "Cx"):
        swapped(s, "yx")
    if switched(s, "B_false", "B"):
        s.add("transf_addition_constantA_111", "-")
    if switched(s, "I_false", "I"):
        s.fold("transf_offsetA_000")
    offsets(s)
    if switched(s, "Cy_false", "Cy"):
        s.refuse("transf_function_enabledCy_false")
    enlarge(s, "transf_offsetE_0", "transf_offsetF_0")
    measured_box(s)


def tower_folds(s: FormulaStep, move: str, flat: str, whole: str) -> None:
    """Folds of the cylinder, the ball and the torus."""
    absolutes(s, s.on("transf_function_enabledAx"), s.on("transf_function_enabledAy"), "Az_false")
    if s.on("transf_function_enabled_false"):
        if switched(s, flat, "A"):
            move_flat(s, move)
        if switched(s, whole, "B"):
            s.add(move, "-")
        polygon_fold(s)
        if switched(s, "Cx_false", "Cx"):
            swapped(s, "xy")
        if switched(s, "Cy_false", "Cy"):
            swapped(s, "xz" if flat == "Bx_false" else "xy")
        offsets(s)
    enlarge(s, "transf_offsetE_2", "transf_offsetF_2")


@known(603, "DIFS - Cylinder", IFS, LEFT_OUT, distance=OWN_SOLID)
def cylinder(s: FormulaStep) -> None:
    """Folds of x and y, and a cylinder or a cone."""
    tower_folds(s, "transf_addition_constant_111", "Bx_false", "By_false")
    if not s.during("transf_start_iterations", "transf_stop_iterations"):
        return
    s.refuse(*(f"transf_function_enabled{k}_false" for k in "I" if s.within(k)))
    d = s.measure(first=True, slope=2 if s.value("transf_scale_0") else 1)
    if s.on("transf_function_enabledSw_false"):
        d.write("x, z = z, x")
    rounded_cylinder(s, d, "transf_radius_1")


def rounded_cylinder(s: FormulaStep, d: FormulaStep, radius: str, tube: bool = False) -> None:
    """A cylinder or a tube whose radius falls with the height or its square."""
    height = "z" if switched(s, "M_false", "M") else "absolute(z)"
    d.write(f"t, h = {height}, absolute(z) - {d.number('transf_offsetA_1')}")
    if switched(s, "T_false", "T"):
        d.write("t = t * t")
    d.write("r = sqrt(x * x + y * y)", f"k = r - {d.number(radius)}")
    if tube:
        d.write(f"k = absolute(k) - {d.number('transf_offset_0')}")
    d.write(f"k = k + {d.number('transf_scale_0')} * t")
    beyond = "r" if switched(s, "N_false", "N") else "maximum(k, 0)"
    d.write(f"m = minimum(maximum(k, h) - {d.number('transf_offsetR_0')}, 0)")
    if switched(s, "O_false", "O"):
        d.write("return sqrt(k * k + h * h) + m")
    else:
        d.write(f"u, h = {beyond}, maximum(h, 0)", "return sqrt(u * u + h * h) + m")


@known(604, "DIFS - Sphere", IFS, LEFT_OUT, distance=OWN_SOLID)
def sphere(s: FormulaStep) -> None:
    """Folds of x and y, and a ball, with a torus."""
    if s.during("transf_start_iterations", "transf_stop_iterations"):
        d = s.measure(first=True)
        d.write(f"m = sqrt(x * x + y * y + z * z) - {d.number('transf_offsetR_1')}")
        if switched(s, "T_false", "T"):
            axes = "zyx" if s.on("transf_function_enabledSw_false") else "xyz"
            own = ring(d, d.number("transf_offsetT_1"), d.number("transf_offset_05"), False, axes)
            d.write(f"m = minimum(m, {own})")
        d.write("return m")
    tower_folds(s, "transf_addition_constantA_111", "A_false", "B_false")


@known(606, "DIFS - Torus", IFS, LEFT_OUT, distance=OWN_SOLID)
def torus(s: FormulaStep) -> None:
    """Folds of x and y, and a torus."""
    tower_folds(s, "transf_addition_constantA_111", "A_false", "B_false")
    s.refuse(*(f"transf_function_enabled{k}_false" for k in "M" if s.within(k)))
    if s.on("transf_function_enabledM") and s.during("transf_start_iterations", "transf_stop_iterations"):
        d = s.measure(first=True)
        axes = "zyx" if s.on("transf_function_enabledSw_false") else "xyz"
        d.write(f"return {ring(d, d.number('transf_offsetT_1'), d.number('transf_offset_05'), False, axes)}")


def hexagons(d: FormulaStep, square: bool) -> None:
    """Distance to a grid of hexagons, in the plane of x and y, of square or round wires."""
    a = d.number("transf_scale_1")
    d.write(f"z = z / {d.number('transf_scaleF_1')}", f"v = absolute(y - {a} * floor(y / {a} + 0.5))")
    d.write(f"k = 1.5 * {a} / {SLOPE}", "u = absolute(x - k * floor(x / k + 0.5))")
    d.write(f"t = minimum(maximum(v, u * {SLOPE} + 0.5 * v) - 0.5 * {a}, v)")
    wire = "maximum(absolute(t), absolute(z))" if square else "sqrt(t * t + z * z)"
    d.write(f"return {wire} - {d.number('transf_offset_0005')}")


@known(608, "DIFS - Hextgrid2", IFS, LEFT_OUT, distance=OWN_SOLID)
def hexagon_grid(s: FormulaStep) -> None:
    """An inversion, tiles, a scale, and a grid of hexagons."""
    if inverted_first(s, "transf_scaleG_1", "transf_addition_constant"):
        s.scale("transf_scaleA_1")
    if s.on("transf_function_enabledC_false") and s.during(
        "transf_start_iterations_C", "transf_stop_iterations_C1"
    ):
        a, b = s.number("transf_offset_2"), s.number("transf_offsetA_2")
        s.write("x, y, z = w")
        for p, k in (("x", a), ("y", b)):
            s.write(f"{p} = absolute({p}) + {k}", f"{p} = {p} - 2 * {k} * floor({p} / (2 * {k})) - {k}")
        s.write("w = (x, y, z)")
    if s.within("S"):
        scale_by(s, add_vary(s, "transf_scale_2", "transf_scaleC_1", switched(s, "K_false", "K"), False))
    s.add("transf_offset_001")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")
    if s.during("transf_start_iterations", "transf_stop_iterations"):
        hexagons(s.measure(), s.on("transf_function_enabledJ_false"))


@known(1603, "T>DIFS Hextgrid2", IFS, LEFT_OUT, distance=OWN_SOLID)
def hexagon_grid_here(s: FormulaStep) -> None:
    """A grid of hexagons."""
    if s.on("transf_function_enabledG_false"):
        s.scale("transf_scaleA_1")
        s.add("transf_offset_000")
        s.refuse(*(f"transf_function_enabled{p}_false" for p in "xyz"))
    if s.on("transf_rotation_enabled"):
        s.refuse_values("transf_rotation")
    hexagons(s.measure(), s.on("transf_function_enabledJ_false"))


@known(1600, "T>DIFS Box", IFS, LEFT_OUT, distance=OWN_SOLID)
def box_here(s: FormulaStep) -> None:
    """A box."""
    d = s.measure()
    d.write(f"a, b, c = {d.point('transf_addition_constant_111')}")
    box_distance(d, ("a", "b", "c"), d.number("transf_offsetB_0"))


@known(1601, "T>DIFS Cylinder", IFS, LEFT_OUT, distance=OWN_SOLID)
def cylinder_here(s: FormulaStep) -> None:
    """A cylinder or a tube."""
    d = s.measure()
    if s.on("transf_function_enabledS_false"):
        d.write("x, y = y, x")
    if s.on("transf_function_enabledSw_false"):
        d.write("x, z = z, x")
    b = d.number("transf_offsetB_0")
    d.write(f"k = sqrt(x * x + y * y) - {d.number('transf_radius_1')} + {b}", "r = k")
    if s.on("transf_function_enabled_false"):
        d.write(f"r = absolute(r) - {d.number('transf_offset_0')}")
    if s.on("transf_function_enabledA_false"):
        d.write("r = maximum(r, k)")
    d.write(f"h = absolute(z) - {d.number('transf_offsetA_1')} + {b}", "m = minimum(maximum(r, h), 0)")
    d.write("r, h = maximum(r, 0), maximum(h, 0)", f"return sqrt(r * r + h * h) + m - {b}")


@known(1604, "T>DIFS Sphere", IFS, LEFT_OUT, distance=OWN_SOLID)
def sphere_here(s: FormulaStep) -> None:
    """A ball."""
    d = s.measure()
    d.write(f"return sqrt(x * x + y * y + z * z) - {d.number('transf_offsetR_1')}")


@known(1605, "T>DIFS Torus", IFS, LEFT_OUT, distance=OWN_SOLID)
def torus_here(s: FormulaStep) -> None:
    """A torus, of a square or a round tube."""
    s.refuse("transf_function_enabledC_false")
    d = s.measure()
    if s.on("transf_function_enabledSw_false"):
        d.write("x, z = z, x")
    if s.on("transf_function_enabledS_false"):
        d.write("y, z = z, y")
    square = s.on("transf_function_enabledJ_false")
    d.write(f"m = {ring(d, d.number('transf_offsetT_1'), d.number('transf_offset_05'), square)}")
    for switch, axis in (("A", "x"), ("B", "y")):
        if s.on(f"transf_function_enabled{switch}_false"):
            d.write(f"m = maximum(m, -{axis})")
    d.write("return m")


@known(1606, "T>DIFS Prism", IFS, LEFT_OUT, distance=OWN_SOLID)
def prism_here(s: FormulaStep) -> None:
    """A prism of three sides, or its shell."""
    d = s.measure()
    if s.on("transf_function_enabledSw_false"):
        d.write("x, z = z, x")
    d.write(f"m = maximum({SLOPE} * absolute(y) + 0.5 * z, -z) - {d.number('transf_offset_05')}")
    if s.on("transf_function_enabled_false"):
        d.write(f"m = maximum(m, absolute(m) - {d.number('transf_offset_p01')})")
    d.write(f"return maximum(absolute(x) - {d.number('transf_offset_1')}, m)")


@known(1627, "T>DIFS Sphere Grid", IFS, LEFT_OUT, distance=OWN_SOLID)
def sphere_grid(s: FormulaStep) -> None:
    """A meridian of a globe, with an equator and two circles of latitude."""
    s.refuse(
        "transf_function_enabled_false", "transf_rotation2_enabled_false", "transf_function_enabledC_false"
    )
    d = s.measure(last=not s.on("analyticDE_enabled_false"))
    r = d.number("transf_offsetR_1")
    square = s.on("transf_function_enabledJ_false")
    d.write(f"m = {ring(d, r, d.number('transf_offset_p01'), square, 'yzx')}")
    if s.on("transf_function_enabledM_false"):
        square = s.on("transf_function_enabledN_false")
        d.write(f"m = minimum(m, {ring(d, r, d.number('transf_offsetA_p01'), square)})")
    if s.on("transf_function_enabledO_false"):
        h = d.number("transf_offset_05")
        d.write(f"z = absolute(z) - {h}", f"r = sqrt(maximum({r} * {r} - {h} * {h}, 0))")
        square = s.on("transf_function_enabledP_false")
        d.write(f"m = minimum(m, {ring(d, 'r', d.number('transf_offsetB_p01'), square)})")
    d.write("return m")


@known(1633, "T>DIFS Box Frame", IFS, LEFT_OUT, distance=OWN_SOLID)
def box_frame(s: FormulaStep) -> None:
    """Folds of polygons, and the edges of a box (Quilez, iquilezles.org: box frame)."""
    for switch, letter, axes, name in (
        ("Cx", "A", "xy", "X"),
        ("Cy", "B", "yz", "Y"),
        ("Cz", "C", "zx", "Z"),
    ):
        if switched(s, f"{switch}_false", letter):
            second = axes[1]
            s.write("x, y, z = w", f"{second} = absolute({second})", "w = (x, y, z)")
            polygon(s, axes, f"transf_int8_{name}")
    if switched(s, "D_false", "D"):
        s.add("transf_offset_000", "-")
        s.write("w = positive(w)")
    if switched(s, "E_false", "E"):
        s.fold("transf_offsetA_000")
    if s.within("S"):
        s.scale("transf_scale_1")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")
    s.refuse_values("transf_rotation2")
    if s.within("Zc"):
        s.refuse("transf_function_enabledZc_false")
    d = s.measure(last=not s.within("G"))
    frame(d, s.on("transf_function_enabledSw_false"))


def frame(d: FormulaStep, hollow: bool) -> None:
    """Distance to the edges of a box, with a thickness along each axis."""
    d.write(f"a, b, c = {d.point('transf_offsetC_111')}")
    d.write("x, y, z = absolute(x) - a, absolute(y) - b, absolute(z) - c")
    for p, q, name in (("x", "u", "p01"), ("y", "v", "A_p01"), ("z", "s", "B_p01")):
        e = d.number(f"transf_offset{'_' if name == 'p01' else ''}{name}")
        d.write(f"{q} = absolute({p}) - {e}" if hollow else f"{q} = absolute({p} + {e}) - {e}")
    parts = []
    for k, (p, q, r) in enumerate((("x", "v", "s"), ("u", "y", "s"), ("u", "v", "z"))):
        d.write(f"l, m, n = maximum({p}, 0), maximum({q}, 0), maximum({r}, 0)")
        d.write(f"d{k} = sqrt(l * l + m * m + n * n) + minimum(maximum({p}, maximum({q}, {r})), 0)")
        parts.append(f"d{k}")
    d.write(f"return minimum(minimum({parts[0]}, {parts[1]}), {parts[2]})")


@known(1639, "T>DIFS Chessboard", IFS, LEFT_OUT, distance=OWN_SOLID)
def chessboard(s: FormulaStep) -> None:
    """A board, or a plane."""
    if s.within("Zc"):
        s.refuse("transf_function_enabledZc_false")
    d = s.measure(last=s.on("transf_function_enabledD_false"))
    if s.on("transf_function_enabled_false"):
        d.write("return z + 0 * x")
        return
    d.write(f"a, b, c = {d.point('transf_offset_110')}")
    d.write("return maximum(maximum(absolute(x) - a, absolute(y) - b), absolute(z) - c)")


@known(1625, "T>DIFS Hexprism V2", IFS, LEFT_OUT, distance=OWN_SOLID)
def hexagon_prism(s: FormulaStep) -> None:
    """A prism of six sides (Quilez, iquilezles.org: hexagonal prism), which may narrow with the height."""
    if s.on("transf_function_enabledA_false"):
        absolute_of(s, [s.on(f"transf_function_enabledA{axis}_false") for axis in "xyz"])
    s.add("transf_offset_000")
    if s.on("transf_function_enabledP_false") and s.during(
        "transf_start_iterations_P", "transf_stop_iterations_P1"
    ):
        s.write("x, y, z = w", "w = (x, absolute(y), z)")
        polygon(s, "xy", "transf_int_6")
    if s.on("transf_rotation_enabled_false") and s.during(
        "transf_start_iterations_R", "transf_stop_iterations_R1"
    ):
        s.turn("transf_rotation")
    if s.within("Zc"):
        s.refuse("transf_function_enabledZc_false")
    s.refuse("transf_function_enabledD_false", "transf_function_enabledB_false")
    narrow = s.on("transf_function_enabledC_false")
    d = s.measure(slope=2 if narrow else 1)
    a, b = d.number("transf_offset_1"), d.number("transf_offsetB_0")
    d.write("h = z", "x, y, z = absolute(x), absolute(y), absolute(z)")
    d.write(f"t = 2 * minimum(0.5 * y - {SLOPE} * x, 0)", f"x, y = x + {SLOPE} * t, y - 0.5 * t")
    d.write(f"k = {a} / {2 * float(SLOPE)}", f"u, v = x - minimum(maximum(x, -k), k), y - {a}")
    d.write(f"r = where(v < 0, -1, 1) * sqrt(u * u + v * v) + {b}")
    if narrow:
        height = "h" if switched(s, "M_false", "M") else "z"
        height = f"{height} * {height}" if switched(s, "T_false", "T") else height
        s.refuse_values("transf_offsetR_0", "transf_offsetF_0")
        if s.within("J"):
            d.write(f"r = r + {d.number('transf_scaleA_1')} * {height}")
    d.write(f"h = z - {d.number('transf_offsetA_1')} + {b}", "m = minimum(maximum(r, h), 0)")
    d.write("r, h = maximum(r, 0), maximum(h, 0)", f"return sqrt(r * r + h * h) + m - {b}")


@known(1632, "T>DIFS Helix", IFS, LEFT_OUT, distance=OWN_SOLID)
def helix(s: FormulaStep) -> None:
    """A cylinder in coordinates that turn with height and radius."""
    s.refuse("transf_function_enabledZc_false", "transf_rotation_enabled_false")
    d = s.measure(slope=2)
    d.write(f"a, b, c = {d.point('transf_scale3D_111')}", "x, y, z = a * x, b * y, c * z")
    if s.during("transf_start_iterations_C", "transf_stop_iterations_C1"):
        d.write(
            f"t = sqrt(x * x + y * y) * {d.number('transf_scaleA_0')} + z * {d.number('transf_scaleB_0')}"
        )
        k, m = d.number("transf_scaleC_1"), d.number("transf_scaleD_1")
        d.write(f"x, y = {k} * (x * cos(t) - y * sin(t)), {m} * (x * sin(t) + y * cos(t))")
    d.write(f"a, b, c = {d.point('transf_offsetA_000')}", "x, y, z = x + a, y + b, z + c")
    if s.on("transf_function_enabledA_false"):
        for p in "xyz":
            if s.on(f"transf_function_enabledA{p}_false"):
                d.write(f"{p} = absolute({p})")
        d.write(f"a, b, c = {d.point('transf_offset_000')}", "x, y, z = x + a, y + b, z + c")
    d.write(f"y = y * sqrt({d.number('transf_scale_1')})")
    rounded_cylinder(s, d, "transf_offset_01", s.on("transf_function_enabled_false"))


@known(
    278, "Koch V5", "von Koch 1904; folds by Knighty 2010, fractalforums.com", LEFT_OUT, distance=OWN_SOLID
)
def koch_5(s: FormulaStep) -> None:
    """The snowflake's folds, measured with a box or a ball."""
    koch(s)
    if not s.on("transf_function_enabled"):
        return
    s.refuse_values("transf_scaleA_0")
    slab, box = switched(s, "S_false", "S"), s.on("transf_function_enabledM") and s.within("O")
    name = "transf_offsetA_0" if box else "transf_offset_0"
    d = s.measure(last=not s.within("Z"), thin=not slab and not (box and s.value(name) > 0))
    falls = s.on("transf_function_enabledF_false")
    size = f"{d.number(name)} / {s.index + 1} * {d.number('transf_scaleA_1')}" if falls else d.number(name)
    if box:
        d.write(f"m = maximum(absolute(x), maximum(absolute(y), absolute(z))) - {size}")
    else:
        d.write(f"m = absolute(sqrt(x * x + y * y + z * z) - {size})")
    if slab:
        s.refuse("transf_function_enabledAw_false")
        d.write(
            f"m = minimum(m, absolute(z - {d.number('transf_offsetR_0')}) - {d.number('transf_offsetF_0')})"
        )
    if s.within("J"):
        s.refuse("transf_function_enabledT_false")
    d.write("return m")
