"""Parallel gathering of rows."""

from __future__ import annotations

import os

import numpy as np

from ..work import Work, chunks

ROWS = 1 << 17
"""Rows per task."""


def gathered(table: np.ndarray, rows: np.ndarray, threads: int = 0) -> np.ndarray:
    """Gather rows of a table by several threads.

    Parameters
    ----------
    table
        Table, [m, ...].
    rows
        Row numbers, int [n, ...], 0 <= row < m.
    threads
        Threads; 0 for all cores.

    Returns
    -------
    ndarray
        `table[rows]`.
    """
    result = np.empty(rows.shape + table.shape[1:], table.dtype)

    def task(part: slice) -> None:
        np.take(table, rows[part], axis=0, out=result[part], mode="clip")  # "raise" would copy the output

    Work(threads or os.cpu_count() or 1).map(task, chunks(len(rows), ROWS))
    return result
