"""CSG operators: union, intersection, difference, and what hollows and fills."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.parameters import REQUIRED, SMALLEST, Number
from ..expr.vocabulary import absolute, floor, maximum, minimum
from ..fields.box import Box
from ..fields.field import outermost
from ..fields.registry import Node, csg_operator
from ..fields.varying import Variable, Varying, as_argument, slope_of

SMOOTH = Variable(
    0.0,
    "width of the rounded seam: where two fields differ by less than this they are blended (0: a sharp seam)",
    least=0,
)


def seam(a, b, smooth):  # type: ignore[no-untyped-def]
    """Height of a quadratic seam between two fields (Quilez 2013, "Smooth minimum")."""
    h = maximum(smooth - absolute(a - b), 0.0)
    return h * h / (4.0 * smooth)


@csg_operator((1, None), smooth=SMOOTH)
def union(a, b, smooth):  # type: ignore[no-untyped-def]
    """The union of the elements; with `smooth`, seams are filled by at most smooth/4 (Quilez 2013,
    quadratic).

    The gradient in a seam is a weighted mean of the elements' gradients, so L = maximum of the elements'. A
    seam with one escape-time fractal has 1.25 times that, a seam between several 3 times (measured;
    `conservative_union` avoids the factor).
    """
    return minimum(a, b) - seam(a, b, smooth)


def conservative_union(a, b, smooth, steepest):  # type: ignore[no-untyped-def]
    """Conservative bound of the distance to a smooth union.

    The seam lies on level sets other than the surfaces: where both fields are below 5/4 of its width. Fields
    of escape-time fractals are steeper there (`Bounds.steepening`), by about the factor `steepest`; elsewhere
    the seam does not loosen the bound. L = maximum of the elements'.

    `a`, `b`: values of conservative fields of the elements; `smooth` in scene units.
    """
    low, high = minimum(a, b), maximum(a, b)
    return minimum(low, maximum(low - seam(a, b, smooth), high - 1.25 * smooth) / steepest)


@csg_operator((1, None), smooth=SMOOTH)
def intersection(a, b, smooth):  # type: ignore[no-untyped-def]
    """The intersection of the elements. L = maximum of the elements', as for a union."""
    return maximum(a, b) + seam(a, b, smooth)


@csg_operator((1, None), smooth=SMOOTH)
def difference(a, b, smooth):  # type: ignore[no-untyped-def]
    """The first element minus the others. L = maximum of the elements', as for a union."""
    return maximum(a, -b) + seam(a, -b, smooth)


def sharp_union(a, b):  # type: ignore[no-untyped-def]
    return minimum(a, b)


def sharp_intersection(a, b):  # type: ignore[no-untyped-def]
    return maximum(a, b)


def sharp_difference(a, b):  # type: ignore[no-untyped-def]
    return maximum(a, -b)


def conservative_difference(a, b):  # type: ignore[no-untyped-def]
    """Conservative bound of the distance to a difference, where the field of b is an exterior bound only."""
    return maximum(a, minimum(-b, 0.0))


SHARP = {union: sharp_union, intersection: sharp_intersection, difference: sharp_difference}


def _needs_conservative(node: Node) -> bool:
    """True for the conservative field of a smooth operator with an escape-time fractal among its elements."""
    return (
        not csg_unordered(node)
        and node.is_conservative
        and any(child.bounds.exterior_only for child in node.children)
    )


def csg_unordered(node: Node) -> bool:
    return not isinstance(node["smooth"], Varying) and bool(node["smooth"] < SMALLEST)


def csg_keeps_sign(node: Node) -> bool:
    return csg_unordered(node)


def csg_select(node: Node) -> Callable[..., Any]:
    """A seam of a union adds material, and its conservative field has to know. Other seams only remove
    material, so a ball outside the sharp solid is outside the smooth one.
    """
    later = any(child.bounds.exterior_only for child in node.children[1:])
    if node.formula is difference and node.is_conservative and later:
        return conservative_difference
    if _needs_conservative(node) and node.formula is union:
        return conservative_union
    return SHARP[node.formula] if csg_unordered(node) or _needs_conservative(node) else node.formula.function


def csg_arguments(node: Node) -> dict[str, object]:
    if node.function is conservative_union:
        return {"smooth": node["smooth"], "steepest": 1 + node.bounds.steepening / 8}
    smooth = node["smooth"].at_least(SMALLEST) if isinstance(node["smooth"], Varying) else node["smooth"]
    return {"smooth": as_argument(smooth)} if node.function is node.formula.function else {}


def csg_check(node: Node) -> None:
    if isinstance(node["smooth"], Varying) and any(child.bounds.exterior_only for child in node.children):
        reason = "an element is a fractal, whose slope away from its surface is measured and not proved"
        raise node.fail(f"smooth={node['smooth']!r}: expected a number, as {reason}")


def csg_slope(node: Node) -> float:
    """Lipschitz bound of a CSG operator.

    Minimum, maximum and their quadratic seams take a weighted mean of the gradients: L = maximum of the
    elements'. A seam follows level sets other than the surface, where the field of an escape-time fractal is
    steeper than its bound. The factors for one such field and for several are measured
    (`docs/how/accuracy.md`). A seam grows by at most a quarter of its width.
    """
    fields = [child.bounds for child in node.children]
    seams = not (csg_unordered(node) or _needs_conservative(node))
    exterior_only = seams * sum(f.exterior_only for f in fields)
    widening = (len(fields) - 1) * slope_of(node["smooth"]) / 4
    return max(f.lipschitz for f in fields) * (1.0, 1.25, 3.0)[min(exterior_only, 2)] + widening


for _operator in SHARP:
    _operator.unordered(csg_unordered)
    _operator.keeps_sign(csg_keeps_sign)
    _operator.select(csg_select)
    _operator.arguments(csg_arguments)
    _operator.slope(csg_slope)
    _operator.check(csg_check)


@union.bounds
def union_bounds(node: Node) -> Box:
    sharp, smooth = Box.enclosing(c.bounds.box for c in node.children), node["smooth"]
    seams = len(node.children) - 1
    if not isinstance(smooth, Varying):  # seams end a width below the lowest element, however many
        return sharp.grown(min(seams / 4, 1.0) * smooth)
    # Where seams reach beyond the box, they are wider by the slope times the way to a corner.
    width, wider = max(smooth.most(sharp), 0.0), seams * math.sqrt(3) * smooth.slope / 4
    return sharp.grown(seams * width / 4 / (1 - wider) if wider < 1 else math.inf)


@union.tips
def union_tips(node: Node) -> NDArray[np.float64] | None:
    tips = list[NDArray[np.float64]]()
    for child in node.children if node["smooth"] == 0 else ():
        if (own := child.tips) is None:
            return None
        tips.append(own)
    return outermost(np.hstack(tips).T) if tips else None


@intersection.bounds
def intersection_bounds(node: Node) -> Box:
    return reduce(Box.__and__, (c.bounds.box for c in node.children))


@csg_operator(
    (1, 1),
    thickness=Variable(
        REQUIRED, "of the wall, in scene units; its outer face is the element's surface", above=0
    ),
)
def shell(a, thickness):  # type: ignore[no-untyped-def]
    """The element made hollow: material deeper inside than the thickness is removed. L = the element's."""
    return maximum(a, -(a + thickness))


def conservative_shell(a, thickness):  # type: ignore[no-untyped-def]
    """Conservative bound of the distance to a shell, where the element's field is an exterior bound only."""
    return maximum(a, minimum(-(a + thickness), 0.0))


@shell.select
def shell_select(node: Node):  # type: ignore[no-untyped-def]
    return conservative_shell if node.is_conservative and node.bounds.exterior_only else shell.function


@csg_operator(
    (1, 1),
    period=Number(REQUIRED, "distance from wall to wall", above=0),
    thickness=Variable(REQUIRED, "of the walls", above=0),
)
def onion(a, period, over, thickness):  # type: ignore[no-untyped-def]
    """Walls within the element that follow its surface, one below the other, the first with the surface as
    its outer face (after Quilez 2008, "Distance functions"). L = the element's.
    """
    deep = maximum(-a, 0.0)
    below = deep - period * floor(deep * over)
    return maximum(a, minimum(absolute(below - 0.5 * thickness) - 0.5 * thickness, period - below))


def conservative_onion(a):  # type: ignore[no-untyped-def]
    """Conservative bound of the distance to an onion, where the element's field is an exterior bound only."""
    return maximum(a, 0.0)


@onion.select
def onion_select(node: Node):  # type: ignore[no-untyped-def]
    return conservative_onion if node.is_conservative and node.bounds.exterior_only else onion.function


@onion.arguments
def onion_arguments(node: Node) -> dict[str, object]:
    if node.function is conservative_onion:
        return {}
    period = node["period"]
    return {"period": period, "over": 1 / period, "thickness": as_argument(node["thickness"])}


@onion.check
def onion_check(node: Node) -> None:
    if not isinstance(node["thickness"], Varying) and node["thickness"] >= node["period"]:
        raise node.fail(f"thickness={node['thickness']:g}: expected less than period={node['period']:g}")


# Far away, fillers without end may be no numbers, which are then the first operand, and not chosen.


@csg_operator(
    (2, 2),
    shell=Variable(REQUIRED, "thickness of the wall that stays whole, in scene units", above=0),
    denser=Number(
        0.0, "how much thicker what fills it is at the surface of the first element, by less deeper inside"
    ),
    within=Number(1.0, "depth from which on it is as thick as given", above=0),
)
def infill(a, b, shell):  # type: ignore[no-untyped-def]
    """The first element, of which a wall stays whole, and behind it what the other elements fill, such as a
    lattice. L = maximum of the elements'; with `denser`, the fillers' plus denser / 2 / within times that of
    the first element.
    """
    return maximum(minimum(b, -(a + shell)), a)


def graded_infill(a, b, shell, more, slope):  # type: ignore[no-untyped-def]
    thicker = more * minimum(maximum(1.0 + slope * a, 0.0), 1.0)
    return maximum(minimum(b - thicker, -(a + shell)), a)


def conservative_infill(a, b, shell):  # type: ignore[no-untyped-def]
    """Conservative bound of the distance to an infill, where the first field is an exterior bound only."""
    return maximum(minimum(minimum(b, -(a + shell)), 0.0), a)


@infill.select
def infill_select(node: Node):  # type: ignore[no-untyped-def]
    if node.is_conservative and node.children[0].bounds.exterior_only:
        return conservative_infill
    return graded_infill if node["denser"] else infill.function


@infill.check
def infill_check(node: Node) -> None:
    if node["denser"] and any(child.bounds.exterior_only for child in node.children):
        raise node.fail("denser: expected elements with distances on both sides, and no fractals")


@infill.arguments
def infill_arguments(node: Node) -> dict[str, object]:
    given = {"shell": as_argument(node["shell"])}
    if node.function is graded_infill:
        given |= {"more": node["denser"] / 2, "slope": 1 / node["within"]}
    return given


@infill.slope
def infill_slope(node: Node) -> float:
    """The wall's field and the fillers' are those whose slopes grow, each alone."""
    solid, filler = (child.bounds.lipschitz for child in node.children)
    graded = filler + abs(node["denser"]) / 2 / node["within"] * solid
    return float(max(solid + slope_of(node["shell"]), graded))


@csg_operator(
    (2, 2),
    by=Number(REQUIRED, "how much thicker the first element is on both sides together; negative: thinner"),
    within=Number(1.0, "distance from the others from which on it is as it was", above=0),
)
def thicken(a, b, more, slope, beyond):  # type: ignore[no-untyped-def]
    """The first element, such as a lattice, thicker inside the others, and by less the farther from them: its
    density follows a solid, a model, a text or the heights of a picture. L = the first element's plus
    by / 2 / within times the others', or 1 if that is more. The result is clipped at the grown box.
    """
    return maximum(a - more * minimum(maximum(1.0 - slope * b, 0.0), 1.0), beyond)


def endless_thicken(a, b, more, slope):  # type: ignore[no-untyped-def]
    return a - more * minimum(maximum(1.0 - slope * b, 0.0), 1.0)


@thicken.select
def thicken_select(node: Node):  # type: ignore[no-untyped-def]
    return thicken.function if _beyond(node.bounds.box) else endless_thicken


@thicken.arguments
def thicken_arguments(node: Node) -> dict[str, object]:
    given = {"more": node["by"] / 2, "slope": 1 / node["within"]}
    if beyond := _beyond(node.bounds.box):
        given["beyond"] = Varying(beyond).argument
    return given


def _beyond(box: Box) -> str:
    """Expression of the largest coordinate relative to a box; of none where it is unbounded."""
    sides = zip("xyz", box.lo, box.hi, strict=True)
    ends = [
        f"max({low!r} - {name}, {name} - {high!r})" for name, low, high in sides if math.isfinite(high - low)
    ]
    return reduce(lambda one, other: f"max({one}, {other})", ends) if ends else ""


@thicken.bounds
def thicken_bounds(node: Node) -> Box:
    return node.children[0].bounds.box.grown(max(node["by"] / 2, 0.0))


@thicken.slope
def thicken_slope(node: Node) -> float:
    first, other = (child.bounds.lipschitz for child in node.children)
    return float(max(1.0, first + abs(node["by"]) / 2 / node["within"] * other))


@thicken.check
def thicken_check(node: Node) -> None:
    if any(child.bounds.exterior_only for child in node.children):
        raise node.fail("expected elements with distances on both sides, and no fractals")


@shell.arguments
def shell_arguments(node: Node) -> dict[str, object]:
    return {"thickness": as_argument(node["thickness"])}


@onion.slope
@shell.slope
def shell_slope(node: Node) -> float:
    return node.children[0].bounds.lipschitz + slope_of(node["thickness"])


@difference.bounds
@shell.bounds
@onion.bounds
@infill.bounds
def first_bounds(node: Node) -> Box:
    return node.children[0].bounds.box
