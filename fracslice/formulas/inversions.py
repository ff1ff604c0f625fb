"""Fractals of inversions in spheres: limit sets of groups of reflections, and packings of balls."""

from __future__ import annotations

import math

from ..common.parameters import Choice, Count, Number, Vector
from ..expr.vocabulary import absolute, maximum, minimum, orbit, ratio, rsqrt, sqrt, where
from ..fields.box import Box
from ..fields.registry import Fixed, Node, shape

UPWARD = math.sqrt(1 / 3)
AXES = tuple(
    (UPWARD * a, UPWARD * b, UPWARD * c) for a, b, c in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
)
"""Directions of the corners of a tetrahedron."""

RADIUS = math.sqrt(6) - 2
"""Radius of four balls that touch each other and, from inside, the unit sphere."""

BALLS = tuple((*((1 - RADIUS) * v for v in axis), RADIUS) for axis in AXES)
"""Centres and radii of the four balls."""

MIDDLE = math.sqrt(5 - 2 * math.sqrt(6))
"""Radius of the sphere around the origin at right angles to the four balls."""

MIRRORS = ((0.0, 0.0, 0.0, MIDDLE), *((*(-3.0 * v for v in axis), math.sqrt(8)) for axis in AXES))
"""Centres and radii of the spheres at right angles to four of the five; any two meet at 60 degrees."""


@shape(
    lipschitz=2.0,
    exterior_only=True,
    level=Count(4, "how often the gaps are filled", most=12),
    swell=Number(1.02, "radius of the balls in units of that at which they touch", least=0.5, most=1.1),
)
def apollonian(x, y, z, level, swell):  # type: ignore[no-untyped-def]
    """Apollonian packing of balls in the unit ball (Soddy 1936, "The kiss precise"; Boyd 1973).

    Inversions in the five spheres at right angles to four of the five first ones, the four balls and the
    outside, make all others: one for each level, in the sphere that a point is deepest in, as the others do
    not move the ball that it is in. A ball of radius d around an image point, all outside or all in one ball,
    comes from one of radius d / (a + b d) at least, and these maps compose. L = 2 is measured, on both sides:
    balls of further levels are left out.
    """
    a, b = 1.0 + 0.0 * x, 0.0 * x
    within = 0.0 * x
    for _ in range(level):
        r2 = x * x + y * y + z * z
        orbit(r2, r2 < 4.0, x, y, z)
        x = where(r2 < 1e-12, 1e-6, x)  # the centre has no image
        depth, square = 0.0 * x, 1.0 + 0.0 * x
        u, v, w = x, y, z
        for cx, cy, cz, radius in MIRRORS:
            px, py, pz = x - cx, y - cy, z - cz
            deep = radius - (px * px + py * py + pz * pz) / radius
            deeper = deep > depth
            depth, square = where(deeper, deep, depth), where(deeper, radius * radius, square)
            u, v, w = where(deeper, px, u), where(deeper, py, v), where(deeper, pz, w)
        inside = depth > 0.0
        k = where(inside, ratio(square, maximum(u * u + v * v + w * w, 1e-12)), 1.0)
        a, b = a * k, where(inside, a * sqrt(k / square) + b, b)
        within = where(square < 1.0, 1.0, within)
        x, y, z = x + (k - 1.0) * u, y + (k - 1.0) * v, z + (k - 1.0) * w
    d = where(within > 0.5, 1.0 / swell - sqrt(x * x + y * y + z * z), 1e6)
    for cx, cy, cz, radius in BALLS:
        px, py, pz = x - cx, y - cy, z - cz
        d = minimum(d, sqrt(px * px + py * py + pz * pz) - swell * radius)
    return d / (minimum(a, 1e30) + minimum(b, 1e30) * absolute(d))


@apollonian.bounds
def apollonian_bounds(node: Node) -> Box:
    return Box.centred(max(node["swell"], 1.0))


@apollonian.potential
def apollonian_potential(node: Node) -> bool:
    return False


@shape(
    lipschitz=2.0,
    exterior_only=True,
    size=Vector((0.92436, 0.90756, 0.92436), "half sizes of the box that is folded into", above=0, most=4),
    ball=Number(1.0, "square of the radius of the ball that is folded out of", above=0, most=4),
    c=Vector((0.0, 0.0, 0.0), "added in each step", least=-4, most=4),
    thickness=Number(0.05, "of the innermost shape", above=0, most=1),
    steps=Count(8, "steps of the orbit", least=1, most=60),
)
def pseudo_kleinian(x, y, z, size, ball, c, thickness, steps):  # type: ignore[no-untyped-def]
    """Folds into a box and out of a ball, around a cross of a plane and an axis (Theli-at and Knighty 2011,
    fractalforums.com: "Scale 1 JuliaBox + something"). Without end; put `bounds` around it.

    Steps are similarities beside their creases: the stretch is a number. L = 2 is measured.
    """
    sx, sy, sz = size
    cx, cy, cz = c
    grown = 0.0 * x + 1.0
    for _ in range(steps):
        x = 2.0 * minimum(maximum(x, -sx), sx) - x
        y = 2.0 * minimum(maximum(y, -sy), sy) - y
        z = 2.0 * minimum(maximum(z, -sz), sz) - z
        r2 = x * x + y * y + z * z
        orbit(r2, grown > 0.0, x, y, z)
        k = maximum(ratio(ball, maximum(r2, 1e-12)), 1.0)
        x, y, z = k * x + cx, k * y + cy, k * z + cz
        grown = minimum(k * grown, 1e20)
    rho2 = x * x + y * y
    return 0.5 * (absolute(sqrt(rho2) * z) - thickness) * rsqrt(rho2 + z * z + thickness) / grown


@pseudo_kleinian.bounds
def pseudo_kleinian_bounds(node: Node) -> Box:
    return Box.everywhere()


@pseudo_kleinian.potential
def pseudo_kleinian_potential(node: Node) -> bool:
    return False


def mirrors(p: int, q: int, r: int) -> tuple[tuple[float, ...], ...]:
    """Normals of the mirrors of the honeycomb {p, q, r} in Minkowski space, with the cell's centre at the
    origin of the ball: a Coxeter simplex by Cholesky's method.
    """
    rows: list[list[float]] = []
    products = {(0, 1): p, (1, 2): q, (2, 3): r}
    for i in range(4):
        row: list[float] = []
        for k in range(min(i, 3)):
            wanted = -math.cos(math.pi / products[k, i]) if (k, i) in products else 0.0
            row.append((wanted - sum(s * t for s, t in zip(row, rows[k], strict=False))) / rows[k][k])
        left = 1 - sum(t * t for t in row)
        rows.append([*row, math.sqrt(left), 0.0, 0.0, 0.0][:4] if i < 3 else [*row, -math.sqrt(-left)])
    return tuple(map(tuple, rows))


HONEYCOMBS = {"435": (4, 3, 5), "534": (5, 3, 4), "535": (5, 3, 5), "353": (3, 5, 3)}


@shape(
    kind=Choice(
        "534", "Schlaefli symbol: p-gons, q at a corner of a cell, r cells at an edge", tuple(HONEYCOMBS)
    ),
    thickness=Number(0.16, "hyperbolic diameter of the struts", above=0, most=2),
    reach=Number(0.95, "radius of the ball that is filled; at 1 is infinity", above=0, most=0.995),
)
def honeycomb(x, y, z, shrunk, reach, normals, first, second):  # type: ignore[no-untyped-def]
    """Struts along the edges of a regular honeycomb of hyperbolic space, in Poincare's ball (Coxeter 1954,
    "Regular honeycombs in hyperbolic space"; Nelson and Segerman 2017): a Kleinian group of reflections.

    Points of the hyperboloid are reflected into a cell of the group. The hyperbolic distance to the edge
    there bounds that in space, as the ball of radius artanh t around a point at r holds one of radius
    (1 - r^2) t / (1 + r t): L = 1.
    """
    far = sqrt(x * x + y * y + z * z)
    shrink = minimum(reach / maximum(far, 1e-9), 1.0)
    x, y, z = shrink * x, shrink * y, shrink * z
    r2 = x * x + y * y + z * z
    left = 1.0 - r2
    x, y, z, t = 2.0 * x / left, 2.0 * y / left, 2.0 * z / left, (1.0 + r2) / left
    for _ in range(20):
        for a, b, c, d in normals:
            s = 2.0 * minimum(a * x + b * y + c * z - d * t, 0.0)
            x, y, z, t = x - s * a, y - s * b, z - s * c, t - s * d
    a, b, c, d = first
    u = a * x + b * y + c * z - d * t
    a, b, c, d = second
    v = a * x + b * y + c * z - d * t
    s = u * u + v * v
    e = (sqrt(s) + sqrt(s + 1.0)) * shrunk
    tanh = (e - 1.0) / (e + 1.0)
    r = sqrt(r2)
    return maximum(left * tanh / (1.0 + r * absolute(tanh)), far - reach)


@honeycomb.arguments
def honeycomb_arguments(node: Node) -> dict[str, object]:
    normals = mirrors(*HONEYCOMBS[node["kind"]])
    second, third = normals[2:]
    along = sum(s * t for s, t in zip(second[:3], third[:3], strict=True)) - second[3] * third[3]
    across = [t - along * s for s, t in zip(second, third, strict=True)]
    length = math.sqrt(1 - along * along)
    return {
        "shrunk": math.exp(-node["thickness"] / 2),
        "reach": node["reach"],
        "normals": Fixed(normals),
        "first": Fixed(second),
        "second": Fixed(tuple(t / length for t in across)),
    }


@honeycomb.bounds
def honeycomb_bounds(node: Node) -> Box:
    return Box.centred(node["reach"])
