"""Tubes along curves of Lindenmayer systems, and the solid of Koch's curve."""

from __future__ import annotations

import math

from ..common.parameters import Count, Number
from ..expr.vocabulary import absolute, atan2, cos, floor, maximum, minimum, sin, sqrt, where
from ..fields.box import Box
from ..fields.registry import Fixed, Node, shape

Row = tuple[tuple[int, ...], ...]

OCTANTS: tuple[Row, ...] = (
    ((-1, -1, -1), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 0), (1, 0, 0)),
    ((-1, -1, 1), (0, 1, 0), (0, 0, 1), (1, 0, 0), (0, -1, 0), (1, 0, 0)),
    ((-1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, -1)),
    ((-1, 1, -1), (0, 1, 0), (0, 0, -1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)),
    ((1, 1, -1), (1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, 0, 0), (0, 0, -1)),
    ((1, 1, 1), (0, -1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (1, 0, 0)),
    ((1, -1, 1), (0, -1, 0), (0, 0, 1), (-1, 0, 0), (-1, 0, 0), (0, -1, 0)),
    ((1, -1, -1), (0, 0, -1), (-1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, 0, 0)),
)
"""Octants in the order of the curve, from corner -x -y -z to corner +x -y -z: centre, rows of the rotation
that takes the curve in the octant to the whole, and there the directions of the octants before and after.
"""


@shape(
    level=Count(2, "how often every cell is cut into eight", least=1, most=10),
    thickness=Number(0.5, "diameter of the tube in cells", above=0, below=1),
)
def hilbert(x, y, z, level, thickness, cell, rows):  # type: ignore[no-untyped-def]
    """A tube along a Hilbert curve in the cube [-1, 1]^3 (Hilbert 1891; as a Lindenmayer system by
    Prusinkiewicz and Lindenmayer 1990, "The Algorithmic Beauty of Plants").

    The distance to the two halves of the curve's edges in the point's cell, clipped at half a cell, which is
    nearer than those of any other cell: L = 1.
    """
    beyond = maximum(absolute(x), maximum(absolute(y), absolute(z))) - (1.0 - cell + thickness * cell)
    x = minimum(maximum(x, -1.0), 1.0)
    y = minimum(maximum(y, -1.0), 1.0)
    z = minimum(maximum(z, -1.0), 1.0)
    ax, ay, az, bx, by, bz = 0.0 * x, 0.0 * x, 0.0 * x, 0.0 * x, 0.0 * x, 0.0 * x
    for _ in range(level):
        sx, sy, sz = where(x < 0.0, -1.0, 1.0), where(y < 0.0, -1.0, 1.0), where(z < 0.0, -1.0, 1.0)
        u, v, w = 2.0 * x - sx, 2.0 * y - sy, 2.0 * z - sz
        oax, oay, oaz, obx, oby, obz = ax, ay, az, bx, by, bz
        for cx, cy, cz, p, q, r, d, e, f, g, h, i, lx, ly, lz, nx, ny, nz in rows:
            here = sx * cx + sy * cy + sz * cz > 2.5
            x = where(here, p * u + q * v + r * w, x)
            y = where(here, d * u + e * v + f * w, y)
            z = where(here, g * u + h * v + i * w, z)
            ax = where(here, lx + 0.0 * u, ax)
            ay = where(here, ly + 0.0 * u, ay)
            az = where(here, lz + 0.0 * u, az)
            bx = where(here, nx + 0.0 * u, bx)
            by = where(here, ny + 0.0 * u, by)
            bz = where(here, nz + 0.0 * u, bz)
        begins = sx + sy + sz < -2.5
        ax = where(begins, oaz, ax)
        ay = where(begins, oax, ay)
        az = where(begins, oay, az)
        ends = sx - sy - sz > 2.5
        bx = where(ends, -obz, bx)
        by = where(ends, -obx, by)
        bz = where(ends, oby, bz)
    before = minimum(maximum(x * ax + y * ay + z * az, 0.0), 1.0)
    after = minimum(maximum(x * bx + y * by + z * bz, 0.0), 1.0)
    ax, ay, az = x - before * ax, y - before * ay, z - before * az
    bx, by, bz = x - after * bx, y - after * by, z - after * bz
    near = sqrt(minimum(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz))
    return maximum(cell * (minimum(near, 1.0) - thickness), beyond)


@hilbert.arguments
def hilbert_arguments(node: Node) -> dict[str, object]:
    return {
        "level": node["level"],
        "thickness": node["thickness"],
        "cell": 0.5 ** node["level"],
        "rows": Fixed(tuple(sum(row, ()) for row in OCTANTS)),
    }


@hilbert.bounds
def hilbert_bounds(node: Node) -> Box:
    return Box.centred(1.0 - 0.5 ** node["level"] * (1.0 - node["thickness"]))


@hilbert.visible
def hilbert_visible(node: Node, voxel: float) -> Node:
    """The curve of the deepest level whose tube and gaps are wider than two voxels."""
    thinnest = 2.0 * min(node["thickness"], 1.0 - node["thickness"])
    deepest = max(math.floor(math.log2(max(thinnest / (2.0 * voxel), 1.0)) + 1e-6), 1)
    return node if node["level"] <= deepest else node.changed(level=deepest)


@shape(
    branches=Count(3, "branches at the end of every branch", least=2, most=12),
    level=Count(4, "how often branches fork", most=12),
    angle=Number(35.0, "between a branch and the one before, degrees", least=0, most=90),
    ratio=Number(0.7, "size of a branch in units of the one before", above=0, most=0.9),
    thickness=Number(0.2, "diameter of the trunk, whose length is 1", above=0, most=1),
)
def tree(x, y, z, level, sector, cosine, sine, ratio, radius):  # type: ignore[no-untyped-def]
    """The tree of the Lindenmayer system A -> F [&A] [/&A] ..., from the origin along the z axis (Honda 1971;
    Prusinkiewicz and Lindenmayer 1990, "The Algorithmic Beauty of Plants").

    Space is folded onto one branch of every fork, so branches end where they meet the plane between two, and
    L = 1.
    """
    size = 1.0
    t = z - minimum(maximum(z, 0.0), size)
    f = sqrt(x * x + y * y + t * t) - radius
    for _ in range(level):
        z = z - size
        turn = sector * floor(atan2(y, x) / sector + 0.5)
        c, s = cos(turn), sin(turn)
        x, y = c * x + s * y, absolute(c * y - s * x)
        x, z = cosine * x - sine * z, sine * x + cosine * z
        size, radius = ratio * size, ratio * radius
        t = z - minimum(maximum(z, 0.0), size)
        f = minimum(f, sqrt(x * x + y * y + t * t) - radius)
    return f


@tree.arguments
def tree_arguments(node: Node) -> dict[str, object]:
    angle = math.radians(node["angle"])
    return {
        "level": node["level"],
        "sector": 2 * math.pi / node["branches"],
        "cosine": math.cos(angle),
        "sine": math.sin(angle),
        "ratio": node["ratio"],
        "radius": node["thickness"] / 2,
    }


@tree.bounds
def tree_bounds(node: Node) -> Box:
    """The trunk, and the ball around its end that all branches reach."""
    reach = sum(node["ratio"] ** k for k in range(1, node["level"] + 1))
    radius = node["thickness"] / 2
    wide = reach + radius
    return Box((-wide, -wide, min(0.0, 1.0 - reach) - radius), (wide, wide, 1.0 + wide))


@shape(
    radius=Number(1.0, "from the axis to the corners", above=0),
    height=Number(0.5, "the height along z, centred at the origin", above=0),
    level=Count(4, "how often the middle third of every edge is replaced by two", most=12),
)
def koch(x, y, z, apothem, half_edge, half, level):  # type: ignore[no-untyped-def]
    """A prism over the snowflake of von Koch 1904.

    L = 1: an exact distance. The triangle is folded onto half an edge, and every edge onto a quarter, by
    mirrors that take the curve on one side to that on the other.
    """
    third_turn = 2.0943951023931953
    turn = third_turn * (floor(atan2(y, x) / third_turn) + 0.5)
    c, s = cos(turn), sin(turn)
    q, v = c * x + s * y - apothem, absolute(c * y - s * x)
    edge = half_edge
    for _ in range(level):
        back = 2.0 * minimum(0.8660254037844386 * (v - edge / 3.0) - 0.5 * q, 0.0)
        v, q = absolute(v - 0.8660254037844386 * back - edge / 1.5), q + 0.5 * back
        edge = edge / 3.0
    v = maximum(v - edge, 0.0)
    across = sqrt(q * q + v * v)
    across = where(q < 0.0, -across, across)
    along = absolute(z) - half
    a, b = maximum(across, 0.0), maximum(along, 0.0)
    return sqrt(a * a + b * b) + minimum(maximum(across, along), 0.0)


@koch.arguments
def koch_arguments(node: Node) -> dict[str, object]:
    radius = node["radius"]
    return {
        "apothem": radius / 2,
        "half_edge": radius * math.sqrt(3) / 2,
        "half": node["height"] / 2,
        "level": node["level"],
    }


@koch.bounds
def koch_bounds(node: Node) -> Box:
    return Box.centred(node["radius"], node["radius"], node["height"] / 2)


@koch.visible
def koch_visible(node: Node, voxel: float) -> Node:
    """The snowflake of the deepest level whose edges are longer than a voxel."""
    deepest = max(math.floor(math.log(math.sqrt(3) * node["radius"] / voxel, 3.0) + 1e-6), 0)
    return node if node["level"] <= deepest else node.changed(level=deepest)
