"""Triangle models of files as solids."""

from __future__ import annotations

from typing import Any

from ..common.parameters import MILLIMETRES, REQUIRED, Choice, Digest, File, Number
from ..errors import MeshError, SceneError
from ..expr.functions import InMemory
from ..expr.vocabulary import solid_distance
from ..fields.box import Box
from ..fields.registry import Node, shape


@shape(
    file=File(REQUIRED, "an STL, OBJ, PLY, GLB or 3MF file, in the folder of the scene", inside=True),
    size=Number(None, "the longest side; without it, a scene unit is a millimetre of the model", above=0),
    place=Choice(
        "as is",
        "where the file has it, with its box centred at the origin, or there with its lowest point at z = 0",
        ("as is", "centre", "bed"),
    ),
    units=Choice("mm", "unit of an STL, OBJ or PLY file; GLB and 3MF state their own", tuple(MILLIMETRES)),
    sha256=Digest(None, "hash of the file, by which a file that has changed is noticed"),
)
def model(x, y, z, solid):  # type: ignore[no-untyped-def]
    """A triangle model, closed and without self-intersections. L = 1: the exact distance to its triangles, on
    the side that Baerentzen and Aanaes 2005, "Signed Distance Computation Using the Angle Weighted
    Pseudonormal", have.
    """
    return solid_distance(x, y, z, solid)


@model.completed
def model_completed(values: dict[str, Any]) -> dict[str, Any]:
    from ..mesh.models import identify

    try:
        file, digest = identify(values["file"], values["sha256"])
    except MeshError as error:
        raise SceneError(f'<model> file="{values["file"]}": {error}') from error
    return {**values, "file": file, "sha256": digest}


@model.arguments
def model_arguments(node: Node) -> dict[str, InMemory]:
    return {"solid": _solid(node)}


@model.bounds
def model_bounds(node: Node) -> Box:
    box: Box = _solid(node).box
    return box


def _solid(node: Node) -> Any:
    """The placed solid of a node, a `mesh.models.Solid`."""
    from ..mesh.models import solid

    try:
        return solid(**node.values)
    except MeshError as error:
        raise node.fail(f'file="{node["file"]}": {error}') from error
