"""Writes cases.h, the marching cubes table: `python make_cases.py > cases.h` (a second; needs NumPy only).

Corner c of a cell sits at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge axis*4 + p + 2*q runs along `axis`; p and q
are its place along the two other axes, in order. A case is the set of inside corners, bit c for corner c.

On each face the crossings are joined so that every run of inside corners is cut off by itself. That rule
looks at the four signs of the face only, so the two cells at a face draw the same segments, and the
segments of a cell close into loops. Each loop becomes triangles such that
  (a) no diagonal joins two crossings of one face, for the neighbour might draw it too;
  (b) no two triangles of the cell meet, but in a shared vertex or edge, wherever the crossings lie.
(b) is searched with random crossings, many of them close to the corners; some triangulation passes in every
case, so no loop needs a vertex in its middle. Of those that pass, the one with the shortest diagonals wins.
One case is solved for each class under the 24 rotations of the cube; the others are turned from it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, permutations, product
from textwrap import wrap

import numpy as np

Triangle = tuple[int, int, int]
Loop = tuple[int, ...]
CORNERS = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])


def edge_between(a: int, b: int) -> int:
    axis = {1: 0, 2: 1, 4: 2}[a ^ b]
    place = [a >> k & 1 for k in range(3) if k != axis]
    return axis * 4 + place[0] + 2 * place[1]


ENDS = {edge_between(a, a | 1 << k): (a, a | 1 << k) for k in range(3) for a in range(8) if not a >> k & 1}
FACES = list(product(range(3), range(2)))


def share_a_face(a: int, b: int) -> bool:
    corners = CORNERS[[*ENDS[a], *ENDS[b]]]
    return bool((corners == corners[0]).all(axis=0).any())


def loops(case: int) -> list[Loop]:
    """Loops of crossings, directed so that triangles along them are counter-clockwise seen from outside."""
    following = {}
    for axis, high in FACES:
        u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        ring = [high << axis | c for c in ((0, u, u | v, v) if high else (0, v, u | v, u))]
        for i in range(4):
            if case >> ring[i - 1] & 1 or not case >> ring[i] & 1:
                continue
            last = i
            while case >> ring[(last + 1) % 4] & 1:
                last += 1
            entering = edge_between(ring[i - 1], ring[i])
            following[edge_between(ring[last % 4], ring[(last + 1) % 4])] = entering
    closed = []
    while following:
        loop = [min(following)]
        while loop[-1] in following:
            loop.append(following.pop(loop[-1]))
        closed.append(tuple(reversed(loop[:-1])))
    return closed


def triangulations(loop: Loop) -> Iterator[list[Triangle]]:
    """Every way to cut the loop into triangles without a diagonal inside a face of the cell."""
    if len(loop) < 3:
        yield []
        return
    a, b = loop[0], loop[-1]
    for k in range(1, len(loop) - 1):
        c = loop[k]
        if (k > 1 and share_a_face(a, c)) or (k < len(loop) - 2 and share_a_face(c, b)):
            continue
        for left, right in product(triangulations(loop[: k + 1]), triangulations(loop[k:])):
            yield [(a, c, b), *left, *right]


def place(t: np.ndarray) -> np.ndarray:
    """Positions [samples, 12, 3] of the crossings at t [samples, 12]."""
    low, high = (CORNERS[[ENDS[e][k] for e in range(12)]] for k in range(2))
    positions: np.ndarray = low + t[..., None] * (high - low)
    return positions


def samples(count: int = 6000) -> np.ndarray:
    """Positions [2 * count, 12, 3] of random crossings: half of them anywhere, half of them at the ends."""
    rng = np.random.default_rng(8)
    anywhere = rng.beta(0.3, 0.3, (count, 12)).clip(1e-3, 1 - 1e-3)
    at_ends = np.where(rng.random((count, 12)) < 0.5, 0.02, 0.98) + rng.uniform(-0.019, 0.019, (count, 12))
    return place(np.concatenate([anywhere, at_ends]))


def above(p: np.ndarray, a: int, b: int, c: int, d: int) -> np.ndarray:
    """Whether the point d lies on the side of triangle abc that its normal shows to, for every sample."""
    normal = np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a])
    side: np.ndarray = np.einsum("ij,ij->i", normal, p[:, d] - p[:, a]) > 0
    return side


def pierces(p: np.ndarray, ends: tuple[int, int], triangle: Triangle) -> np.ndarray:
    (a, b, c), (d, e) = triangle, ends
    turns = [above(p, d, e, u, v) for u, v in ((a, b), (b, c), (c, a))]
    parted: np.ndarray = above(p, a, b, c, d) != above(p, a, b, c, e)
    around: np.ndarray = (turns[0] == turns[1]) & (turns[1] == turns[2])
    pierced: np.ndarray = parted & around
    return pierced


def meet(p: np.ndarray, first: Triangle, second: Triangle) -> bool:
    """Whether two triangles cross in any sample. On one edge they cannot: coplanar crossings are convex."""
    if len(set(first) & set(second)) == 2:
        return False
    return any(
        pierces(p, (a, b), other).any()
        for one, other in ((first, second), (second, first))
        for a, b in combinations(one, 2)
        if a not in other and b not in other
    )


def clean(p: np.ndarray, triangles: list[Triangle]) -> bool:
    return not any(meet(p, a, b) for a, b in combinations(triangles, 2))


def length(triangles: list[Triangle]) -> float:
    middle = place(np.full((1, 12), 0.5))[0]
    return sum(float(((middle[a] - middle[b]) ** 2).sum()) for t in triangles for a, b in combinations(t, 2))


def solve(case: int, p: np.ndarray) -> list[Triangle]:
    picks = product(*(triangulations(loop) for loop in loops(case)))
    for triangles in sorted(([t for part in pick for t in part] for pick in picks), key=length):
        if clean(p, triangles):
            return triangles
    raise SystemExit(f"case {case} has no triangulation without intersections")


def rotations() -> Iterator[tuple[list[int], dict[int, int]]]:
    """The cube's 24 turns: where each corner goes, and where each edge goes."""
    for order in permutations(range(3)):
        for flips in product((0, 1), repeat=3):
            matrix = np.zeros((3, 3))
            for row, column in enumerate(order):
                matrix[row, column] = 1 - 2 * flips[row]
            if np.linalg.det(matrix) < 0:
                continue
            turned = CORNERS[:, list(order)] ^ np.array(flips)
            corner = [int(c @ [1, 2, 4]) for c in turned]
            yield corner, {e: edge_between(corner[a], corner[b]) for e, (a, b) in ENDS.items()}


def table() -> list[list[Triangle]]:
    p, solved = samples(), dict[int, list[Triangle]]()
    for case in range(256):
        if case in solved:
            continue
        model = solve(case, p)
        for corner, edge in rotations():
            turned = sum(1 << corner[c] for c in range(8) if case >> c & 1)
            solved.setdefault(turned, [(edge[a], edge[b], edge[c]) for a, b, c in model])
    return [solved[case] for case in range(256)]


def header() -> str:
    cases = table()
    lines = [
        "// Written by make_cases.py, which explains it; do not edit.",
        "#pragma once",
        "#include <cstdint>",
        "namespace fracslice::mesh {",
        "struct Case {",
        "    uint8_t triangles;  // how many",
        "    uint16_t edges;     // bit e: edge e is crossed",
        f"    uint8_t corners[{3 * max(map(len, cases))}];  // three edges a triangle",
        "    uint8_t loop_length;  // of the loop of crossings, where there is one only; else 0",
        "    uint8_t loop[12];     // its edges, in the triangles' sense",
        "};",
        "constexpr Case kCases[256] = {",
    ]
    rows = []
    for case, triangles in enumerate(cases):
        rings = loops(case)
        loop = rings[0] if len(rings) == 1 else ()
        flat = [e for triangle in triangles for e in triangle]
        crossed = sum(1 << e for e in set(flat))
        ring = f"{len(loop)},{{{','.join(map(str, loop)) or 0}}}"
        rows.append(f"{{{len(triangles)},{crossed},{{{','.join(map(str, flat)) or 0}}},{ring}}},")
    lines += wrap(" ".join(rows), 125, initial_indent="    ", subsequent_indent="    ")
    return "\n".join([*lines, "};", "}  // namespace fracslice::mesh"])


if __name__ == "__main__":
    print(header())
