"""Projection of vertices that lie on no grid edge to the surface, each within its own trust region."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .. import _native
from ..kernel import Field
from ..work import Work, chunks
from .roots import Roots

TrustRegions = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Function of point numbers, [n], and of a mask of the interior ones, [n]; float64 [4, 3, n], scene units.

The rows are the lower and upper corners of boxes that the points must not leave, which may be flat; points in
the boxes or on their boundaries where the field has the opposite sign, or NaN; and points in the boxes in the
middle of the known part of the surface there, or NaN.
"""

AT_ONCE = 1 << 16
"""Points per thread between two checks for cancellation."""


def project(
    root: Field,
    points: np.ndarray,
    trust_regions: TrustRegions,
    voxel: float,
    work: Work | None = None,
) -> None:
    """Project points, in place, to the zero set within their trust regions.

    A point moves along the gradient if the field changes its sign there within four Newton steps and the box,
    else straight towards the point of opposite sign of its trust region. Where the field is smooth nearby, it
    moves straight towards the middle if the surface lies between. A point that would come no nearer stays, as
    does a point already on the surface, such as an exact corner.

    Parameters
    ----------
    root
        Field.
    points
        Points, float64 [n, 3], contiguous, scene units.
    trust_regions
        Trust regions of some points. It is called by several threads and may read these points, not others.
    voxel
        Voxel size, scene units.
    work
        Execution settings.

    Raises
    ------
    Cancelled
        If the job was cancelled; some points are moved then.
    """
    work = work or Work()  # on the CPU: copies to a GPU and back take longer
    guess, exact = (Roots(root, precision, voxel) for precision in ("float32", "float64"))
    lead, find, entry = guess.native("lead"), guess.native("find"), root.kernel("cpu", "float64").entry
    exactly = exact.native("find"), exact.native("aim")
    loops = _native.ProjectionLoops(guess.width, lead, find, *exactly, entry)
    for part in chunks(len(points), AT_ONCE * work.threads):
        work.check()
        _native.project(points, part.start, part.stop, loops, trust_regions, voxel, work.threads)


def anywhere(which: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Return unbounded trust regions.

    Parameters
    ----------
    which
        Point numbers, [n].
    inside
        Mask of the interior points, [n]; not used.

    Returns
    -------
    ndarray
        Infinite boxes, [4, 3, n].
    """
    sides = np.array([-np.inf, np.inf, np.nan, np.nan])
    return np.tile(sides[:, None, None], (1, 3, len(which)))
