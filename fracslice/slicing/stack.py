"""What is to be cut: the job, and the stack of layers that is planned for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..errors import SceneError, SliceError
from ..formulas import transform
from ..formulas.algebra import length
from ..formulas.box import Box
from ..formulas.parameters import REQUIRED, Vector, validate
from ..formulas.registry import Node
from ..kernel import Field
from ..printing import printable
from ..scene import Print
from ..scene.lengths import Length, Pair
from ..volume import plan, with_depths
from ..work import Work

MOST_LAYERS = 100_000
MOST_PIXELS = 65_536


@dataclass(frozen=True)
class SliceJob:
    """What to cut. Lengths are numbers of mm, or text such as "0.05mm"; the fields hold mm.

    size: the object's longest side, before anything is cut off or added. layer: layer height. pixel: width
    and height of a pixel, or one length for both. up: the direction of the scene that is up in the print.
    printing: what makes it printable. Raises `SceneError` for a value that cannot be, `SliceError` for layers
    or pixels as large as the object.
    """

    size: float
    layer: float = 0.05
    pixel: tuple[float, float] = (0.05, 0.05)
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    printing: Print = field(default_factory=Print)

    def __post_init__(self) -> None:
        validate(self, _KINDS, SceneError)
        if self.layer >= self.size:
            raise SliceError(f"a layer of {self.layer:g} mm is as high as the object: {self.size:g} mm")
        if max(self.pixel) >= self.size:
            raise SliceError(f"a pixel of {max(self.pixel):g} mm is as large as the object: {self.size:g} mm")


_KINDS = {
    "size": Length(REQUIRED, "the longest side"),
    "layer": Length(0.05, "the layer height"),
    "pixel": Pair((0.05, 0.05), "width and height"),
    "up": Vector((0.0, 0.0, 1.0), "a direction", nonzero=True),
}


@dataclass(frozen=True, eq=False)
class Stack:
    """A planned job: the field, and where its layers and pixels lie.

    root: the scene with all depths known, turned so that z is up. scale: mm per scene unit. corner:
    position of the lattice point (0, 0) in scene units. pixel: mm (x, y). shape: pixels (ny, nx); there is
    one more lattice point along each. z: float64 [n], the heights at which the layers are cut, scene units.
    tops: float64 [n], the layers' upper faces in mm above the object's lowest point. size: the object's
    size in mm. outer: a box that surely encloses it, scene units. notes: what a pixel is too large for, in
    words.
    """

    root: Field
    scale: float
    corner: tuple[float, float]
    pixel: tuple[float, float]
    shape: tuple[int, int]
    z: np.ndarray
    tops: np.ndarray
    size: tuple[float, float, float]
    outer: Box
    notes: tuple[str, ...] = ()

    @property
    def heights(self) -> np.ndarray:
        """Each layer's height in mm, float64 [n]."""
        return np.diff(self.tops, prepend=0.0)

    @property
    def frame(self) -> np.ndarray:
        """(x0, y0, dx, dy) in scene units, float64 [4]."""
        return np.array([*self.corner, self.pixel[0] / self.scale, self.pixel[1] / self.scale])


def plan_stack(root: Node, job: SliceJob, work: Work | None = None) -> Stack:
    """Finds the object's size and depths and lays its layers and pixels.

    Raises `SliceError` if there would be too many, `VolumeError` for a scene without a solid.
    """
    turned = _turned(root, job.up, work)
    planned = plan(turned, job.size / min(job.pixel), work)
    planned, scale = printable(planned, job.size, job.printing, work)
    found, outer = planned.box, planned.outer
    mm = tuple(s * scale for s in found.size)
    shape, corner = [0, 0], [0.0, 0.0]
    for axis in range(2):
        step = job.pixel[axis] / scale
        shape[1 - axis] = 2 * math.ceil(outer.size[axis] / step / 2 + 1)
        corner[axis] = found.centre[axis] - step * shape[1 - axis] / 2
    tops = _tops(mm[2], job.layer)
    if max(shape) > MOST_PIXELS:
        raise SliceError(f"{shape[1]} x {shape[0]} pixels: at most {MOST_PIXELS} along a side")
    z = found.lo[2] + (tops - np.diff(tops, prepend=0.0) / 2) / scale
    size, at = (mm[0], mm[1], mm[2]), (corner[0], corner[1])
    pixels, notes = (shape[0], shape[1]), (*planned.notes, *_rounded(mm[2], float(tops[-1])))
    return Stack(planned.root, scale, at, job.pixel, pixels, z, tops, size, outer, notes)


def _tops(height: float, layer: float) -> np.ndarray:
    """As many whole layers as come nearest to the height, at least one."""
    count = max(round(height / layer), 1)
    if count > MOST_LAYERS:
        raise SliceError(f"{count} layers: at most {MOST_LAYERS}")
    return layer * np.arange(1, count + 1)


def _rounded(height: float, made: float) -> tuple[str, ...]:
    """A line if whole layers make the object lower or higher by more than a hundredth, mm."""
    if abs(made - height) <= height / 100:
        return ()
    return (f"whole layers are {made:.4g} mm high, the object {height:.4g} mm; expected lower layers",)


def _turned(root: Node, up: tuple[float, float, float], work: Work | None) -> Node:
    """The scene turned so that `up` points along z, by the shortest way; as deep as it is unturned."""
    direction = np.asarray(up, float) / length(np.asarray(up, float))
    axis = np.cross(direction, (0.0, 0.0, 1.0))
    angle = math.degrees(math.atan2(length(axis), float(direction[2])))
    if angle == 0:
        return root
    if not length(axis) > 0:
        axis = np.array([1.0, 0.0, 0.0])
    return transform(with_depths(root, work), rotate=(*axis.tolist(), angle))
