"""Roots of a field on many segments at once: the compiled loops.

A segment is six rows: its start, and the vector to its end; a root is a fraction t of it. Each lane is
independent: its result does not depend on its neighbours or on the order of the segments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..expr.machine import constant
from ..fields.field import Device, Field, Precision
from .root_loops import aim, find, lead, polish

SURE = 8e-5
"""Length of Newton's last step, as a fraction of a voxel, below which a root is exact: the error is of the
order of its square.
"""

FRAMES = {"float32": (1e-6, 1e-5, 5e-2, 1e-6, SURE), "float64": (1e-9, 1e-7, 1e-5, 1e-6, 1e-7)}
"""Entries of FRAME after the first, lengths in voxels. Ends of float32 at longer steps than `SURE` save fewer
steps than float64 then takes.
"""

LOOPS = {"float32": (find, lead), "float64": (find, polish, aim)}
"""Loops compiled for each precision."""


class Roots:
    """Root-finding loops of one scene's field. Thread-safe.

    Segments are float [6, n] of that precision; n is a multiple of `width`.

    `precision`: "float32" or "float64"; `voxel` in scene units.
    """

    def __init__(self, root: Field, precision: Precision, voxel: float, device: Device = "cpu") -> None:
        self.precision, self.dtype = precision, np.dtype(precision)
        small, near, reach, tight, close = FRAMES[precision]
        frame = np.array([1 / voxel, small, near, reach * voxel, tight * voxel, close])
        self.frame = constant(frame, self.dtype)
        loops = root.loops(LOOPS[precision], precision, device)
        self.width, self.batch, self.runs, self.on_gpu = loops.width, loops.batch, loops.runs, loops.on_gpu

    def native(self, name: str) -> tuple[Any, ...] | Callable[..., None]:
        """Return a loop for native code."""
        return self.runs[name].native(self.frame)
