"""How large what stays of an object is, where some of its bodies are taken away from its mesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..formulas.box import Box
from ..work import Work
from . import Plan
from .extent import reached


def box_of_the_rest(
    planned: Plan, whole: np.ndarray, rest: np.ndarray, tips: Callable[[], np.ndarray], work: Work
) -> Box:
    """The box of the bodies that stay, scene units: the field's, for a mesh does not have all of its tips.

    whole, rest: bounds of the mesh [2, 3] with all bodies, and with those. tips: the outermost vertices that
    stay, [n, 3], scene units, from which a side is looked for where bodies that were removed reach farther.
    """
    if (rest == whole).all():
        return planned.box
    found = reached(planned.root, tips().T, planned.voxel, work)
    own = np.array([planned.box.lo, planned.box.hi])
    lo, hi = np.where(rest == whole, own, [found.lo, found.hi]).tolist()
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))


def outermost(vertices: np.ndarray) -> np.ndarray:
    """Those of [n, 3] that are farthest out along each axis, [6, 3]."""
    found: np.ndarray = vertices[[*vertices.argmin(0), *vertices.argmax(0)]]
    return found
