"""Bricks of samples around a surface: the output of the sampler, the input of the mesher and of OpenVDB."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

OUTSIDE, INSIDE = -1, -2


@dataclass(frozen=True, eq=False, kw_only=True)
class SamplingCounts:
    """Counts of what a sampling took.

    Attributes
    ----------
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

    evaluations: int = 0
    repaired: int = 0
    audited: int = 0
    proved: float | None = None

    @property
    def counts(self) -> dict[str, Any]:
        """The counts by name."""
        return {f.name: getattr(self, f.name) for f in fields(SamplingCounts)}


@dataclass(frozen=True, eq=False)
class Bricks(SamplingCounts):
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
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    values: np.ndarray
    index: np.ndarray

    def __len__(self) -> int:
        return len(self.ijk)

    @property
    def signs(self) -> SignBricks:
        """Signs of the samples."""
        from .._native import signs

        return SignBricks(self.origin, self.voxel, self.ijk, signs(self.values), self.index, **self.counts)


@dataclass(frozen=True, eq=False)
class SignBricks(SamplingCounts):
    """Bricks with one bit per sample: enough to extract a known field's surface, in 1/32 of the memory.

    Attributes
    ----------
    signs
        Sign bits, uint8 [n, 8, 8]: bit z of byte (x, y) is set inside.
    origin, voxel, ijk, index
        As in `Bricks`.
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    signs: np.ndarray
    index: np.ndarray

    def __len__(self) -> int:
        return len(self.ijk)
