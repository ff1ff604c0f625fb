"""Sealed cavities of a field on a coarse grid."""

from __future__ import annotations

import numpy as np

from ..formulas import Box
from ..kernel import Field
from ..work import Work

LEAST = 27
"""Cells of the smallest cavity; smaller ones are noise of the grid."""


def count_sealed(root: Field, outer: Box, cell: float, work: Work) -> tuple[int, float]:
    """Count the components of the empty space that no outside cell reaches.

    `outer`, `cell` in scene units. Returns cubed scene units.
    """
    from scipy.ndimage import label

    counts = [int(np.ceil(side / cell)) for side in outer.size]
    x, y, z = (low + cell * (np.arange(n) + 0.5) for low, n in zip(outer.lo, counts, strict=True))
    kernel, empty = root.kernel(), np.ones([n + 2 for n in counts], bool)
    yy, zz = np.meshgrid(y, z, indexing="ij")
    for i, at in enumerate(x.tolist()):
        work.check()
        empty[i + 1, 1:-1, 1:-1] = kernel.points(np.full_like(yy, at), yy, zz) >= 0
    sizes = np.bincount(label(empty)[0].ravel())
    sizes = sizes[2:]  # after the solid and the outside
    kept = sizes[sizes >= LEAST]
    return len(kept), float(kept.sum()) * cell**3
