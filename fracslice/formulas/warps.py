"""Where an element is looked at: transforms, mirrors, repetition, twist, bend, and a volume that confines it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .box import Box
from .parameters import REQUIRED, Axis, Number, Vector
from .registry import Fixed, Node, warp
from .vocabulary import absolute, any_of, atan2, cos, floor, maximum, minimum, sin, sqrt


# --- transform ------------------------------------------------------------------------------------------------------
@warp(
    translate=Vector((0.0, 0.0, 0.0), "moves by this, last"),
    rotate=Vector(None, "an axis and an angle in degrees, counter-clockwise seen against the axis", sizes=(4,)),
    scale=Vector((1.0,), "one factor, or one per axis, first", sizes=(1, 3)),
    matrix=Vector(None, "3 x 4 or 4 x 4 numbers row by row, applied before the other three", sizes=(12, 16)),
)
def transform(child, x, y, z, inverse, shrink):  # type: ignore[no-untyped-def]
    """Scaled, then rotated, then moved.

    The child's field is multiplied by the smallest stretch of the map, its smallest singular value: f never grows faster
    than the child's, and is a distance where the scale is uniform.
    """
    a, b, c, d, e, f, g, h, i, tx, ty, tz = inverse
    return shrink * child(
        a * x + b * y + c * z + tx,
        d * x + e * y + f * z + ty,
        g * x + h * y + i * z + tz,
    )


def moved(child, x, y, z, offset):  # type: ignore[no-untyped-def]
    tx, ty, tz = offset
    return child(x - tx, y - ty, z - tz)


def _rotation(rotate: Sequence[float]) -> np.ndarray:
    """Rodrigues' formula."""
    axis = np.array(rotate[:3]) / np.linalg.norm(rotate[:3])
    angle = math.radians(rotate[3])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def affine(node: Node) -> tuple[np.ndarray, np.ndarray]:
    """The 3 x 3 matrix and the translation of a transform node."""
    linear = np.diag(np.broadcast_to(np.array(node["scale"]), 3))
    if node["rotate"]:
        linear = _rotation(node["rotate"]) @ linear
    offset = np.array(node["translate"])
    if node["matrix"]:
        given = np.array(node["matrix"][:12]).reshape(3, 4)
        offset = offset + linear @ given[:, 3]
        linear = linear @ given[:, :3]
    return linear, offset


@transform.check
def _(node: Node) -> None:
    if node["rotate"] and not any(node["rotate"][:3]):
        raise node.fail("rotate: expected an axis that is not zero, then degrees")
    if node["matrix"] and len(node["matrix"]) == 16 and node["matrix"][12:] != (0, 0, 0, 1):
        raise node.fail("matrix: expected the last row 0 0 0 1")
    stretch = np.linalg.svd(affine(node)[0], compute_uv=False)
    if not stretch[-1] > 1e-9 * stretch[0]:
        raise node.fail("scale or matrix: expected a map that does not flatten space")


@transform.identity
def _(node: Node) -> bool:
    linear, offset = affine(node)
    return bool((linear == np.eye(3)).all() and not offset.any())


@transform.select
def _(node: Node):  # type: ignore[no-untyped-def]
    return moved if (affine(node)[0] == np.eye(3)).all() else transform.function


@transform.arguments
def _(node: Node) -> dict[str, object]:
    linear, offset = affine(node)
    if node.function is moved:
        return {"offset": tuple(offset.tolist())}
    inverse = np.linalg.inv(linear)
    flat = [*inverse.ravel().tolist(), *(-inverse @ offset).tolist()]
    return {"inverse": tuple(flat), "shrink": float(np.linalg.svd(linear, compute_uv=False)[-1])}


@transform.bounds
def _(node: Node) -> Box:
    box = node.children[0].facts.box
    if box.empty:
        return box
    linear, offset = affine(node)
    lo, hi = np.array(box.lo), np.array(box.hi)
    with np.errstate(invalid="ignore"):
        ends = np.stack([linear * lo, linear * hi])
    ends = np.where(linear == 0, 0.0, ends)
    low, high = ends.min(0).sum(1) + offset, ends.max(0).sum(1) + offset
    return Box(tuple(low.tolist()), tuple(high.tolist()))


# --- mirror ---------------------------------------------------------------------------------------------------------
@warp(axis=Axis(REQUIRED, "the axis that is mirrored: what is on its positive side also appears on its negative side"))
def mirror(child, x, y, z, along_x, along_y):  # type: ignore[no-untyped-def]
    """The half of the element on the axis' positive side, and its mirror image."""
    if along_x:
        x = absolute(x)
    elif along_y:
        y = absolute(y)
    else:
        z = absolute(z)
    return child(x, y, z)


@mirror.arguments
def _(node: Node) -> dict[str, object]:
    return _along(node)


@mirror.bounds
def _(node: Node) -> Box:
    axis, box = "xyz".index(node["axis"]), node.children[0].facts.box
    lo, hi = list(box.lo), list(box.hi)
    lo[axis] = -hi[axis]
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


def _along(node: Node) -> dict[str, object]:
    return {"along_x": Fixed(node["axis"] == "x"), "along_y": Fixed(node["axis"] == "y")}


# --- confining ------------------------------------------------------------------------------------------------------
# Each operator below that confines its child returns ``maximum(d, minimum(child, 2 m - d))`` with d a distance to a
# volume around the child and m > 0. The surface is unchanged where d <= 0, the result does not jump, and where d >= m it
# is d whatever the child's value: there the child need not be evaluated, and its Lipschitz bound is not needed either.


@warp(
    min=Vector(REQUIRED, "the corner with the smallest coordinates"),
    max=Vector(REQUIRED, "the corner with the largest coordinates"),
)
def bounds(child, x, y, z, centre, half, margin):  # type: ignore[no-untyped-def]
    """What is inside a box; the element is not looked at far from it, however much of it there is."""
    cx, cy, cz = centre
    hx, hy, hz = half
    d = maximum(absolute(x - cx) - hx, maximum(absolute(y - cy) - hy, absolute(z - cz) - hz))
    f = d
    if any_of(d < margin):
        f = maximum(d, minimum(child(x, y, z), 2.0 * margin - d))
    return f


@bounds.check
def _(node: Node) -> None:
    if any(a >= b for a, b in zip(node["min"], node["max"], strict=True)):
        raise node.fail("min and max: expected min < max on every axis")


@bounds.arguments
def _(node: Node) -> dict[str, object]:
    box = Box(node["min"], node["max"])
    half = tuple(s / 2 for s in box.size)
    return {"centre": box.centre, "half": half, "margin": max(half) / 4}


@bounds.bounds
def _(node: Node) -> Box:
    return Box(node["min"], node["max"]) & node.children[0].facts.box


@bounds.slope
def _(node: Node) -> float:
    return max(1.0, node.children[0].facts.lipschitz)


# --- repetition -----------------------------------------------------------------------------------------------------
@warp(
    period=Vector(REQUIRED, "distance between copies along x, y and z", above=0),
    count=Vector((0, 0, 0), "copies along x, y and z, centred at the origin; 0: without end", least=0, most=1e6, whole=True),
)
def repeat(child, x, y, z, period, first, last, centre, half, middle, reach, gap, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Copies on a lattice. Every copy that can be the nearest is looked at, so cell borders are right.

    Copies further than `gap` are not; the value never exceeds it inside the lattice, so that leaving one out is not
    seen. A copy's value is at least the distance to its box, for the same reason.
    """
    px, py, pz = period
    fx, fy, fz = first
    lx, ly, lz = last
    cx, cy, cz = centre
    hx, hy, hz = half
    mx, my, mz = middle
    rx, ry, rz = reach
    kx = minimum(maximum(floor((x - cx) / px - fx) - 0.5 * (nx - 2.0), 0.0), lx - (nx - 1.0))
    ky = minimum(maximum(floor((y - cy) / py - fy) - 0.5 * (ny - 2.0), 0.0), ly - (ny - 1.0))
    kz = minimum(maximum(floor((z - cz) / pz - fz) - 0.5 * (nz - 2.0), 0.0), lz - (nz - 1.0))
    f = maximum(gap, maximum(absolute(x - mx) - rx, maximum(absolute(y - my) - ry, absolute(z - mz) - rz)))
    for i in range(nx):
        qx = x - (kx + (fx + i)) * px
        for j in range(ny):
            qy = y - (ky + (fy + j)) * py
            for k in range(nz):
                qz = z - (kz + (fz + k)) * pz
                d = maximum(absolute(qx - cx) - hx, maximum(absolute(qy - cy) - hy, absolute(qz - cz) - hz))
                f = minimum(f, maximum(d, child(qx, qy, qz)))
    return f


ENDLESS = 1 << 20


def _window(node: Node, axis: int) -> int:
    """How many neighbouring copies can be nearest along an axis."""
    box, period, count = node.children[0].facts.box, node["period"][axis], node["count"][axis]
    if count == 1:
        return 1
    overlap = box.size[axis] / 2 / period
    if not overlap <= 3:
        raise node.fail(f"period: expected at least a sixth of the element's size, {box.size[axis]:.4g}, along {'xyz'[axis]}")
    window = 2 * math.ceil(max(overlap, 0.0) + 0.5)
    return min(window, count or window)


@repeat.arguments
def _(node: Node) -> dict[str, object]:
    box, period, count = node.children[0].facts.box, node["period"], node["count"]
    windows = [_window(node, axis) for axis in range(3)]
    number = [c or ENDLESS for c in count]
    first = tuple(-((c - 1) / 2) if c else -float(ENDLESS // 2) for c in count)
    gaps = [w / 2 * p - s / 2 for w, p, s, n in zip(windows, period, box.size, number, strict=True) if n > w]
    whole = _lattice(node)
    return {
        "period": period,
        "first": first,
        "last": tuple(float(n - 1) for n in number),
        "centre": box.centre if box.finite else tuple(c if math.isfinite(c) else 0.0 for c in box.centre),
        "half": tuple(s / 2 for s in box.size),
        "middle": tuple(c if math.isfinite(c) else 0.0 for c in whole.centre),
        "reach": tuple(s / 2 for s in whole.size),
        "gap": min(gaps, default=math.inf),
        "nx": Fixed(windows[0]),
        "ny": Fixed(windows[1]),
        "nz": Fixed(windows[2]),
    }


def _lattice(node: Node) -> Box:
    box, lo, hi = node.children[0].facts.box, [], []
    for a, b, p, c in zip(box.lo, box.hi, node["period"], node["count"], strict=True):
        reach = (c - 1) / 2 * p if c else math.inf
        lo.append(a - reach)
        hi.append(b + reach)
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


@repeat.bounds
def _(node: Node) -> Box:
    return _lattice(node)


@repeat.slope
def _(node: Node) -> float:
    return max(1.0, node.children[0].facts.lipschitz)


# --- twist ----------------------------------------------------------------------------------------------------------
@warp(
    axis=Axis("z", "the axis to turn about"),
    degrees=Number(REQUIRED, "how far to turn per unit of length along the axis"),
)
def twist(child, x, y, z, rate, radius, margin, along_x, along_y):  # type: ignore[no-untyped-def]
    """Turned about an axis, further the further along it (Barr 1984, "Global and Local Deformations of Solid Primitives").

    At radius rho space is sheared by s = rate rho, which stretches by (s + sqrt(s^2 + 4)) / 2. The bound is taken at
    5/4 of the element's own radius; beyond, the value is the distance to the cylinder around it.
    """
    if along_x:
        a, b, t = y, z, x
    elif along_y:
        a, b, t = z, x, y
    else:
        a, b, t = x, y, z
    d = sqrt(a * a + b * b) - radius
    f = d
    if any_of(d < margin):
        c = cos(rate * t)
        s = sin(rate * t)
        p = c * a + s * b
        q = c * b - s * a
        if along_x:
            inner = child(t, p, q)
        elif along_y:
            inner = child(q, t, p)
        else:
            inner = child(p, q, t)
        f = maximum(d, minimum(inner, 2.0 * margin - d))
    return f


def _twist_radius(node: Node) -> float:
    across = [a for a in range(3) if a != "xyz".index(node["axis"])]
    radius = node.children[0].facts.box.radius(*across)
    if not math.isfinite(radius):
        raise node.fail(f"can only twist what is bounded across the {node['axis']} axis; put <bounds> around it")
    return max(radius, 1e-30)


@twist.identity
def _(node: Node) -> bool:
    return bool(node["degrees"] == 0)


@twist.arguments
def _(node: Node) -> dict[str, object]:
    radius = _twist_radius(node)
    return {"rate": math.radians(node["degrees"]), "radius": radius, "margin": radius / 4, **_along(node)}


@twist.bounds
def _(node: Node) -> Box:
    axis, radius, box = "xyz".index(node["axis"]), _twist_radius(node), node.children[0].facts.box
    lo, hi = [-radius] * 3, [radius] * 3
    lo[axis], hi[axis] = box.lo[axis], box.hi[axis]
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


@twist.slope
def _(node: Node) -> float:
    shear = abs(math.radians(node["degrees"])) * 1.25 * _twist_radius(node)
    return max(1.0, node.children[0].facts.lipschitz * (shear + math.sqrt(shear * shear + 4)) / 2)


# --- bend -----------------------------------------------------------------------------------------------------------
@warp(
    axis=Axis("z", "the hinge, which stays straight: z bends x towards y, x bends y towards z, y bends z towards x"),
    degrees=Number(REQUIRED, "how far to turn per unit of length along the bent axis"),
)
def bend(child, x, y, z, curvature, side, inner_radius, half, slope, margin, along_x, along_y):  # type: ignore[no-untyped-def]
    """A straight axis made an arc (Barr 1984, "Global and Local Deformations of Solid Primitives").

    In polar coordinates (r, theta) around the arc's centre, at distance 1 / curvature, the element is looked at in
    theta / curvature and 1 / curvature - r. Lengths shrink towards the centre; the bound is taken at half the smallest
    radius the element reaches. Nearer than that, and near the cut opposite to it, the value is a distance to the sector
    that holds the element.
    """
    if along_x:
        a, b, t = y, side * z, x
    elif along_y:
        a, b, t = z, side * x, y
    else:
        a, b, t = x, side * y, z
    centre = 1.0 / curvature
    up = centre - b
    r = sqrt(a * a + up * up)
    u = atan2(a, up) * centre
    v = side * (centre - r)
    d = maximum(inner_radius - r, minimum(slope * (absolute(u) - half), 0.5 * inner_radius))
    f = d
    if any_of(d < margin):
        if along_x:
            inner = child(t, u, v)
        elif along_y:
            inner = child(v, t, u)
        else:
            inner = child(u, v, t)
        f = maximum(d, minimum(inner, 2.0 * margin - d))
    return f


def _bend_frame(node: Node) -> tuple[float, float, float, float]:
    """Curvature, side (+1 or -1), the smallest radius the element reaches, and its half length along the bent axis."""
    hinge, box = "xyz".index(node["axis"]), node.children[0].facts.box
    along, across = (hinge + 1) % 3, (hinge + 2) % 3
    curvature, side = abs(math.radians(node["degrees"])), math.copysign(1.0, node["degrees"])
    half = max(abs(box.lo[along]), abs(box.hi[along]))
    inward = box.hi[across] if side > 0 else -box.lo[across]
    if not half * curvature < 0.999 * math.pi:
        raise node.fail(f"degrees={node['degrees']:g}: expected less than {math.degrees(math.pi / half):.4g}, a full circle")
    if not inward * curvature < 0.99:
        raise node.fail(f"degrees={node['degrees']:g}: expected less than {math.degrees(1 / inward):.4g}, or it is bent through itself")
    return curvature, side, min(1 / curvature - inward, 1 / curvature), half


@bend.identity
def _(node: Node) -> bool:
    return bool(node["degrees"] == 0)


@bend.arguments
def _(node: Node) -> dict[str, object]:
    curvature, side, inner_radius, half = _bend_frame(node)
    slope = curvature * inner_radius / math.pi
    margin = min(inner_radius / 2, slope * (math.pi / curvature - half))
    return {
        "curvature": curvature,
        "side": side,
        "inner_radius": inner_radius,
        "half": half,
        "slope": slope,
        "margin": margin,
        **_along(node),
    }


@bend.bounds
def _(node: Node) -> Box:
    if node.is_identity:
        return node.children[0].facts.box
    curvature, side, inner_radius, half = _bend_frame(node)
    hinge, box = "xyz".index(node["axis"]), node.children[0].facts.box
    along, across = (hinge + 1) % 3, (hinge + 2) % 3
    outer = 1 / curvature - min(side * box.lo[across], side * box.hi[across])
    top = half * curvature
    turns = [t for t in (-math.pi / 2, 0.0, math.pi / 2) if abs(t) <= top] + [-top, top]
    points = [(r * math.sin(t), side * (1 / curvature - r * math.cos(t))) for t in turns for r in (inner_radius, outer)]
    lo, hi = list(box.lo), list(box.hi)
    for axis, values in ((along, [p[0] for p in points]), (across, [p[1] for p in points])):
        lo[axis], hi[axis] = min(values), max(values)
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


@bend.slope
def _(node: Node) -> float:
    if node.is_identity:
        return node.children[0].facts.lipschitz
    curvature, _, inner_radius, _ = _bend_frame(node)
    return max(1.0, node.children[0].facts.lipschitz * 2 / (curvature * inner_radius))
