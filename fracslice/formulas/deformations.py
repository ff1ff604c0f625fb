"""Domain operators that twist and bend (Barr 1984, "Global and Local Deformations of Solid Primitives").

Both confine their element, see `confining`.
"""

from __future__ import annotations

import math

from ..common.parameters import REQUIRED, SMALLEST, Axis, Number
from ..expr.vocabulary import absolute, any_of, atan2, cos, maximum, minimum, sin, sqrt, where
from ..fields.box import Box
from ..fields.registry import Node, always_keeps_sign, domain_operator
from .transforms import chosen_axis


@domain_operator(
    axis=Axis("z", "the axis to turn about"),
    degrees=Number(REQUIRED, "how far to turn per unit of length along the axis"),
)
def twist(child, x, y, z, rate, radius, margin, axis):  # type: ignore[no-untyped-def]
    """The element twisted about an axis (Barr 1984, "Global and Local Deformations of Solid Primitives").

    At radius rho the twist shears space by s = rate rho, which stretches lengths by (s + sqrt(s^2 + 4)) / 2.
    L = the element's times this stretch at 5/4 of the element's radius. Beyond, the value is the distance to
    the cylinder around the element.
    """
    axes = x, y, z, x, y
    t, a, b = axes[axis], axes[axis + 1], axes[axis + 2]
    d = sqrt(a * a + b * b) - radius
    f = d
    if any_of(d < margin):
        c = cos(rate * t)
        s = sin(rate * t)
        p = c * a + s * b
        q = c * b - s * a
        turned = p, q, t, p, q
        inner = child(turned[2 - axis], turned[3 - axis], turned[4 - axis])
        f = maximum(d, minimum(inner, 2.0 * margin - d))
    return f


def _twist_radius(node: Node) -> float:
    """Radius of the element about the axis of the twist. Raises `SceneError` if it is unbounded."""
    across = [a for a in range(3) if a != "xyz".index(node["axis"])]
    radius = node.children[0].bounds.box.radius(*across)
    if not math.isfinite(radius):
        raise node.fail(
            f"expected a solid that is bounded across the {node['axis']} axis; put <bounds> around it"
        )
    return max(radius, 1e-30)


@twist.identity
def twist_identity(node: Node) -> bool:
    return bool(abs(node["degrees"]) < SMALLEST)


@twist.arguments
def twist_arguments(node: Node) -> dict[str, object]:
    radius = _twist_radius(node)
    return {
        "rate": math.radians(node["degrees"]),
        "radius": radius,
        "margin": radius / 4,
        "axis": chosen_axis(node),
    }


twist.keeps_sign(always_keeps_sign)


@twist.bounds
def twist_bounds(node: Node) -> Box:
    axis, radius, box = "xyz".index(node["axis"]), _twist_radius(node), node.children[0].bounds.box
    lo, hi = [-radius] * 3, [radius] * 3
    lo[axis], hi[axis] = box.lo[axis], box.hi[axis]
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


@twist.slope
def twist_slope(node: Node) -> float:
    shear = abs(math.radians(node["degrees"])) * 1.25 * _twist_radius(node)
    return max(1.0, node.children[0].bounds.lipschitz * (shear + math.sqrt(shear * shear + 4)) / 2)


@domain_operator(
    axis=Axis(
        "z", "the hinge, which stays straight: z bends x towards y, x bends y towards z, y bends z towards x"
    ),
    degrees=Number(REQUIRED, "how far to turn per unit of length along the bent axis"),
)
def bend(child, x, y, z, curvature, side, inward, inner_radius, half, slope, margin, axis):  # type: ignore[no-untyped-def]
    """The element bent: a straight axis becomes an arc (Barr 1984, "Global and Local Deformations of Solid
    Primitives").

    In polar coordinates (r, theta) around the arc's centre, at distance 1 / curvature, the element is
    evaluated at theta / curvature and 1 / curvature - r. Lengths shrink towards the centre; at half the
    smallest radius r that the element reaches, L = 2 / (curvature r) times the element's. Nearer to the
    centre, and near the cut opposite to the element, the value is a distance to the sector that holds the
    element.
    """
    axes = x, y, z, x, y
    t, a, b = axes[axis], axes[axis + 1], side * axes[axis + 2]
    # Distances are measured from the arc: for a slight bend its centre is too far away for float32.
    s = curvature * a
    c = 1.0 - curvature * b
    r = sqrt(s * s + c * c)
    u = atan2(s, c) / curvature
    deep = where(r < 2.0, (2.0 * b - curvature * (a * a + b * b)) / (1.0 + r), (1.0 - r) / curvature)
    v = side * deep
    d = maximum(deep - inward, minimum(slope * (absolute(u) - half), 0.5 * inner_radius))
    f = d
    if any_of(d < margin):
        straight = u, v, t, u, v
        inner = child(straight[2 - axis], straight[3 - axis], straight[4 - axis])
        f = maximum(d, minimum(inner, 2.0 * margin - d))
    return f


def _bend_frame(node: Node) -> tuple[float, float, float, float]:
    """Curvature, side (+1 or -1), smallest radius that the element reaches, and half length along the bent
    axis. Raises `SceneError` for a bend too strong for the element.
    """
    hinge, box = "xyz".index(node["axis"]), node.children[0].bounds.box
    along, across = (hinge + 1) % 3, (hinge + 2) % 3
    curvature, side = abs(math.radians(node["degrees"])), math.copysign(1.0, node["degrees"])
    half = max(abs(box.lo[along]), abs(box.hi[along]))
    inward = box.hi[across] if side > 0 else -box.lo[across]
    if not half * curvature < 0.999 * math.pi:
        raise node.fail(
            f"degrees={node['degrees']:g}: expected less than "
            f"{math.degrees(math.pi / half):.4g}, a full circle"
        )
    if not inward * curvature < 0.99:
        raise node.fail(
            f"degrees={node['degrees']:g}: expected less than "
            f"{math.degrees(1 / inward):.4g}, or it is bent through itself"
        )
    return curvature, side, min(1 / curvature - inward, 1 / curvature), half


@bend.identity
def bend_identity(node: Node) -> bool:
    return bool(abs(node["degrees"]) < SMALLEST)


@bend.arguments
def bend_arguments(node: Node) -> dict[str, object]:
    curvature, side, inner_radius, half = _bend_frame(node)
    slope = curvature * inner_radius / math.pi
    margin = min(inner_radius / 2, slope * (math.pi / curvature - half))
    return {
        "curvature": curvature,
        "side": side,
        "inward": 1 / curvature - inner_radius,
        "inner_radius": inner_radius,
        "half": half,
        "slope": slope,
        "margin": margin,
        "axis": chosen_axis(node),
    }


bend.keeps_sign(always_keeps_sign)


@bend.bounds
def bend_bounds(node: Node) -> Box:
    if node.is_identity:
        return node.children[0].bounds.box
    curvature, side, inner_radius, half = _bend_frame(node)
    hinge, box = "xyz".index(node["axis"]), node.children[0].bounds.box
    along, across = (hinge + 1) % 3, (hinge + 2) % 3
    outer = 1 / curvature - min(side * box.lo[across], side * box.hi[across])
    top = half * curvature
    turns = [t for t in (-math.pi / 2, 0.0, math.pi / 2) if abs(t) <= top] + [-top, top]
    points = [
        (r * math.sin(t), side * (1 / curvature - r * math.cos(t)))
        for t in turns
        for r in (inner_radius, outer)
    ]
    lo, hi = list(box.lo), list(box.hi)
    for axis, values in ((along, [p[0] for p in points]), (across, [p[1] for p in points])):
        lo[axis], hi[axis] = min(values), max(values)
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


@bend.slope
def bend_slope(node: Node) -> float:
    if node.is_identity:
        return node.children[0].bounds.lipschitz
    curvature, _, inner_radius, _ = _bend_frame(node)
    return max(1.0, node.children[0].bounds.lipschitz * 2 / (curvature * inner_radius))
