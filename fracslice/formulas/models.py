"""Triangle models of files as solids, and what shapes of files have in common."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..common.arrays import Triangles
from ..common.parameters import MILLIMETRES, REQUIRED, Choice, Digest, File, Number, alternatives
from ..errors import MeshError, SceneError, VolumeError
from ..expr.vocabulary import solid_distance
from ..fields.box import Box, three
from ..fields.registry import Formula, Node, shape
from ..formats import ENDINGS, mesh_format

DIGEST = Digest(None, "hash of the file, by which a file that has changed is noticed")
"""Hash of a file that a formula reads; see `identify_file`."""

PLACE = Choice(
    "as is",
    "where the file has it, with its box centred at the origin, or there with its lowest point at z = 0",
    ("as is", "centre", "bed"),
)
"""Place of what a file has."""


def identify_file(
    formula: Formula, name: str, known: Collection[str], what: str, sha256: str = "sha256"
) -> None:
    """Let the values of a formula have the whole path and the hash of its file, if one is given.

    `name` and `sha256`: parameters of these; `known`: extensions that it may have; `what`: what it is, for
    errors.
    """
    before = formula.hooks.get("completed", lambda values: values)

    @formula.completed
    def file_completed(values: dict[str, Any]) -> dict[str, Any]:
        from ..mesh.models import identify

        values = before(values)
        if values[name] is None:
            return values
        try:
            file, digest = identify(values[name], values[sha256], known, what)
        except MeshError as error:
            raise SceneError(f'<{formula.name}> {name}="{values[name]}": {error}') from error
        return {**values, name: file, sha256: digest}


@contextmanager
def reading(node: Node, name: str) -> Iterator[None]:
    """Give errors about the file of a node its place; `name`: parameter of the file."""
    try:
        yield
    except (MeshError, VolumeError) as error:
        raise node.fail(f'{name}="{node[name]}": {error}') from error


@shape(
    file=File(REQUIRED, f"a model, {alternatives(*ENDINGS)}, in the folder of the scene", inside=True),
    size=Number(None, "the longest side; without it, a scene unit is a millimetre of the model", above=0),
    place=PLACE,
    units=Choice("mm", "unit of a file that states none, as .3mf and .glb do", tuple(MILLIMETRES)),
    sha256=DIGEST,
)
def model(x, y, z, origin, scale, inverse, solid):  # type: ignore[no-untyped-def]
    """A triangle model, closed and without self-intersections. L = 1: the exact distance to its triangles, on
    the side that Baerentzen and Aanaes 2005, "Signed Distance Computation Using the Angle Weighted
    Pseudonormal", have.
    """
    ox, oy, oz = origin
    return scale * solid_distance((x - ox) * inverse, (y - oy) * inverse, (z - oz) * inverse, solid)


identify_file(model, "file", ENDINGS, "a model file")


@model.check
def model_check(node: Node) -> None:
    if node["units"] != "mm" and mesh_format(Path(node["file"]).suffix.lower()).has_unit:
        raise node.fail(f'units="{node["units"]}": expected none, as the file states its own')


@model.arguments
def model_arguments(node: Node) -> dict[str, Any]:
    solid = _solid(node)
    return {**placement(node, solid.box), "solid": solid}


@model.bounds
def model_bounds(node: Node) -> Box:
    return placed_box(node, _solid(node).box)


@model.triangles
def model_triangles(node: Node) -> Triangles | None:
    solid = _solid(node)
    if solid.mesh is None:
        return None
    place = placement(node, solid.box)
    return Triangles(solid.mesh.vertices * place["scale"] + place["origin"], solid.mesh.triangles)


def placement(node: Node, box: Box) -> dict[str, Any]:
    """Where the origin of a file's coordinates is, the length of their unit in scene units, and its inverse.

    `box`: bounds of the solid in the file.
    """
    scale = MILLIMETRES[node["units"]] if node["size"] is None else node["size"] / max(box.size)
    x, y, z = (-scale * c for c in box.centre)
    places = {"as is": (0.0, 0.0, 0.0), "centre": (x, y, z), "bed": (x, y, -scale * box.lo[2])}
    return {"origin": places[node["place"]], "scale": scale, "inverse": 1 / scale}


def placed_box(node: Node, box: Box) -> Box:
    """Bounds of a solid of a file, in the scene."""
    placed = placement(node, box)
    corners = [
        [o + placed["scale"] * c for o, c in zip(placed["origin"], corner, strict=True)]
        for corner in (box.lo, box.hi)
    ]
    return Box.around([three(corner) for corner in corners])


def _solid(node: Node) -> Any:
    """The solid of a node, a `mesh.models.Solid`, in mm of its file."""
    from ..mesh.models import solid

    with reading(node, "file"):
        return solid(node["file"], node["sha256"])
