"""A slab: a few adjacent layers, sampled around their contours.

`fracslice._slices` does the work; this module provides the bounds that it needs of a field. Blocks are
subdivided top down: of 64, 32 and 16 pixels over all layers of the slab, of 8 over a few of them, of 4 over
one or two. A block is dropped where ``|f| > bound * reach`` at its centre shows that no sample in it has the
other sign. In the remaining blocks of each layer, one sample of each block of 2 pixels is evaluated, then the
others, unless the bound of a value covers them. Closure follows: where two neighbours differ in sign and one
sign is only implied, that sample is evaluated. Nothing within a layer is evaluated twice.

Above 16 pixels the bound is the formula's own, which is proven or measured with a margin. Escape-time
fractals are far from it: their values are a fifth of the distance outside and a fiftieth inside (means on
Mandelbulbs and Julia sets), and subdivision to single pixels by that bound would cost more than the contours.
In a scene of fractals with a potential only, blocks of 16 are dropped by half of the bound outside and by a
tenth inside. Smaller blocks are dropped by the steepness of the field there, but not below `LIKELY`. Single
samples are dropped where two blocks around theirs all have one sign: inside, the signs around a sample are
better evidence of the distance to the surface than its value. Specks of a pixel or two are lost, below 0.1 %
of the area (tests/slicing/test_layers.py). Orbits that grow linearly, such as a Mandelbox, have values near
to the distance on both sides: there, and where a scene mixes fractals with other shapes, small blocks are
dropped by `MIXED` of the bound.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from .._slices import BorderError, Encoding, Memory, ProbeBounds, Slab
from ..errors import SliceError
from ..formulas.field import Bounds
from ..kernel import Field, Kernel

LIKELY = 0.06, 0.015
"""Minimum bounds for small blocks of a fractal, outside and inside, as fractions of its own bound."""

MIXED = 0.25
"""Fraction of the bound for small blocks of scenes with other shapes or linear growth."""


class ScreenView(NamedTuple):
    """How a screen shows a layer, its back up.

    Attributes
    ----------
    shape : tuple of int
        Rows and columns of the picture.
    transposed : bool
        Rows of the picture run along y of the layer.
    backwards : bool
        Columns run from right to left.
    at : tuple of int
        Row and column of the layer's first pixel on the screen, seen from above, the first row in front.
    layer : tuple of int
        Rows and columns of the layer.
    levels : bytes
        Grey level for each coverage, 256 bytes, the first 0, the last 255.
    """

    shape: tuple[int, int]
    transposed: bool
    backwards: bool
    at: tuple[int, int]
    layer: tuple[int, int]
    levels: bytes


Pictures = tuple[ScreenView, Encoding]
"""Pictures to make of layers: the screen that shows them, and their encoding."""

Encoded = tuple[bytes, float, int]
"""Encoded picture of a layer, its area in pixels, and the number of pixels that the contour cuts."""


class Sampler:
    """Samples slabs of a stack. Safe to use from many threads.

    Parameters
    ----------
    kernel : Kernel
        float32 kernel of `root`.
    root : Field
        The field.
    bounds : Bounds
        Its bounds.
    frame : float64 [4]
        (x0, y0, dx, dy) of the lattice, scene units.
    shape : tuple of int
        Lattice points (ny, nx).
    """

    def __init__(
        self,
        kernel: Kernel,
        root: Field,
        bounds: Bounds,
        frame: np.ndarray,
        shape: tuple[int, int],
    ) -> None:
        self.frame, self.shape = frame, shape
        self._memory, self._probe_bounds = Memory(), _probe_bounds(root, bounds)
        self._entry = kernel.entry

    def slab(self, z: np.ndarray) -> Slab:
        """Create a slab without samples.

        Parameters
        ----------
        z : float64 [n]
            Heights of adjacent layers, scene units.
        """
        x0, y0, dx, dy = self.frame.tolist()
        return Slab(self._memory, self._entry, self._probe_bounds, (x0, y0, dx, dy), z.tolist(), *self.shape)

    def sample(self, slab: Slab, layer: int) -> int:
        """Sample a layer of a slab.

        Returns
        -------
        int
            Evaluations.

        Raises
        ------
        SliceError
            If the solid reaches the rim of the lattice.
        """
        before = slab.evaluations
        with _within_the_rim():
            slab.sample(layer)
        return slab.evaluations - before

    def pictures(self, slab: Slab, layers: list[int], pictures: Pictures) -> list[tuple[int, Encoded]]:
        """Sample the first layers of some, as many as take 20 ms, and make their pictures.

        Returns
        -------
        list of tuple
            Evaluations and picture of a layer, at least one. The slab holds the last of these layers.

        Raises
        ------
        SliceError
            If the solid reaches the rim of the lattice.
        """
        view, encoding = pictures
        with _within_the_rim():
            return slab.pictures(layers, *view, encoding)


@contextmanager
def _within_the_rim() -> Iterator[None]:
    try:
        yield
    except BorderError as error:
        raise SliceError(f"{error}; give it finite <bounds>") from None


def _probe_bounds(root: Field, bounds: Bounds) -> ProbeBounds:
    """Bounds by which blocks are dropped."""
    bound, exterior_only = bounds.lipschitz, bounds.exterior_only
    if exterior_only and root.escape_time_only:
        return ProbeBounds(bound, bound * LIKELY[0], bound * LIKELY[1], True)
    likely = bound * MIXED if exterior_only else bound
    return ProbeBounds(bound, likely, likely, False)
