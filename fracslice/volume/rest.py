"""Bounds of an object after some components are removed from its mesh."""

from __future__ import annotations

import numpy as np

from ..formulas.box import Box
from ..work import Work
from . import Plan
from .extent import reached


def box_of_the_rest(planned: Plan, whole: np.ndarray, rest: np.ndarray, tips: np.ndarray, work: Work) -> Box:
    """Return the bounds of the remaining components, from the field: a mesh does not contain all tips.

    Parameters
    ----------
    planned
        Scene, bounds and voxel size.
    whole, rest
        Bounds of the mesh with all components and with the remaining ones, [2, 3], scene units.
    tips
        Outermost remaining vertices, [n, 3], scene units. The search for a side starts there if a
        removed component reached farther.
    work
        Execution settings.

    Returns
    -------
    Box
        Bounds, scene units.
    """
    if (rest == whole).all():
        return planned.box
    result = reached(planned.root, tips.T, planned.voxel, work)
    own = np.array([planned.box.lo, planned.box.hi])
    lo, hi = np.where(rest == whole, own, [result.lo, result.hi]).tolist()
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))
