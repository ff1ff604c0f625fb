"""Rows of arrays: records of arrays of equal length, and parallel gathering."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Self

import numpy as np

from .work import Work, chunks

ROWS = 1 << 17
"""Rows per task."""


class Rows:
    """Base of dataclasses whose fields are all arrays with one row per item, [n, ...]."""

    def chosen(self, which: np.ndarray | slice) -> Self:
        """Select rows.

        Parameters
        ----------
        which
            Mask, bool [n]; row indices; or a slice.

        Returns
        -------
        Self
            The selected rows of every array.
        """
        return type(self)(*(values[which] for values in vars(self).values()))

    def __add__(self, more: Self) -> Self:
        """Append the rows of another record."""
        return type(self).joined([self, more])

    @classmethod
    def joined(cls, records: Sequence[Self]) -> Self:
        """Concatenate records.

        Parameters
        ----------
        records
            At least one record.

        Returns
        -------
        Self
            The rows of all records, in order.
        """
        arrays = zip(*(vars(record).values() for record in records), strict=True)
        return cls(*(np.concatenate(some) for some in arrays))


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
