"""Outlines of files in a plane as solids: extruded and revolved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..common.parameters import REQUIRED, Choice, Digest, File, Number
from ..errors import MeshError, SceneError
from ..expr.vocabulary import absolute, maximum, minimum, outline_distance, sqrt
from ..fields.box import Box
from ..fields.registry import Formula, Node, shape

if TYPE_CHECKING:
    from ..mesh.outlines import Outline

_FILE: dict[str, Any] = {
    "file": File(REQUIRED, "an SVG file, in the folder of the scene", inside=True),
    "size": Number(
        None, "the longest side of the outline; without it, a scene unit is a millimetre", above=0
    ),
}
_DIGEST = Digest(None, "hash of the file, by which a file that has changed is noticed")


@shape(
    **_FILE,
    height=Number(1.0, "along z", above=0),
    place=Choice(
        "centre",
        "centred at the origin, or there from z = 0, or from z = 0 where the file has it, y up",
        ("centre", "bed", "as is"),
    ),
    sha256=_DIGEST,
)
def extrude(x, y, z, outline, middle, half):  # type: ignore[no-untyped-def]
    """What an SVG file fills, extruded along z. L = 1: an exact distance, but for curves, which are segments
    within 1/20000 of the longest side. Strokes, clipping and masks do not count.
    """
    d = outline_distance(x, y, outline)
    h = absolute(z - middle) - half
    od = maximum(d, 0.0)
    oh = maximum(h, 0.0)
    return sqrt(od * od + oh * oh) + minimum(maximum(d, h), 0.0)


@extrude.arguments
def extrude_arguments(node: Node) -> dict[str, object]:
    half = node["height"] / 2
    return {"outline": _extruded(node), "middle": 0.0 if node["place"] == "centre" else half, "half": half}


@extrude.bounds
def extrude_bounds(node: Node) -> Box:
    outline, height = _extruded(node), node["height"]
    bottom = -height / 2 if node["place"] == "centre" else 0.0
    return Box((*outline.low, bottom), (*outline.high, bottom + height))


def _extruded(node: Node) -> Outline:
    from ..mesh.outlines import extruded

    try:
        return extruded(node["file"], node["sha256"], node["size"], node["place"] != "as is")
    except MeshError as error:
        raise node.fail(f'file="{node["file"]}": {error}') from error


@shape(
    **_FILE,
    offset=Number(0.0, "from the axis to the left edge of the outline", least=0),
    place=Choice("centre", "centred at the origin, or from z = 0", ("centre", "bed")),
    sha256=_DIGEST,
)
def revolve(x, y, z, outline):  # type: ignore[no-untyped-def]
    """What an SVG file fills, turned around the z axis, with its left edge there and its y along z. L = 1: an
    exact distance, with curves and fills as of `<extrude>`.
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

    values = node.values
    try:
        return revolved(
            values["file"], values["sha256"], values["size"], values["offset"], values["place"] == "centre"
        )
    except MeshError as error:
        raise node.fail(f'file="{node["file"]}": {error}') from error


def _identified(formula: Formula) -> None:
    """Let the values of a formula have the whole path and the hash of its file."""

    @formula.completed
    def outline_completed(values: dict[str, Any]) -> dict[str, Any]:
        from ..mesh.models import identify

        try:
            file, digest = identify(values["file"], values["sha256"], (".svg",), "an outline")
        except MeshError as error:
            raise SceneError(f'<{formula.name}> file="{values["file"]}": {error}') from error
        return {**values, "file": file, "sha256": digest}


for _formula in (extrude, revolve):
    _identified(_formula)
