"""A few neighbouring layers, from the field to the samples around their contours.

The work is `fracslice._slices`; here is what it must know of a field. Top down, blocks of 64, 32 and 16
pixels over all layers of the slab, of 8 over a few of them and of 4 over one or two are dropped where
``|f| > bound * reach`` at their middle says that no sample in them has the other sign. In what is left of
each layer one sample of each block of 2 pixels and then the others are evaluated, as long as no value
reaches them. Then follows closure: where two neighbours differ in sign and one of them is only implied by
another, it is evaluated. Nothing within a layer is evaluated twice.

For more than 16 pixels the bound is the formula's own, which is proven or measured with a margin. It is
far from what escape-time fractals do: their values are a fifth of the distance outside and a fiftieth
inside (means on Mandelbulbs and Julia sets), and going down to single pixels by it would cost more than
the contours. In a scene of nothing else blocks of 16 are dropped by half of it outside and by a tenth
inside, smaller ones by how steep the field is there, but not below `LIKELY`; and single samples where two
blocks around theirs all have one sign, for inside, values tell less of how near the surface is than the
signs around them do. What is lost, specks of a pixel or two, is below 0.1 % of the area
(tests/slicing/test_layers.py). Where a scene mixes them with other shapes, probing ends at blocks of `STOP`
pixels instead, and parts smaller than that which touch no probe are not found.
"""

from __future__ import annotations

import numpy as np

from .._slices import BorderError, Memory, ProbeBounds, Slab
from ..errors import SliceError
from ..formulas.field import Bounds
from ..kernel import Field, Kernel

LIKELY = 0.06, 0.015
"""The least bounds for small blocks of a fractal, outside and inside, as shares of its own."""

STOP = 2, 4
"""Pixels, outside and inside."""


class Sampler:
    """Samples slabs of a stack; may be used from many threads.

    kernel: of `root`, float32. frame: (x0, y0, dx, dy) of the lattice, scene units.
    shape: lattice points (ny, nx).
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
        """Neighbouring layers at heights `z` (scene units), none of them sampled."""
        x0, y0, dx, dy = self.frame.tolist()
        return Slab(self._memory, self._entry, self._probe_bounds, (x0, y0, dx, dy), z.tolist(), *self.shape)

    def sample(self, slab: Slab, layer: int) -> None:
        """Samples a layer of a slab. Raises `SliceError` where the solid reaches the rim of the lattice."""
        try:
            slab.sample(layer)
        except BorderError as error:
            raise SliceError(f"{error}; give it finite <bounds>") from None


def _probe_bounds(root: Field, bounds: Bounds) -> ProbeBounds:
    bound, exterior_only = bounds.lipschitz, bounds.exterior_only
    if exterior_only and root.escape_time_only:
        return ProbeBounds(bound, bound * LIKELY[0], bound * LIKELY[1], 1, 1, True)
    stop = STOP if exterior_only else (1, 1)
    return ProbeBounds(bound, bound, bound, *stop, False)
