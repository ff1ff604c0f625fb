"""Transforms of Mandelbulber in NumPy; see `mandelbulber_oracle`."""

from __future__ import annotations

import numpy as np

from .mandelbulber_oracle import (
    Formula,
    Points,
    Values,
    box,
    column,
    length2,
    mandalay,
    menger,
    rotation,
    symmetric,
    turned_back,
)


def add_constant(w: Points, c: Points, v: Values, _: int) -> Points:
    return w + column(v["transf_addition_constant"]) + column(v["transf_addition_constantA_000"])


def turned(w: Points, c: Points, v: Values, _: int) -> Points:
    return rotation(v["transf_rotation"]) @ w


def turned_more(w: Points, c: Points, v: Values, i: int) -> Points:
    start, stop = v["transf_start_iterations_250"], v["transf_stop_iterations"]
    share = 0.0 if i < start else min((i - start) / (stop - start), 1)
    return rotation(np.array(v["transf_rotation"]) + share * np.array(v["transf_offset_000"])) @ w


def scaled(w: Points, c: Points, v: Values, _: int) -> Points:
    return v["transf_scale"] * w


def scaled_3d(w: Points, c: Points, v: Values, _: int) -> Points:
    return column(v["transf_scale3D_111"]) * w


def box_offset(w: Points, c: Points, v: Values, _: int) -> Points:
    return w + np.sign(w) * column(v["transf_addition_constant"])


def radial_offset(w: Points, c: Points, v: Values, _: int) -> Points:
    return v["transf_scale"] * (1 - v["transf_offset"] / np.sqrt(length2(w))) * w


def add_start(w: Points, c: Points, v: Values, _: int) -> Points:
    return w + c * column(v["transf_constant_multiplier_111"])


def box_fold(w: Points, c: Points, v: Values, _: int) -> Points:
    return box(w, v["mandelbox_folding_limit"], v["mandelbox_folding_value"])


def spherical_fold(w: Points, c: Points, v: Values, _: int) -> Points:
    r2, o = length2(w), column(v["mandelbox_offset"])
    m, f = v["mandelbox_folding_min_radius"] ** 2, v["mandelbox_folding_fixed_radius"] ** 2
    k = np.where(r2 < m, f / m, np.where(r2 < f, f / r2, 1))
    return k * v["transf_scale"] * (w + o) - o


def zyx(w: Points, c: Points, v: Values, _: int) -> Points:
    return w[::-1]


def absolute_between(w: Points, c: Points, v: Values, _: int) -> Points:
    return abs(w + column(v["transf_addition_constant"])) + column(v["transf_offsetA_000"])


def absolute_at(w: Points, c: Points, v: Values, _: int) -> Points:
    w = abs(w + column(v["transf_addition_constant"])) + column(v["transf_offset_000"])
    a = column(v["transf_offsetA_000"])
    return a - abs(a - w)


def tglad(w: Points, c: Points, v: Values, _: int) -> Points:
    a = column(v["transf_addition_constant"])
    return abs(w + a) - abs(w - a) - w


def radial_power(w: Points, c: Points, v: Values, _: int) -> Points:
    return np.sqrt(length2(w)) ** (v["power"] - 1) * w


def radial_cube(w: Points, c: Points, v: Values, _: int) -> Points:
    return v["transf_scale"] * length2(w) * w


def menger_fold(w: Points, c: Points, v: Values, _: int) -> Points:
    return menger(w, v["transf_scale_3"], v["transf_constant_multiplier_111"])


def inverted(w: Points, c: Points, v: Values, _: int) -> Points:
    w = v["transf_scale"] * (w + column(v["mandelbox_offset"]))
    return w / length2(w) - column(v["mandelbox_offset"]) - column(v["transf_addition_constant"])


def turned_folds(w: Points, c: Points, v: Values, _: int) -> Points:
    o = column(v["transf_offset_000"])
    w = abs(rotation(v["transf_rotation"]) @ w + o) - o
    return rotation(v["transf_rotation2"]) @ w


def absolute_conditional(w: Points, c: Points, v: Values, _: int) -> Points:
    a, b = column(v["transf_offset_111"]), column(v["transf_scale3D_000"])
    return np.sign(w) * (a - abs(w) + b * abs(w))


def sectors(w: Points, c: Points, v: Values, _: int) -> Points:
    n = v["transf_int_6"]
    number = np.trunc(-n / (2 * np.pi) * np.arctan(w[0] / w[1]))
    a = number * 2 * np.pi / n
    x, y = w[0] * np.cos(a) - w[1] * np.sin(a), w[0] * np.sin(a) + w[1] * np.cos(a)
    y = np.where(number % 2 == 1, -y, y)
    return np.array([x + v["transf_offset_0"], y + v["transf_offsetA_0"], w[2]])


def polygon(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, k = abs(w[0]), w[1], np.pi / v["transf_int8_X"]
    angle = abs(np.fmod(np.arctan2(y, x) + k, 2 * k) - k)
    r = np.hypot(x, y)
    return np.array([r * np.cos(angle), r * np.sin(angle), w[2]]) + column(v["transf_addition_constant"])


def diagonal(w: Points, c: Points, v: Values, _: int) -> Points:
    return np.array([np.minimum(w[0], w[1]), np.maximum(w[0], w[1]), w[2]])


def scale_about(w: Points, c: Points, v: Values, _: int) -> Points:
    a = column(v["transf_addition_constant"])
    return v["transf_scale_1"] * (w - a) + a


def add_inverse(w: Points, c: Points, v: Values, _: int) -> Points:
    d, r = 1 / length2(w), 1 / np.sqrt(length2(w))
    d = r + (d - r) * v["transf_scaleA_1"]
    return v["transf_scaleB_1"] * (w + w * column(v["transf_scale3D_111"]) * d)


def times_square(w: Points, c: Points, v: Values, i: int) -> Points:
    first, w = w, v["transf_scale"] * (w + column(v["mandelbox_offset"]))
    r2 = length2(first if v["transf_function_enabledy_false"] else w)
    k = r2
    if v["transf_function_enabledP_false"] and i < v["transf_stop_iterations_P1"]:
        k = 1 / r2
        w = k * w
    o = column(v["transf_offset_000"])
    if i < v["transf_stop_iterations_C1"]:
        w = (w + o) / k - o
    return w - column(v["mandelbox_offset"]) - column(v["transf_addition_constant"])


def tiled(w: Points, c: Points, v: Values, _: int) -> Points:
    size = v["transf_offset_222"][0]
    w = w - column(v["transf_addition_constantA_000"])
    w[0] = w[0] - v["transf_offset_000"][0]
    w[0] = w[0] - size * np.floor(w[0] / size + 0.5)
    return w


def add_start_inverted(w: Points, c: Points, v: Values, _: int) -> Points:
    return w + column(v["transf_constant_multiplier_111"]) / c


def sine_cosine(w: Points, c: Points, v: Values, _: int) -> Points:
    x = 2 * np.pi * w[0]
    s = v["transf_scaleA_1"] * np.sin(x / v["transf_constant_multiplierA_111"][0])
    t = v["transf_scaleB_1"] * np.cos(x / v["transf_constant_multiplierB_111"][0])
    w = w.copy()
    w[0] = np.maximum(np.maximum(s, t), v["transf_scaleC_1"] * s * t)
    return v["transf_scale"] * w


def polygon_mixed(w: Points, c: Points, v: Values, i: int) -> Points:
    if i >= v["transf_stop_iterations_D1"]:
        return w + column(v["transf_addition_constant"])
    x, y, z = np.array([abs(w[0]), abs(w[1]), w[2]]) + column(v["transf_offset_000"])
    k = np.pi / v["transf_int8_X"]
    angle, r = abs(np.fmod(np.arctan2(y, x) + k, 2 * k) - k), np.hypot(x, y)
    p, q = r * np.cos(angle), r * np.sin(angle)
    mixed = [q + (p - q) * v["transf_scaleF_1"], p + (q - p) * v["transf_scaleG_1"], z]
    return np.array(mixed) + column(v["transf_addition_constant"])


def menger_fold_2(w: Points, c: Points, v: Values, _: int) -> Points:
    w, o, scale = abs(w) + column(v["transf_offset_000"]), v["transf_offset_1105"], v["transf_scale_3"]
    for k, (i, j) in enumerate(((0, 2), (0, 1), (1, 2))):
        t = v["transf_addition_constant_0555"][k] * (w[i] - w[j] - abs(w[i] - w[j]))
        w[i], w[j] = w[i] - t, w[j] + t
    middle = o[2] * (scale - 1) / scale
    w[2] = middle - abs(w[2] - middle)
    return scale * w - column((o[0], o[1], 0)) * (scale - 1) + column(v["transf_addition_constantA_000"])


def dot_fold(w: Points, c: Points, v: Values, _: int) -> Points:
    a, b = np.radians(v["transf_angle_deg_A"]), np.radians(v["transf_angle_deg_B"])
    n = np.array([np.cos(a) * np.sin(b), np.sin(a), np.cos(a) * np.cos(b)]) + v["transf_offset_000"]
    n /= np.linalg.norm(n)
    return rotation(v["transf_rotation"]) @ (w - 2 * n[:, None] * np.maximum(n @ w, 0))


def octo_fold(w: Points, c: Points, v: Values, _: int) -> Points:
    for j, sign in ((1, -1), (2, -1), (1, 1), (2, 1)):
        low = w[0] < sign * w[j]
        w = w.copy()
        w[0], w[j] = np.where(low, sign * w[j], w[0]), np.where(low, sign * w[0], w[j])
    w[0] = abs(w[0])
    return v["transf_scale_2"] * w - (v["transf_scale_2"] - 1) * column(v["transf_offset_100"])


def folding_planes(w: Points, c: Points, v: Values, _: int) -> Points:
    limit, value = v["mandelbox_folding_limit"], v["mandelbox_folding_value"]
    for k in range(3):
        back, forth = (rotation(v[f"mandelbox_rotation_{s}_{k + 1}"]) for s in ("neg", "pos"))
        above, below = back @ w, forth @ w
        first, second = above[k] > limit, below[k] < -limit
        above[k], below[k] = value - above[k], -value - below[k]
        w = np.where(first, back.T @ above, np.where(second, forth.T @ below, w))
    return w


def absolute_differences(w: Points, c: Points, v: Values, _: int) -> Points:
    a, b = column(v["transf_addition_constant"]), column(v["transf_offset_000"])
    return abs(w + a) - abs(w - b) - column(v["transf_scale3D_111"]) * w + column(v["transf_offsetA_000"])


def sine_or_cosine(w: Points, c: Points, v: Values, _: int) -> Points:
    u = w * column(v["transf_constant_multiplierC_111"])
    return v["transf_scale"] * np.array([np.cos(u[0]), np.sin(u[1]), np.sin(u[2])])


def platonic(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = v["platonic_solid_frequency"] * w
    waves, r = np.cos(x) * np.sin(y) + np.cos(y) * np.sin(z) + np.cos(z) * np.sin(x), np.sqrt(length2(w))
    if v["transf_function_enabled_false"]:
        radial = r**0.5 + (r - r**0.5) * v["transf_scale_1"]
        return w * (abs(waves) * v["platonic_solid_amplitude"] + radial * v["platonic_solid_rhoMul"])
    return w * (waves * v["platonic_solid_amplitude"] + r**0.5 * v["platonic_solid_rhoMul"])


FORMULAS: dict[int, Formula] = {
    56: platonic,
    1001: add_constant,
    1002: turned,
    1003: scaled,
    1004: scaled_3d,
    1005: box_offset,
    1006: radial_offset,
    1007: add_start,
    1020: box_fold,
    1021: spherical_fold,
    1022: zyx,
    1023: absolute_between,
    1025: tglad,
    1027: radial_power,
    1029: absolute_differences,
    1036: turned_more,
    1048: folding_planes,
    1052: menger_fold,
    1054: radial_cube,
    1055: inverted,
    1059: octo_fold,
    1064: turned_folds,
    1065: absolute_conditional,
    1068: radial_offset,
    1080: sectors,
    1082: sine_or_cosine,
    1084: sine_cosine,
    1098: diagonal,
    1100: polygon,
    1105: scale_about,
    1108: mandalay,
    1129: turned_back,
    1135: add_start_inverted,
    1140: polygon_mixed,
    1145: menger_fold_2,
    1146: add_inverse,
    1150: tiled,
    1151: dot_fold,
    1152: absolute_at,
    1155: times_square,
    1158: symmetric,
}
