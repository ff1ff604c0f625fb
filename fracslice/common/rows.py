"""Records of arrays of equal length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np


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
