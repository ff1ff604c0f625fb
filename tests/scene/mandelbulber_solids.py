"""Kleinian groups and solids in iterations of Mandelbulber in NumPy: steps as in `mandelbulber_oracle`, and
distances of points [3, n] by values, from their published mathematics.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .mandelbulber_oracle import (
    DIAGONAL,
    Formula,
    Points,
    Values,
    about,
    ball,
    box,
    column,
    folded_diagonal,
    koch_ifs,
    length2,
    menger,
    rotation,
)

Distance = Callable[[Points, Values], np.ndarray]

VALUES = {
    103: "transf_addition_constant_0777 0.6 0.7 0.8; transf_function_enabledN_false true; "
    "transf_function_enabledR_false true; transf_rotation 10 0 20; transf_addition_constant 0.1 0 0.2; "
    "transf_function_enabledP_false true; transf_constant_multiplier_000 0.1 0.2 0",
    117: "transf_benesi_T1_enabled_false true; transf_function_enabledF_false true; "
    "transf_function_enabled_false true; transf_scale3D_000 0.1 0.2 0.3; transf_offsetA_000 0.9 1 1.1; "
    "transf_function_enabledS_false true; transf_minR2_p25 0.3",
    101: "transf_function_enabledF_false true; transf_offsetF_000 0.9 1 1.1; transf_offset_000 1 0.8 1; "
    "transf_function_enabled true; transf_stop_iterations_M 1; transf_scaleB_1 0.9",
    217: "transf_sphere_inversion_enabled_false true; transf_offset_000 0.3 0 0; transf_scaleG_1 1.5; "
    "transf_function_enabledN_false true; transf_offset_0 0.1; transf_function_enabledG_false true; "
    "transf_addition_constantA_000 0.1 0.2 0; transf_constant_multiplier_000 0.1 0 0.05",
    122: "transf_offset_111 0.9 1 1.1; transf_folding_value 1.9; transf_offset 0.3",
    239: "transf_offset_000 0.2 0 0; transf_sphere_inversion_enabled_false true; transf_rotation2 0 10 20; "
    "transf_function_enabledI_false true; transf_function_enabledBy_false true; "
    "transf_addition_constantP_000 0 0.1 0; transf_function_enabledK_false true; transf_scale_vary_0 0.1",
    278: "transf_offset_0 0.2; transf_function_enabledS_false true; transf_offsetR_0 0.1; "
    "transf_offsetF_0 0.05",
    600: "transf_offset_001 0.1 0 0.5; transf_scale_2 1.5; transf_addition_constant_111 1 0.5 0.3; "
    "transf_function_enabledM_false true; transf_scaleA_0 0.1; transf_offsetE_0 0.2",
    601: "transf_function_enabledP_false true; transf_function_enabledT_false true; transf_scale_0 0.2; "
    "transf_function_enabledC_false true; transf_offsetC_0 0.4; transf_offset_001 0 0.1 0.3",
    602: "transf_function_enabledI_false true; transf_offsetA_000 1 0.9 0.8; "
    "transf_function_enabledR_false true; transf_rotation 10 20 0; "
    "transf_function_enabledCx_false true; transf_offset_001 0 0.1 0.3",
    603: "transf_function_enabled_false true; transf_function_enabledBx_false true; transf_radius_1 0.6; "
    "transf_function_enabledCy_false true; transf_function_enabledT_false true; transf_scale_0 0.2; "
    "transf_offsetE_2 1.5; transf_function_enabledK_false true; transf_scale_vary_0 0.2",
    604: "transf_function_enabledT_false true; transf_offset_001 0 0 0.5",
    606: "transf_function_enabledSw_false true; transf_offsetT_1 0.8; transf_offset_001 0 0 0.5",
    608: "transf_function_enabledC_false true; transf_scale_1 0.7; transf_offset_001 0 0.2 0.5; "
    "transf_offset_0005 0.05; transf_scaleF_1 0.8",
    1600: "transf_addition_constant_111 1 0.5 0.3; transf_offsetB_0 0.1",
    1601: "transf_function_enabledS_false true; transf_offset_0 0.2; transf_function_enabled_false true",
    1603: "transf_function_enabledG_false true; transf_scaleA_1 1.2; transf_function_enabledJ_false true",
    1605: "transf_function_enabledJ_false true; transf_function_enabledA_false true",
    1606: "transf_function_enabled_false true; transf_offset_p01 0.1",
    250: "transf_scaleB_1 1.5; transf_offset_000 0.1 0 0",
    1625: "transf_function_enabledC_false true; transf_function_enabledT_false true; transf_scaleA_1 0.2; "
    "transf_offsetA_1 0.7; transf_offset_000 0.1 0 0.2; transf_offset_1 0.8",
    1639: "transf_offset_110 1 0.8 0.1",
    1627: "transf_function_enabledM_false true; transf_function_enabledO_false true; transf_offset_05 0.3; "
    "transf_function_enabledP_false true; transf_offset_p01 0.1",
    104: "transf_function_enabledAy_false true; transf_function_enabledK_false true; transf_scaleB_1 1.2; "
    "transf_function_enabledN_false true; transf_addition_constant 0.1 0 0.2; "
    "transf_function_enabledM_false true; transf_start_iterations_M 1; transf_addition_constantA_000 0 0.1 0",
    225: "transf_sphere_inversion_enabled_false true; transf_offset_000 1 0 -0.1; transf_offset 0.1; "
    "transf_addition_constant 0 0 -1; transf_folding_value 1.97; transf_function_enabledP_false true; "
    "transf_function_enabledI_false true; transf_function_enabledz false; transf_scaleA_1 0.8",
    230: "transf_folding_value 1.9; transf_function_enabledAw_false true; "
    "transf_function_enabledN_false true; transf_function_enabledX_false true; transf_offset 0.1; "
    "transf_offset_02 0.1; transf_offset_2 1; transf_function_enabledE_false true; transf_scale_0 -0.5; "
    "transf_function_enabledK_false true; transf_scale_vary_0 0.05; transf_function_enabledT_false true; "
    "transf_start_iterations_T 1",
    610: "donut_factor 2; donut_number 5; donut_ring_thickness 0.2",
    82: "donut_factor 2.5; donut_number 6; donut_ring_thickness 0.15",
    1628: "transf_function_enabledM_false true; transf_function_enabledO_false true; transf_offset_p01 0.1; "
    "transf_rotation -13 0 0; transf_scale_1 0.9; transf_offset_000 0 0.1 0.2; transf_offset_05 0.3; "
    "transf_function_enabledZc_false true; transf_stop_iterations_Zc 2; transf_function_enabledP_false true",
    1629: "transf_function_enabledCz_false true; transf_int_32 8; transf_offset_000 0 0 0.3; "
    "transf_function_enabledK_false true; transf_int_1 3; transf_offset_p01 0.1; transf_scale_1 1.2; "
    "transf_rotation 0 20 0",
    1637: "transf_function_enabledE_false true; transf_function_enabledZc_false true; "
    "transf_offset_000 0 0.5 0; transf_offset_110 1 1 0.2; transf_offsetA_000 -0.1 0.4 0; "
    "transf_offsetC_0 0.2; transf_radius_1 0.8; transf_function_enabledF_false true; transf_scaleB_1 0.2; "
    "transf_scaleD_1 0.8; transf_offset_01 0.4; transf_function_enabled_false true; transf_scaleA_1 0.7",
    1643: "transf_scaleA_1 1.2; transf_function_enabledF_false true; transf_offsetF_000 0.1 0.2 0; "
    "transf_function_enabledA_false true; transf_offset_000 0.1 0 0",
    1645: "transf_function_enabledCx false; transf_function_enabledD_false true; transf_offsetA_1 0.5; "
    "transf_function_enabledE_false true; transf_function_enabledK_false true; transf_offset_p01 0.1; "
    "transf_function_enabledS_false true; transf_offsetF_000 0.5 0.2 0; transf_function_enabledT_false true; "
    "transf_scale_1 1.5; transf_offsetA_000 0.1 0.2 0",
    1646: "transf_angle_deg_A 22; transf_function_enabledJ_false true; transf_function_enabledC_false true; "
    "transf_function_enabledT_false true; transf_offset_000 0.4 0 0; transf_scale_1 1.3; "
    "transf_offset_0005 0.1",
    1632: "transf_scaleB_0 0.7; transf_scaleA_0 0.2; transf_function_enabledA_false true; "
    "transf_function_enabledAx_false true; transf_offset_000 0.1 0 0; transf_scaleC_1 0.8",
    1633: "transf_function_enabledCx_false true; transf_int8_X 5; transf_scale_1 1.5; transf_offset_p01 0.1; "
    "transf_offsetA_p01 0.2; transf_offsetB_p01 0.15; transf_function_enabledD_false true",
}


FIRST = {
    1636: "; transf_function_enabledJ_false true; transf_offset_2 0.5; transf_offsetE_0 0.2",
    1643: "; transf_function_enabledD_false true; transf_function_enabledE_false true; transf_scale_08 0.6; "
    "transf_function_enabledJ_false true",
}
"""Values of solids that are about the start point, and so of the first iteration alone."""

VARIANTS = [
    (37, "mandelbox_generalized_fold_type fold_dodeca; mandelbox_scale -1.7"),
    (37, "mandelbox_generalized_fold_type fold_cube; mandelbox_scale -1.7"),
    (37, "mandelbox_generalized_fold_type fold_box5; mandelbox_scale -1.7"),
    (37, "mandelbox_generalized_fold_type fold_box6; mandelbox_solid 0.8"),
    (
        56,
        "transf_function_enabled_false true; transf_function_enabledAx_false true; transf_scale_1 0.4; "
        "transf_function_enabledy_false true; transf_function_enabledAz_false true",
    ),
    (
        91,
        "transf_function_enabledx_false true; transf_int_1 2; transf_constant_multiplierB_111 1 0.5 0.2; "
        "transf_addition_constantA_000 0.1 0 0; mandelbulbMulti_order_of_xyz_C zxy",
    ),
    (117, "transf_function_enabledx_false true; transf_scale3D_333 2.6 3 3"),
    (126, "transf_function_enabledX_false true; transf_start_iterations_B 1"),
    (127, "transf_function_enabledAx_false true; transf_addition_constant 0 0.1 2; transf_scale_1 -0.6"),
    (
        132,
        "transf_function_enabledBx_false true; transf_function_enabledBz_false true; transf_scale_1 0.2; "
        "transf_addition_constant 0.1 -0.3 -0.1; transf_stop_iterations_X 2",
    ),
    (
        226,
        "transf_function_enabledN_false true; transf_function_enabledA_false true; "
        "transf_function_enabledAx_false true; transf_start_iterations_N 1; transf_offset_0 0.1",
    ),
    (
        262,
        "transf_function_enabledF_false true; transf_function_enabledE_false true; "
        "transf_function_enabledAz_false true; transf_function_enabledA_false true",
    ),
    (1155, "transf_scale 0.9; mandelbox_offset 0.2 0 0; transf_function_enabledy_false true"),
    (1633, "transf_function_enabledZc_false true; transf_offset_p01 0.3; transf_offsetC_111 2 1 1.5"),
    (1639, "transf_function_enabledZc_false true; transf_offset_110 1 0.8 0.1"),
]
"""Formulas with switches beside those of `VALUES`."""


def inverse(w: Points, centre: Points, radius2: float, back: Points) -> Points:
    """Inversion in a sphere, moved."""
    v = w + centre
    return radius2 * v / length2(v) + back - centre


def out_of_ball(w: Points, v: Values) -> Points:
    """Folds of the group: a box, then the outside of a ball."""
    w = box(w, v["transf_addition_constant_0777"])
    return w * np.where(
        length2(w) < v["transf_minimum_radius_05"], v["transf_minimum_radius_05"] / length2(w), 1
    )


def flipped(w: Points, *axes: int) -> Points:
    w = w.copy()
    for axis in axes:
        w[axis] *= -1
    return w


def cross(w: Points, v: Values) -> Points:
    """The prism's folds: a reflection at 60 degrees, sorted coordinates, and what is behind falls down."""
    x, y, z = w[0], abs(w[1]), abs(w[2])
    t = v["transf_scale"] * np.maximum(y / 2 - np.sqrt(3) / 2 * x, 0)
    x, y = x + np.sqrt(3) * t, abs(y - t)
    y, z = np.sort([y, z], axis=0)
    x, y, z = np.array([x, y, z]) - column(v["transf_constant_multiplier_000"]) * column(
        (0.75**0.5, 1.5, 1.5)
    )
    z, x = np.sort([x, z], axis=0)
    return np.array([x, np.where((x > 0) & (y < 0), 0, y), np.where((x > 0) & (z < 0), 0, z)])


def pseudo_kleinian(w: Points, c: Points, v: Values, i: int) -> Points:
    w = flipped(out_of_ball(cross(w, v) if i == 0 else w, v), 2)
    return rotation(v["transf_rotation"]) @ w + column(v["transf_addition_constant"])


def diagonal_scale(w: Points, scale: Points, back: Points) -> Points:
    """Absolute values in a frame about the diagonal."""
    return DIAGONAL.T @ (scale * abs(DIAGONAL @ w)) - back


def pushed(w: Points, limit: Points, share: Points) -> Points:
    """Coordinates pushed towards the middle of a folded box."""
    near = np.minimum(abs(w), np.maximum(2 * limit - abs(w), 0))
    return w - np.sign(w) * share * near**2 / (2 * limit)


def pseudo_kleinian_2(w: Points, c: Points, v: Values, i: int) -> Points:
    if v["transf_function_enabledx_false"]:
        start = folded_diagonal(w, column(v["transf_scale3D_333"]), v["transf_addition_constant_111"])
        return out_of_ball(w if i else start, v)
    w = v["transf_scale_1"] * ball(w, v["transf_minR2_p25"], v["transf_maxR2_1"])
    if i == 0:
        w = diagonal_scale(w, column(v["transf_scale3D_222"]), column(v["transf_offset_200"]))
    w, limit = out_of_ball(w, v), column(v["transf_offsetA_000"])
    return pushed(box(w, v["transf_offsetA_000"]), limit, column(v["transf_scale3D_000"]))


def pseudo_kleinian_std(w: Points, c: Points, v: Values, i: int) -> Points:
    a, b, k = (column(v[f"transf_{name}"]) for name in ("offsetF_000", "offset_000", "scale3D_111"))
    w = abs(w + a) - abs(w - b) - k * w
    if i < v["transf_stop_iterations_M"]:
        w = menger(w, v["transf_scale_3"])
    return out_of_ball(v["transf_scaleB_1"] * w, v)


def pseudo_kleinian_4(w: Points, c: Points, v: Values, i: int) -> Points:
    if i == 0:
        w = inverse(w, column(v["transf_offset_000"]), v["transf_scaleG_1"], 0 * column((0, 0, 0)))
    w = out_of_ball(w - np.where(w < 0, -1, 1) * column(v["transf_constant_multiplier_000"]), v)
    w = w + (-1) ** i * column(v["transf_addition_constantA_000"])
    x, y = abs(w[0]), abs(w[1])
    x, y = x + y - v["transf_offset_0"], -abs(x - y)
    x, y = (x + y) / 2, (x - y) / 2
    return np.array([1 - abs(x + 1), y, w[2]])


def jos_kleinian(w: Points, c: Points, v: Values, _: int) -> Points:
    (sx, sy, sz), a, b = v["transf_offset_111"], v["transf_folding_value"], v["transf_offset"]
    x, z = ((p + s) % (2 * s) - s for p, s in ((w[0], sx), (w[2], sz)))
    y = (w[1] + sy - 1) % (a * sy) - (sy - 1)
    above = y >= a * (0.5 + 0.2 * np.sin(np.pi * (x + b / 2) / sx))
    w = np.where(above, [-b - x, a - y, -z], [x, y, z])
    return -w / length2(w) * column((-1, 1, 1)) + column((-b, a, 0))


def amazing_ifs(w: Points, c: Points, v: Values, i: int) -> Points:
    if i == 0:
        w = inverse(w, column(v["transf_offset_000"]), v["transf_scaleG_1"], column((0, 0, 0)))
    limit = v["transf_addition_constant_0555"]
    w = np.array([*box(w, limit)[:2], w[2]])
    w[1] = abs(w[1]) - v["transf_addition_constantP_000"][1]
    w = w + column(v["transf_addition_constantA_000"])
    added = 0.0
    for _ in range(i):
        added -= v["transf_scale_vary_0"] * (abs(added) - v["transf_scaleC_1"])
    r2 = length2(w)
    w = (v["transf_scale_2"] + added) * w / np.clip(r2, v["transf_minR2_p25"], 1)
    return rotation(v["transf_rotation2"]) @ w


def vary(v: Values, i: int, on: bool) -> float:
    """Scale of an iteration."""
    added = 0.0
    for _ in range(i if on else 0):
        added -= v["transf_scale_vary_0"] * (abs(added) - v["transf_scaleC_1"])
    return float(v["transf_scale_2"] + added)


def beyond(p: np.ndarray, a: float) -> np.ndarray:
    """Reflected to the side above a."""
    return np.where(p < a, 2 * a - p, p)


def polygon(w: Points, sides: int) -> Points:
    """Angle about z, folded into half of a sector, as C's remainder is of negative angles."""
    angle, r, k = np.arctan2(w[1], w[0]), np.hypot(w[0], w[1]), np.pi / sides
    angle = abs(np.fmod(angle + k, 2 * k) - k)
    return np.array([r * np.cos(angle), r * np.sin(angle), w[2]])


def scaled_about(w: Points, scale: float, x: float, y: float, v: Values) -> Points:
    o = column((x, y, 0))
    return scale * (w - o) + o + column(v["transf_offset_001"])


def box_diagonal_1(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y = np.sort(w[:2], axis=0)
    a, b, _ = v["transf_addition_constantA_111"]
    w = np.array([abs(x) - a, abs(y) - b, w[2]])
    return scaled_about(w, v["transf_scale_2"], v["transf_offsetE_0"], v["transf_offsetF_0"], v)


def box_1(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y = box(w, v["transf_addition_constantA_111"])[:2]
    w = polygon(np.array([abs(x), y, w[2]]), 6)
    w[0] = beyond(w[0], v["transf_offsetC_0"])
    return scaled_about(w, v["transf_scale_2"], 0, 0, v)


def box_diagonal_3(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y = abs(w[0]), abs(w[1])
    w = np.array([np.maximum(x, y), np.minimum(x, y), w[2]])
    w = box(w, v["transf_offsetA_000"])
    return rotation(v["transf_rotation"]) @ scaled_about(w, v["transf_scale_2"], 0, 0, v)


def cylinder(w: Points, c: Points, v: Values, i: int) -> Points:
    a, b, _ = v["transf_addition_constant_111"]
    x, y, z = abs(w[0]) - a, abs(w[1]) - b, w[2]
    x, z = np.minimum(x, z), np.maximum(x, z)
    scale = vary(v, i, True)
    return scaled_about(np.array([x, y, z]), scale, v["transf_offsetE_2"], v["transf_offsetF_2"], v)


def tower(w: Points, c: Points, v: Values, _: int) -> Points:
    w = np.array([abs(w[0]), abs(w[1]), w[2]])
    return scaled_about(w, v["transf_scale_2"], v["transf_offsetE_2"], v["transf_offsetF_2"], v)


def tiled(w: Points, c: Points, v: Values, i: int) -> Points:
    w = w.copy()
    if i < v["transf_stop_iterations_C1"]:
        for k, t in enumerate((v["transf_offset_2"], v["transf_offsetA_2"])):
            w[k] = np.fmod(abs(w[k]) + t, 2 * t) - t
    return v["transf_scale_2"] * w + column(v["transf_offset_001"])


def same(w: Points, c: Points, v: Values, _: int) -> Points:
    return w


def scaled(w: Points, c: Points, v: Values, _: int) -> Points:
    return v["transf_scaleA_1"] * w


def framed(w: Points, c: Points, v: Values, i: int) -> Points:
    if v["transf_function_enabledZc_false"]:
        return abs(v["transf_scale_1"] * w) - column(v["transf_offsetC_111"])
    if v["transf_start_iterations_A"] <= i < v["transf_stop_iterations_A"]:
        w = polygon(np.array([w[0], abs(w[1]), w[2]]), int(v["transf_int8_X"]))
    return v["transf_scale_1"] * abs(w - column(v["transf_offset_000"]))


def board(w: Points, c: Points, v: Values, _: int) -> Points:
    return abs(w) - column(v["transf_offset_110"]) if v["transf_function_enabledZc_false"] else w


def moved(w: Points, c: Points, v: Values, _: int) -> Points:
    return w + column(v["transf_offset_000"])


def triplex(w: Points, power: float) -> Points:
    """Power of a triplex number, by its angles."""
    r, theta, phi = np.sqrt(length2(w)), np.arcsin(w[2] / np.sqrt(length2(w))), np.arctan2(w[1], w[0])
    theta, phi = power * theta, power * phi
    return r**power * np.array([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)])


def newton(w: Points, c: Points, v: Values, _: int) -> Points:
    root = column((1, 0, 0))
    w = v["transf_scaleA_1"] * triplex(w, -1) + root
    w = 2 / 3 * w + triplex(w, -2) / 3 - root
    return v["transf_scaleB_1"] * triplex(w, -1) + column(v["transf_offset_000"])


def globe_2(w: Points, c: Points, v: Values, i: int) -> Points:
    w = rotation(v["transf_rotation"]) @ (v["transf_scale_1"] * (w + column(v["transf_offset_000"])))
    return lunes(w, int(v["transf_int8_Z"])) if i < v["transf_stop_iterations_Zc"] else w


def globe_3(w: Points, c: Points, v: Values, _: int) -> Points:
    w = polygon(np.array([w[0], abs(w[1]), w[2]]), int(v["transf_int_32"]))
    z, x, y = polygon(np.array([w[2], abs(w[0]), w[1]]), int(v["transf_int8_Z"]))
    w = v["transf_scale_1"] * (np.array([x, y, z]) + column(v["transf_offset_000"]))
    return rotation(v["transf_rotation"]) @ w[[2, 0, 1]]


def cayley(w: Points, c: Points, v: Values, i: int) -> Points:
    if i == 0:
        w = about(2, 45) @ w
    x, y, z = np.array([abs(w[0]), abs(w[1]), w[2]]) + column(v["transf_offset_000"])
    x, y, z = v["transf_scale_1"] * np.array([x, y, z])
    square = (x + 1j * y) ** 2
    m = v["transf_scaleA_2"] * x**2 * y**2 + x**4 + y**4
    n = m + v["transf_scale_4"] * x * y + 1
    image = np.array([v["transf_scale_2"] * (m - 1) / n, -2 * square.real / n, v["transf_scaleA_1"] * z])
    return abs(image) - column(v["transf_offset_110"])


def of_cayley(w: Points, v: Values) -> np.ndarray:
    to_planes = (w + column(v["transf_offset_110"]) - column(v["transf_addition_constant"])).min(axis=0)
    first = np.maximum(np.linalg.norm(np.maximum(w, 0), axis=0), to_planes) - v["transf_offsetC_0"]
    r, h = np.hypot(w[0], w[1]) - v["transf_radius_1"], abs(w[2]) - v["transf_offset_01"]
    a, b, d = v["transf_offsetA_000"]
    corner = np.hypot(np.maximum(r - a, -b), np.maximum(h - d, 0))
    second = np.maximum(np.minimum(np.maximum(r, h), 0) + corner, to_planes) - v["transf_offsetD_0"]
    return first + (second - first) * v["transf_scaleD_1"] - v["transf_offsetA_0"]


def octant(w: Points, c: Points, v: Values, _: int) -> Points:
    h = column(v["transf_offsetF_000"])
    return abs(v["transf_scaleA_1"] * (w - np.clip(w, -h, h))) - column(v["transf_offset_000"])


def of_octahedron(w: Points, v: Values) -> np.ndarray:
    p = octant(w, w, v, 0)
    k = v["transf_scale_1"] * ((p.sum(axis=0) - v["transf_offset_1"]) / 3) ** 2
    t = np.minimum(p - k, 0).sum(axis=0) / 2
    m = np.linalg.norm(p - np.clip(p - k + t, 0, v["transf_offsetA_1"]), axis=0) - v["transf_offset_0005"]
    m = np.maximum(m / v["transf_scaleA_1"], of_box(w, column(v["transf_addition_constant_0555"])))
    return np.minimum(m, np.sqrt(length2(w)) - v["transf_scale_08"])


def tube(w: Points, c: Points, v: Values, _: int) -> Points:
    return v["transf_scale_1"] * w - column(v["transf_offsetA_000"])


def of_tube_2(w: Points, v: Values) -> np.ndarray:
    y, x, z = w
    a, b, _ = v["transf_offsetF_000"]
    z = abs(z) - b
    t = np.hypot(abs(x) - a, z)
    t = np.maximum(0.75**0.5 * t + z / 2, -z) - v["transf_offset_02"]
    return capped(np.maximum(t, abs(t) - v["transf_offset_p01"]), abs(y) - v["transf_offsetA_1"])


def torus_4(w: Points, c: Points, v: Values, _: int) -> Points:
    turn = about(2, v["transf_angle_deg_A"])
    w = turn @ (v["transf_scale_1"] * w - column(v["transf_offset_000"]))
    return turn @ np.array([abs(w[0]), w[1], w[2]])


def of_half_torus(w: Points, v: Values) -> np.ndarray:
    e = v["transf_offset_0005"]
    wall = abs(torus(w, v["transf_radius_1"], v["transf_offset_02"], square=True) + e) - e
    return np.maximum(wall, -w[1])


def donuts(w: Points, c: Points, v: Values, _: int) -> Points:
    radius, k = v["donut_ring_radius"], 2 * np.pi / v["donut_number"]
    m = (radius - np.hypot(w[0], w[1])) ** 2 + w[2] ** 2 - v["donut_ring_thickness"] ** 2
    number = np.exp(-1j * k * np.rint(np.arctan2(w[1], w[0]) / k)) * (w[0] + 1j * w[1])
    small = v["donut_factor"] * np.array([number.real - radius, w[2], number.imag])
    return np.where(m > 0.03, small, w / m)


def pseudo_kleinian_1(w: Points, c: Points, v: Values, i: int) -> Points:
    w = box(w, v["transf_addition_constant_0777"]) + (1 - v["transf_scaleB_1"]) * w
    w = flipped(w * np.maximum(v["transf_minimum_radius_05"] / length2(w), 1), 2)
    w = flipped(out_of_ball(w, v), 0) + column(v["transf_addition_constant"])
    if i >= v["transf_start_iterations_M"]:
        w = menger(abs(w), v["transf_scale_3"]) + column(v["transf_addition_constantA_000"])
    return w


def group(w: Points, v: Values, scale: float, swing: float, tiled: bool) -> Points:
    """Translations in a box, a half turn of the upper side, and an inversion; z is the height."""
    a, b, size = v["transf_folding_value"], v["transf_offset"], v["transf_offset_111"]
    x, y = [(p + s) % (2 * s) - s if tiled else p for p, s in zip(w[:2], size[:2], strict=True)]
    z = (w[2] + size[2] - 1) % (a * size[2]) - size[2] + 1
    up = z >= a * (0.5 + swing * np.sin(np.sign(b) * np.pi * (x + b / 2) / size[0]))
    w = scale * np.where(up, [-b - x, y, a - z], [x, y, z])
    return w / length2(w) * column((1, -1, -1)) + column((-b, 0, a))


def jos_kleinian_3(w: Points, c: Points, v: Values, i: int) -> Points:
    if i == 0:
        w = polygon(np.array([abs(w[0]), abs(w[1]), w[2]]), int(v["transf_int8_X"]))
        back = column(v["transf_addition_constant"])
        w = v["transf_scaleA_1"] * inverse(w, column(v["transf_offset_000"]), v["transf_maxR2_1"], back)
    return group(w, v, v["transf_scale_1"], 0.2, True)


def jos_kleinian_4(w: Points, c: Points, v: Values, i: int) -> Points:
    size = np.array((v["transf_offset_2"], v["transf_offsetA_2"]))[:, None]
    w = np.array([*(w[:2] - size * np.rint(w[:2] / size)), w[2]])
    added = 0.0
    for _ in range(i):
        added = v["transf_scale_vary_0"] * (abs(added) + 1)
    x, y, z = group(w, v, v["transf_scale_1"] - added, v["transf_offset_02"], False)
    y = np.sign(y) * (v["transf_offset_1"] + (v["transf_scale_0"] - 1) * abs(y))
    return np.array([x, y, np.minimum(z, v["transf_folding_value"] - z) if i else z])


def of_heights(w: Points, v: Values) -> np.ndarray:
    height = np.minimum(w[2], v["transf_folding_value"] - w[2])
    return np.minimum(height + v["analyticDE_offset_0"], v["analyticDE_tweak_005"])


FORMULAS: dict[int, Formula] = {
    82: donuts,
    104: pseudo_kleinian_1,
    225: jos_kleinian_3,
    230: jos_kleinian_4,
    610: donuts,
    1628: globe_2,
    1629: globe_3,
    1637: cayley,
    1643: octant,
    1645: tube,
    1646: torus_4,
    250: newton,
    1625: moved,
    1639: board,
    103: pseudo_kleinian,
    117: pseudo_kleinian_2,
    101: pseudo_kleinian_std,
    217: pseudo_kleinian_4,
    122: jos_kleinian,
    239: amazing_ifs,
    278: koch_ifs,
    600: box_diagonal_1,
    601: box_1,
    602: box_diagonal_3,
    603: cylinder,
    604: tower,
    606: tower,
    608: tiled,
    1600: same,
    1601: same,
    1603: scaled,
    1604: same,
    1605: same,
    1606: same,
    1627: same,
    1632: same,
    1633: framed,
}


def of_box(w: Points, size: np.ndarray) -> np.ndarray:
    q = abs(w) - size
    return np.linalg.norm(np.maximum(q, 0), axis=0) + np.minimum(q.max(axis=0), 0)


def boxes(w: Points, v: Values) -> np.ndarray:
    size = column(v["transf_addition_constant_111"]) + 0 * w
    if v["transf_function_enabledT_false"]:
        size[:2] += v["transf_scale_0"] * w[2] ** 2
    if v["transf_function_enabledM_false"]:
        size[:2] -= v["transf_scaleA_0"] * w[2]
    return of_box(w, size)


def torus(w: Points, radius: float, tube: float, axis: int = 2, square: bool = False) -> np.ndarray:
    across = np.delete(w, axis, axis=0)
    p = np.array([np.linalg.norm(across, axis=0) - radius, w[axis]])
    return (abs(p).max(axis=0) if square else np.linalg.norm(p, axis=0)) - tube


def capped(r: np.ndarray, h: np.ndarray) -> np.ndarray:
    p = np.array([r, h])
    return np.linalg.norm(np.maximum(p, 0), axis=0) + np.minimum(p.max(axis=0), 0)


def of_cylinder(w: Points, v: Values) -> np.ndarray:
    k = np.hypot(w[0], w[1]) - v["transf_radius_1"] + v["transf_scale_0"] * w[2] ** 2
    return capped(k, abs(w[2]) - v["transf_offsetA_1"])


def of_tube(w: Points, v: Values) -> np.ndarray:
    r = abs(np.hypot(w[0], w[1]) - v["transf_radius_1"]) - v["transf_offset_0"]
    return capped(r, abs(w[2]) - v["transf_offsetA_1"])


def of_sphere(w: Points, v: Values) -> np.ndarray:
    ring = torus(w, v["transf_offsetT_1"], v["transf_offset_05"])
    return np.minimum(np.sqrt(length2(w)) - v["transf_offsetR_1"], ring)


def of_hexagons(w: Points, v: Values) -> np.ndarray:
    a, height = v["transf_scale_1"], w[2] / v["transf_scaleF_1"]
    k = a * np.sqrt(3)
    x, y = abs(w[0] - k * np.rint(w[0] / k)), abs(w[1] - a * np.rint(w[1] / a))
    t = np.minimum(np.maximum(y, x * 0.75**0.5 + y / 2) - a / 2, y)
    wire = np.maximum(abs(t), abs(height)) if v["transf_function_enabledJ_false"] else np.hypot(t, height)
    return wire - v["transf_offset_0005"]


def of_prism(w: Points, v: Values) -> np.ndarray:
    side = (
        np.max([0.75**0.5 * w[1] + w[2] / 2, -(0.75**0.5) * w[1] + w[2] / 2, -w[2]], axis=0)
        - v["transf_offset_05"]
    )
    shell = np.maximum(side, abs(side) - v["transf_offset_p01"])
    return np.maximum(abs(w[0]) - v["transf_offset_1"], shell)


def lunes(w: Points, count: int) -> Points:
    """Angle from the y axis, folded into half of a sector."""
    x, y, z = polygon(np.array([w[1], abs(w[0]), w[2]]), count)
    return np.array([y, x, z])


def of_globe(w: Points, v: Values) -> np.ndarray:
    return rings_of_globe(lunes(w, int(v["transf_int8_Z"])), v, 0)


def rings_of_globe(w: Points, v: Values, axis: int) -> np.ndarray:
    """A ring about an axis, an equator and two circles of latitude of square tubes."""
    r, h = v["transf_offsetR_1"], v["transf_offset_05"]
    circle = np.array([w[0], w[1], abs(w[2]) - h])
    parts = (
        torus(w, r, v["transf_offset_p01"], axis=axis),
        torus(w, r, v["transf_offsetA_p01"]),
        torus(circle, np.sqrt(r * r - h * h), v["transf_offsetB_p01"], square=True),
    )
    return np.min(parts, axis=0)


def of_helix(w: Points, v: Values) -> np.ndarray:
    t = np.hypot(w[0], w[1]) * v["transf_scaleA_0"] + w[2] * v["transf_scaleB_0"]
    xy = (w[0] + 1j * w[1]) * np.exp(1j * t)
    x, y = v["transf_scaleC_1"] * xy.real, v["transf_scaleD_1"] * xy.imag
    x = abs(x) + v["transf_offset_000"][0]
    return capped(np.hypot(x, y) - v["transf_offset_01"], abs(w[2]) - v["transf_offsetA_1"])


def of_frame(w: Points, v: Values) -> np.ndarray:
    e = column([v[f"transf_offset{n}_p01"] for n in ("", "A", "B")])
    p = abs(w) - column(v["transf_offsetC_111"])
    q = abs(p + e) - e
    edges = []
    for k in range(3):
        own = q.copy()
        own[k] = p[k]
        edges.append(np.linalg.norm(np.maximum(own, 0), axis=0) + np.minimum(own.max(axis=0), 0))
    return np.min(edges, axis=0)


def of_koch(w: Points, v: Values) -> np.ndarray:
    size = abs(w).max(axis=0) - v["transf_offsetA_0"]
    return np.minimum(size, abs(w[2] - v["transf_offsetR_0"]) - v["transf_offsetF_0"])


def of_hexagon(w: Points, v: Values) -> np.ndarray:
    """A prism whose six sides come nearer with the square of the height."""
    a = v["transf_offset_1"]
    angle = np.radians(30 + 60 * np.arange(6))
    corners = a / np.cos(np.pi / 6) * np.array([np.cos(angle - np.pi / 6), np.sin(angle - np.pi / 6)])
    sides = []
    for p, q in zip(corners.T, np.roll(corners, -1, axis=1).T, strict=True):
        t = np.clip(((w[:2].T - p) @ (q - p)) / ((q - p) @ (q - p)), 0, 1)
        sides.append(np.linalg.norm(w[:2].T - p - t[:, None] * (q - p), axis=1))
    normals = np.array([np.cos(angle), np.sin(angle)])
    inside = (normals.T @ w[:2] < a).all(axis=0)
    r = np.where(inside, -1, 1) * np.min(sides, axis=0)
    return capped(r + v["transf_scaleA_1"] * w[2] ** 2, abs(w[2]) - v["transf_offsetA_1"])


SOLIDS: dict[int, Distance] = {
    225: of_heights,
    230: of_heights,
    610: lambda w, v: torus(w, v["donut_ring_radius"], v["donut_ring_thickness"]),
    1628: lambda w, v: rings_of_globe(w, v, 0),
    1629: lambda w, v: torus(lunes(w, int(v["transf_int_1"])), v["transf_offsetR_1"], v["transf_offset_p01"]),
    1637: of_cayley,
    1643: of_octahedron,
    1645: of_tube_2,
    1646: of_half_torus,
    1625: of_hexagon,
    1639: lambda w, v: (abs(w) - column(v["transf_offset_110"])).max(axis=0),
    101: lambda w, v: np.hypot(w[0], w[1]),
    103: lambda w, v: np.maximum(
        np.hypot(w[0], w[1]) - 1, np.hypot(w[0], w[1]) * abs(w[2]) / np.sqrt(length2(w))
    ),
    122: lambda w, v: np.min(
        [w[1], v["transf_folding_value"] - w[1], v["analyticDE_tweak_005"] + 0 * w[1]], axis=0
    ),
    278: of_koch,
    600: boxes,
    601: boxes,
    602: boxes,
    603: of_cylinder,
    604: of_sphere,
    606: lambda w, v: torus(w, v["transf_offsetT_1"], v["transf_offset_05"], axis=0),
    608: of_hexagons,
    1600: lambda w, v: of_box(w, column(v["transf_addition_constant_111"])) - v["transf_offsetB_0"],
    1601: of_tube,
    1603: of_hexagons,
    1604: lambda w, v: np.sqrt(length2(w)) - v["transf_offsetR_1"],
    1605: lambda w, v: np.maximum(torus(w, v["transf_offsetT_1"], v["transf_offset_05"], square=True), -w[0]),
    1606: of_prism,
    1627: of_globe,
    1632: of_helix,
    1633: of_frame,
}
"""Distances of formulas that have one of their own; of 104, 117 and 217 that of 103."""


def hypercomplex(q: np.ndarray, c: np.ndarray, k: int, v: Values) -> tuple[np.ndarray, np.ndarray]:
    """Square of numbers of four parts by their table of products: i i = -1, i j = -k."""
    product = np.zeros_like(q)
    for a in range(4):
        for b in range(4):
            known = a == 0 or b == 0
            at = max(a, b) if known else 0 if a == b else 6 - a - b
            product[at] += (1 if known else -1) * q[a] * q[b]
    product[:3] += c
    return product, c


def aexion(q: np.ndarray, c: np.ndarray, k: int, v: Values) -> tuple[np.ndarray, np.ndarray]:
    """Squares of two pairs, crossed; the constant is that of the start point in four coordinates."""
    if k == 0:
        signs = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
        q = c = abs(signs @ q[:3]) + v["cadd"]
    first, second = (q[0] + 1j * q[1]) ** 2, (q[2] + 1j * q[3]) ** 2
    image = (
        first.real + second.imag,
        second.imag - first.real,
        second.real + first.imag,
        first.imag - second.real,
    )
    return np.array(image) + c, c


FOURS = {4: hypercomplex, 19: aexion}
"""Steps in four dimensions: points [4, n], their constants, the number of the iteration, and values."""
