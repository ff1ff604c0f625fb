"""Parallel evaluation of a field."""

from __future__ import annotations

import numpy as np

from ..kernel import Kernel
from ..work import Work, chunks


def values_at(kernel: Kernel, points: np.ndarray, work: Work) -> np.ndarray:
    """Evaluate a field at many points on all threads.

    Parameters
    ----------
    kernel
        Kernel of the field.
    points
        Points, [3, n], scene units.
    work
        Execution settings.

    Returns
    -------
    ndarray
        Field values, [n], of the kernel's dtype.

    Raises
    ------
    Cancelled
        If the job was cancelled.
    """
    f = np.empty(points.shape[1], kernel.dtype)

    def task(part: slice) -> None:
        f[part] = kernel.points(*points[:, part])

    work.map(task, chunks(len(f), kernel.batch // 8))
    return f
