"""Formulas of Mandelbulber that measure the distance to a solid in each iteration (dIFS)."""

from __future__ import annotations

from collections.abc import Sequence

from .box_formulas import add_vary, scale_by
from .distances import (
    box_distance,
    enlarge_by,
    frame,
    globe,
    hexagons,
    meridians,
    move,
    moved,
    ring,
    rounded_cylinder,
    turn,
)
from .folds import absolute_of, polygon, switched
from .kleinian_formulas import SLOPE, inverted_first
from .sponge_formulas import koch
from .step_text import LEFT_OUT, OWN_SOLID, FormulaStep, known

IFS = "Knighty 2010 and McLaren 2018, fractalforums.org: distances in iterations"


# Folds that the family has in common.


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
    whole = s.during("transf_start_iterations", "transf_stop_iterations")
    ringed = switched(s, "I_false", "I")
    if not whole and not ringed:
        return
    d = s.measure(first=True, slope=2 if s.value("transf_scale_0") else 1)
    if whole and s.on("transf_function_enabledSw_false"):
        d.write("x, z = z, x")
    if ringed:
        axes = "zyx" if s.on("transf_function_enabledJ_false") else "xyz"
        own = ring(d, d.number("transf_offsetT_1"), d.number("transf_offset_05"), False, axes)
        d.write(f"return {own}" if not whole else f"round = {own}")
    if whole:
        capped = rounded_cylinder(d, "transf_radius_1")
        d.write(f"return minimum(round, {capped})" if ringed else f"return {capped}")


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
    """Meridians of a globe, with an equator and two circles of latitude."""
    s.refuse("transf_function_enabledC_false")
    d = s.measure(last=not s.on("analyticDE_enabled_false"))
    with moved(s, d) as t:
        if s.on("transf_function_enabled_false"):
            s.refuse("transf_function_enabledD_false")
            move(t, "transf_offset_000")
            enlarge_by(t, "transf_scale_1")
            turn(t, "transf_rotation")
        meridians(t, "transf_int8_Z")
        if s.on("transf_rotation2_enabled_false"):
            turn(t, "transf_rotation2")
    globe(d, "yzx")


@known(1628, "T>DIFS Sphere Grid V2", IFS, LEFT_OUT, distance=OWN_SOLID)
def sphere_grid_2(s: FormulaStep) -> None:
    """As the first, moved, scaled and turned."""
    s.add("transf_offset_000")
    s.scale("transf_scale_1")
    s.turn("transf_rotation")
    d = s.measure(last=s.on("analyticDE_enabled_false"))
    with moved(s, d) as t:
        meridians(t, "transf_int8_Z")
        if s.on("transf_rotation2_enabled_false"):
            turn(t, "transf_rotation2")
    globe(d, "yzx")


@known(1629, "T>DIFS Sphere Grid V3", IFS, LEFT_OUT, distance=OWN_SOLID)
def sphere_grid_3(s: FormulaStep) -> None:
    """Circles about z after folds of polygons, in other coordinates."""
    for switch, letter, axes, name in (
        ("Cx", "A", "xy", "transf_int_32"),
        ("Cy_false", "B", "yz", "transf_int8_Y"),
        ("Cz_false", "C", "zx", "transf_int8_Z"),
    ):
        if switched(s, switch, letter):
            absolute_polygon(s, axes, name)
    s.add("transf_offset_000")
    s.scale("transf_scale_1")
    s.write("x, y, z = w", "w = (z, x, y)")
    s.turn("transf_rotation")
    d = s.measure(last=s.on("analyticDE_enabled_false"))
    with moved(s, d) as t:
        if s.on("transf_function_enabledK_false"):
            meridians(t, "transf_int_1")
        if s.on("transf_rotation2_enabled_false"):
            turn(t, "transf_rotation2")
    globe(d, "xyz")


def absolute_polygon(s: FormulaStep, axes: str, name: str) -> None:
    """A polygon's fold of the angle in a plane, from the first axis on, after an absolute value."""
    second = axes[1]
    s.write("x, y, z = w", f"{second} = absolute({second})", "w = (x, y, z)")
    polygon(s, axes, name)


@known(1633, "T>DIFS Box Frame", IFS, LEFT_OUT, distance=OWN_SOLID)
def box_frame(s: FormulaStep) -> None:
    """Folds of polygons, and the edges of a box (Quilez, iquilezles.org: box frame)."""
    for switch, letter, axes, name in (
        ("Cx", "A", "xy", "X"),
        ("Cy", "B", "yz", "Y"),
        ("Cz", "C", "zx", "Z"),
    ):
        if switched(s, f"{switch}_false", letter):
            absolute_polygon(s, axes, f"transf_int8_{name}")
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
    shifted = switched(s, "Zc_false", "Zc")
    if shifted:
        s.write(f"w = positive(w) - {s.point('transf_offsetC_111')}")
    d = s.measure(last=not s.within("G"))
    if not shifted:
        d.write(f"a, b, c = {d.point('transf_offsetC_111')}")
        d.write("x, y, z = absolute(x) - a, absolute(y) - b, absolute(z) - c")
    frame(d, s.on("transf_function_enabledSw_false"))


@known(1639, "T>DIFS Chessboard", IFS, LEFT_OUT, distance=OWN_SOLID)
def chessboard(s: FormulaStep) -> None:
    """A board, or a plane."""
    plane, shifted = s.on("transf_function_enabled_false"), switched(s, "Zc_false", "Zc")
    if shifted and not plane:
        s.write(f"w = positive(w) - {s.point('transf_offset_110')}")
    d = s.measure(last=s.on("transf_function_enabledD_false"))
    if plane:
        d.write("return z + 0 * x")
        return
    if not shifted:
        d.write(f"a, b, c = {d.point('transf_offset_110')}")
        d.write("x, y, z = absolute(x) - a, absolute(y) - b, absolute(z) - c")
    d.write("return maximum(maximum(x, y), z)")


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
    s.refuse("transf_function_enabledZc_false", "transf_function_enabled_auxC_false")
    d = s.measure(slope=2)
    d.write(f"a, b, c = {d.point('transf_scale3D_111')}", "x, y, z = a * x, b * y, c * z")
    if s.on("transf_rotation_enabled_false") and s.during(
        "transf_start_iterations_R", "transf_stop_iterations_R1"
    ):
        turn(d, "transf_rotation")
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
    tube = s.on("transf_function_enabled_false")
    d.write(f"return {rounded_cylinder(d, 'transf_offset_01', tube)}")


@known(
    278, "Koch V5", "von Koch 1904; folds by Knighty 2010, fractalforums.com", LEFT_OUT, distance=OWN_SOLID
)
def koch_5(s: FormulaStep) -> None:
    """The snowflake's folds, measured with a box or a ball."""
    koch(s)
    if not s.on("transf_function_enabled"):
        return
    s.refuse_values("transf_scaleA_0")
    slab, box = switched(s, "S_false", "S"), switched(s, "M", "O")
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


@known(
    1637, "T>DIFS Cayley2", "McLaren 2021, fractalforums.org, after Cayley 1846", LEFT_OUT, distance=OWN_SOLID
)
def cayley_2(s: FormulaStep) -> None:
    """The square of Cayley's transform of x and y, measured with a mean of a box and a cylinder."""
    if s.on("transf_function_enabled_false") and s.during(
        "transf_start_iterations", "transf_stop_iterations_1"
    ):
        s.write("w = turn(w, (0, 0, 1), 45)")
    if s.on("transf_function_enabledM"):
        absolute_of(s, [s.on(f"transf_function_enabled{switch}") for switch in ("Ax", "Ay", "Az_false")])
    s.add("transf_offset_000")
    if s.on("transf_rotation_enabled_false") and s.during(
        "transf_start_iterations_R", "transf_stop_iterations_R1"
    ):
        s.turn("transf_rotation")
    s.scale("transf_scale_1")
    s.refuse("transf_function_enabledT_false")
    thin = s.state.get("thin", 1.0)
    s.state["thin"] = thin * s.value("transf_scaleB_1")
    d = s.measure(slope=4)
    with moved(s, d) as t:
        cayley_square(t)
        t.write(f"a, b, c = {t.point('transf_offset_110')}")
        t.write("x, y, z = absolute(x) - a, absolute(y) - b, absolute(z) - c")
    box_and_cylinder(d, thin)


def cayley_square(d: FormulaStep) -> None:
    """(u^2 + 1) / (u^2 - 1) of u = x + i y, up to factors."""
    d.write("u, v = x * x, y * y", f"m = {d.number('transf_scaleA_2')} * u * v + u * u + v * v")
    d.write(f"n = m + {d.number('transf_scale_4')} * x * y + 1", f"k = {d.number('transf_scale_2')}")
    whole = d.on("transf_function_enabledB_false")
    d.write(f"x, y = k * (m - 1){'' if whole else ' / n'}, 2 * (v - u) / n")
    d.write(f"z = {d.number('transf_scaleA_1')} * z")


def box_and_cylinder(d: FormulaStep, thin: float) -> None:
    """A mean of the distances to a box, whose faces x, y and z count from, and to a cylinder."""
    d.write(f"a, b, c = {d.point('transf_offset_110')}", f"e, f, g = {d.point('transf_addition_constant')}")
    d.write("k = minimum(minimum(x + a - e, y + b - f), z + c - g)")
    d.write("u, v, r = maximum(x, 0), maximum(y, 0), maximum(z, 0)", "m = sqrt(u * u + v * v + r * r)")
    h = f"{d.number('transf_offset_01')} * {d.parameter('thin', thin)}"
    d.write(f"r, h = sqrt(x * x + y * y) - {d.number('transf_radius_1')}, absolute(z) - {h}")
    d.write(f"a, b, c = {d.point('transf_offsetA_000')}", "u, v = maximum(r - a, -b), maximum(h - c, 0)")
    d.write("n = minimum(maximum(r, h), 0) + sqrt(u * u + v * v)")
    for p, letter, name in (("m", "E", "transf_offsetC_0"), ("n", "F", "transf_offsetD_0")):
        if d.on(f"transf_function_enabled{letter}_false"):
            d.write(f"{p} = maximum(k, {p}) - {d.number(name)}")
    d.write(f"return m + (n - m) * {d.number('transf_scaleD_1')} - {d.number('transf_offsetA_0')}")


@known(1643, "T>DIFS Octahedron V2", "Quilez, iquilezles.org: octahedron", LEFT_OUT, distance=OWN_SOLID)
def octahedron_2(s: FormulaStep) -> None:
    """An octahedron, with a box or a ball about the start point."""
    box, ball = (s.on(f"transf_function_enabled{letter}_false") for letter in "DE")
    if s.index:
        s.refuse("transf_function_enabledD_false", "transf_function_enabledE_false")
    d = s.measure(first=True, slope=3 if s.on("transf_function_enabledA_false") else 1)
    d.write("p, q, r = x, y, z")
    into_octant(d)
    octahedron(d)
    if box:
        d.write(f"a, b, c = {d.point('transf_addition_constant_0555')}")
        d.write("a, b, c = absolute(p) - a, absolute(q) - b, absolute(r) - c")
        d.write("t = minimum(maximum(a, maximum(b, c)), 0)")
        d.write("a, b, c = maximum(a, 0), maximum(b, 0), maximum(c, 0)")
        both = "maximum" if s.on("transf_function_enabledJ_false") else "minimum"
        d.write(f"m = {both}(sqrt(a * a + b * b + c * c) + t, m)")
    if ball:
        d.write(f"m = minimum(sqrt(p * p + q * q + r * r) - {d.number('transf_scale_08')}, m)")
    d.write("return m")
    s.write("x, y, z = w")
    into_octant(s)
    s.write("w = (x, y, z)")


def into_octant(d: FormulaStep) -> None:
    """Clip, scale and turn, and take absolute values."""
    if d.on("transf_function_enabledF_false"):
        d.write(f"a, b, c = {d.point('transf_offsetF_000')}")
        for p, a in zip("xyz", "abc", strict=True):
            d.write(f"{p} = {p} - maximum(minimum({p}, {a}), -{a})")
    enlarge_by(d, "transf_scaleA_1")
    if d.on("transf_rotation2_enabled_false") and d.within("C"):
        turn(d, "transf_rotation")
    d.write("x, y, z = absolute(x), absolute(y), absolute(z)")
    if d.on("transf_function_enabledA_false"):
        move(d, "transf_offset_000", "-")


def octahedron(d: FormulaStep) -> None:
    """Distance m to an octahedron, from a point with coordinates that are not negative."""
    bent = d.on("transf_function_enabledA_false")
    d.write(f"k = (x + y + z - {d.number('transf_offset_1')}) / 3")
    if bent:
        d.write(f"k = {d.number('transf_scale_1')} * k * k")
    d.write("t = 0.5 * (minimum(x - k, 0) + minimum(y - k, 0) + minimum(z - k, 0))")
    most = d.number("transf_offsetA_1" if bent else "transf_offset_1")
    less = "" if d.on("transf_function_enabledB_false") else " - k"
    for p, q in zip("xyz", "abc", strict=True):
        start = f"absolute({p})" if not less else f"{p}{less}"
        d.write(f"{q} = {p} - minimum(maximum({start} + t, 0), {most})")
    d.write(f"m = where(k < 0, -1, 1) * sqrt(a * a + b * b + c * c) - {d.number('transf_offset_0005')}")
    d.write(f"m = m / {d.number('transf_scaleA_1')}")


def tube_folds(s: FormulaStep, letter: str, name: str, switches: Sequence[str]) -> None:
    """Scale, absolute values, an offset and a turn, in the iterations of T."""
    if not switched(s, "T_false", "T"):
        return
    s.scale("transf_scale_1")
    if s.within(letter):
        if switches:
            absolute_of(s, [s.on(f"transf_function_enabled{switch}") for switch in switches])
        s.add(name, "-")
    if switched(s, "R_false", "R"):
        s.turn("transf_rotation")


@known(1645, "T>DIFS Tube", IFS, LEFT_OUT, distance=OWN_SOLID)
def tube(s: FormulaStep) -> None:
    """A tube along y whose section is a square, a circle or a triangle."""
    tube_folds(s, "T", "transf_offsetA_000", ("x_false", "y_false", "A_false"))
    triangle = any(s.on(f"transf_function_enabled{letter}_false") for letter in "EF")
    d = s.measure(slope=1.5 if triangle else 1)
    for letter, swap in (("S", "x, y = y, x"), ("M", "x, z = z, x")):
        if switched(s, f"{letter}_false", letter):
            d.write(swap)
    if s.on("transf_function_enabledP_false") and s.during(
        "transf_start_iterations_P", "transf_stop_iterations_P1"
    ):
        s.refuse(*(f"transf_function_enabledA{axis}_false" for axis in "xyz"))
    d.write(f"a, b, c = {d.point('transf_offsetF_000')}", "t = x")
    if s.on("transf_function_enabledBx"):
        d.write("t = absolute(t) - a")
    if s.on("transf_function_enabledK_false"):
        d.write("z = absolute(z) - b")
    section(d)
    d.write(f"t = t - {d.number('transf_offset_02')}")
    if not s.on("transf_function_enabledG_false"):
        d.write(f"t = maximum(absolute(t) - {d.number('transf_offset_p01')}, t)")
    d.write(f"h = absolute(y) - {d.number('transf_offsetA_1')}", "m = minimum(maximum(t, h), 0)")
    d.write("t, h = maximum(t, 0), maximum(h, 0)", "return sqrt(t * t + h * h) + m")


def section(d: FormulaStep) -> None:
    """Sections of a tube, one after another."""
    if d.on("transf_function_enabledCx"):
        d.write("t = maximum(absolute(t), absolute(z))")
    if d.on("transf_function_enabledD_false"):
        d.write("t = sqrt(t * t + z * z)")
    if d.on("transf_function_enabledE_false"):
        d.write(f"t = maximum(absolute(t) * {SLOPE} + 0.5 * z, -z)")
    if d.on("transf_function_enabledF_false"):
        sides = []
        for p, letter, name in (("u", "y", "transf_offsetB_0"), ("v", "z", "transf_offsetC_0")):
            d.write(f"{p} = z")
            if d.on(f"transf_function_enabledC{letter}"):
                d.write(f"{p} = absolute({p}) - {d.number(name)}")
            if d.on(f"transf_function_enabledC{letter}_false"):
                d.write(f"{p} = {d.number(name)} - {p}")
            sides.append(p)
        d.write(f"t = maximum(absolute(t) * {SLOPE} + 0.5 * u, v)")


@known(1646, "T>DIFS Torus V4", IFS, LEFT_OUT, distance=OWN_SOLID)
def torus_4(s: FormulaStep) -> None:
    """Half a torus, of a square or a round tube, which may be hollow."""
    folded = s.on("transf_function_enabledG_false")
    tube_folds(s, "M", "transf_offset_000", ("Ax_false", "Ay_false", "Az_false") if folded else ())
    angle = s.value("transf_angle_deg_A")
    if angle:
        a = s.number("transf_angle_deg_A")
        s.write(f"w = turn(w, (0, 0, 1), {a})", "x, y, z = w", "w = (absolute(x), y, z)")
        s.write(f"w = turn(w, (0, 0, 1), {a})")
    hollow, square = s.on("transf_function_enabledC_false"), s.on("transf_function_enabledJ_false")
    d = s.measure()
    d.write(f"m = {ring(d, d.number('transf_radius_1'), d.number('transf_offset_02'), square)}")
    if hollow:
        e = d.number("transf_offset_0005")
        d.write(f"m = absolute(m + {e}) - {e}")
    d.write("return maximum(m, -y)")


@known(610, "DIFS Msltoe Donut", "Msltoe 2011, fractalforums.com: donut", LEFT_OUT, distance=OWN_SOLID)
def donut(s: FormulaStep) -> None:
    """Rings along a ring, and so on, measured with the ring."""
    d = s.measure(first=True)
    d.write(f"return {ring(d, d.number('donut_ring_radius'), d.number('donut_ring_thickness'), False)}")
    rings(s)


def rings(s: FormulaStep) -> None:
    """Turn to the nearest of the points at equal distances on a ring, and enlarge about it; within the ring,
    divide by the distance.
    """
    radius, tube, factor = (s.number(f"donut_{name}") for name in ("ring_radius", "ring_thickness", "factor"))
    s.write("x, y, z = w", f"k = 6.283185307179586 / {s.number('donut_number')}")
    s.write(f"r = {radius} - sqrt(maximum(x * x + y * y, 1e-30))", f"m = r * r + z * z - {tube} * {tube}")
    s.write("t = k * floor(atan2(y, x) / k + 0.5)", "u, v = cos(t), sin(t)")
    s.write(f"a, b, d = u * x + v * y - {radius}, z, u * y - v * x")
    s.write(f"f = where(m > 0.03, {factor}, 1 / where(absolute(m) < 1e-9, 1e-9, m))")
    s.write("w = (f * where(m > 0.03, a, x), f * where(m > 0.03, b, y), f * where(m > 0.03, d, z))")


@known(82, "Msltoe - Donut", "Msltoe 2011, fractalforums.com: donut", LEFT_OUT)
def donut_of_escape(s: FormulaStep) -> None:
    """Rings along a ring, and so on, by escape."""
    rings(s)
