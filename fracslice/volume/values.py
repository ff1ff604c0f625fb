"""A field at many points, on all threads."""

from __future__ import annotations

import numpy as np

from ..kernel import Kernel
from ..work import Work, chunks


def values_at(kernel: Kernel, points: np.ndarray, work: Work) -> np.ndarray:
    """Field values [n] in the kernel's dtype at points [3, n], scene units. Raises `Cancelled`."""
    f = np.empty(points.shape[1], kernel.dtype)

    def task(part: slice) -> None:
        f[part] = kernel.points(*points[:, part])

    work.map(task, chunks(len(f), kernel.batch // 8))
    return f
