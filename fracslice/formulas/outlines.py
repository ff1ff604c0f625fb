"""Outlines of files in a plane as solids: extruded, revolved and swept, and texts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..common.parameters import REQUIRED, Choice, Digest, File, Label, Number, Points
from ..errors import MeshError
from ..expr.vocabulary import absolute, maximum, minimum, outline_distance, solid_distance, sqrt
from ..fields.box import Box
from ..fields.registry import Node, shape
from .models import DIGEST, identify_file, reading

if TYPE_CHECKING:
    from ..mesh.outlines import Outline
    from ..mesh.sweeps import Swept

_FILE: dict[str, Any] = {
    "file": File(REQUIRED, "an SVG file, in the folder of the scene", inside=True),
    "size": Number(
        None, "the longest side of the outline; without it, a scene unit is a millimetre", above=0
    ),
}


def _prism(x, y, z, outline, middle, half):  # type: ignore[no-untyped-def]
    """The exact distance of an outline that is extruded, after Quilez."""
    d = outline_distance(x, y, outline)
    h = absolute(z - middle) - half
    od = maximum(d, 0.0)
    oh = maximum(h, 0.0)
    return sqrt(od * od + oh * oh) + minimum(maximum(d, h), 0.0)


def _prism_arguments(outline: Outline, height: float, place: str) -> dict[str, object]:
    return {"outline": outline, "middle": 0.0 if place == "centre" else height / 2, "half": height / 2}


def _prism_box(outline: Outline, height: float, place: str) -> Box:
    bottom = -height / 2 if place == "centre" else 0.0
    return Box((*outline.low, bottom), (*outline.high, bottom + height))


@shape(
    **_FILE,
    height=Number(1.0, "along z", above=0),
    place=Choice(
        "centre",
        "centred at the origin, or there from z = 0, or from z = 0 where the file has it, y up",
        ("centre", "bed", "as is"),
    ),
    sha256=DIGEST,
)
def extrude(x, y, z, outline, middle, half):  # type: ignore[no-untyped-def]
    """What an SVG file fills, extruded along z (Quilez 2008, "Distance functions"). L = 1: an exact distance,
    but for curves, which are segments within 1/20000 of the longest side. Strokes, clipping and masks do not
    count.
    """
    return _prism(x, y, z, outline, middle, half)


@extrude.arguments
def extrude_arguments(node: Node) -> dict[str, object]:
    return _prism_arguments(_extruded(node), node["height"], node["place"])


@extrude.bounds
def extrude_bounds(node: Node) -> Box:
    return _prism_box(_extruded(node), node["height"], node["place"])


def _extruded(node: Node) -> Outline:
    from ..mesh.outlines import extruded

    with reading(node, "file"):
        return extruded(node["file"], node["sha256"], node["size"], node["place"] != "as is")


@shape(
    **_FILE,
    offset=Number(0.0, "from the axis to the left edge of the outline", least=0),
    place=Choice("centre", "centred at the origin, or from z = 0", ("centre", "bed")),
    sha256=DIGEST,
)
def revolve(x, y, z, outline):  # type: ignore[no-untyped-def]
    """What an SVG file fills, turned around the z axis, with its left edge there and its y along z (after
    Quilez 2008, "Distance functions"). L = 1: an exact distance, with curves and fills as of `<extrude>`.
    """
    return outline_distance(sqrt(x * x + y * y), z, outline)


@revolve.arguments
def revolve_arguments(node: Node) -> dict[str, object]:
    return {"outline": _revolved(node)}


@revolve.bounds
def revolve_bounds(node: Node) -> Box:
    outline = _revolved(node)
    radius = outline.high[0]
    return Box((-radius, -radius, outline.low[1]), (radius, radius, outline.high[1]))


def _revolved(node: Node) -> Outline:
    from ..mesh.outlines import revolved

    names = ("file", "sha256", "size", "offset")
    with reading(node, "file"):
        return revolved(*(node[name] for name in names), node["place"] == "centre")


@shape(
    **_FILE,
    anchor=Choice(
        "centre",
        "the point of the outline that is on the path: the centre of its box, or the origin of its file",
        ("centre", "origin"),
    ),
    path=File(None, "an SVG file whose lines are the path, in the folder of the scene", inside=True),
    length=Number(None, "longest side of that path; without it, a scene unit is a millimetre", above=0),
    place=Choice(
        "centre", "that path centred at the origin, or where its file has it, y up", ("centre", "as is")
    ),
    points=Points(None, "corners of the path, in place of a file"),
    closed=Choice("no", "whether points are joined to a ring", ("no", "yes")),
    sha256=DIGEST,
    path_sha256=Digest(None, "hash of the file of the path, in the same way"),
)
def sweep(x, y, z, solids):  # type: ignore[no-untyped-def]
    """What an SVG file fills, swept along a path: seen along the path, its x is to the right, and its y up,
    towards z where the path starts (Wang, Juettler, Zheng and Liu 2008, "Computation of Rotation Minimizing
    Frames"). Corners below 165 degrees are mitred. L = 1: an exact distance, but for curves, which are
    segments within 1/20000 of the longest side of the outline, or of the path. Where a path meets itself, or
    bends more tightly than the outline is wide, parts are united: inside, the distance is then a bound.
    """
    return solid_distance(x, y, z, solids)


@sweep.check
def sweep_check(node: Node) -> None:
    if node["path"] is not None and node["points"] is not None:
        raise node.fail("path and points: expected one of them")
    if node["points"] is not None and (node["length"] is not None or node["place"] != "centre"):
        raise node.fail("length and place: expected a path of a file with them")
    if node["points"] is None and node["closed"] == "yes":
        raise node.fail(
            'closed="yes": expected points with it; whether a path of a file is closed is in the file'
        )


@sweep.arguments
def sweep_arguments(node: Node) -> dict[str, object]:
    return {"solids": _swept(node)}


@sweep.bounds
def sweep_bounds(node: Node) -> Box:
    return _swept(node).box


def _swept(node: Node) -> Swept:
    from ..mesh.sweeps import Path, drawn, profile, swept

    if (points := node["points"]) is not None:
        paths: tuple[Path, ...] = (Path(points, node["closed"] == "yes"),)
    elif node["path"] is None:
        raise node.fail("path and points: expected one of them")
    else:
        with reading(node, "path"):
            paths = drawn(node["path"], node["path_sha256"], node["length"], node["place"] == "centre")
    with reading(node, "file"):
        outline = profile(node["file"], node["sha256"], node["size"], node["anchor"] == "centre")
    try:
        return swept(outline, paths)
    except MeshError as error:
        raise node.fail(str(error)) from error


@shape(
    text=Label(REQUIRED, "the text, in one line and one direction of writing"),
    font=File(REQUIRED, "a TrueType or OpenType font, in the folder of the scene", inside=True),
    size=Number(1.0, "font size: the em, of which a capital letter is about 0.7", above=0),
    depth=Number(1.0, "along z", above=0),
    place=Choice(
        "centre",
        "centred at the origin, or there from z = 0, or along the base line from the origin and from z = 0",
        ("centre", "bed", "as is"),
    ),
    variations=Label("", "where on its axes a variable font is, such as wght=700, wdth=80"),
    sha256=Digest(None, "hash of the font, by which a file that has changed is noticed"),
)
def text(x, y, z, outline, middle, half):  # type: ignore[no-untyped-def]
    """A text, extruded along z (Quilez 2008, "Distance functions"), with ligatures and scripts in all
    directions by HarfBuzz. L = 1: an exact distance, but for curves, which are segments within 1/20000 of the
    em.
    """
    return _prism(x, y, z, outline, middle, half)


@text.arguments
def text_arguments(node: Node) -> dict[str, object]:
    return _prism_arguments(_written(node), node["depth"], node["place"])


@text.bounds
def text_bounds(node: Node) -> Box:
    return _prism_box(_written(node), node["depth"], node["place"])


def _written(node: Node) -> Outline:
    from ..mesh.outlines import written

    names = ("font", "sha256", "text", "variations", "size")
    with reading(node, "font"):
        return written(*(node[name] for name in names), node["place"] != "as is")


for _formula in (extrude, revolve, sweep):
    identify_file(_formula, "file", {".svg"}, "an outline")
identify_file(sweep, "path", {".svg"}, "a path", "path_sha256")
identify_file(text, "font", {".ttf", ".otf", ".ttc", ".otc"}, "a font")
