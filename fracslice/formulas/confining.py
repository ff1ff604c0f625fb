"""Domain operators that bound their element: bounding box, offset, displacement and repetition."""

from __future__ import annotations

import math

from ..common.parameters import LARGEST, REQUIRED, Number, Vector
from ..expr.vocabulary import absolute, any_of, floor, maximum, minimum
from ..fields.box import Box
from ..fields.registry import Fixed, Node, always_keeps_sign, domain_operator
from ..fields.varying import Variable, Varying, as_argument, slope_of

# An operator that confines its child returns ``maximum(d, minimum(child, 2 m - d))``, where d is the signed
# distance to a volume around the child and m > 0 a margin. The surface is unchanged where d <= 0, and the
# result is continuous. Where d >= m the result is d for any value of the child: neither the child's value nor
# its Lipschitz bound is needed there.


def beyond(x, y, z, centre, half):  # type: ignore[no-untyped-def]
    """Largest coordinate of a point relative to a box: negative inside."""
    cx, cy, cz = centre
    hx, hy, hz = half
    return maximum(absolute(x - cx) - hx, maximum(absolute(y - cy) - hy, absolute(z - cz) - hz))


@domain_operator(
    min=Vector(REQUIRED, "the corner with the smallest coordinates"),
    max=Vector(REQUIRED, "the corner with the largest coordinates"),
)
def bounds(child, x, y, z, centre, half, margin):  # type: ignore[no-untyped-def]
    """The part of the element inside a box; far from the box the element is not evaluated.

    The element may be unbounded. L = maximum of 1 (the box) and the element's.
    """
    d = beyond(x, y, z, centre, half)
    f = d
    if any_of(d < margin):
        f = maximum(d, minimum(child(x, y, z), 2.0 * margin - d))
    return f


@bounds.check
def bounds_check(node: Node) -> None:
    if any(a >= b for a, b in zip(node["min"], node["max"], strict=True)):
        raise node.fail("min and max: expected min < max on every axis")


@bounds.arguments
def bounds_arguments(node: Node) -> dict[str, object]:
    box = Box(node["min"], node["max"])
    half = tuple(s / 2 for s in box.size)
    return {"centre": box.centre, "half": half, "margin": max(half) / 4}


bounds.keeps_sign(always_keeps_sign)


@bounds.bounds
def bounds_bounds(node: Node) -> Box:
    return Box(node["min"], node["max"]) & node.children[0].bounds.box


@domain_operator(
    distance=Number(REQUIRED, "how far outward the surface moves, in scene units; negative: inward")
)
def offset(child, x, y, z, distance, centre, half):  # type: ignore[no-untyped-def]
    """The element grown or shrunk by a distance; exact where its field is a distance.

    A field that underestimates distances would grow too far; the result is clipped at the grown box.
    L = maximum of 1 (the box) and the element's; more for an escape-time fractal, whose field is steeper away
    from its surface (`Bounds.steepening`; measured). A shrunk element lies inside the original. The field of
    a fractal is an exterior bound only, so the conservative field of a shrunk fractal is that of the
    original.
    """
    return maximum(child(x, y, z) - distance, beyond(x, y, z, centre, half))


@offset.arguments
def offset_arguments(node: Node) -> dict[str, object]:
    only_grown = node.is_conservative and node.bounds.exterior_only
    distance = max(node["distance"], 0.0) if only_grown else node["distance"]
    return {"distance": distance, **frame(node.bounds.box)}


@offset.bounds
def offset_bounds(node: Node) -> Box:
    return node.children[0].bounds.box.grown(node["distance"])


@offset.slope
def offset_slope(node: Node) -> float:
    return max(1.0, node.children[0].bounds.slope_less(node["distance"]))


@offset.identity
def offset_identity(node: Node) -> bool:
    return bool(node["distance"] == 0)


@domain_operator(
    by=Variable(REQUIRED, "how far outward the surface moves at each point, in scene units; negative: inward")
)
def displace(child, x, y, z, by, centre, half):  # type: ignore[no-untyped-def]
    """The element whose surface moves by an expression in x, y and z (Cook 1984, "Shade trees"). L = the
    element's plus the bound of the expression's slope, or 1 if that is more. The result is clipped at the box
    of the element, grown by the largest displacement there; the field of an escape-time fractal as by
    `<offset>`.
    """
    return maximum(child(x, y, z) - by, beyond(x, y, z, centre, half))


@displace.arguments
def displace_arguments(node: Node) -> dict[str, object]:
    by = node["by"]
    if node.is_conservative and node.bounds.exterior_only:
        by = by.at_least(0.0) if isinstance(by, Varying) else max(by, 0.0)
    return {"by": as_argument(by), **frame(node.bounds.box)}


@displace.bounds
def displace_bounds(node: Node) -> Box:
    return node.children[0].bounds.box.grown(_farthest(node))


@displace.slope
def displace_slope(node: Node) -> float:
    slope = node.children[0].bounds.slope_less(_farthest(node)) + slope_of(node["by"])
    return max(1.0, slope)


def _farthest(node: Node) -> float:
    """Bound of the displacement where the displaced element is."""
    by, box = node["by"], node.children[0].bounds.box
    if not isinstance(by, Varying):
        return float(by)
    # Beyond the box it is more by the slope times the way to a corner.
    wider = math.sqrt(3) * by.slope
    within = max(by.most(box), 0.0) / (1 - wider) if wider < 1 else math.inf
    farthest = min(within, by.most(Box.everywhere()))
    if not farthest < LARGEST:
        raise node.fail(f"by={by!r}: expected one with a limit, such as min(..., 1)")
    return farthest


def frame(box: Box) -> dict[str, object]:
    """Centre of a box, 0 along unbounded axes, and its half sizes."""
    return {
        "centre": tuple(c if math.isfinite(c) else 0.0 for c in box.centre),
        "half": tuple(s / 2 for s in box.size),
    }


@domain_operator(
    period=Vector(REQUIRED, "distance between copies along x, y and z", above=0),
    count=Vector(
        (0, 0, 0),
        "copies along x, y and z, centred at the origin; 0: without end",
        least=0,
        most=1e6,
        whole=True,
    ),
)
def repeat(child, x, y, z, period, first, last, centre, half, middle, reach, gap, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Copies on a lattice. Every copy that can be the nearest is evaluated, so cell borders are right.

    Copies farther than `gap` are skipped. The value never exceeds `gap` inside the lattice, so a skipped copy
    does not change it. For the same reason a copy's value is at least the distance to its box. L = maximum of
    1 and the element's: skipped values are larger than `gap`, and minima preserve the bound.
    """
    px, py, pz = period
    fx, fy, fz = first
    lx, ly, lz = last
    cx, cy, cz = centre
    kx = minimum(maximum(floor((x - cx) / px - fx) - 0.5 * (nx - 2.0), 0.0), lx - (nx - 1.0))
    ky = minimum(maximum(floor((y - cy) / py - fy) - 0.5 * (ny - 2.0), 0.0), ly - (ny - 1.0))
    kz = minimum(maximum(floor((z - cz) / pz - fz) - 0.5 * (nz - 2.0), 0.0), lz - (nz - 1.0))
    f = maximum(gap, beyond(x, y, z, middle, reach))
    for i in range(nx):
        qx = x - (kx + (fx + i)) * px
        for j in range(ny):
            qy = y - (ky + (fy + j)) * py
            for k in range(nz):
                qz = z - (kz + (fz + k)) * pz
                f = minimum(f, maximum(beyond(qx, qy, qz, centre, half), child(qx, qy, qz)))
    return f


ENDLESS = 1 << 20


def _window(node: Node, axis: int) -> int:
    """Number of neighbouring copies along an axis that can be the nearest."""
    box, period, count = node.children[0].bounds.box, node["period"][axis], node["count"][axis]
    if count == 1:
        return 1
    overlap = box.size[axis] / 2 / period
    if not overlap <= 3:
        raise node.fail(
            f"period: expected at least a sixth of the element's size, {box.size[axis]:.4g}, "
            f"along {'xyz'[axis]}"
        )
    window = 2 * math.ceil(max(overlap, 0.0) + 0.5)
    return int(min(window, count or window))


@repeat.arguments
def repeat_arguments(node: Node) -> dict[str, object]:
    box, period, count = node.children[0].bounds.box, node["period"], node["count"]
    windows = [_window(node, axis) for axis in range(3)]
    number = [c or ENDLESS for c in count]
    first = tuple(-((c - 1) / 2) if c else -float(ENDLESS // 2) for c in count)
    gaps = [w / 2 * p - s / 2 for w, p, s, n in zip(windows, period, box.size, number, strict=True) if n > w]
    whole = frame(repeat_bounds(node))
    return {
        "period": period,
        "first": first,
        "last": tuple(float(n - 1) for n in number),
        **frame(box),
        "middle": whole["centre"],
        "reach": whole["half"],
        "gap": min(gaps, default=math.inf),
        "nx": Fixed(windows[0]),
        "ny": Fixed(windows[1]),
        "nz": Fixed(windows[2]),
    }


repeat.keeps_sign(always_keeps_sign)


@repeat.bounds
def repeat_bounds(node: Node) -> Box:
    """Bounding box of all copies."""
    box = node.children[0].bounds.box
    far = [(c - 1) / 2 * p if c else math.inf for p, c in zip(node["period"], node["count"], strict=True)]
    lo, hi = ([e + s * f for e, f in zip(ends, far, strict=True)] for ends, s in ((box.lo, -1), (box.hi, 1)))
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))
