"""Limits of the printability checks.

Guides of makers of resin printers advise supports for flat cantilevers over 1 mm (Addema, "Recommendations -
SLA"; EnvisionTEC, "Self-Supporting Features") and keep bridges under 21 mm (Addema): beyond, surfaces
suffer. Prints fail later; the limit of cantilevers, 5 mm, is ours, as are those of necks, cups and specks.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import SceneError
from ..formulas.parameters import Number
from ..formulas.records import attribute, validate
from ..scene.lengths import Length


@dataclass(frozen=True)
class Limits:
    """Limits of the checks. Lengths are numbers of mm, or text such as "0.4mm".

    Attributes
    ----------
    speck : float
        Components with less area in every layer (mm^2; at least 8 pixels), or less volume (mm^3), are counted
        as specks but are not a problem.
    cup : float
        Minimum area of a suction cup, a resin trap or, in layers, a sealed cavity, mm^2.
    deep : float
        Minimum height of a suction cup, mm; every hole in the first layers is a shallow one.
    wall : float
        Thinnest allowed wall, mm; layers are judged by their thinnest hundredth.
    floor : float
        Thinnest allowed floor or roof along z, mm.
    thin : float
        Minimum area of thin walls, or thin floors, that is a problem, mm^2.
    overhang : float
        Longest flat cantilever, mm.
    span : float
        Longest flat bridge between two supports, mm.
    neck : float
        Largest area that an area of 1 carries; a layer on less contact tears off.
    heavy : float
        Cross-section from which a component counts as carried, mm^2.
    density : float
        Density of the resin, g/cm^3.

    Raises
    ------
    SceneError
        For an invalid value.
    """

    speck: float = attribute(Number, 0.02, "an area", least=0)
    cup: float = attribute(Number, 1.0, "an area", least=0)
    deep: float = attribute(Length, 2.0, "a height", zero=True)
    wall: float = attribute(Length, 0.1, "a thickness", zero=True)
    floor: float = attribute(Length, 0.1, "a thickness", zero=True)
    thin: float = attribute(Number, 1.0, "an area", least=0)
    overhang: float = attribute(Length, 5.0, "a length")
    span: float = attribute(Length, 20.0, "a length")
    neck: float = attribute(Number, 50.0, "a ratio", above=0)
    heavy: float = attribute(Number, 20.0, "an area", least=0)
    density: float = attribute(Number, 1.1, "of the resin", above=0)

    def __post_init__(self) -> None:
        validate(self, SceneError)
