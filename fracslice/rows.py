"""Records of arrays that run side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np


class Rows:
    """A dataclass of nothing but arrays with a row for each of n things, [n, ...]."""

    def chosen(self, which: np.ndarray | slice) -> Self:
        """Some of them: bool [n], numbers or a slice."""
        return type(self)(*(values[which] for values in vars(self).values()))

    def __add__(self, more: Self) -> Self:
        """These, then those."""
        return type(self).joined([self, more])

    @classmethod
    def joined(cls, records: Sequence[Self]) -> Self:
        """All of them, one after the other; at least one."""
        arrays = zip(*(vars(record).values() for record in records), strict=True)
        return cls(*(np.concatenate(some) for some in arrays))
