"""Primitives with exact distances, after Quilez, "Distance functions" (2008-2020), and other solids."""

from __future__ import annotations

import math
from typing import Any

from ..common.parameters import Count, Number, Vector
from ..expr.vocabulary import absolute, atan2, cos, exp, floor, log, maximum, minimum, sin, sqrt, where
from ..fields.box import Box, Triple
from ..fields.registry import Node, shape


@shape(radius=Number(1.0, "the radius", above=0))
def sphere(x, y, z, radius):  # type: ignore[no-untyped-def]
    """A sphere centred at the origin. L = 1: an exact distance."""
    return sqrt(x * x + y * y + z * z) - radius


@sphere.bounds
def sphere_bounds(node: Node) -> Box:
    return Box.centred(node["radius"])


@shape(
    size=Vector((1.0, 1.0, 1.0), "the three edge lengths", above=0),
    round=Number(0.0, "radius of the rounded edges and corners, within the size", least=0),
)
def box(x, y, z, half, round):  # type: ignore[no-untyped-def]
    """A box centred at the origin, with sharp or rounded edges. L = 1: an exact distance."""
    hx, hy, hz = half
    qx = absolute(x) - hx
    qy = absolute(y) - hy
    qz = absolute(z) - hz
    ox = maximum(qx, 0.0)
    oy = maximum(qy, 0.0)
    oz = maximum(qz, 0.0)
    return sqrt(ox * ox + oy * oy + oz * oz) + minimum(maximum(qx, maximum(qy, qz)), 0.0) - round


@box.check
def box_check(node: Node) -> None:
    if 2 * node["round"] > min(node["size"]):
        raise node.fail(
            f"round={node['round']:g}: expected at most half the shortest edge, {min(node['size']) / 2:g}"
        )


@box.arguments
def box_arguments(node: Node) -> dict[str, object]:
    return {"half": tuple(s / 2 - node["round"] for s in node["size"]), "round": node["round"]}


@box.bounds
def box_bounds(node: Node) -> Box:
    return Box.centred(*(s / 2 for s in node["size"]))


@shape(
    radius=Number(1.0, "from the centre to the middle of the tube", above=0),
    tube=Number(0.25, "radius of the tube", above=0),
)
def torus(x, y, z, radius, tube):  # type: ignore[no-untyped-def]
    """A torus around the z axis. L = 1: an exact distance."""
    q = sqrt(x * x + y * y) - radius
    return sqrt(q * q + z * z) - tube


@torus.bounds
def torus_bounds(node: Node) -> Box:
    outer = node["radius"] + node["tube"]
    return Box.centred(outer, outer, node["tube"])


@shape(
    radius=Number(0.5, "the radius", above=0),
    height=Number(1.0, "the height along z, centred at the origin", above=0),
)
def cylinder(x, y, z, radius, half):  # type: ignore[no-untyped-def]
    """A cylinder along the z axis, with flat ends. L = 1: an exact distance."""
    q = sqrt(x * x + y * y) - radius
    h = absolute(z) - half
    oq = maximum(q, 0.0)
    oh = maximum(h, 0.0)
    return sqrt(oq * oq + oh * oh) + minimum(maximum(q, h), 0.0)


@cylinder.arguments
def cylinder_arguments(node: Node) -> dict[str, object]:
    return {"radius": node["radius"], "half": node["height"] / 2}


@cylinder.bounds
def cylinder_bounds(node: Node) -> Box:
    return Box.centred(node["radius"], node["radius"], node["height"] / 2)


_CAPSULE: dict[str, Any] = {
    "from": Vector((0.0, 0.0, -0.5), "centre of one end"),
    "to": Vector((0.0, 0.0, 0.5), "centre of the other end"),
    "radius": Number(0.25, "the radius", above=0),
    "end": Number(None, "the radius at the other end; without it, the same", above=0),
}


@shape(**_CAPSULE)
def capsule(x, y, z, start, along, scale, radius):  # type: ignore[no-untyped-def]
    """A capsule: all points within the radius of a segment; with `end`, a round cone between two balls
    (Quilez 2008, "Distance functions"). L = 1: an exact distance.
    """
    sx, sy, sz = start
    ax, ay, az = along
    px = x - sx
    py = y - sy
    pz = z - sz
    t = minimum(maximum((px * ax + py * ay + pz * az) * scale, 0.0), 1.0)
    qx = px - t * ax
    qy = py - t * ay
    qz = pz - t * az
    return sqrt(qx * qx + qy * qy + qz * qz) - radius


def round_cone(x, y, z, start, axis, length, radius, slope, apart):  # type: ignore[no-untyped-def]
    # The distance from a ball of the cone is a convex function of the ball's place on the axis.
    sx, sy, sz = start
    ax, ay, az = axis
    px = x - sx
    py = y - sy
    pz = z - sz
    t = px * ax + py * ay + pz * az
    qx = px - t * ax
    qy = py - t * ay
    qz = pz - t * az
    across = qx * qx + qy * qy + qz * qz
    place = minimum(maximum(t - apart * sqrt(across), 0.0), length)
    beside = t - place
    return sqrt(across + beside * beside) - (radius - slope * place)


@capsule.select
def capsule_select(node: Node) -> Any:
    return capsule.function if node["end"] in (None, node["radius"]) else round_cone


@capsule.arguments
def capsule_arguments(node: Node) -> dict[str, object]:
    along = tuple(b - a for a, b in zip(node["from"], node["to"], strict=True))
    length2 = sum(a * a for a in along)
    if node.function is round_cone:
        return _cone_arguments(
            node["from"], node["to"], along, math.sqrt(length2), node["radius"], node["end"]
        )
    return {
        "start": node["from"],
        "along": along,
        "scale": 1.0 / length2 if length2 > 0 else 0.0,
        "radius": node["radius"],
    }


def _cone_arguments(
    start: Triple, end: Triple, along: tuple[float, ...], length: float, first: float, last: float
) -> dict[str, object]:
    if abs(first - last) >= length:  # the larger ball holds the other one
        centre = start if first > last else end
        given: tuple[Any, ...] = centre, (0.0, 0.0, 0.0), 0.0, max(first, last), 0.0, 0.0
    else:
        slope = (first - last) / length
        apart = slope / math.sqrt(1 - slope * slope)
        given = start, tuple(a / length for a in along), length, first, slope, apart
    return dict(zip(("start", "axis", "length", "radius", "slope", "apart"), given, strict=True))


@capsule.bounds
def capsule_bounds(node: Node) -> Box:
    start, end = (Box.around([node[name]]) for name in ("from", "to"))
    return start.grown(node["radius"]) | end.grown(node["radius"] if node["end"] is None else node["end"])


@shape(
    radius=Number(0.5, "radius of the base", above=0),
    height=Number(1.0, "from the base up to the tip along z, centred at the origin", above=0),
)
def cone(x, y, z, radius, half, scale):  # type: ignore[no-untyped-def]
    """A cone along the z axis, with its tip up. L = 1: an exact distance."""
    # In the half plane (q, z): distances to the base segment and to the side; both give the sign.
    q = sqrt(x * x + y * y)
    base = maximum(q - radius, 0.0)
    below = -half - z
    t = minimum(maximum((q * radius + (half - z) * (2.0 * half)) * scale, 0.0), 1.0)
    sq = q - t * radius
    sz = z - half + t * (2.0 * half)
    nearest = sqrt(minimum(base * base + below * below, sq * sq + sz * sz))
    outside_side = (q - radius) * (2.0 * half) + (z + half) * radius
    return where(maximum(below, outside_side) < 0.0, -nearest, nearest)


@cone.arguments
def cone_arguments(node: Node) -> dict[str, object]:
    radius, height = node["radius"], node["height"]
    return {"radius": radius, "half": height / 2, "scale": 1.0 / (radius * radius + height * height)}


@cone.bounds
def cone_bounds(node: Node) -> Box:
    return Box.centred(node["radius"], node["radius"], node["height"] / 2)


@shape(
    normal=Vector((0.0, 0.0, 1.0), "points out of the solid; any length", nonzero=True),
    offset=Number(0.0, "distance of the plane from the origin along the normal"),
)
def plane(x, y, z, normal, offset):  # type: ignore[no-untyped-def]
    """The half-space behind a plane. L = 1: an exact distance."""
    nx, ny, nz = normal
    return x * nx + y * ny + z * nz - offset


@plane.arguments
def plane_arguments(node: Node) -> dict[str, object]:
    length = math.hypot(*node["normal"])
    return {"normal": tuple(n / length for n in node["normal"]), "offset": node["offset"]}


@plane.bounds
def plane_bounds(node: Node) -> Box:
    lo, hi = [-math.inf] * 3, [math.inf] * 3
    used = [axis for axis in range(3) if node["normal"][axis]]
    if len(used) == 1:
        sign = math.copysign(1, node["normal"][used[0]])
        (hi if sign > 0 else lo)[used[0]] = sign * node["offset"]
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


@shape(radius=Number(1.0, "from the centre to each of the six corners", above=0))
def octahedron(x, y, z, radius):  # type: ignore[no-untyped-def]
    """A regular octahedron centred at the origin. L = 1: an exact distance."""
    ax = absolute(x)
    ay = absolute(y)
    az = absolute(z)
    m = ax + ay + az - radius
    # Distance to the face or, where the foot of the perpendicular is off the face, to the edge opposite to
    # the smallest coordinate.
    in_x = 3.0 * ax < m
    in_y = 3.0 * ay < m
    in_z = 3.0 * az < m
    qx = where(in_x, ax, where(in_y, ay, az))
    qy = where(in_x, ay, where(in_y, az, ax))
    qz = where(in_x, az, where(in_y, ax, ay))
    k = minimum(maximum(0.5 * (qz - qy + radius), 0.0), radius)
    dy = qy - radius + k
    dz = qz - k
    edge = sqrt(qx * qx + dy * dy + dz * dz)
    return where(in_x | in_y | in_z, edge, m * 0.57735026918962576)


@octahedron.bounds
def octahedron_bounds(node: Node) -> Box:
    return Box.centred(node["radius"])


@shape(
    sides=Count(6, "number of sides", least=3, most=1000),
    radius=Number(0.5, "from the axis to the corners", above=0),
    height=Number(1.0, "the height along z, centred at the origin", above=0),
)
def prism(x, y, z, sector, flat, side, half):  # type: ignore[no-untyped-def]
    """A regular prism along the z axis, with a corner on the x axis (Quilez 2020, "Distance functions").

    L = 1: an exact distance.
    """
    turn = sector * (floor(atan2(y, x) / sector) + 0.5)
    c, s = cos(turn), sin(turn)
    q = c * x + s * y - flat
    v = maximum(absolute(c * y - s * x) - side, 0.0)
    out = maximum(q, 0.0)
    across = sqrt(out * out + v * v) + minimum(q, 0.0)
    along = absolute(z) - half
    a, b = maximum(across, 0.0), maximum(along, 0.0)
    return sqrt(a * a + b * b) + minimum(maximum(across, along), 0.0)


@prism.arguments
def prism_arguments(node: Node) -> dict[str, object]:
    sector = 2 * math.pi / node["sides"]
    flat, side = (node["radius"] * f(sector / 2) for f in (math.cos, math.sin))
    return {"sector": sector, "flat": flat, "side": side, "half": node["height"] / 2}


@prism.bounds
def prism_bounds(node: Node) -> Box:
    return Box.centred(node["radius"], node["radius"], node["height"] / 2)


@shape(
    size=Vector((1.0, 1.0, 1.0), "the three diameters", above=0),
    exponent=Number(4.0, "2 is an ellipsoid; larger numbers come near to a box", least=2, most=100),
)
def superquadric(x, y, z, over, exponent, least):  # type: ignore[no-untyped-def]
    """A superellipsoid (Barr 1981, "Superquadrics and angle-preserving transformations").

    The p-norm of the coordinates in half diameters, minus 1, times the smallest one. For p >= 2 the gradient
    of the p-norm is at most 1, so L = 1.
    """
    px, py, pz = over
    x, y, z = absolute(x) * px, absolute(y) * py, absolute(z) * pz
    most = maximum(maximum(x, maximum(y, z)), 1e-12)
    u, v, w = maximum(x / most, 1e-9), maximum(y / most, 1e-9), maximum(z / most, 1e-9)
    total = exp(exponent * log(u)) + exp(exponent * log(v)) + exp(exponent * log(w))
    return (most * exp(log(total) / exponent) - 1.0) * least


@superquadric.arguments
def superquadric_arguments(node: Node) -> dict[str, object]:
    over = tuple(2 / s for s in node["size"])
    return {"over": over, "exponent": node["exponent"], "least": min(node["size"]) / 2}


@superquadric.bounds
def superquadric_bounds(node: Node) -> Box:
    return Box.centred(*(s / 2 for s in node["size"]))
