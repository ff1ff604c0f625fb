"""Formulas of Mandelbulber with loops, windings and polyhedra in NumPy; see `mandelbulber_solids`."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from .mandelbulber_oracle import Points, Values, ball, column, length2, rotation
from .mandelbulber_solids import Distance

VALUES = {
    37: "mandelbox_generalized_fold_type fold_icosa; mandelbox_folding_min_radius 0.3; mandelbox_scale -1.5; "
    "mandelbox_main_rotation_enabled true; mandelbox_rotation_main 10 5 3; mandelbox_offset 0.1 0 0",
    267: "analyticDE_enabled_false true; transf_int8_X 14; transf_scale_2 2.55; transf_scaleF_1 1.03",
    268: "analyticDE_enabled_false true; transf_int_16 12; transf_scale_1 0.99; transf_scaleF_1 1.05; "
    "transf_start_iterations_A 3; transf_stop_iterations_A 6; transf_function_enabledM_false true; "
    "transf_scale_0 0.1; transf_offset_105 1.2",
    275: "analyticDE_enabled_false true; transf_function_enabledP_false true; "
    "transf_offset_000 0.1 0.2 -0.1; transf_function_enabledCy_false true; "
    "transf_function_enabledCx_false true; transf_stop_iterations_A 2; transf_function_enabledF_false true; "
    "transf_offsetA_000 0.1 0.2 0; transf_scale_08 0.9",
    271: "analyticDE_enabled_false true; transf_function_enabledA_false true; transf_start_iterations_A 1; "
    "transf_function_enabledJ_false true; transf_offset_0 1.3; transf_offsetA_000 0 0 2; "
    "transf_rotation 6 0 0; transf_int8_X 5; transf_scale_015 2; transf_scale_3 2.6",
    1638: "transf_int_16 2; transf_scale_2 1.5; transf_int_1 2; transf_rotation 20 0 10; "
    "transf_offset_0005 0.2; transf_scale_main_2 1.5; transf_offset_4 1.5; transf_scale_16 8",
    1640: "transf_int8_X 2; transf_function_enabledC_false true; transf_function_enabledS_false true; "
    "transf_offset_0 0.5; transf_offset_0005 0.3; transf_function_enabledF_false true; "
    "transf_offsetA_000 0.1 0 0; transf_function_enabledAz_false true; transf_function_enabledK_false true; "
    "transf_scale_16 6",
    1636: "transf_function_enabled_false true; transf_offset_000 0.2 0.1 0; "
    "transf_scaleC_0 0.3; transf_function_enabledAy_false true; "
    "transf_scaleA_2 5; transf_scale_1 1.3",
    1149: "transf_function_enabledP_false true; transf_function_enabledx_false true; transf_scale_1 1.2; "
    "transf_addition_constantA_000 0.1 0 0; transf_function_enabledCx_false true; transf_rotation 0 0 20; "
    "transf_function_enabledM_false true; transf_function_enabledJ_false true; transf_offset_2 1.5; "
    "transf_function_enabledE_false true; transf_function_enabledF_false true; transf_offset_1 0.2",
}

PHI = (1 + np.sqrt(5)) / 2


def normals(kind: str) -> np.ndarray:
    """Normals of the faces of a polyhedron whose faces touch the unit ball [n, 3]."""
    if kind.startswith("fold_box"):
        n = int(kind[-1])
        angles = 2 * np.pi * np.arange(n) / n
        return np.array([(0, 0, 1), (0, 0, -1), *((np.cos(t), np.sin(t), 0) for t in angles)])
    seeds = {
        "fold_dodeca": [(0, 1, PHI)],
        "fold_icosa": [(1, 1, 1), (0, 1 / PHI, PHI)],
        "fold_cube": [(1, 0, 0)],
    }
    found = {
        tuple(np.round(np.roll(np.array(s) * signs, k), 12))
        for s in seeds[kind]
        for signs in product((1, -1), repeat=3)
        for k in range(3)
    }
    faces = np.array(sorted(found))
    return faces / np.linalg.norm(faces, axis=1)[:, None]


def nearest(w: Points, faces: np.ndarray) -> Points:
    """Nearest point of a polyhedron, among the feet on its faces, its edges and its corners."""
    every = np.array(
        [
            np.linalg.solve(faces[[*t]], np.ones(3))
            for t in combinations(range(len(faces)), 3)
            if abs(np.linalg.det(faces[[*t]])) > 1e-6
        ]
    )
    kept = every[(every @ faces.T < 1 + 1e-9).all(axis=1)]
    corners = kept[np.unique(np.round(kept, 6), axis=0, return_index=True)[1]]
    best, least = w.copy(), np.where((faces @ w).max(axis=0) <= 1, 0, np.inf)

    def offer(foot: Points, valid: np.ndarray | bool) -> None:
        nonlocal best, least
        size = np.where(valid, length2(foot - w), np.inf)
        best, least = np.where(size < least, foot, best), np.minimum(size, least)

    for face in faces:
        foot = w - face[:, None] * (face @ w - 1)
        offer(foot, (faces @ foot < 1 + 1e-9).all(axis=0))
    for p, q in combinations(corners, 2):
        if ((p @ faces.T > 1 - 1e-6) & (q @ faces.T > 1 - 1e-6)).sum() == 2:
            t = np.clip((q - p) @ (w - p[:, None]) / ((q - p) @ (q - p)), 0, 1)
            offer(p[:, None] + t * (q - p)[:, None], True)
    return best


def fold_of_polyhedron(w: Points, c: Points, v: Values, _: int) -> Points:
    kind = v.section.text("mandelbox_generalized_fold_type")  # type: ignore[attr-defined]
    size = v["mandelbox_solid"]
    w = 2 * size * nearest(w / size, normals(kind)) - w
    inner, outer = v["mandelbox_folding_min_radius"] ** 2, v["mandelbox_folding_fixed_radius"] ** 2
    w = ball(w, inner, outer, v["mandelbox_offset"])
    return v["mandelbox_scale"] * (rotation(v["mandelbox_rotation_main"]) @ w)


class Packing:
    """Balls that touch the unit ball's neighbours on the faces of a polyhedron, by its corners."""

    def __init__(
        self, corners: list[tuple[float, ...]], tangent: float, most: float, slack: float, size: float
    ):
        p = np.array(corners)
        sides = np.cross(p, np.roll(p, -1, axis=0) - p)
        self.sides = sides / np.linalg.norm(sides, axis=1)[:, None]
        self.middle = p.sum(axis=0) / np.linalg.norm(p.sum(axis=0))
        self.radius = np.sqrt(most / (1 + tangent**-2 - most))  # 1 / sin^2 = 1 + 1 / tan^2
        self.distance = np.hypot(1, self.radius)
        self.free = (self.distance - self.radius * slack) * size


def packings(v: Values) -> tuple[Packing, Packing]:
    f = (1 + np.sqrt(5)) / v["transf_scale_2"]
    five = [(1 / f, 0, f), (1, -1, 1), (f, -1 / f, 0), (f, 1 / f, 0), (1, 1, 1)]
    middle = np.sum(five, axis=0)
    return (
        Packing(five, middle[2] / middle[0], 2, v["transf_scaleD_1"], v["transf_scaleB_1"]),
        Packing(
            [(0, 1, f), (0, -1, f), (f, 0, 1)], f / (1 + 2 * f), 4, v["transf_scaleC_1"], v["transf_scaleA_1"]
        ),
    )


def cluster_walk(w: np.ndarray, v: Values, number: int) -> tuple[np.ndarray, float, float, float]:
    """Last point of one start, its stretch, the size of the ball in the middle, and the ratio of balls."""
    p, g, free, k = w.copy(), 1.0, 0.0, v["transf_scale_08"]
    pentagons, triangles = packings(v)
    first = number == 267
    count, back = int(v["transf_int8_X" if first else "transf_int_16"]), True
    if not first:
        p, g = p * v["transf_scaleG_1"], g * v["transf_scaleG_1"]
    for n in range(count):
        if first:
            k *= v["transf_scale_1"]
            balls = pentagons if v["transf_function_enabledD_false"] else triangles
        else:
            within = v["transf_start_iterations_A"] <= n < v["transf_stop_iterations_A"]
            balls = triangles if within else pentagons
            if v["transf_function_enabledP_false"] and n < v["transf_stop_iterations_P1"]:
                for axis, letter in enumerate("xyz"):
                    if v[f"transf_function_enabledC{letter}_false"]:
                        p[axis] = abs(p[axis]) + v["transf_offsetA_000"][axis]
        if back:
            if np.linalg.norm(p) > v["transf_offset_105"]:
                if not first:
                    break
                p = np.array((0, 0, 1e-15))
            free = balls.free
            p, g, back = p * free / (p @ p), g * free / (p @ p), False
        free = balls.free
        for _ in range(3 if balls is triangles else 2):
            for side in balls.sides:
                p = p - 2 * side * min(p @ side, 0)
        centre = balls.middle * balls.distance
        q = p - centre
        if np.linalg.norm(q) < balls.radius or n == count - 1:
            power = balls.radius**2
            if not first and v["transf_function_enabledM_false"]:
                power += (free - power) * v["transf_scale_0"]
            p, g = centre + q * power / (q @ q), g * power / (q @ q)
            if np.linalg.norm(p) < (free if first else free * k):
                p, g, back = p / (free * k), g / (free * k), True
        if not first:
            k *= v["transf_scale_1"]
        p, g = p * v["transf_scaleF_1"], g * v["transf_scaleF_1"]
    return p, g, free, k


def cluster(number: int) -> Distance:
    def distance(w: Points, v: Values) -> np.ndarray:
        found = []
        for start in w.T:
            p, g, free, k = cluster_walk(start, v, number)
            if number == 275:
                size = (p - v["transf_offset_000"]).max() - v["transf_offset_0"] - free * k
            else:
                size = np.linalg.norm(p) - free * v["transf_scaleE_1"] * k
            found.append(size / g)
        return np.array(found)

    return distance


def of_corners(w: Points, v: Values) -> np.ndarray:
    """The cube after a loop that subtracts the nearest of four vectors."""
    k, scale, turn = v["transf_scale_015"], v["transf_scale_3"], rotation(v["transf_rotation"])
    found = []
    for start in w.T:
        p, g = k * start, k
        for n in range(int(v["transf_int8_X"])):
            x, y, z = turn @ abs(p)
            x, y = max(x, y), min(x, y)
            x, z = max(x, z), min(x, z)
            p = np.array((x, max(y, z), min(y, z)))
            first = v["transf_offsetA_000"] if n else v["transf_offsetA_111"]
            to = [p - first, p - v["transf_offset_101"], p - v["transf_offset_110"], p]
            at = int(np.argmin([q @ q for q in to]))
            p, g = scale * to[at], scale * g
            if at == 3:
                break
        found.append((abs(p).max() - v["transf_offset_0"]) / g)
    return np.array(found)


def turns_of(w: Points) -> np.ndarray:
    return np.arctan2(w[1], w[0]) / (2 * np.pi)


def wave(t: np.ndarray, period: float) -> np.ndarray:
    return np.mod(t + period / 2, period) - period / 2


def sponge(w: Points, v: Values, count: int) -> Points:
    s, o = v["transf_scale_3"], column(v["transf_offsetA_111"])
    for _ in range(count):
        w = np.sort(rotation(v["transf_rotation"]) @ abs(w), axis=0)[::-1]
        w = s * w - (s - 1) * o
        period = (s - 1) * o[2] + v["transf_offsetA_0"]
        w[2] = np.where(w[2] < -period / 2, w[2] + period, w[2])
    return w


def beside(w: Points, v: Values) -> Points:
    return np.maximum(abs(w) - column([v[f"transf_offset{n}"] for n in ("A_1", "_01", "_p1")]), 0)


def of_helix_sponge(w: Points, v: Values) -> np.ndarray:
    w = v["transf_scale_2"] * w
    u, y = turns_of(w), np.hypot(w[0], w[1]) - v["transf_scale_main_2"]
    z = wave(w[2] - v["transf_offset_4"] * v["transf_int_1"] * u, v["transf_offset_4"])
    x = np.mod(v["transf_scale_16"] * u + v["transf_offset_1"], 2) - 1
    a = np.pi * v["transf_int_2"] * u
    y, z = z * np.cos(a) + y * np.sin(a), y * np.cos(a) - z * np.sin(a)
    w = sponge(np.array([x, y, z]), v, int(v["transf_int_16"]))
    return beside(w, v).max(axis=0) - v["transf_offset_0005"]


def of_ring_sponge(w: Points, v: Values) -> np.ndarray:
    w = v["transf_scale_2"] * (np.array([abs(w[0]), w[1], w[2]]) + column(v["transf_offsetA_000"]))
    u, y, z = turns_of(w), np.hypot(w[0], w[1]) - v["transf_scale_main_2"], w[2]
    x = np.mod(v["transf_scale_16"] * u + v["transf_offset_1"], 2) - 1
    a = np.pi * v["transf_int_2"] * u
    x, z = z * np.cos(a) + x * np.sin(a), x * np.cos(a) - z * np.sin(a)
    d = beside(sponge(np.array([x, y, z]), v, int(v["transf_int8_X"])), v)
    return np.hypot(np.hypot(d[0], d[1]) - v["transf_offset_0"], d[2]) - v["transf_offset_0005"]


def of_helix_box(w: Points, v: Values) -> np.ndarray:
    clip = abs(w[2] - v["transf_offsetE_0"]) - v["transf_offset_2"]
    w = v["transf_scale_1"] * w
    u, y = turns_of(w), np.hypot(w[0], w[1]) - v["transf_radius_1"] + v["transf_scaleC_0"] * w[2]
    z = wave(w[2] - v["transf_offsetA_2"] * v["transf_int_1"] * u, v["transf_offsetA_2"])
    x = np.mod(v["transf_scaleA_2"] * u + v["transf_offset_1"], 2) - 1
    a = np.pi * v["transf_int_2"] * u
    y, z = z * np.cos(a) + y * np.sin(a), y * np.cos(a) - z * np.sin(a)
    w = column(v["transf_offset_000"]) - abs(np.array([x, y, z]))
    return np.maximum(clip, np.sqrt(length2(beside(w, v))) - v["transf_offset_0005"])


def same(w: Points, c: Points, v: Values, _: int) -> Points:
    return w


def sector(w: Points, count: int) -> Points:
    k = np.pi / count
    angle, r = abs(np.fmod(np.arctan2(w[1], w[0]) + k, 2 * k) - k), np.hypot(w[0], w[1])
    return np.array([r * np.cos(angle), r * np.sin(angle), w[2]])


def sincos_helix(w: Points, c: Points, v: Values, i: int) -> Points:
    if i == 0:
        w = np.array([abs(w[0]), w[1], w[2]]) + column(v["transf_addition_constantA_000"])
        w = rotation(v["transf_rotation"]) @ sector(w, int(v["transf_int8_X"]))
    w = v["transf_scale_1"] * w
    u, y = np.arctan2(w[0], w[1]) / (2 * np.pi), np.hypot(w[0], w[1]) - v["transf_scale_015"]
    z = wave(w[2] - v["transf_offset_4"] * v["transf_int_1"] * u, v["transf_offset_4"])
    x = np.mod(v["transf_scale_16"] * u + v["transf_offsetR_1"], 2) - 1
    if i == 0:
        near = abs(z) < 1.5 * v["transf_offset_2"]
        z = np.where(near, np.minimum(abs(wave(z, v["transf_offset_2"])), v["transf_offset_1"]), z)
        z = np.minimum(c[2] + v["transf_offsetF_0"], -np.maximum(c[2] - v["transf_offsetE_0"], z))
    return np.array([x, y, z])


FORMULAS = {
    37: fold_of_polyhedron,
    267: same,
    268: same,
    271: same,
    275: same,
    1149: sincos_helix,
    1636: same,
    1638: same,
    1640: same,
}

SOLIDS = {
    267: cluster(267),
    268: cluster(268),
    271: of_corners,
    275: cluster(275),
    1636: of_helix_box,
    1638: of_helix_sponge,
    1640: of_ring_sponge,
}

SIGNS = {1636, 1638, 1640}
"""Formulas whose distance we divide by more than the oracle: their signs are compared."""

SLOW = {267, 268, 271, 275}
"""Solids of loops that are written here for one point at a time."""
