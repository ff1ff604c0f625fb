"""Bricks of samples around a surface: the output of the sampler, the input of the mesher and of OpenVDB."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

OUTSIDE, INSIDE = -1, -2


@dataclass(frozen=True, eq=False)
class Bricks:
    """Samples of a signed field on the grid points near its zero set.

    No sign change crosses a face between a brick with samples and one without, or between two without;
    everything beyond `index` is outside. The surface is therefore closed and lies within the samples.

    Attributes
    ----------
    origin
        Position of grid point (0, 0, 0), scene units.
    voxel
        Grid spacing, scene units.
    ijk
        Grid index of each brick's first sample, int32 [n, 3], C-contiguous: multiples of 8, in lexicographic
        order.
    values
        Samples, float32 [n, 512], at offset x*64 + y*8 + z; negative inside, never NaN.
    index
        Row of each brick, int32 [bx, by, bz]; `OUTSIDE` or `INSIDE` where no samples are needed.
    evaluations
        Field evaluations, probing included.
    repaired
        Bricks that a violated bound would have lost, detected by the audit or the closure rule, and sampled.
    audited
        Points tested outside the samples to verify the bounds that pruning relies on.
    proved
        Share of the unsampled bricks whose sign is proved; None if it was not determined. The rest relies on
        a measured bound.
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    values: np.ndarray
    index: np.ndarray
    evaluations: int = field(default=0, kw_only=True)
    repaired: int = field(default=0, kw_only=True)
    audited: int = field(default=0, kw_only=True)
    proved: float | None = field(default=None, kw_only=True)

    def __len__(self) -> int:
        return len(self.ijk)

    @property
    def signs(self) -> SignBricks:
        """Signs of the samples."""
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
            proved=self.proved,
        )


@dataclass(frozen=True, eq=False)
class SignBricks:
    """Bricks with one bit per sample: enough to extract a known field's surface, in 1/32 of the memory.

    Attributes
    ----------
    signs
        Sign bits, uint8 [n, 8, 8]: bit z of byte (x, y) is set inside.
    origin, voxel, ijk, index, evaluations, repaired, audited, proved
        As in `Bricks`.
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    signs: np.ndarray
    index: np.ndarray
    evaluations: int = field(default=0, kw_only=True)
    repaired: int = field(default=0, kw_only=True)
    audited: int = field(default=0, kw_only=True)
    proved: float | None = field(default=None, kw_only=True)

    def __len__(self) -> int:
        return len(self.ijk)
