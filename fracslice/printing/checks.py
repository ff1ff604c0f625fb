"""Would it print? What the samples tell of the solid as a whole, in time linear in its surface."""

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
"""Samples along the longest side, at least and at most."""

SPECK = 27
"""Samples: less is not told from noise."""

ACROSS = 4
"""Samples across the thinnest wall that may be, if `FINE` allows."""

UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Limits:
    """What counts. Lengths are numbers of mm, or text such as "0.4mm".

    speck: parts with less area (mm^2) in every layer, or less volume (mm^3), are dust that is counted but no
    reason to stop. cup: the least area of a suction cup or a resin trap, mm^2. deep: the least height of a
    suction cup, mm: any hole in the first layers is a shallow one. wall: the thinnest wall, mm; in a layer it
    is judged by the thinnest hundredth. floor: the thinnest floor or roof, mm, measured upwards. thin: walls
    and floors count from so much thin surface on, mm^2. density: of the resin, g/cm^3. Raises `SceneError`
    for a value that cannot be.
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
    """What the samples told, and the field of what is thinner. voxel: mm between samples: lengths are right
    within one. bodies, cavities: their volumes in mm^3, the largest first, without specks. walls, gaps,
    floors: thicknesses up to 2 mm. thin_walls, thin_floors: how much surface is under the limits, mm^2.
    unseen: what walls a mesh or layers may lose, in words.
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
        """The problems that neither a mesh nor layers tell of."""
        return self.problems[int(len(self.bodies) > 1) + int(bool(self.cavities)) :]

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON."""
        return asdict(self)


def check_object(
    root: Field,
    outer: Box,
    scale: float,
    limits: Limits | None = None,
    work: Work | None = None,
    finest: float | None = None,
) -> SolidReport:
    """Checks an object, all depths of its tree known, within the box `outer`. scale: mm per scene unit. The
    rest, and what it raises, is that of `check_solid`.
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
    """Checks a sampled solid: loose bodies, sealed cavities, thin walls and floors. root: what the bricks are
    samples of. scale: mm per scene unit. finest: mm, what is thinner a mesh or layers may lose; if not given,
    a voxel.

    Raises `VolumeError`, `Cancelled`.
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
    told = [widths_of(w.width * scale, w.area * scale**2) for w in (thick, between, floors)]
    unseen = _unseen(thick, finest or bricks.voxel * scale, limits.thin, scale)
    return SolidReport(
        bricks.voxel * scale, bodies, cavities, told[0], told[1], told[2], narrow, bare, unseen, problems
    )


def _unseen(found: Walls, finest: float, least: float, scale: float) -> str:
    """Walls thinner than `finest` mm, if there are `least` mm2 of them: how thin, and where in the scene."""
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
    """How many there are, and what: "1 suction cup", "2 suction cups"."""
    return f"{len(things)} {one if len(things) == 1 else more or one + 's'}"


def _volumes(bricks: Bricks, speck: float) -> tuple[list[float], list[float]]:
    """Of all bodies, and of all cavities, of at least `speck`, the largest first."""
    components = components_of(bricks)
    sizes = [
        bricks.voxel**3 * components.count[numbers] for numbers in (components.bodies, components.cavities)
    ]
    bodies, cavities = ([v for v in size.tolist() if v >= speck] for size in sizes)
    return bodies, cavities


def _under(found: Walls, limit: float, scale: float) -> float:
    """How much surface is thinner than a limit, mm^2, by more than a hundredth of it."""
    return float(np.sum(found.area[found.width * scale < 0.99 * limit]) * scale**2)
