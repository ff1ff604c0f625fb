"""Planned layers of a job: of one height, with supports if it has them, or adaptive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..common.arrays import quantile
from ..common.parameters import Length, validate_value
from ..errors import SliceError
from ..fields.field import Field
from ..records import SliceJob
from ..volume.amount import Sizing
from ..work import Work
from .layers import Layer, Slicer
from .stack import Stack, plan_object, stack_of

ACROSS = 128
"""Pixels along the longer side of the coarse layers on which slopes are measured."""

SHARE = 0.9
"""Quantile of the slope along an outline that limits the layer; the rest of a rough outline is ignored."""


def plan_stack(root: Field, job: SliceJob, work: Work | None = None, size: Sizing | None = None) -> Stack:
    """Find the object's size and depths, make it printable, and place layers of one height and pixels.

    Parameters
    ----------
    root : Field
        The object.
    job : SliceJob
        The job.
    work : Work, optional
        Threads, progress and cancellation.
    size : Sizing, optional
        Size of the object; by default that of the job.

    Returns
    -------
    Stack
        The planned layers.

    Raises
    ------
    SliceError
        For too many layers or pixels, or an object too far from the origin.
    VolumeError
        For a scene without a solid, or if it cannot be made printable.
    Cancelled
        When the work is cancelled.
    """
    size = size or Sizing.of(job.size, job.scale)
    planned, scale = plan_object(root, job, size, work)
    if job.printing.supports == "none":
        return stack_of(planned, scale, job, size)
    from .supports import layers_with_room, supported  # measuring needs what many layers do not

    stack = layers_with_room(planned, scale, job, size)
    made = supported(planned, stack, job.printing, work or Work())
    return stack_of(made, scale, job, size, stack if made.supports else None)


def plan_layers(root: Field, job: SliceJob, work: Work | None = None, size: Sizing | None = None) -> Stack:
    """Plan the layers of a job, of one height or adaptive; see `plan_stack`."""
    stack, most = plan_stack(root, job, work, size), job.layer[1]
    return stack if most is None else adapted(stack, most, work)


def adapted(stack: Stack, most: float, work: Work | None = None) -> Stack:
    """Merge planned layers where the surface is steep.

    A layer of height t leaves cusps of height t |n|, n the vertical component of the surface's unit normal
    (Dolenc and Maekelae 1994, "Slicing procedures for layered manufacturing techniques"). Layers grow while
    that is at most the height of one planned layer. The result does not depend on the number of threads.

    Parameters
    ----------
    stack : Stack
        Layers of one height.
    most : float or str
        Maximum height of a layer, mm, or text such as "0.2mm".
    work : Work, optional
        Threads, progress and cancellation.

    Returns
    -------
    Stack
        The stack with merged layers.

    Raises
    ------
    SliceError
        For an invalid `most`, or one below the planned height.
    Cancelled
        When the work is cancelled.
    """
    least, most = float(stack.heights[0]), validate_value("layer", most, Length(None, ""), SliceError)
    if most < least:
        raise SliceError(
            f"layers of {least:g} to {most:g} mm: expected a range from the lowest to the highest"
        )
    slopes = list(Slicer(_coarse(stack), work or Work()).map(_slope))
    ends = _ends(np.array(slopes), int(most / least * (1 + 1e-9)))
    tops = stack.tops[ends]
    bottoms = np.concatenate([[0.0], tops[:-1]])
    z = stack.z[0] + ((tops + bottoms) / 2 - least / 2) / stack.scale
    return replace(stack, tops=tops, z=z)


def _ends(slopes: np.ndarray, most: int) -> list[int]:
    """Last planned layer of each merged layer; at most `most` planned layers are merged into one."""
    ends, count, steepest = [], 0, 0.0
    for index, slope in enumerate(slopes.tolist()):
        if count and (count == most or (count + 1) * max(steepest, slope) > 1):
            ends.append(index - 1)
            count, steepest = 0, 0.0
        count, steepest = count + 1, max(steepest, slope)
    return [*ends, len(slopes) - 1]


def _coarse(stack: Stack) -> Stack:
    """The same layers on a coarser lattice."""
    ny, nx = stack.shape
    times = max(max(ny, nx) // ACROSS, 1)
    pixel = stack.pixel[0] * times, stack.pixel[1] * times
    return replace(stack, pixel=pixel, shape=(-(-ny // times), -(-nx // times)))


def _slope(layer: Layer) -> float:
    """Vertical component of the normal along an outline, 0 to 1, by differences over the layer's height."""
    edges, ends = layer.slab.crossings(layer.place)
    if not len(edges):
        return 0.0
    stack = layer.stack
    share = (ends[:, 0] / (ends[:, 0] - ends[:, 1]))[:, None]
    x, y = (stack.frame[:2] + stack.frame[2:] * (edges[:, :2] + share * np.eye(2)[edges[:, 2]])).T
    z = np.full(len(x), stack.z[layer.index])
    half = layer.height / stack.scale / 2
    at = stack.exact.points
    gradient = np.array(
        [
            at(x + half, y, z) - at(x - half, y, z),
            at(x, y + half, z) - at(x, y - half, z),
            at(x, y, z + half) - at(x, y, z - half),
        ]
    )
    length = np.linalg.norm(gradient, axis=0)
    vertical = np.abs(gradient[2]) / np.where(length > 0, length, 1.0)
    return quantile(vertical, SHARE)
