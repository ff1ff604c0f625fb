"""Completeness of a mesh or stack of layers: its size and volume against those of the field."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..common.digits import decimal
from ..formulas import Box
from ..formulas.algebra import dot
from ..formulas.box import Triple
from ..volume import Lattice, Plan
from ..volume.amount import FINER, amount, finer
from ..work import Work

if TYPE_CHECKING:
    from ..kernel import Field
    from ..slicing import Slicer

Grid = tuple[Triple, Triple, Callable[[float], str]]
"""Origin and spacing of the samples, scene units, and a function that names samples of a fraction of the
spacing.
"""

SLABS = 6
"""Slabs of a stack that are measured, evenly distributed."""


@dataclass(frozen=True)
class Amount:
    """Volumes of the object and of its mesh or layers, mm3.

    Attributes
    ----------
    object
        Volume of the object, estimated from its field at random points.
    error
        Standard error of that estimate.
    made
        Volume of the mesh or the layers.
    off
        Relative difference if it is significant, else 0.
    """

    object: float
    error: float
    made: float
    off: float


def lost_size(
    name: str, box: Sequence[float], made: Sequence[float], whole: Sequence[float], spacing: Sequence[float]
) -> tuple[Triple, tuple[str, ...]]:
    """Compare the size of a mesh or layers with that of the object.

    Parameters
    ----------
    name : str
        What was made, with its verb.
    box, made, whole : sequence of float
        Sizes of the object, of what was made, and of that with the bodies that were removed, mm.
    spacing : sequence of float
        Spacing of the samples, mm.

    Returns
    -------
    tuple of float
        Length that is missing along each axis, mm.
    tuple of str
        A note on the axis along which most samples are missing, if it is more than one.
    """
    x, y, z = lost = [max(of - own, 0.0) for of, own in zip(box, made, strict=True)]
    samples = [mm / step for mm, step in zip(lost, spacing, strict=True)]
    axis = samples.index(max(samples))
    if samples[axis] <= 1:
        return (x, y, z), ()
    removed = whole[axis] - made[axis] > lost[axis] / 2
    reason = "bodies that were removed" if removed else "tips or walls finer than the samples"
    along = f"{name} {decimal(made[axis])} mm of {decimal(box[axis])} mm along {'xyz'[axis]}"
    return (x, y, z), (f"{along}: {reason} reach farther",)


def mesh_amount(planned: Plan, made: float, scale: float, work: Work) -> tuple[Amount, tuple[str, ...]]:
    """Compare the volume of a mesh with that of its field.

    Parameters
    ----------
    planned : Plan
        Sampled field.
    made : float
        Volume of the mesh, removed bodies included, mm3.
    scale : float
        mm per scene unit.
    work : Work
        Threads and cancellation.

    Returns
    -------
    Amount
        Both volumes.
    tuple of str
        A note if they differ.

    Raises
    ------
    Cancelled
        If the work is cancelled.
    """
    lattice = Lattice.around(planned.outer, planned.voxel)

    def sampling(voxel: float) -> str:
        return f"a voxel of {voxel * planned.voxel * scale:.2g} mm"

    spacing = planned.voxel, planned.voxel, planned.voxel
    return _compared(planned.root, [planned.outer], made, scale, (lattice.origin, spacing, sampling), work)


def layers_amount(slicer: Slicer, work: Work) -> tuple[Amount, tuple[str, ...]]:
    """Compare the volume of some slabs of a stack with that of its field.

    Parameters
    ----------
    slicer : Slicer
        Slicer of the stack; layers that it has painted are not sampled again.
    work : Work
        Threads and cancellation.

    Returns
    -------
    Amount
        Both volumes.
    tuple of str
        A note if they differ.

    Raises
    ------
    SliceError, Cancelled
        If a layer cannot be sampled, or the work is cancelled.
    """
    from ..slicing import SLAB

    stack = slicer.stack
    starts = np.arange(0, len(stack.z), SLAB)
    chosen = [s.tolist() for s in np.split(np.arange(len(stack.z)), starts[1:])]
    chosen = [chosen[k] for k in np.unique(np.linspace(0, len(starts) - 1, SLABS).round().astype(int))]
    layers = [layer for slab in chosen for layer in slab]
    for _ in slicer.map(lambda layer: layer.area, [k for k in layers if k not in slicer.areas]):
        pass  # the slicer keeps the areas
    areas = np.array([slicer.areas[k] for k in layers])
    (x0, y0, dx, dy), height = stack.frame.tolist(), stack.heights / stack.scale
    low, high = stack.z - height / 2, stack.z + height / 2
    (left, front, _), (right, back, _) = stack.outer.lo, stack.outer.hi
    boxes = [Box((left, front, low[s[0]]), (right, back, high[s[-1]])) for s in chosen]
    least = float(stack.heights.min())

    def sampling(share: float) -> str:
        return f"pixels of {share * min(stack.pixel):.2g} mm and layers of {share * least:.2g} mm"

    grid = (x0, y0, float(stack.z[0])), (dx, dy, least / stack.scale), sampling
    return _compared(stack.root, boxes, dot(areas, stack.heights[layers]), stack.scale, grid, work)


def _compared(
    root: Field,
    boxes: list[Box],
    made: float,
    scale: float,
    grid: Grid,
    work: Work,
) -> tuple[Amount, tuple[str, ...]]:
    """Compare the volume of the field in boxes, scene units, with `made`, mm3."""
    true = amount(root, boxes, work)
    off, unit = true.off(made / scale**3), scale**3
    compared = Amount(true.volume * unit, true.error * unit, made, off)
    if off > 0:
        return compared, (f"{off:.1%} more volume than the object has: the samples are too coarse for it",)
    if off == 0:
        return compared, ()
    origin, spacing, name = grid
    times = finer(root, true, off, origin, spacing, work)
    would = f"{name(1 / times)} would show it" if times else f"{name(1 / FINER[-1])} would not show it either"
    return compared, (f"{-off:.1%} of the object's volume is finer than the samples and missing: {would}",)
