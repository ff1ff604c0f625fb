"""Where a field is zero on many segments at once: the loops that its compiled kernel runs, and their rounds.

A segment is six rows: where it starts, and from there to its end; a root is a share t of it. Every lane is
for itself: what it finds does not depend on its neighbours, nor on how the segments are dealt out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..formulas.field import Field, Precision
from ..kernel.machine import constant
from .root_loops import aim, find, lead, polish

FRAMES = {"float32": (1e-6, 1e-5, 5e-2, 1e-6, 3e-4), "float64": (1e-9, 1e-7, 1e-5, 1e-6, 1e-7)}
"""FRAME but for its first number, the lengths in voxels."""

QUICK, MOST = 8, 48
"""Steps towards a root that all segments are given, and those that then are left."""

LOOPS = {"float32": (find, lead), "float64": (find, polish, aim)}


class Roots:
    """The loops over one scene's field. Safe to call from many threads at once.

    precision: "float32" or "float64". voxel: scene units. Segments are float [6, n] of that precision, n a
    multiple of `width`. batch: segments worth a call.
    """

    def __init__(self, root: Field, precision: Precision, voxel: float) -> None:
        self.dtype = np.dtype(precision)
        small, near, reach, tight, close = FRAMES[precision]
        frame = np.array([1 / voxel, small, near, reach * voxel, tight * voxel, close])
        self._frame = constant(frame, self.dtype)
        loops = root.loops(LOOPS[precision], precision)
        self.width, self.batch, self._runs = loops.width, loops.batch, loops.runs

    def padded(self, index: np.ndarray) -> np.ndarray:
        """The numbers of some segments, the last one repeated until they fill their lanes."""
        return np.concatenate([index, np.repeat(index[-1:], -len(index) % self.width)])

    def found(self, segments: np.ndarray) -> np.ndarray:
        """The roots, [n], as shares of the segments; where the ends have one sign, the end nearer to zero."""
        roots = self._stepped(segments, QUICK)
        slow = np.flatnonzero(roots > 1)
        if len(slow):
            slow = self.padded(slow)
            left = self._stepped(segments.take(slow, 1), MOST)
            roots[slow] = np.where(left > 1, left - 2, left)
        return roots

    def _stepped(self, segments: np.ndarray, steps: int) -> np.ndarray:
        roots = np.empty((1, segments.shape[1]), self.dtype)
        self._runs["find"](self._frame, segments, roots, steps)
        found: np.ndarray = roots[0]
        return found

    def native(self, name: str) -> tuple[Any, ...] | Callable[..., None]:
        """One of the loops for native code."""
        return self._runs[name].native(self._frame)

    def aimed(self, segments: np.ndarray, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Roots brought nearer, [n], and |f| in voxels, [n]."""
        out = np.empty((2, len(roots)), self.dtype)
        out[0] = roots
        self._runs["aim"](self._frame, segments, out)
        return out[0], out[1]

    def lead(self, trust_regions: np.ndarray) -> np.ndarray:
        """The ways, [3, n], from points to the surface. trust_regions: [15, n]: the points, the space
        below and above them, the ways to somewhere of the other sign and to the middle, or NaN."""
        ways = np.empty((3, trust_regions.shape[1]), self.dtype)
        self._runs["lead"](self._frame, trust_regions, ways)
        return ways
