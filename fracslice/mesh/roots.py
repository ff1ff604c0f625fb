"""Roots of a field on many segments at once: the compiled loops and their rounds.

A segment is six rows: its start, and the vector to its end; a root is a fraction t of it. Each lane is
independent: its result does not depend on its neighbours or on the order of the segments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..formulas.field import Device, Field, Precision
from ..kernel.machine import constant
from .root_loops import aim, find, lead, polish

FRAMES = {"float32": (1e-6, 1e-5, 5e-2, 1e-6, 3e-4), "float64": (1e-9, 1e-7, 1e-5, 1e-6, 1e-7)}
"""Entries of FRAME after the first, lengths in voxels."""

QUICK, MOST = 8, 48
"""Steps for all segments, and further steps for those not finished."""

LOOPS = {"float32": (find, lead), "float64": (find, polish, aim)}
"""Loops compiled for each precision."""


class Roots:
    """Root-finding loops of one scene's field. Thread-safe.

    Segments are float [6, n] of that precision; n is a multiple of `width`.

    Parameters
    ----------
    root
        Field.
    precision
        "float32" or "float64".
    voxel
        Voxel size, scene units.
    device
        "cpu" or "cuda".

    Attributes
    ----------
    frame
        FRAME of the loops.
    dtype
        Floating-point type.
    width
        Lanes.
    batch
        Segments per call that amortise its overhead.
    """

    def __init__(self, root: Field, precision: Precision, voxel: float, device: Device = "cpu") -> None:
        self.dtype = np.dtype(precision)
        small, near, reach, tight, close = FRAMES[precision]
        frame = np.array([1 / voxel, small, near, reach * voxel, tight * voxel, close])
        self.frame = constant(frame, self.dtype)
        loops = root.loops(LOOPS[precision], precision, device)
        self.width, self.batch, self._runs = loops.width, loops.batch, loops.runs

    def padded(self, index: np.ndarray) -> np.ndarray:
        """Pad segment numbers to a multiple of the lanes by repeating the last one.

        Parameters
        ----------
        index
            Segment numbers, int [n], n > 0.

        Returns
        -------
        ndarray
            Segment numbers, int [m], m a multiple of `width`.
        """
        return np.concatenate([index, np.repeat(index[-1:], -len(index) % self.width)])

    def find(self, segments: np.ndarray) -> np.ndarray:
        """Find the roots on segments.

        Parameters
        ----------
        segments
            Starts and vectors, [6, n].

        Returns
        -------
        ndarray
            Roots as fractions of the segments, [n]; where both ends have the same sign, the end nearer to
            zero.
        """
        roots = self._stepped(segments, QUICK)
        slow = np.flatnonzero(roots > 1)
        if len(slow):
            slow = self.padded(slow)
            left = self._stepped(segments.take(slow, 1), MOST)
            roots[slow] = np.where(left > 1, left - 2, left)
        return roots

    def _stepped(self, segments: np.ndarray, steps: int) -> np.ndarray:
        """Run `find` with a limit of steps."""
        roots = np.empty((1, segments.shape[1]), self.dtype)
        self._runs["find"](self.frame, segments, roots, steps)
        result: np.ndarray = roots[0]
        return result

    def native(self, name: str) -> tuple[Any, ...] | Callable[..., None]:
        """Return a loop for native code.

        Parameters
        ----------
        name
            Name of the loop.

        Returns
        -------
        tuple or Callable
            Machine code and its constant arguments, or a Python function.
        """
        return self._runs[name].native(self.frame)

    def aimed(self, segments: np.ndarray, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Refine roots by one step.

        Parameters
        ----------
        segments
            Starts and vectors, [6, n].
        roots
            Roots as fractions of the segments, [n].

        Returns
        -------
        roots : ndarray
            Refined roots, [n].
        miss : ndarray
            Values of |f| there in voxels, [n].
        """
        out = np.empty((2, len(roots)), self.dtype)
        out[0] = roots
        self._runs["aim"](self.frame, segments, out)
        return out[0], out[1]

    def lead(self, trust_regions: np.ndarray) -> np.ndarray:
        """Compute directions from points to the surface.

        Parameters
        ----------
        trust_regions
            Rows [15, n]: the points, the distances to the lower and upper sides of their trust regions, and
            the vectors to a point of opposite sign and to the middle of the surface, or NaN.

        Returns
        -------
        ndarray
            Directions, [3, n].
        """
        rays = np.empty((3, trust_regions.shape[1]), self.dtype)
        self._runs["lead"](self.frame, trust_regions, rays)
        return rays
