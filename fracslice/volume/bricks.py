"""The record that the sampler hands to the mesher and to OpenVDB: bricks of samples around a surface."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

OUTSIDE, INSIDE = -1, -2


@dataclass(frozen=True, eq=False)
class Bricks:
    """Samples of a signed field on the grid points near its zero set.

    origin: position of grid point (0, 0, 0), scene units. voxel: spacing, scene units.
    ijk: int32 [n, 3], C-contiguous: grid index of each brick's first sample, multiples of 8, in lexicographic
    order. values: float32 [n, 512], offset x*64 + y*8 + z; negative inside, never NaN.
    index: int32 [bx, by, bz]: the row of each brick, or `OUTSIDE` or `INSIDE` where no sample is needed.

    No sign change crosses a face between a brick with samples and one without, or between two without; all
    beyond `index` is outside. So the surface is closed and wholly within the samples.

    evaluations: how many times the field was evaluated, probing included. audited: points that were looked at
    outside the samples, to test the bounds that pruning relies on. repaired: bricks that a violated bound
    would have lost, found by the audit or the closure rule, and sampled.
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    values: np.ndarray
    index: np.ndarray
    evaluations: int = field(default=0, kw_only=True)
    repaired: int = field(default=0, kw_only=True)
    audited: int = field(default=0, kw_only=True)

    def __len__(self) -> int:
        return len(self.ijk)

    @property
    def signs(self) -> SignBricks:
        """What is left of these samples where only their signs are needed."""
        from .._native import signs

        return SignBricks(
            self.origin,
            self.voxel,
            self.ijk,
            signs(self.values),
            self.index,
            evaluations=self.evaluations,
            repaired=self.repaired,
            audited=self.audited,
        )


@dataclass(frozen=True, eq=False)
class SignBricks:
    """Bricks whose samples are kept as a bit each: enough to find a known field's surface, in a 32nd of the
    memory.

    signs: uint8 [n, 8, 8], bit z of byte (x, y) set where inside. All else as in `Bricks`.
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    signs: np.ndarray
    index: np.ndarray
    evaluations: int = field(default=0, kw_only=True)
    repaired: int = field(default=0, kw_only=True)
    audited: int = field(default=0, kw_only=True)

    def __len__(self) -> int:
        return len(self.ijk)
