"""Formulas of Mandelbulber in NumPy, from their published mathematics: functions of points [3, n], the start
points [3, n], values by name, and the number of the iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Points = np.ndarray
Values = Mapping[str, Any]
Formula = Callable[[Points, Points, Values, int], Points]

X, Y, Z = np.eye(3)


def about(axis: int, degrees: float) -> np.ndarray:
    """Matrix of a rotation about an axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def rotation(angles: Any) -> np.ndarray:
    """Matrix of a turn about x, then y, then z."""
    return about(2, angles[2]) @ about(1, angles[1]) @ about(0, angles[0])


def column(values: Any) -> np.ndarray:
    return np.array(values, float)[:, None]


def length2(w: Points) -> np.ndarray:
    return (w**2).sum(0)


def box(w: Points, limit: Any, value: Any | None = None) -> Points:
    """Reflect at a limit, towards a value."""
    limit = np.broadcast_to(np.asarray(limit, float).reshape(-1, 1), (3, 1))
    value = 2 * limit if value is None else value
    return np.where(abs(w) > limit, np.sign(w) * value - w, w)


def ball(w: Points, inner2: float, outer2: float, offset: Any = (0, 0, 0)) -> Points:
    """Scale within the inner radius, invert within the outer one, about an offset."""
    r2, o = length2(w), column(offset)
    k = np.where(r2 < inner2, outer2 / inner2, np.where(r2 < outer2, outer2 / np.maximum(r2, 1e-300), 1.0))
    return k * (w + o) - o


def sorted_down(w: Points) -> Points:
    return np.sort(w, axis=0)[::-1]


def bulb(w: Points, power: float, alpha: float = 0.0, beta: float = 0.0) -> Points:
    """Power in polar coordinates whose angle is that to the equator."""
    r = np.sqrt(length2(w))
    theta = power * (np.arcsin(w[2] / r) + np.radians(beta))
    phi = power * (np.arctan2(w[1], w[0]) + np.radians(alpha))
    return r**power * np.array([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)])


def mandelbulb(w: Points, c: Points, v: Values, _: int) -> Points:
    return bulb(w, v["power"], v["alpha_angle_offset"], v["beta_angle_offset"])


def mandelbulb_square(w: Points, c: Points, v: Values, _: int) -> Points:
    return bulb(w, 2) * column((1, 1, -1))


def quaternion(w: Points, c: Points, v: Values, _: int) -> Points:
    q = np.array([w[0] ** 2 - w[1] ** 2 - w[2] ** 2, 2 * w[0] * w[1], 2 * w[0] * w[2]])
    return q


def bristorbrot(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = w
    return np.array([x * x - y * y - z * z, y * (2 * x - z), z * (2 * x + y)])


def xenodreambuie(w: Points, c: Points, v: Values, _: int) -> Points:
    r, n = np.sqrt(length2(w)), v["power"]
    phi = n * (np.arctan2(w[1], w[0]) + np.radians(v["beta_angle_offset"]))
    theta = np.arccos(w[2] / r) + np.radians(v["alpha_angle_offset"])
    theta = n * np.where(abs(theta) > np.pi / 2, np.sign(theta) * np.pi - theta, theta)
    return r**n * np.array([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)])


def mandelbox(w: Points, c: Points, v: Values, _: int) -> Points:
    limit, value = v["mandelbox_folding_limit"], v["mandelbox_folding_value"]
    if v["mandelbox_rotations_enabled"]:
        for k in range(3):
            for_neg, for_pos = (rotation(v[f"mandelbox_rotation_{s}_{k + 1}"]) for s in ("neg", "pos"))
            above, below = for_neg @ w, for_pos @ w
            first, second = above[k] > limit, (for_pos @ w)[k] < -limit
            above[k], below[k] = value - above[k], -value - below[k]
            w = np.where(first, for_neg.T @ above, np.where(second, for_pos.T @ below, w))
    else:
        w = box(w, limit, value)
    inner, outer = v["mandelbox_folding_min_radius"] ** 2, v["mandelbox_folding_fixed_radius"] ** 2
    w = ball(w, inner, outer, v["mandelbox_offset"])
    if v["mandelbox_main_rotation_enabled"]:
        w = rotation(v["mandelbox_rotation_main"]) @ w
    return v["mandelbox_scale"] * w


def menger(w: Points, scale: float, offset: Any = (1, 1, 1), always: bool = False) -> Points:
    w = scale * sorted_down(abs(w)) - 2 * column((*offset[:2], 0))
    w[2] -= np.where(always | (w[2] > 1), 2 * offset[2], 0)
    return w


def menger_sponge(w: Points, c: Points, v: Values, _: int) -> Points:
    return menger(w, v["transf_scale_3"])


def menger_3(w: Points, c: Points, v: Values, _: int) -> Points:
    o = column(v["transf_offset_111"])
    w = rotation(v["transf_rotation2"]) @ sorted_down(rotation(v["transf_rotation"]) @ abs(w))
    w[2] = abs(w[2] - o[2] / 3) + o[2] / 3
    return v["transf_scale_3"] * w - o * (v["transf_scale_3"] - 1)


def menger_mod_1(w: Points, c: Points, v: Values, i: int) -> Points:
    w = menger(w, v["transf_scale_3"], v["transf_constant_multiplier_111"])
    if v["transf_rotation_enabled"] and v["transf_start_iterations"] <= i < v["transf_stop_iterations"]:
        w = rotation(v["transf_rotation"]) @ w
    w = w + column(v["transf_addition_constant"])
    if v["transf_function_enabledx_false"]:
        w = w + np.where(w < 0, -1, 1) * column(v["transf_addition_constantA_000"])
    return w


def menger_smooth(w: Points, c: Points, v: Values, _: int) -> Points:
    scale, e = v["transf_scale_3"], v["transf_offset_0005"]
    a, b, d = v["transf_offset_1105"]
    w = np.sqrt(w * w + e)
    for p, q in ((0, 1), (0, 2), (1, 2)):
        t = 0.5 * (w[p] - w[q] - np.sqrt((w[p] - w[q]) ** 2 + e))
        w[p], w[q] = w[p] - t, w[q] + t
    t = d * (scale - 1) / scale
    w[2] = t - np.sqrt((w[2] - t) ** 2 + e)
    w = scale * w - (scale - 1) * column((a, b, 0))
    return rotation(v["transf_rotation"]) @ w if v["transf_rotation_enabled"] else w


def kaleidoscope(w: Points, c: Points, v: Values, _: int) -> Points:
    w = np.array([abs(p) if v[f"IFS_abs_{a}"] else p for a, p in zip("xyz", w, strict=True)])
    for k in range(9):
        if v[f"IFS_enabled_{k}"]:
            w = rotation(v[f"IFS_rotations_{k}"][::-1]) @ w
            n = np.array(v[f"IFS_direction_{k}"], float)
            n /= np.linalg.norm(n)
            depth = np.minimum(n @ w - v[f"IFS_distance_{k}"], 0)
            w = w - 2 * v[f"IFS_intensity_{k}"] * n[:, None] * depth
    o, scale = column(v["IFS_offset"]), v["IFS_scale"]
    if v["IFS_rotation_enabled"]:
        w = rotation(v["IFS_rotation"][::-1]) @ (w - o) + o
    if v["IFS_edge_enabled"]:
        e = column(v["IFS_edge"])
        w = np.where(e > 0, e - abs(e - w), w)
    if not v["IFS_menger_sponge_mode"]:
        return scale * w - o * (scale - 1)
    w, t = scale * w, o[:, 0] * (scale - 1)
    return w - np.array([t[0] + 0 * w[0], t[1] + 0 * w[1], np.where(w[2] > 0.5 * t[2], t[2], 0)])


def sierpinski(w: Points, c: Points, v: Values, _: int) -> Points:
    for i, j in ((0, 1), (0, 2), (1, 2)):
        low = w[i] + w[j] < 0
        w = w.copy()
        w[i], w[j] = np.where(low, -w[j], w[i]), np.where(low, -w[i], w[j])
    return v["transf_scaleA_2"] * w - column(v["transf_offset_111"])


def flat(w: Points, limit: Any) -> Points:
    return box(w, (limit[0], limit[1], 1e9))


def box_fold_bulb(w: Points, c: Points, v: Values, _: int) -> Points:
    w = 2 * ball(box(w, v["boxfold_bulbpow2_folding_factor"]), 0.25, 1)
    return bulb(w, 2) * column((1, 1, -v["boxfold_bulbpow2_z_factor"]))


DIAGONAL = about(2, 45) @ about(1, -np.degrees(np.arctan(np.sqrt(0.5))))
"""Turns the diagonal of a cube to the z axis."""


def folded_diagonal(w: Points, scale: Points, limits: Any) -> Points:
    """Absolute values and a fold into a box in the frame of the diagonal."""
    return DIAGONAL.T @ box(scale * abs(DIAGONAL @ w), limits)


def box_fold_bulb_2(w: Points, c: Points, v: Values, i: int) -> Points:
    if v["transf_start_iterations_B"] <= i:
        w = box(w, v["transf_addition_constant_111"])
    w = ball(w, v["transf_minR2_p25"], v["transf_maxR2_1"], v["mandelbox_offset"])
    w = v["transf_scale"] * w
    if v["transf_function_enabledX_false"] and i == 0:
        w = folded_diagonal(w, column(v["transf_scale3D_333"]), v["transf_addition_constantA_111"])
    if v["transf_start_iterations_A"] <= i < v["transf_stop_iterations_A"]:
        w = bulb(2 * w, 2) * column((1, 1, -v["boxfold_bulbpow2_z_factor"]))
    return w


def abox_mod_11(w: Points, c: Points, v: Values, i: int) -> Points:
    scale = v["mandelbox_scale"]
    for _ in range(i + 1):
        last = scale
        scale = v["mandelbox_scale"] + v["mandelbox_vary_scale_vary"] * (abs(last) - 1)
    w = box(w, v["transf_addition_constant_111"])
    w = ball(w, v["transf_minR2_p25"], v["transf_maxR2_1"], v["mandelbox_offset"])
    w = scale * w + column(v["transf_addition_constant"])
    return rotation(v["transf_rotation"]) @ w if v["transf_rotation_enabled"] else w


def amazing_surf_mod_2(w: Points, c: Points, v: Values, i: int) -> Points:
    w, a = flat(w, v["transf_addition_constant_111"]), column(v["transf_addition_constant"])
    if v["transf_function_enabledBx_false"] and i < v["transf_stop_iterations_X"]:
        w = w - (a**3 / (w**2 + a**2) - 2 * a) * v["transf_scale_1"]
    else:
        w = w + a
    w = ball(w, v["transf_minR2_p25"], v["transf_maxR2_1"], v["mandelbox_offset"])
    w = v["mandelbox_scale"] * w
    return rotation(v["mandelbox_rotation_main"]) @ w if v["mandelbox_main_rotation_enabled"] else w


def amazing_surf_mod_4(w: Points, c: Points, v: Values, _: int) -> Points:
    w = flat(w, v["transf_addition_constant_111"]) + column(v["transf_offsetA_000"])
    w = v["transf_scale_2"] * ball(w, v["transf_minR2_p25"], 1)
    return rotation(v["transf_rotation2"]) @ (w + column(v["transf_addition_constantA_000"]))


def amazing_surf_mod_1(w: Points, c: Points, v: Values, _: int) -> Points:
    w = flat(w, v["transf_addition_constant_111"]) + column(v["transf_addition_constant"])
    w = v["mandelbox_scale"] * ball(w, np.sqrt(v["transf_minimum_radius_05"]), 1)
    return rotation(v["transf_rotation"]) @ w


def abox_mod_15(w: Points, c: Points, v: Values, i: int) -> Points:
    if v["transf_sphere_inversion_enabled_false"] and i < v["transf_stop_iterations_1"]:
        o = column(v["transf_offset_000"])
        w = (w + o) * v["transf_scaleG_1"] / length2(w + o) + column(v["transf_addition_constant"]) - o
    w = box(w, v["transf_addition_constant_111"]) + column(v["transf_offsetA_000"])
    w = v["transf_scale_2"] * ball(w, v["transf_minR2_p25"], v["transf_maxR2_1"])
    w = rotation(v["transf_rotation2"]) @ (w + column(v["transf_addition_constantA_000"]))
    return crossed(w, v) if v["transf_function_enabledN_false"] and v["transf_start_iterations_N"] <= i else w


def crossed(w: Points, v: Values) -> Points:
    """Reflections of |y| and |x| in the frame of their diagonal, then at two lines."""
    x, y = abs(w[1]), abs(w[0])
    u, t = x + y - v["transf_offset_0"], -abs(x - y - v["transf_offsetA_0"])
    x, y = (u + t) / 2, (u - t) / 2
    a, b = v["transf_offset_1"], v["transf_offsetA_1"]
    return np.array([a - abs(x + a), b - abs(y + b), w[2]])


def ifs(w: Points, c: Points, v: Values, _: int) -> Points:
    w = v["transf_scale_2"] * (abs(w) - column(v["transf_offset_111"]))
    w = rotation(v["transf_rotation"]) @ w + column(v["transf_offset_000"])
    return rotation(v["transf_rotation2"]) @ w


def koch_ifs(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = abs(w[0]), abs(w[1]), w[2]
    x, y = np.maximum(x, y), np.minimum(x, y)
    y = v["transf_scale_1"] / 3 - abs(y - v["transf_scale_1"] / 3)
    for t in (1 / 3, -1 / 3):
        x, z = np.maximum(x + t, z) - t, np.minimum(x + t, z)
    w, o = np.array([x, y, z]) - column(v["transf_offset_100"]), column(v["transf_addition_constant_neg100"])
    return v["transf_scale_2"] * (w - o) + o


def turned_back(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = v["transf_rotationXYZ"]
    return about(0, x) @ about(1, y) @ about(2, z) @ w


def mandalay(w: Points, c: Points, v: Values, _: int) -> Points:
    f, g, a = v["transf_addition_constant_0555"], v["transf_offsetA_000"], abs(w)
    q = a.copy()
    for k in range(3):
        side = np.maximum(a[(k + 1) % 3], a[(k + 2) % 3])
        t = a[k] - 2 * f[k]
        gap = np.maximum(abs(t + f[k]) - f[k], side - 4 * f[k])
        q[k] = np.minimum(np.minimum(gap, np.maximum(t - g[k], side)), a[k])
    return np.sign(w) * q


def symmetric(w: Points, c: Points, v: Values, _: int) -> Points:
    w = abs(w)
    for k, (i, j) in enumerate(((0, 2), (0, 1), (1, 2))):
        t = v["transf_addition_constant_0555"][k] * (w[i] - w[j] - abs(w[i] - w[j]))
        w[i], w[j] = w[i] - t, w[j] + t
    return v["transf_scale_1"] * (w + column(v["transf_offsetA_000"]))


def kali(w: Points, c: Points, v: Values, _: int) -> Points:
    w = column(v["transf_addition_constant_0555"]) - abs(w)
    return v["transf_scale_015"] * ball(w, v["transf_minimum_radius_06"], 1)


def kali_2(w: Points, c: Points, v: Values, _: int) -> Points:
    w = column(v["transf_addition_constant_0555"]) - abs(w)
    w = v["transf_scale_015"] * ball(w, v["transf_minR2_p25"], v["transf_maxR2_1"])
    return w + 2 * column(v["transf_addition_constant"])


def kali_3(w: Points, c: Points, v: Values, i: int) -> Points:
    w = column(v["transf_offset_111"]) - abs(w)
    return column(v["transf_offsetA_111"]) - v["transf_scale_015"] * ball(w, v["transf_minimum_radius_0"], 1)


def abox_mod_1(w: Points, c: Points, v: Values, _: int) -> Points:
    a, f = column(v["transf_addition_constant"]), v["mandelbox_folding_value"]
    f = column((f, f, f * v["transf_scale_1"]))
    w = f - abs(abs(w + a) - f) - abs(a)
    return v["mandelbox_scale"] * ball(w, v["transf_minimum_radius_0"], v["transf_maxR2_1"])


def amazing_surf(w: Points, c: Points, v: Values, _: int) -> Points:
    w = flat(w, v["transf_addition_constant_111"])
    r2, inner = length2(w), np.sqrt(v["transf_minimum_radius_05"])
    r2 = r2 - w[2] ** 2 if v["transf_function_enabled_false"] else r2
    m = v["mandelbox_scale"] / np.where(r2 < inner, inner, np.minimum(r2, 1))
    return rotation(v["transf_rotation"]) @ (((m - 1) * v["transf_scale_1"] + 1) * w)


def abox_icen(w: Points, c: Points, v: Values, _: int) -> Points:
    k, j = column(v["transf_constant_multiplier_111"]), column(v["transf_constant_julia_c"])
    own = v["transf_constant_julia_mode"]
    w = box(w, v["transf_addition_constant_111"]) + (c * k if own else j)
    inner, outer = v["mandelbox_folding_min_radius"] ** 2, v["mandelbox_folding_fixed_radius"] ** 2
    w = v["mandelbox_scale"] * ball(w, inner, outer)
    return w + j + (-c if own else c) * k


def abox_mod_13(w: Points, c: Points, v: Values, i: int) -> Points:
    if v["transf_function_enabledAz_false"]:
        w = w + c * column(v["transf_scale3D_111"]) / length2(c * column(v["transf_scale3D_111"]))
    w = box(w, v["transf_addition_constant_111"])
    w = ball(w, v["transf_minR2_p25"], v["transf_maxR2_1"], v["mandelbox_offset"])
    w = v["mandelbox_scale"] * w
    if v["transf_start_iterations_B"] <= i:
        share = (-v["transf_scale_1"]) ** i if v["transf_function_enabledAx_false"] else 1
        w = w + share * column(v["transf_addition_constant"])
    return rotation(v["transf_rotation"]) @ w if v["transf_rotation_enabled"] else w


def fold_box_mod_1(w: Points, c: Points, v: Values, _: int) -> Points:
    a, b = column(v["transf_addition_constant_111"]), column(v["transf_addition_constantA_111"])
    w = abs(w + a) - abs(w - b) - w * column(v["transf_scale3D_111"])
    inner, outer = v["mandelbox_folding_min_radius"] ** 2, v["mandelbox_folding_fixed_radius"] ** 2
    return v["mandelbox_scale"] * ball(w, inner, outer)


def mandelbox_menger(w: Points, c: Points, v: Values, i: int) -> Points:
    w = mandelbox(w, c, v, i)
    for _ in range(int(v["transf_int_1"])):
        w = menger(w, v["transf_scale_3"], v["transf_constant_multiplierA_111"])
        w = w + column(v["transf_addition_constantA_000"])
        if v["transf_function_enabledx_false"]:
            w = w + c[[2, 0, 1]] * column(v["transf_constant_multiplierB_111"])
    return w


def mandalay_box(w: Points, c: Points, v: Values, i: int) -> Points:
    w = v["transf_scale_2"] * ball(mandalay(w, c, v, i), v["transf_minR2_p25"], 1)
    return rotation(v["transf_rotation"]) @ w


def amazing_surf_klein(w: Points, c: Points, v: Values, i: int) -> Points:
    if i >= v["transf_int8_X"]:
        return v["transf_scale_2"] * box(w, v["transf_offset_110"]) + column(v["transf_offsetA_000"])
    w = flat(w, v["transf_addition_constant_111"])[[0, 2, 1]]
    w = v["transf_scale_1"] * ball(w, v["transf_minimum_radius_0"], 1)
    return w + column(v["transf_addition_constantA_000"])


def menger_smooth_mod_1(w: Points, c: Points, v: Values, _: int) -> Points:
    e, k, m = v["transf_offset_0005"], v["transf_scale_05"], v["transf_constant_multiplier_111"]
    a, b, d = v["transf_constant_multiplier_221"]
    w = np.sqrt(w * w + v["transf_offset_0"])
    for n, (p, q) in enumerate(((0, 1), (0, 2), (1, 2))):
        t = k * (w[p] - w[q] - np.sqrt((w[p] - w[q]) ** 2 + e * m[n]))
        w[p], w[q] = w[p] - t, w[q] + t
    w[2] = d / 3 - np.sqrt((w[2] - d / 3) ** 2 + e + v["transf_offsetA_0"])
    return v["transf_scale_3"] * w - column((a, b, 0))


def menger_cross(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = w[0], abs(w[1]), abs(w[2])
    depth = np.minimum(x * np.sqrt(0.75) - y / 2, 0)
    x, y = x - 2 * depth * np.sqrt(0.75), abs(y + depth)
    y, z = np.minimum(y, z), np.maximum(y, z)
    y = 0.5 + abs(y - 0.5)
    w, scale = np.array([x, y, z]), v["transf_scale_3"]
    if v["transf_function_enabledx_false"]:
        w = column(v["transf_offset_222"]) - w
    return scale * w - (scale - 1) * column((np.sqrt(0.75), 1.5, 1.5)) + column(v["transf_offset_000"])


def benesi(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = w
    o, s = v["transf_offset_000"], y * y + z * z
    u = np.where((c[0] < 0) | (x < np.sqrt(s)), 1, -1) * (x * x - s + o[0])
    k = -2 * abs(x) / np.sqrt(s)
    return np.array([u, k * (y * y - z * z) + o[1], k * 2 * y * z + o[2]])


def pine_tree(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = w
    a, b, d = v["transf_constant_multiplier_100"]
    k = 2 * x / np.hypot(y, z)
    w = np.array([x * x - y * y - z * z + a * c[0], 2 * k * y * z + d * c[2], k * (y * y - z * z) + b * c[1]])
    return about(0, -v["transf_angle_0"]) @ w


def absolute_square(w: Points, c: Points, v: Values, _: int) -> Points:
    before, after = (
        np.array([v[f"buffalo_{name}_{axis}"] for axis in "xyz"])[:, None] for name in ("preabs", "abs")
    )
    w = bulb(np.where(before, abs(w), w), 2) * column((1, 1, 1 if v["buffalo_pos_z"] else -1))
    return np.where(after, abs(w), w) + column(v["transf_offset_000"])


def mandelnest(w: Points, c: Points, v: Values, _: int) -> Points:
    r = np.sqrt(length2(w))
    u = np.cos(np.pi * v["transf_offset_0"] + v["power"] * np.arccos(w / r))
    return u / np.sqrt(length2(u)) * r ** (v["power"] - v["transf_offset_1"]) + column(
        v["transf_offsetF_000"]
    )


def msltoe_sym_4(w: Points, c: Points, v: Values, i: int) -> Points:
    w = symmetric(w, c, {**v, **{n: v[n] for n in SYMMETRIC}, "transf_scale_1": 1}, i)
    k = np.pi / v["transf_int8_Y"]
    angle = abs(np.fmod(np.arctan2(w[2], w[1]) + np.pi + k, 2 * k) - k)
    r = np.hypot(w[1], w[2])
    x, y, z = w[0], r * np.cos(angle), r * np.sin(angle)
    m = 1 - z * z / (x * x + y * y + z * z)
    first, second = (x * x - y * y) * m * v["transf_scaleB_1"], 2 * x * y * m * v["transf_scale"]
    w = np.array([first, second, 2 * z * np.hypot(x, y)]) + column(v["transf_addition_constant_neg100"])
    return v["transf_scale_1"] * (1 - v["transf_offset"] / np.sqrt(length2(w))) * w


SYMMETRIC = ("transf_addition_constant_0555", "transf_offsetA_000")


def pupuku(w: Points, c: Points, v: Values, _: int) -> Points:
    r, n = np.sqrt(length2(w)), v["power"]
    t = n * v["transf_scaleA_1"] * np.arcsin(w[2] / r)
    p = n * v["transf_scaleB_1"] * np.arctan2(w[1], w[0])
    k = np.cos(t)
    x = 1 + (k - 1) * v["transf_scaleB_0"] if v["transf_function_enabledB_false"] else k
    w = np.array([x * np.cos(p), k * np.sin(p), np.sin(t)]) * r ** (n - v["transf_offset_1"] + 1)
    return v["transf_scaleC_1"] * (w + column(v["transf_offset_000"]))


def abox_klein(w: Points, c: Points, v: Values, i: int) -> Points:
    if i >= v["transf_stop_iterations_15"]:
        return v["transf_scale_2"] * box(w, v["transf_offset_110"]) + column(v["transf_offsetA_000"])
    w = ball(box(w, v["transf_addition_constant_111"]), v["transf_minimum_radius_0"], 1)
    return v["transf_scale_1"] * w + column(v["transf_addition_constantA_000"])


def mandalay_box_2(w: Points, c: Points, v: Values, i: int) -> Points:
    return v["transf_scale_2"] * ball(mandalay(w, c, v, i), v["transf_minR2_p25"], v["transf_maxR2_1"])


def mandelbar(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = w
    m = 1 - z * z / (x * x + y * y)
    w = np.array([-2 * x * y * m, (y * y - x * x) * m, 2 * z * np.hypot(x, y)])
    return w * v["transf_scaleA_1"] if v["transf_function_enabledS_false"] else w


def mandelnest_full(w: Points, c: Points, v: Values, _: int) -> Points:
    r = np.sqrt(length2(w))
    u = np.sin(v["power"] * np.arcsin(w / r))
    u = u / np.sqrt(length2(u)) * r ** v["power"]
    added = column(v["transf_offsetA_000"]) + c * column(v["transf_constant_multiplierA_111"])
    return np.where(length2(u + added) < length2(added - u), u, -u) + added


def kali_bulb(w: Points, c: Points, v: Values, _: int) -> Points:
    r, n = np.sqrt(length2(w)), v["transf_pwr_8"]
    t = n * v["transf_scaleA_1"] * (np.arccos(w[2] / r) + np.radians(v["beta_angle_offset"]))
    p = np.arctan(w[1] / w[0]) + np.radians(v["alpha_angle_offset"])
    w = r * np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    t, p = np.arccos(w[2] / r), n * v["transf_scaleB_1"] * np.arctan(w[1] / w[0])
    return r**n * np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def moved_square(w: Points, c: Points, v: Values, _: int) -> Points:
    r2, theta = length2(w), np.arctan2(w[2], np.hypot(w[0], w[1]))
    phi = 2 * np.arctan2(w[1], w[0]) + np.pi
    theta = 2 * theta + np.pi / 4 if v["transf_function_enabledB_false"] else theta + 1.5 * np.pi
    x, y = r2 * np.sin(theta) * np.cos(phi), r2 * np.sin(theta) * np.sin(phi)
    return np.array([x, y, r2 * np.cos(theta) * v["transf_scale_1"]]) + column(v["transf_offset_000"])


def squares(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = w
    sign = -1 if v["transf_function_enabledF_false"] else 1
    m = y * y / (x * x + z * z) - 1
    x, y, z = 2 * x * z * m, 2 * y * np.hypot(x, z), (z * z - x * x) * m
    if v["transf_function_enabledAz_false"]:
        m = 1 - z * z / (x * x + y * y)
        x, y, z = sign * 2 * x * y * m, (y * y - x * x) * m, sign * 2 * z * np.hypot(x, y)
    return np.array([x, y, z])


def buffalo(w: Points, c: Points, v: Values, i: int) -> Points:
    return absolute_square(w, c, {**v, "transf_offset_000": (0, 0, 0), **{n: v[n] for n in SIGNS}}, i)


SIGNS = ("buffalo_pos_z", *(f"buffalo_{name}_{axis}" for name in ("preabs", "abs") for axis in "xyz"))


def iq_bulb(w: Points, c: Points, v: Values, _: int) -> Points:
    r = np.sqrt(length2(w))
    t, p = v["transf_pwr_8"] * np.arccos(w[1] / r), v["transf_pwr_8a"] * np.arctan2(w[0], w[2])
    return r ** v["transf_pwr_8"] * np.array([np.sin(t) * np.sin(p), np.cos(t), np.sin(t) * np.cos(p)])


def eye(w: Points, c: Points, v: Values, _: int) -> Points:
    q = np.hypot(w[0], w[1])
    t = v["transf_scaleB_1"] * np.arctan2(q, w[2]) + v["transf_scaleC_1"] * np.arctan2(q, -w[2])
    p = v["transf_scale_1"] * np.arctan2(w[1], w[0]) + np.arctan2(-w[1], w[0])
    point = np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    return length2(w) * point + column(v["transf_addition_constantA_000"])


def doubled(w: Points, i: int, j: int) -> Points:
    """Double the angle in a plane."""
    r, angle = np.hypot(w[i], w[j]), 2 * np.arctan2(w[j], w[i])
    w = w.copy()
    w[i], w[j] = r * np.cos(angle), r * np.sin(angle)
    return w


def three_planes(w: Points, c: Points, v: Values, _: int) -> Points:
    return np.sqrt(length2(w)) * doubled(doubled(doubled(w, 0, 1), 1, 2), 0, 2)


def two_planes(w: Points, c: Points, v: Values, _: int) -> Points:
    first = doubled(w, 0, 1)
    second = doubled(first, 0, 2)
    signs = np.array([np.where(first[0] < 0, -1, 1), np.ones_like(w[0]), np.where(w[0] < 0, -1, 1)])
    return np.sqrt(length2(w)) * second * signs


def eiffie(w: Points, c: Points, v: Values, _: int) -> Points:
    k, r = np.pi / 8, np.hypot(w[1], w[2])
    angle = abs(np.fmod(np.arctan2(w[2], w[1]) + np.pi + k, 2 * k) - k)
    x, y, z = w[0], r * np.cos(angle), r * np.sin(angle)
    m = 1 - z * z / (x * x + y * y + z * z)
    w = np.array([(x * x - y * y) * m, 2 * x * y * m * v["transf_scale"], 2 * z * np.hypot(x, y)])
    w = w + column(v["transf_addition_constant"])
    return v["transf_scale_1"] * (1 - v["transf_offset"] / np.sqrt(length2(w))) * w


def julia_bulb(w: Points, c: Points, v: Values, i: int, fifth: bool = False) -> Points:
    """The square of a point folded about x, less along the radius, and a quaternion's square."""
    if fifth:
        w = box(w, v["transf_addition_constant"]) if v["transf_function_enabledC_false"] else w
    more = fifth and v["transf_function_enabledB_false"] and i < v["transf_stop_iterations_B"]
    k, r = np.pi / (v["transf_int8_Y"] + v["transf_int_1"] * more), np.hypot(w[1], w[2])
    angle = abs(np.fmod(np.arctan2(w[2], w[1]) + np.pi + k, 2 * k) - k)
    z = r * np.sin(angle)
    square, m = (w[0] + 1j * r * np.cos(angle)) ** 2, 1 - z**2 / length2(w)
    first = square.real * m * (v["transf_scaleB_1"] if fifth else 1)
    w = np.array([first, square.imag * m * v["transf_scale"], 2 * z * np.sqrt(abs(square))])
    w = w + column(v["transf_addition_constant_neg100"])
    if v["transf_addCpixel_enabled_false"]:
        w = w + np.sign(w) * abs(c) * column(v["transf_constant_multiplier_000"])
    w = v["transf_scale_1"] * (1 - v["transf_offset"] / np.sqrt(length2(w))) * w
    if v["transf_function_enabled_false"] and i < v["transf_stop_iterations_A"]:
        w = quaternion(w, c, v, i)
        if fifth:
            w[2] -= c[2] * v["transf_scaleF_1"] + v["transf_offset_0"]
    return w


def julia_bulb_5(w: Points, c: Points, v: Values, i: int) -> Points:
    return julia_bulb(w, c, v, i, True)


def riemann_sphere(w: Points, c: Points, v: Values, _: int) -> Points:
    r = np.sqrt(length2(w))
    u = v["transf_scale"] * w / r
    plane = u[:2] / (1 - u[2])
    w = np.array([*plane, (r - 1.5) * (1 + length2(plane))])
    w = rotation(v["transf_rotation"]) @ w
    w[:2] -= np.floor(w[:2] + 0.5)
    return w * column(v["transf_constant_multiplier_441"]) + column(v["transf_addition_constant"])


def riemann_sphere_2(w: Points, c: Points, v: Values, _: int) -> Points:
    r = np.sqrt(length2(w))
    x, y, z = v["transf_scale_08"] * w / r
    x, z = (
        np.tan(4 * v[f"transf_scale{name}_1"] * np.arctan2(2 * p / (y - 1), (p / (y - 1)) ** 2 - 1))
        for name, p in (("A", x), ("B", z))
    )
    s = x * x + z * z
    return r**4 / (s + 1) * np.array([2 * x, s - 1, 2 * z]) + column(v["transf_offset_010"])


def amazing_surf_klein_2(w: Points, c: Points, v: Values, i: int) -> Points:
    if i >= v["transf_int8_X"]:
        return v["transf_scale_2"] * box(w, v["transf_offset_110"]) + column(v["transf_offsetA_000"])
    w = flat(w, v["transf_addition_constant_111"])[[0, 2, 1]]
    w = v["transf_scale_1"] * ball(w, v["transf_minimum_radius_0"], 1)
    return w + column(v["transf_addition_constantA_000"])


def amazing_surf_m3d(w: Points, c: Points, v: Values, _: int) -> Points:
    w = flat(w, v["transf_addition_constant_111"]) + column(v["transf_offset_000"])
    w = v["transf_scale_015"] * ball(w, v["mandelbox_folding_min_radius"] ** 2, 1)
    return turned_back(w + c * column(v["transf_constant_multiplier_111"]), c, v, 0)


def lkmitch(w: Points, c: Points, v: Values, _: int) -> Points:
    x, y, z = w
    return np.array([x * x - 2 * y * z, z * z + 2 * x * y, y * y - 2 * x * z])


FORMULAS: dict[int, Formula] = {
    2: mandelbulb,
    3: mandelbulb_square,
    5: quaternion,
    7: menger_sponge,
    8: mandelbox,
    9: mandelbox,
    10: kaleidoscope,
    11: xenodreambuie,
    16: box_fold_bulb,
    21: bristorbrot,
    61: menger_mod_1,
    77: amazing_surf_mod_1,
    110: sierpinski,
    113: menger_smooth,
    119: abox_mod_11,
    125: box_fold_bulb_2,
    126: box_fold_bulb_2,
    132: amazing_surf_mod_2,
    186: amazing_surf_mod_4,
    207: menger_3,
    226: abox_mod_15,
    228: ifs,
    279: koch_ifs,
    20: benesi,
    59: fold_box_mod_1,
    60: kali,
    64: abox_mod_1,
    66: pine_tree,
    73: amazing_surf,
    76: abox_icen,
    91: mandelbox_menger,
    98: menger_cross,
    114: menger_smooth_mod_1,
    127: abox_mod_13,
    135: kali_2,
    136: kali_3,
    137: absolute_square,
    198: mandalay_box,
    221: amazing_surf_klein,
    229: mandelnest,
    244: msltoe_sym_4,
    266: pupuku,
    222: abox_klein,
    199: mandalay_box_2,
    282: mandelbar,
    259: mandelnest_full,
    92: kali_bulb,
    240: moved_square,
    262: squares,
    41: buffalo,
    83: iq_bulb,
    800: eye,
    13: three_planes,
    14: two_planes,
    70: eiffie,
    224: amazing_surf_klein_2,
    233: amazing_surf_m3d,
    49: lkmitch,
    71: riemann_sphere,
    139: riemann_sphere_2,
    218: julia_bulb,
    219: julia_bulb_5,
}
