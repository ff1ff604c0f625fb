"""Slicing jobs, and the planned stack of layers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from ..common.cache import key
from ..errors import SliceError
from ..fields.box import Box
from ..fields.field import Field, Kernel
from ..printing import printable
from ..records import SliceJob
from ..volume import Drain, Plan, Supports, plan
from ..volume.amount import Sizing, orient_field
from ..work import Work

MOST_LAYERS = 100_000
MOST_PIXELS = 65_536

BLOCK = 64
"""Pixels along the largest blocks that are dropped together; see `fracslice.slicing.layers`."""

FLOAT_STEPS = 8
"""Minimum number of float32 numbers between two samples."""


@dataclass(frozen=True, eq=False)
class Standing:
    """A part on a plate.

    Attributes
    ----------
    stack : Stack
        The part alone, in layers of the same heights and in the same pixels.
    turns : int
        Quarter turns counter-clockwise.
    at : tuple of int
        Row and column of the plate of its lattice's first pixel, once turned.
    """

    stack: Stack
    turns: int
    at: tuple[int, int]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of its lattice, turned."""
        ny, nx = self.stack.shape
        return (nx, ny) if self.turns % 2 else (ny, nx)

    def moved(self, points: np.ndarray, plate: tuple[int, int]) -> np.ndarray:
        """Points of the part on its plate.

        `points`: mm from the middle of the part, float64 [n, 2]; `plate`: rows and columns of the plate.
        Returns mm from the middle of the plate, float64 [n, 2].
        """
        cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[self.turns]
        x, y = points.T
        middle = [
            (first + own / 2 - whole / 2) * side
            for first, own, whole, side in zip(
                self.at[::-1], self.shape[::-1], plate[::-1], self.stack.pixel, strict=True
            )
        ]
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], 1) + middle


@dataclass(frozen=True, eq=False)
class Stack:
    """A planned job: the field, its layers and its pixels.

    Attributes
    ----------
    root : Field
        The scene with all depths known, rotated so that z is up.
    scale : float
        mm per scene unit.
    corner : tuple of float
        Lattice point (0, 0), scene units.
    pixel : tuple of float
        Width and height of a pixel, mm.
    shape : tuple of int
        Pixels (ny, nx); the lattice has one more point along each axis.
    z : float64 [n]
        Heights at which the layers are cut, scene units.
    tops : float64 [n]
        Upper faces of the layers, mm above the object's lowest point.
    size : tuple of float
        Size of the object, mm.
    outer : Box
        Conservative bounds of the object, scene units.
    notes : tuple of str
        What a pixel or a layer is too large for.
    drains : tuple of Drain
        Drain holes.
    parts : tuple of Standing
        Parts of a plate, which are sliced each for itself; empty for one object.
    supports : Supports or None
        Supports, if there are any.
    side : float
        Size of the job: longest side before compensation and print preparation, mm.
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
    drains: tuple[Drain, ...] = ()
    parts: tuple[Standing, ...] = ()
    supports: Supports | None = None
    side: float = field(kw_only=True)

    @property
    def identity(self) -> list[object]:
        """Values that determine the layers."""
        own = [getattr(self, f.name) for f in fields(self) if f.name not in ("root", "parts", "supports")]
        parts = [(part.turns, part.at, key(*part.stack.identity)) for part in self.parts]
        held = vars(self.supports.pillars).values() if self.supports else ()
        return [self.object.key, *held, *own, *parts]

    @property
    def object(self) -> Field:
        """The object without its supports."""
        return self.supports.carried if self.supports else self.root

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(self)}  # no machine code

    @cached_property
    def exact(self) -> Kernel:
        """float64 kernel of the field."""
        return self.root.kernel("cpu", "float64")

    @property
    def heights(self) -> np.ndarray:
        """Layer heights in mm, float64 [n]."""
        return np.diff(self.tops, prepend=0.0)

    @property
    def origin(self) -> tuple[float, float, float]:
        """Middle of the object's lower face, scene units; places of problems are measured from it."""
        x0, y0, dx, dy = self.frame.tolist()
        ny, nx = self.shape
        lowest = self.z[0] - float(self.tops[0]) / self.scale / 2
        return x0 + dx * nx / 2, y0 + dy * ny / 2, float(lowest)

    @property
    def frame(self) -> np.ndarray:
        """(x0, y0, dx, dy) of the lattice in scene units, float64 [4]."""
        return np.array([*self.corner, self.pixel[0] / self.scale, self.pixel[1] / self.scale])


def plan_object(root: Field, job: SliceJob, size: Sizing, work: Work | None = None) -> tuple[Plan, float]:
    """The printable object of a job, and mm per scene unit; see `fracslice.slicing.plan_stack`."""
    layer, pixel = job.layer[0], job.pixels
    _refuse_coarse(layer, max(pixel), size.side)
    planned = plan(orient_field(root, job.up, size.stretch, work), size.longest / min(pixel), work)
    if job.printing.bodies is not None:
        from ..printing.edits import frame_bodies

        planned = frame_bodies(planned, size, job.printing.bodies, work or Work())
    return printable(planned, size, job.printing, work)


def stack_of(planned: Plan, scale: float, job: SliceJob, size: Sizing, within: Stack | None = None) -> Stack:
    """Place layers of one height and pixels.

    `scale`: mm per scene unit; `within`: layers of a part of the object, whose pixels and heights
    are kept.
    """
    layer, pixel = job.layer[0], job.pixels
    box, outer = planned.box, planned.outer
    mm = tuple(s * scale for s in box.size)
    shape, corner = [0, 0], [0.0, 0.0]
    for axis in range(2):
        step = pixel[axis] / scale
        pixels = 2 * math.ceil(outer.size[axis] / step / 2 + 1)
        if within:
            pixels = max(pixels + (within.shape[1 - axis] - pixels) % (2 * BLOCK), within.shape[1 - axis])
        shape[1 - axis] = pixels
        corner[axis] = box.centre[axis] - step * shape[1 - axis] / 2
    tops = _tops(mm[2], layer)
    if max(shape) > MOST_PIXELS:
        most = f"at most {MOST_PIXELS} along a side; expected larger pixels or a smaller object"
        raise SliceError(f"{shape[1]} x {shape[0]} pixels, {most}")
    _check_precision(outer, scale, min(*pixel, layer))
    z = box.lo[2] + (tops - np.diff(tops, prepend=0.0) / 2) / scale
    if within:  # at the same heights to the last bit: a plane of the object may be at one of them
        below = round((within.z[0] - z[0]) * scale / layer)
        tops = layer * np.arange(1, below + len(within.z) + 1)
        z = np.concatenate([within.z[0] - np.arange(below, 0, -1) * layer / scale, within.z])
    sides, at = (mm[0], mm[1], mm[2]), (corner[0], corner[1])
    rows, notes = (shape[0], shape[1]), (*planned.notes, *_rounding_note(mm[2], float(tops[-1])))
    where, rest = (at, pixel, rows, z, tops), (notes, planned.drains)
    supports = planned.supports
    return Stack(planned.root, scale, *where, sides, outer, *rest, supports=supports, side=size.side)


def _refuse_coarse(layer: float, pixel: float, size: float) -> None:
    """Refuse layers or pixels, mm, as large as the object."""
    if layer >= size:
        raise SliceError(
            f"a layer of {layer:g} mm is as high as the object: {size:g} mm; "
            "expected a lower layer or a larger object"
        )
    if pixel >= size:
        raise SliceError(f"a pixel of {pixel:g} mm is as large as the object: {size:g} mm")


def _check_precision(outer: Box, scale: float, finest: float) -> None:
    """Refuse an object so far from the origin that float32 coordinates do not tell its samples, `finest` mm
    apart, from each other; meshes have the same limit.
    """
    far = max(map(abs, (*outer.lo, *outer.hi)))
    if FLOAT_STEPS * float(np.spacing(np.float32(far))) * scale > finest:
        raise SliceError(
            f"samples {finest:g} mm apart are too fine for float32 coordinates at a distance of {far:.4g} "
            "scene units from the origin; expected the object nearer to it"
        )


def _tops(height: float, layer: float) -> np.ndarray:
    """Upper faces of the whole number of layers, at least one, that is nearest to the height."""
    count = max(round(height / layer), 1)
    if count > MOST_LAYERS:
        raise SliceError(f"{count} layers: at most {MOST_LAYERS}")
    return layer * np.arange(1, count + 1)


def _rounding_note(height: float, made: float) -> tuple[str, ...]:
    """A note if whole layers change the height in mm by more than a hundredth."""
    if abs(made - height) <= height / 100:
        return ()
    return (f"whole layers are {made:.4g} mm high, the object {height:.4g} mm; expected lower layers",)
