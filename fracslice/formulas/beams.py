"""Beams between points: graphs of files, and scaffolds in or on other solids."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..common.parameters import MILLIMETRES, REQUIRED, Choice, Count, File, Number
from ..errors import MeshError
from ..expr.vocabulary import maximum, solid_distance
from ..fields.box import Box
from ..fields.registry import Node, domain_operator, shape
from .models import DIGEST, identify_file, reading

if TYPE_CHECKING:
    from ..mesh.scaffolds import Beams

ENDINGS = {".3mf", ".csv", ".json", ".obj", ".ply"}
"""Files of graphs that are read."""

_SMOOTH = Number(
    0.0,
    "width of rounded seams: where distances of beams differ by less than this they are blended (0: none)",
    least=0,
)


@shape(
    file=File(
        REQUIRED,
        "a graph, in the folder of the scene: .csv, .json, lines of .obj, edges of .ply, beams of .3mf",
        inside=True,
    ),
    thickness=Number(0.1, "diameter of beams whose radius the file does not state", above=0),
    smooth=_SMOOTH,
    size=Number(
        None, "longest side of the box of all ends; without it, a scene unit is a millimetre", above=0
    ),
    place=Choice(
        "as is",
        "where the file has it, with the box of all ends centred at the origin, or there from z = 0",
        ("as is", "centre", "bed"),
    ),
    units=Choice("mm", "unit of the file", tuple(MILLIMETRES)),
    sha256=DIGEST,
)
def beams(x, y, z, beams):  # type: ignore[no-untyped-def]
    """Beams between points, round and with round ends, as a file has them (round cones: Quilez 2008,
    "Distance functions"). L = 1: an exact distance outside, and inside of what is in one beam alone. With
    seams, f is that for which max(0, f + smooth - d)^2, summed over the distances d of all beams, is
    smooth^2; they fill less than `smooth`.
    """
    return solid_distance(x, y, z, beams)


identify_file(beams, "file", ENDINGS, "a file of beams")


@beams.check
def beams_check(node: Node) -> None:
    if node["units"] != "mm" and node["file"].lower().endswith(".3mf"):
        raise node.fail(f'units="{node["units"]}": expected none, as the file states its own')


@beams.arguments
def beams_arguments(node: Node) -> dict[str, Any]:
    return {"beams": _from_file(node)}


@beams.bounds
def beams_bounds(node: Node) -> Box:
    return _from_file(node).box


def _from_file(node: Node) -> Beams:
    from ..mesh.scaffolds import from_file

    about, unit = (node["file"], node["sha256"], node["size"], node["place"]), MILLIMETRES[node["units"]]
    with reading(node, "file"):
        return from_file(*about, unit, node["thickness"] / 2, node["smooth"])


@domain_operator(
    of=Choice(
        "voronoi",
        "edges of the cells of what is nearest to each point, or lines from points to their neighbours",
        ("voronoi", "delaunay"),
    ),
    where=Choice(
        "inside", "points in the element, whose beams end at its surface, or on it", ("inside", "surface")
    ),
    count=Count(100, "number of points", least=5, most=20_000),
    thickness=Number(0.1, "diameter of the beams", above=0),
    smooth=_SMOOTH,
    seed=Count(0, "number that chooses another arrangement", most=2**31 - 1),
)
def scaffold(child, x, y, z, beams):  # type: ignore[no-untyped-def]
    """Beams along the edges of Voronoi 1908 cells or of Delaunay 1934 tetrahedra of points that are spread
    evenly in the element, or on its surface (Edelsbrunner and Shah 1997, "Triangulating topological spaces"),
    which they follow. L = maximum of 1 and the element's; on the surface, 1.
    """
    return maximum(solid_distance(x, y, z, beams), child(x, y, z))


def surface_scaffold(child, x, y, z, beams):  # type: ignore[no-untyped-def]
    return solid_distance(x, y, z, beams)


@scaffold.select
def scaffold_select(node: Node):  # type: ignore[no-untyped-def]
    return surface_scaffold if node["where"] == "surface" else scaffold.function


@scaffold.arguments
def scaffold_arguments(node: Node) -> dict[str, Any]:
    return {"beams": _scaffold(node)}


@scaffold.bounds
def scaffold_bounds(node: Node) -> Box:
    box = _scaffold(node).box
    return box if node["where"] == "surface" else box & node.children[0].bounds.box


@scaffold.slope
def scaffold_slope(node: Node) -> float:
    return 1.0 if node["where"] == "surface" else max(1.0, node.children[0].bounds.lipschitz)


@scaffold.check
def scaffold_check(node: Node) -> None:
    for inside in node.children[0].walk():
        if inside.formula.exterior_only or "visible" in inside.formula.hooks:
            raise node.fail(
                f"<{inside.formula.name}>: expected no fractal inside, whose detail depends on the resolution"
            )


def _scaffold(node: Node) -> Beams:
    from ..mesh.scaffolds import scaffold as made

    (child,) = node.children
    if not child.bounds.box.finite:
        raise node.fail("expected a solid that is bounded; put <bounds> around it")
    about = (node[name] for name in ("of", "where", "count", "seed"))
    try:
        return made(child.conservative(), *about, node["thickness"] / 2, node["smooth"])
    except MeshError as error:
        raise node.fail(str(error)) from error
