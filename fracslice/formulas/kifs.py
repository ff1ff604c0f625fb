"""Kaleidoscopic fractals: folded into the part of space nearest to a corner of a Platonic solid, turned and
enlarged about the corner, again and again (Knighty 2010, "Kaleidoscopic (escape time) IFS",
fractalforums.com). Without the turn they are the flakes of `flakes`.
"""

from __future__ import annotations

import math
from typing import Any

from ..common.parameters import Number
from ..fields.maps import mirror, turn
from ..fields.orbits import orbit
from .flakes import CORNERS, MIRRORS, folded


def turned(scale: float) -> dict[str, Any]:
    """Parameters of a kaleidoscopic fractal."""
    return {
        "scale": Number(scale, "how much each step enlarges", least=1.1, most=10),
        "angle": Number(0.0, "rotation about the corner's axis in each step, degrees"),
    }


TETRAHEDRON, OCTAHEDRON = MIRRORS["tetrahedron"], MIRRORS["octahedron"]
ICOSAHEDRON = DODECAHEDRON = MIRRORS["icosahedron"]
CORNER = {solid: folded(solid, point) for solid, point in CORNERS.items()}
LENGTH = {solid: math.hypot(*point) for solid, point in CORNER.items()}
TETRAHEDRON_AXIS, OCTAHEDRON_AXIS, DODECAHEDRON_AXIS, ICOSAHEDRON_AXIS = (
    (x / LENGTH[solid], y / LENGTH[solid], z / LENGTH[solid]) for solid, (x, y, z) in CORNER.items()
)
"""Directions of the corners, which are on the unit sphere."""


def kaleidoscope(w, mirrors, axis, scale, angle):  # type: ignore[no-untyped-def]
    """Fold by mirrors with these normals, rotate about an axis, and enlarge about its point at distance 1."""
    for a, b, d in mirrors:
        w = mirror(w, (a, b, d))
    return scale * turn(w, axis, angle) - (scale - 1.0) * axis


@orbit(**turned(2.0))
def kifs_tetrahedron(w, c, scale, angle):  # type: ignore[no-untyped-def]
    """The tetrahedron in a kaleidoscope (Knighty 2010); a scale of 2 is Sierpinski's. L = 1."""
    return kaleidoscope(w, TETRAHEDRON, TETRAHEDRON_AXIS, scale, angle)


@orbit(**turned(2.0))
def kifs_octahedron(w, c, scale, angle):  # type: ignore[no-untyped-def]
    """The octahedron in a kaleidoscope (Knighty 2010). L = 1."""
    return kaleidoscope(w, OCTAHEDRON, OCTAHEDRON_AXIS, scale, angle)


@orbit(**turned(2.0))
def kifs_dodecahedron(w, c, scale, angle):  # type: ignore[no-untyped-def]
    """The dodecahedron in a kaleidoscope (Knighty 2010). L = 1."""
    return kaleidoscope(w, DODECAHEDRON, DODECAHEDRON_AXIS, scale, angle)


@orbit(**turned(2.0))
def kifs_icosahedron(w, c, scale, angle):  # type: ignore[no-untyped-def]
    """The icosahedron in a kaleidoscope (Knighty 2010). L = 1."""
    return kaleidoscope(w, ICOSAHEDRON, ICOSAHEDRON_AXIS, scale, angle)
