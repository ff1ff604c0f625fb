"""Walls, gaps, floors and holes of a sampled solid, in time linear in its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..common.messages import format_count, place, significant
from ..fields.box import Box, Triple
from ..fields.field import Field
from ..printing.thin_features import narrow_holes, sampled_object, thin_features
from ..printing.walls import BINS, Measure, Samples, Walls, Widths, project_faces, walls_of, widths_of
from ..volume import Bricks, Drain
from ..work import Work
from . import problems_of
from .problems import Limits, Problem

COARSE, FINE = 96, 192
"""Minimum and maximum number of samples along the longest side."""

ACROSS = 4
"""Samples across the thinnest allowed wall, as far as `FINE` permits."""

UP = (0.0, 0.0, 1.0)

PARALLEL = -0.94
"""Maximum cosine between the normals of the faces of a wall that is too thin: a wedge of more than 20 degrees
is a sharp edge.
"""


@dataclass(frozen=True)
class SolidReport:
    """Report on a solid, measured on samples and, for thin features, on the field."""

    voxel: float  # sample spacing, mm; lengths are accurate to one voxel
    walls: Widths | None  # thicknesses up to 2 mm, or up to the larger limit if that is more
    gaps: Widths | None
    floors: Widths | None
    thin_walls: float  # surface below the limits, mm^2
    thin_floors: float
    unseen: str  # walls that a mesh or layers may lose; empty if there are none
    holes: str  # holes of the shape that may close; empty if there are none
    problems: list[Problem]  # thin walls and floors, which layers do not reveal

    def as_dict(self) -> dict[str, Any]:
        """The report as plain JSON types."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class SolidEvidence:
    """What is known of a sampled solid. Places and widths of walls in scene units."""

    root: Field  # the field, its samples, and mm per scene unit
    bricks: Bricks
    scale: float
    limits: Limits
    middle: np.ndarray  # point from which places are measured
    size: Triple  # sides of the object
    walls: Walls  # measured across the solid, along z, and across what is empty
    floors: Walls
    gaps: Walls
    thin_walls: Walls  # those below the limits, without sharp edges and rims of drain holes
    thin_floors: Walls


def check_object(
    root: Field,
    outer: Box,
    scale: float,
    limits: Limits | None = None,
    work: Work | None = None,
    finest: float | None = None,
    origin: Triple | None = None,
    drains: Sequence[Drain] = (),
) -> SolidReport:
    """Check the walls, floors, gaps and holes of an object given by its field.

    `outer`, `origin` in scene units; `scale`: mm per scene unit; `finest`: width in mm below which a mesh or
    layers may lose walls.
    """
    limits, work = limits or Limits(), work or Work()
    work.progress("checking the solid", 0.0)
    longest = max(outer.size)
    wanted = ACROSS * longest * scale / max(min(limits.wall, limits.floor), 1e-6)
    bricks = sampled_object(root, outer, longest, min(max(wanted, COARSE), FINE), work)
    solid = Samples(bricks)
    work.check()
    thick, between, floors = _measured(root, solid, max(BINS[-1], limits.wall, limits.floor) / scale, work)
    work.progress("checking the solid", 0.9)
    bare, narrow = (
        _off_rims(_under(measured, limit, scale), drains, 2 * limit / scale)
        for measured, limit in ((floors, limits.floor), (thick, limits.wall))
    )
    middle = np.array(origin or (*solid.bounds.box.centre[:2], bricks.origin[2]))
    evidence = SolidEvidence(
        *(root, bricks, scale, limits, middle, solid.bounds.box.size),
        *(thick, floors, between, narrow, bare),
    )
    unseen = _unseen(thick, finest or bricks.voxel * scale, limits.thin, scale, middle)
    tunnels = between.chosen(between.width * scale < 0.99 * limits.hole)
    for drain in drains:  # these are named by themselves
        tunnels = tunnels.chosen(_from_side(tunnels, drain) > 0)
    holes = narrow_holes(root, solid, tunnels, limits.hole / scale, work)
    return SolidReport(
        voxel=bricks.voxel * scale,
        walls=_widths(thick, scale),
        gaps=_widths(between, scale),
        floors=_widths(floors, scale),
        thin_walls=float(narrow.area.sum()) * scale**2,
        thin_floors=float(bare.area.sum()) * scale**2,
        unseen=unseen,
        holes=_closing(holes, limits.hole, scale, middle),
        problems=problems_of("solid", evidence),
    )


def _measured(root: Field, solid: Samples, most: float, work: Work) -> tuple[Walls, Walls, Walls]:
    """Walls, gaps and floors thinner than `most` scene units."""
    work.progress("checking the solid", 0.1)
    thin, tight = thin_features(root, solid, work)
    work.progress("checking the solid", 0.6)
    voxel = solid.bricks.voxel
    least, narrowest = (features.least(voxel) for features in (thin, tight))
    kinds = Measure(False, least), Measure(True, narrowest), Measure(False, least, UP)
    thick, between, upright = (
        project_faces(root, found, voxel, work) for found in walls_of(solid, most, work, kinds)
    )
    return thin.beside(thick, most), tight.beside(between, most), thin.beside(upright, most, UP)


def _widths(walls: Walls, scale: float) -> Widths | None:
    """Statistics of widths in mm, weighted by their surface."""
    return widths_of(walls.width * scale, walls.area * scale**2)


def _unseen(walls: Walls, finest: float, least: float, scale: float, middle: np.ndarray) -> str:
    """Describe the walls thinner than `finest` mm: area, least thickness and its place from `middle`.

    Empty if their area is below `least` mm2.
    """
    lost = walls.chosen(walls.width * scale < finest)
    area = float(lost.area.sum()) * scale**2
    if area < least:
        return ""
    first = int(lost.width.argmin())
    at = place((scale * (lost.middle[first] - middle)).tolist())
    return (
        f"{significant(area)} mm2 of walls are thinner than {finest:.3g} mm and may be lost; "
        f"the thinnest, {lost.width[first] * scale:.2g} mm, at {at} mm"
    )


def _closing(holes: Walls, limit: float, scale: float, middle: np.ndarray) -> str:
    """Describe holes narrower than `limit` mm: number, least width and its place from `middle`."""
    if not len(holes.width):
        return ""
    first = int(holes.width.argmin())
    at = place((scale * (holes.middle[first] - middle)).tolist())
    return f"{may_close(len(holes.width), 'hole', holes.width[first] * scale, limit)}: at {at} mm"


def may_close(count: int, noun: str, width: float, limit: float) -> str:
    """Say that some holes of a width are narrower than a limit, mm."""
    return f"{format_count(count, noun)} of {width:.2g} mm, narrower than {limit:g} mm, may close"


def _under(walls: Walls, limit: float, scale: float) -> Walls:
    """Walls thinner than `limit` mm by more than a hundredth of it, the rims of wedges excepted."""
    return walls.chosen((walls.width * scale < 0.99 * limit) & (walls.facing < PARALLEL))


def _off_rims(thin: Walls, drains: Sequence[Drain], near: float) -> Walls:
    """Walls except for the sharp rims of drain holes: those nearer than `near` to the side of a hole."""
    for drain in drains:
        thin = thin.chosen(np.abs(_from_side(thin, drain)) > near)
    return thin


def _from_side(walls: Walls, drain: Drain) -> np.ndarray:
    """Distance of the middles of walls from the side of a drain hole, negative within it."""
    start, along = np.array(drain.start), np.array(drain.end) - drain.start
    share = np.clip((walls.middle - start) @ along / (along @ along), 0, 1)
    return np.asarray(np.linalg.norm(walls.middle - start - share[:, None] * along, axis=1) - drain.radius)
