"""What is to be cut: the planned stack of layers, and the record of one layer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SliceError
from ..formulas import bounds, box, transform, union
from ..formulas.box import Box
from ..formulas.registry import Node
from ..volume import plan
from ..work import Work

if TYPE_CHECKING:
    from .printable import Term

MOST_LAYERS = 100_000
MOST_PIXELS = 65_536


@dataclass(frozen=True)
class SliceJob:
    """What to cut, lengths in mm.

    size: the object's longest side, before anything is cut off or added. layer: layer height. pixel: width
    and height of a pixel. up: the direction of the scene that is up in the print. base: so much is cut off
    the bottom. raft: the height of a plate under the object, half of it around its lowest part. Raises
    `SliceError` for values that cannot be.
    """

    size: float
    layer: float = 0.05
    pixel: tuple[float, float] = (0.05, 0.05)
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    base: float = 0.0
    raft: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("size", self.size), ("layer", self.layer), ("pixel", min(self.pixel))):
            if not (math.isfinite(value) and value > 0):
                raise SliceError(f"{name} {value:g} mm: expected a length > 0")
        if self.layer >= self.size:
            raise SliceError(f"a layer of {self.layer:g} mm is as high as the object: {self.size:g} mm")
        if max(self.pixel) >= self.size:
            raise SliceError(f"a pixel of {max(self.pixel):g} mm is as large as the object: {self.size:g} mm")
        for name, value in (("base", self.base), ("raft", self.raft)):
            if not 0 <= value < self.size:
                raise SliceError(f"{name} {value:g} mm: expected less than the object's size")
        if not np.linalg.norm(self.up) > 0:
            raise SliceError("up: expected a direction other than 0 0 0")


@dataclass(frozen=True, eq=False)
class Stack:
    """A planned job: the field, and where its layers and pixels lie.

    root: the scene with all depths known, turned so that z is up. scale: mm per scene unit. corner:
    position of the lattice point (0, 0) in scene units. pixel: mm (x, y). shape: pixels (ny, nx); there is
    one more lattice point along each. z: float64 [n], the heights at which the layers are cut, scene units.
    tops: float64 [n], the layers' upper faces in mm above the object's lowest point. size: the object's
    size in mm.
    """

    root: Node
    scale: float
    corner: tuple[float, float]
    pixel: tuple[float, float]
    shape: tuple[int, int]
    z: np.ndarray
    tops: np.ndarray
    size: tuple[float, float, float]
    outer: Box
    terms: tuple[Term, ...] = ()

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
    turned = _turned(root, job.up)
    planned = plan(turned, job.size / min(job.pixel), work)
    scale = job.size / max(planned.box.size)
    node, found, outer = _standing(planned.root, planned.box, planned.outer, job, scale)
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
    return Stack(node, scale, at, job.pixel, (shape[0], shape[1]), z, tops, size, outer)


def _standing(root: Node, found: Box, outer: Box, job: SliceJob, scale: float) -> tuple[Node, Box, Box]:
    """The scene with its bottom cut off and a raft under it, its box, and a box that encloses it.

    The raft reaches a tenth of the longest side beyond the object, and half its height into it.
    """
    (x0, y0, z0), (x1, y1, z1) = found.lo, found.hi
    if job.base:
        z0 += job.base / scale
        root = bounds(root, min=(outer.lo[0], outer.lo[1], z0), max=outer.hi)
        outer = Box((outer.lo[0], outer.lo[1], z0), outer.hi)
    if job.raft:
        height, rim = job.raft / scale, max(found.size) / 10
        low = (x0 - rim, y0 - rim, z0 - height / 2)
        raft = Box(low, (x1 + rim, y1 + rim, z0 + height / 2))
        root = union(root, transform(box(size=raft.size), translate=raft.centre))
        found, outer = Box((x0, y0, z0), (x1, y1, z1)) | raft, outer | raft
    else:
        found = Box((x0, y0, z0), (x1, y1, z1))
    return root, found, outer


def _tops(height: float, layer: float) -> np.ndarray:
    """As many whole layers as come nearest to the height, at least one."""
    count = max(round(height / layer), 1)
    if count > MOST_LAYERS:
        raise SliceError(f"{count} layers: at most {MOST_LAYERS}")
    return layer * np.arange(1, count + 1)


def _turned(root: Node, up: tuple[float, float, float]) -> Node:
    """The scene turned so that `up` points along z, by the shortest way."""
    direction = np.asarray(up, float) / np.linalg.norm(up)
    axis = np.cross(direction, (0.0, 0.0, 1.0))
    angle = math.degrees(math.atan2(float(np.linalg.norm(axis)), float(direction[2])))
    if angle == 0:
        return root
    if not np.linalg.norm(axis) > 0:
        axis = np.array([1.0, 0.0, 0.0])
    return transform(root, rotate=(*axis.tolist(), angle))
