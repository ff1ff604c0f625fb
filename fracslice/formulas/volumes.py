"""Grids of OpenVDB files as solids."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..common.parameters import MILLIMETRES, REQUIRED, Choice, File, Label, Number
from ..expr.vocabulary import solid_distance
from ..fields.box import Box
from ..fields.registry import Node, shape
from .models import DIGEST, PLACE, identify_file, placed_box, placement, reading

if TYPE_CHECKING:
    from ..volume.level_sets import LevelSet


@shape(
    file=File(REQUIRED, "an OpenVDB file, in the folder of the scene", inside=True),
    grid=Label("", "name of a grid of the file; by default surface or density, or the only one"),
    kind=Choice(
        "as stated",
        "signed distances, negative inside, or densities, larger inside; or what the class of the grid says",
        ("as stated", "surface", "density"),
    ),
    iso=Number(None, "value at the surface; by default 0 of a surface and 0.5 of a density"),
    size=Number(None, "the longest side; without it, a scene unit is a millimetre of the grid", above=0),
    place=PLACE,
    units=Choice("mm", "unit of the file", tuple(MILLIMETRES)),
    sha256=DIGEST,
)
def volume(x, y, z, origin, scale, inverse, slope, level_set):  # type: ignore[no-untyped-def]
    """A grid of an OpenVDB file (Museth 2013, "VDB: High-Resolution Sparse Volumes with Dynamic Topology").
    Near the surface its distances, linear between samples; farther off, distances to where edges of the grid
    cross the surface. Other numbers become distances first. L = 1 is measured at the samples, with a margin.
    """
    ox, oy, oz = origin
    there = solid_distance((x - ox) * inverse, (y - oy) * inverse, (z - oz) * inverse, level_set)
    return scale * slope * there


identify_file(volume, "file", {".vdb"}, "an OpenVDB file")


@volume.arguments
def volume_arguments(node: Node) -> dict[str, Any]:
    found = _level_set(node)
    return {**placement(node, found.box), "slope": found.slope, "level_set": found}


@volume.slope
def volume_slope(node: Node) -> float:
    return _level_set(node).slope


@volume.bounds
def volume_bounds(node: Node) -> Box:
    return placed_box(node, _level_set(node).box)


@volume.tips
def volume_tips(node: Node) -> NDArray[np.float64] | None:
    found = _level_set(node)
    if found.tips is None:
        return None
    place = placement(node, found.box)
    tips: NDArray[np.float64] = found.tips * place["scale"] + np.array(place["origin"])[:, None]
    return tips


def _level_set(node: Node) -> LevelSet:
    """The level set of a node, in units of its file."""
    from ..volume.level_sets import level_set

    with reading(node, "file"):
        return level_set(node["file"], node["sha256"], node["grid"], node["kind"], node["iso"])
