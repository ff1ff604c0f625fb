"""Base and raft of an object."""

from __future__ import annotations

from dataclasses import replace

from ..errors import VolumeError
from ..formulas import Box, box, plane, transform
from ..scene import Print
from ..volume import Plan, extent
from ..work import Work
from .edits import edited_field


def standing(made: Plan, how: Print, scale: float, work: Work) -> Plan:
    """Cut off the base and add the raft.

    The raft extends a tenth of the longest side beyond the object, and half its height into it.

    Parameters
    ----------
    made : Plan
        Printable scene.
    how : Print
        Heights of the base and the raft, mm.
    scale : float
        mm per scene unit.
    work : Work
        Threads and cancellation.

    Returns
    -------
    Plan
        Scene that stands on the bed.

    Raises
    ------
    VolumeError
        If the base leaves nothing, or the raft is thinner than a voxel.
    Cancelled
        When the work is cancelled.
    """
    root, extents, outer = made.root, made.box, made.outer
    (x0, y0, z0), (x1, y1, z1) = extents.lo, extents.hi
    base, raft = how.base / scale, how.raft / scale
    if 0 < raft < made.voxel:
        raise VolumeError(
            f"a raft of {how.raft:g} mm: expected at least a voxel, {made.voxel * scale:.4g} mm"
        )
    if base:
        z0 += base
        if z0 >= z1:
            raise VolumeError(f"a base of {base * scale:g} mm leaves nothing of the object")
        root = edited_field(root, "keep", plane(normal=(0, 0, -1), offset=-z0))
        left = extent(root, work).box  # the widest part may be cut off
        (x0, y0, _), (x1, y1, _) = left.lo, left.hi
        extents = Box((x0, y0, z0), (x1, y1, z1))
    if raft:
        rim = max(extents.size) / 10
        lying = Box((x0 - rim, y0 - rim, z0 - raft / 2), (x1 + rim, y1 + rim, z0 + raft / 2))
        root = edited_field(root, "add", transform(box(size=lying.size), translate=lying.centre))
        extents, outer = extents | lying, (outer | lying).about(outer.centre)
    return replace(made, root=root, box=extents, outer=outer)
