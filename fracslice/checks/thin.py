"""Walls, floors and roofs that are too thin."""

from __future__ import annotations

from collections.abc import Iterator

from ..common.messages import significant
from ..printing.walls import Walls
from . import Check
from .problems import Problem
from .solid_checks import SolidEvidence

THICKEN = 1 / 250
"""Least thickness that can be restored, as a fraction of the longest side."""


def _walls(of: SolidEvidence) -> Iterator[Problem]:
    return _too_thin("walls", of.thin_walls, of.limits.wall, of)


def _floors(of: SolidEvidence) -> Iterator[Problem]:
    return _too_thin("floors", of.thin_floors, of.limits.floor, of)


def _too_thin(kind: str, under: Walls, limit: float, of: SolidEvidence) -> Iterator[Problem]:
    """Problem of walls or floors below a limit in mm, if their area is large enough."""
    area = float(under.area.sum()) * of.scale**2
    if area < of.limits.thin:
        return
    text = f"{significant(area)} mm2 of {kind} are thinner than {limit:g} mm"
    x, y, z = (of.scale * (under.middle[under.width.argmin()] - of.middle)).tolist()
    mend = (("thickness", f"{max(limit, THICKEN * of.scale * max(of.size)):.2g}mm"),)
    yield Problem(kind, text, at=(x, y, z), mend=mend)


CHECKS = Check("walls", "solid", _walls, rank=50), Check("floors", "solid", _floors, rank=51)
