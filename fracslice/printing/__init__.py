"""Field edits that make an object printable; what the checks measure of solids."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..records import Print
from ..work import Work

if TYPE_CHECKING:
    from ..volume import Plan
    from ..volume.amount import Sizing

__all__ = ["printable"]


def printable(
    planned: Plan, size: Sizing, how: Print, work: Work | None = None, *, measured: bool = True
) -> tuple[Plan, float]:
    """Make a planned scene printable.

    Samples with the voxel of `planned` lie at the same points before and after.

    Parameters
    ----------
    planned : Plan
        The scene, around the bodies that stay; see `frame_bodies`.
    size : Sizing
        Size of that, before anything is cut off or added.
    how : Print
        Changes to make.
    work : Work, optional
        Threads, progress and cancellation.
    measured : bool
        Whether a note names the walls that stay thinner than the thickness. A mesh measures its triangles.

    Returns
    -------
    plan : Plan
        The printable scene.
    scale : float
        mm per scene unit.

    Raises
    ------
    VolumeError
        If nothing would be left, or a length is too small to measure or larger than the object.
    Cancelled
        When the work is cancelled.
    """
    scale = size.scale(planned.box)
    if how == Print():
        return planned, scale
    from .preparation import apply_print_edits  # most objects are printed as they are

    return apply_print_edits(planned, size, how, scale, work or Work(), measured), scale
