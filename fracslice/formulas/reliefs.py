"""Pictures as heights: landscapes, lithophanes, and reliefs of other solids."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ..common.parameters import REQUIRED, Choice, File, Number
from ..expr.vocabulary import absolute, atan2, maximum, minimum, outline_distance, sin, sqrt
from ..fields.box import Box
from ..fields.registry import Fixed, Node, domain_operator, shape
from .confining import beyond, frame
from .models import DIGEST, identify_file, reading

if TYPE_CHECKING:
    from ..mesh.reliefs import Relief, Round

ENDINGS = {".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff"}
"""Files of pictures that are read."""

_FILE = File(REQUIRED, "a picture, .png, .jpg, .webp or .tif, in the folder of the scene", inside=True)
_PLACE = Choice("centre", "centred at the origin, or there from z = 0", ("centre", "bed"))


def _plate(x, y, z, relief, slope, half, rise):  # type: ignore[no-untyped-def]
    """What is below the heights of a picture, measured along z."""
    hx, hy = half
    around = maximum(absolute(x) - hx, absolute(y) - hy)
    z = z - rise
    return maximum(maximum(around, -z), z - slope * outline_distance(x, y, relief))


def _plate_arguments(node: Node) -> dict[str, Any]:
    given = _relief(node)
    return {"relief": given, "slope": given.slope, "half": given.half, "rise": _rise(node)}


def _plate_bounds(node: Node) -> Box:
    given, bottom = _relief(node), _rise(node)
    hx, hy = given.half
    return Box((-hx, -hy, bottom), (hx, hy, bottom + given.highest))


def _rise(node: Node) -> float:
    """Height of the origin of a plate, or of the middle of a wall or ball."""
    on_bed = node["place"] == "bed"
    if node.formula is heightmap or node["form"] == "flat":
        return 0.0 if on_bed else -_relief(node).highest / 2
    made = _round(node)
    outside = made.relief.highest if node["form"] == "sphere" else 0.0
    return made.half[1] + outside if on_bed else 0.0


@shape(
    file=_FILE,
    size=Number(1.0, "longest side, between the middles of pixels", above=0),
    height=Number(0.1, "of white above black", above=0),
    base=Number(0.05, "thickness below black", above=0),
    place=_PLACE,
    sha256=DIGEST,
)
def heightmap(x, y, z, relief, slope, half, rise):  # type: ignore[no-untyped-def]
    """A picture as a landscape: above the middle of each pixel the height of its level of grey, of 8 or 16
    bits, and bilinear between (a displacement map: Cook 1984, "Shade trees"). The field is measured along z,
    and L = sqrt(1 + s^2), where s is the largest slope of the picture, from all its pixels. One of more than
    4 million pixels is averaged.
    """
    return _plate(x, y, z, relief, slope, half, rise)


@shape(
    file=_FILE,
    form=Choice(
        "flat",
        "a plate; a wall around the z axis, the picture's middle towards -y; a ball, of a map of its surface",
        ("flat", "cylinder", "sphere"),
    ),
    size=Number(1.0, "longest side of the plate, height of the wall, or inner diameter of the ball", above=0),
    thinnest=Number(0.01, "thickness of white", above=0),
    thickest=Number(0.05, "thickness of black", above=0),
    degrees=Number(
        360.0, "how far a wall goes around the axis, to a whole column of pixels", above=0, most=360
    ),
    place=_PLACE,
    sha256=DIGEST,
)
def lithophane(x, y, z, relief, slope, half, rise):  # type: ignore[no-untyped-def]
    """A picture that shows where light shines through (de Bourgoing 1827): the darker, the thicker, linear in
    levels of grey, of 8 or 16 bits. One face is smooth, the lower or inner one; a ball takes a map of
    longitudes and latitudes. The field is measured across the smooth face, and L = sqrt(1 + s^2), where s is
    the largest slope of the picture, from all its pixels. One of more than 4 million pixels is averaged.
    """
    return _plate(x, y, z, relief, slope, half, rise)


def wall(x, y, z, relief, slope, half, rise, radius, shift, closed):  # type: ignore[no-untyped-def]
    """The heights of a picture on a cylinder around z, measured from it."""
    angle, hz = half
    z = z - rise
    rho = sqrt(x * x + y * y)
    turn = atan2(x, -y)
    thick = rho - radius - slope * outline_distance(radius * turn + shift, z, relief)
    f = maximum(maximum(absolute(z) - hz, radius - rho), thick)
    if not closed:
        aside = minimum(maximum(absolute(turn) - angle, -0.5 * math.pi), 0.5 * math.pi)
        f = maximum(f, rho * sin(aside))
    return f


def ball(x, y, z, relief, slope, rise, radius, shift):  # type: ignore[no-untyped-def]
    """The heights of a picture on a sphere, measured from it."""
    z = z - rise
    across = x * x + y * y
    rho = sqrt(across + z * z)
    east, north = radius * atan2(x, -y) + shift, radius * atan2(z, sqrt(across))
    return maximum(radius - rho, rho - radius - slope * outline_distance(east, north, relief))


@lithophane.select
def lithophane_select(node: Node):  # type: ignore[no-untyped-def]
    return {"flat": lithophane.function, "cylinder": wall, "sphere": ball}[node["form"]]


@lithophane.check
def lithophane_check(node: Node) -> None:
    if node["thinnest"] > node["thickest"]:
        raise node.fail(f"thinnest={node['thinnest']:g}: expected at most thickest={node['thickest']:g}")
    if node["degrees"] < 360 and node["form"] != "cylinder":
        raise node.fail(f'degrees={node["degrees"]:g}: expected form="cylinder" with it')


@lithophane.arguments
def lithophane_arguments(node: Node) -> dict[str, Any]:
    if node["form"] == "flat":
        return _plate_arguments(node)
    made = _round(node)
    given = {"relief": made.relief, "slope": made.relief.slope, "rise": _rise(node)}
    given |= {"radius": made.radius, "shift": made.shift}
    if node["form"] == "cylinder":
        given |= {"half": made.half, "closed": Fixed(node["degrees"] == 360)}
    return given


@lithophane.bounds
def lithophane_bounds(node: Node) -> Box:
    if node["form"] == "flat":
        return _plate_bounds(node)
    made, rise = _round(node), _rise(node)
    outer = made.radius + made.relief.highest
    angle, half = made.half if node["form"] == "cylinder" else (math.pi, outer)
    side = outer * math.sin(min(angle, math.pi / 2))
    back = -math.cos(angle) * (made.radius if angle < math.pi / 2 else outer)
    return Box((-side, -outer, rise - half), (side, back, rise + half))


def relief_slope(node: Node) -> float:
    return math.hypot(1.0, _relief(node).slope)


heightmap.arguments(_plate_arguments)
heightmap.bounds(_plate_bounds)
for _formula in (heightmap, lithophane):
    _formula.slope(relief_slope)


def _heights(node: Node) -> tuple[float, float]:
    """Heights of black and white."""
    if node.formula is lithophane:
        return node["thickest"], node["thinnest"]
    if node.formula is heightmap:
        return node["base"], node["base"] + node["height"]
    return 0.0, node["height"]


def _relief(node: Node) -> Relief:
    """Heights of the picture of a node, scene units."""
    if node.formula is lithophane and node["form"] != "flat":
        return _round(node).relief
    from ..mesh.reliefs import flat

    with reading(node, "file"):
        return flat(node["file"], node["sha256"], node["size"], *_heights(node))


def _round(node: Node) -> Round:
    """Heights of the picture of a node on a cylinder or sphere, scene units."""
    from ..mesh.reliefs import around, globe

    about = (node["file"], node["sha256"], node["size"])
    with reading(node, "file"):
        if node["form"] == "sphere":
            return globe(*about, *_heights(node))
        return around(*about, node["degrees"], *_heights(node))


@domain_operator(
    file=_FILE,
    size=Number(1.0, "longest side, between the middles of pixels; its middle is on the z axis", above=0),
    height=Number(0.05, "by which the surface rises under white, from none under black", above=0),
    sha256=DIGEST,
)
def relief(child, x, y, z, relief, slope, centre, half):  # type: ignore[no-untyped-def]
    """The element raised by a picture that falls on it along z, by its levels of grey; around the picture, by
    the levels of its edge. L = the element's plus the largest slope of the picture, from all its pixels.
    """
    raised = child(x, y, z) - slope * outline_distance(x, y, relief)
    return maximum(raised, beyond(x, y, z, centre, half))


@relief.arguments
def raised_arguments(node: Node) -> dict[str, Any]:
    given = _relief(node)
    return {"relief": given, "slope": given.slope, **frame(node.bounds.box)}


@relief.bounds
def raised_bounds(node: Node) -> Box:
    return node.children[0].bounds.box.grown(_relief(node).highest)


@relief.slope
def raised_slope(node: Node) -> float:
    given = _relief(node)
    return max(1.0, node.children[0].bounds.slope_less(given.highest) + given.slope)


for _formula in (heightmap, lithophane, relief):
    identify_file(_formula, "file", ENDINGS, "a picture")
