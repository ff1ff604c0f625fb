"""Printability checks on a sampled solid, in time linear in its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import SceneError
from ..formulas import Box
from ..formulas.parameters import Number, validate
from ..kernel import Field
from ..scene.lengths import Length
from ..volume import Bricks
from ..work import Work
from .components import components_of
from .connectivity import resolved, shown
from .faces import projected
from .samples import Samples
from .thin_features import thin_features
from .walls import Walls, walls
from .widths import BINS, Widths, widths_of

COARSE, FINE = 96, 192
"""Minimum and maximum number of samples along the longest side."""

SPECK = 27
"""Volume in samples; smaller components are indistinguishable from noise."""

ACROSS = 4
"""Samples across the thinnest allowed wall, as far as `FINE` permits."""

UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Limits:
    """Limits of the checks. Lengths are numbers of mm, or text such as "0.4mm".

    Attributes
    ----------
    speck : float
        Components with less area in every layer (mm^2), or less volume (mm^3), are counted as specks but are
        not a problem.
    cup : float
        Minimum area of a suction cup or a resin trap, mm^2.
    deep : float
        Minimum height of a suction cup, mm; every hole in the first layers is a shallow one.
    wall : float
        Thinnest allowed wall, mm; layers are judged by their thinnest hundredth.
    floor : float
        Thinnest allowed floor or roof along z, mm.
    thin : float
        Minimum area of thin walls, or thin floors, that is a problem, mm^2.
    density : float
        Density of the resin, g/cm^3.

    Raises
    ------
    SceneError
        For an invalid value.
    """

    speck: float = 0.02
    cup: float = 1.0
    deep: float = 0.5
    wall: float = 0.1
    floor: float = 0.1
    thin: float = 1.0
    density: float = 1.1

    def __post_init__(self) -> None:
        validate(self, _KINDS, SceneError)


_KINDS = {
    **dict.fromkeys(("speck", "cup", "thin"), Number(0.0, "an area", least=0)),
    "deep": Length(0.5, "a height", zero=True),
    **dict.fromkeys(("wall", "floor"), Length(0.1, "a thickness", zero=True)),
    "density": Number(1.1, "of the resin", above=0),
}


@dataclass(frozen=True)
class SolidReport:
    """Report on a solid, measured on samples and, for thin features, on the field.

    Attributes
    ----------
    voxel : float
        Sample spacing, mm; lengths are accurate to one voxel.
    bodies, cavities : list of float
        Volumes without specks, mm^3, the largest first.
    walls, gaps, floors : Widths or None
        Thicknesses up to 2 mm, or up to the larger limit if that is more.
    thin_walls, thin_floors : float
        Surface below the limits, mm^2.
    unseen : str
        Walls that a mesh or layers may lose; empty if there are none.
    problems : list of str
        One line for each problem.
    """

    voxel: float
    bodies: list[float]
    cavities: list[float]
    walls: Widths | None
    gaps: Widths | None
    floors: Widths | None
    thin_walls: float
    thin_floors: float
    unseen: str
    problems: list[str]

    @property
    def thin(self) -> list[str]:
        """Problems that neither a mesh nor layers reveal: thin walls and floors."""
        return self.problems[int(len(self.bodies) > 1) + int(bool(self.cavities)) :]

    def as_dict(self) -> dict[str, Any]:
        """The report as plain JSON types.

        Returns
        -------
        dict
            Keyed by attribute name.
        """
        return asdict(self)


def check_object(
    root: Field,
    outer: Box,
    scale: float,
    limits: Limits | None = None,
    work: Work | None = None,
    finest: float | None = None,
) -> SolidReport:
    """Check an object given by its field.

    Parameters
    ----------
    root : Field
        The object, all depths of its tree known.
    outer : Box
        Conservative bounds of the object, scene units.
    scale : float
        mm per scene unit.
    limits : Limits, optional
        Limits of the checks.
    work : Work, optional
        Threads, progress and cancellation.
    finest : float, optional
        Width in mm below which a mesh or layers may lose walls; the sample spacing if not given.

    Returns
    -------
    SolidReport
        The report.

    Raises
    ------
    VolumeError
        If the field cannot be sampled.
    Cancelled
        When the work is cancelled.
    """
    limits, work = limits or Limits(), work or Work()
    longest = max(outer.size)
    wanted = ACROSS * longest * scale / max(min(limits.wall, limits.floor), 1e-6)
    samples = min(max(wanted, COARSE), FINE)
    bricks = shown(root, outer, longest, samples, work)
    return check_solid(root, bricks, scale, limits, work, finest)


def check_solid(
    root: Field,
    bricks: Bricks,
    scale: float,
    limits: Limits | None = None,
    work: Work | None = None,
    finest: float | None = None,
) -> SolidReport:
    """Check a sampled solid: bodies, sealed cavities, thin walls and thin floors.

    Parameters
    ----------
    root : Field
        The sampled field.
    bricks : Bricks
        Its samples.
    scale : float
        mm per scene unit.
    limits : Limits, optional
        Limits of the checks.
    work : Work, optional
        Threads, progress and cancellation.
    finest : float, optional
        Width in mm below which a mesh or layers may lose walls; the sample spacing if not given.

    Returns
    -------
    SolidReport
        The report.

    Raises
    ------
    VolumeError
        If the field cannot be sampled.
    Cancelled
        When the work is cancelled.
    """
    limits, work = limits or Limits(), work or Work()
    work.progress("checking the solid", 0.0)
    most = max(float(BINS[-1]), limits.wall, limits.floor) / scale
    solid = Samples(bricks)
    work.check()
    thin, tight = thin_features(root, solid, work)

    def seen(**how: Any) -> Walls:
        return projected(root, walls(solid, most, work, **how), bricks.voxel, work)

    thick = thin.beside(seen(), most)
    between = tight.beside(seen(gaps=True), most)
    floors = thin.beside(seen(direction=UP), most, UP)
    bare = _under(floors, limits.floor, scale)
    narrow = _under(thick, limits.wall, scale)
    speck = max(limits.speck, SPECK * (bricks.voxel * scale) ** 3) / scale**3
    found = _volumes(bricks, speck)
    missed = thin.walls + tight.walls
    fine = resolved(root, bricks, limits.thin / scale**2, len(found[0]) > 1, work, missed)
    if fine is not bricks:
        found = _volumes(fine, speck)
    bodies, cavities = ([v * scale**3 for v in volumes] for volumes in found)
    problems = []
    if len(bodies) > 1:
        problems.append(f"{len(bodies)} loose bodies")
    if cavities:
        sealed = counted(cavities, "sealed cavity", "sealed cavities")
        problems.append(f"{sealed} of {sum(cavities):.3g} mm3")
    if narrow >= limits.thin:
        problems.append(f"{narrow:.3g} mm2 of walls are thinner than {limits.wall:g} mm")
    if bare >= limits.thin:
        problems.append(f"{bare:.3g} mm2 of floors are thinner than {limits.floor:g} mm")
    unseen = _unseen(thick, finest or bricks.voxel * scale, limits.thin, scale)
    return SolidReport(
        voxel=bricks.voxel * scale,
        bodies=bodies,
        cavities=cavities,
        walls=_widths(thick, scale),
        gaps=_widths(between, scale),
        floors=_widths(floors, scale),
        thin_walls=narrow,
        thin_floors=bare,
        unseen=unseen,
        problems=problems,
    )


def _widths(found: Walls, scale: float) -> Widths | None:
    """Statistics of widths in mm, weighted by their surface."""
    return widths_of(found.width * scale, found.area * scale**2)


def _unseen(found: Walls, finest: float, least: float, scale: float) -> str:
    """Describe the walls thinner than `finest` mm: area, least thickness and its place in the scene.

    Empty if their area is below `least` mm2.
    """
    lost = found.chosen(found.width * scale < finest)
    area = float(lost.area.sum()) * scale**2
    if area < least:
        return ""
    first = int(lost.width.argmin())
    x, y, z = lost.middle[first].tolist()
    return (
        f"{area:.3g} mm2 of walls are thinner than {finest:.3g} mm and may be lost; "
        f"the thinnest, {lost.width[first] * scale:.2g} mm, at {x:.3g} {y:.3g} {z:.3g} in the scene"
    )


def counted(things: Sequence[object], one: str, more: str = "") -> str:
    """Count with its noun: "1 suction cup", "2 suction cups".

    Parameters
    ----------
    things : sequence
        Things to count.
    one, more : str
        Singular and plural; the plural is the singular and an s if not given.

    Returns
    -------
    str
        The number and the noun.
    """
    return f"{len(things)} {one if len(things) == 1 else more or one + 's'}"


def _volumes(bricks: Bricks, speck: float) -> tuple[list[float], list[float]]:
    """Volumes of bodies and of cavities of at least `speck`, the largest first, cubed scene units."""
    components = components_of(bricks)
    sizes = [
        bricks.voxel**3 * components.count[numbers] for numbers in (components.bodies, components.cavities)
    ]
    bodies, cavities = ([v for v in size.tolist() if v >= speck] for size in sizes)
    return bodies, cavities


def _under(found: Walls, limit: float, scale: float) -> float:
    """Surface thinner than `limit` mm by more than a hundredth of it, mm^2."""
    return float(np.sum(found.area[found.width * scale < 0.99 * limit]) * scale**2)
