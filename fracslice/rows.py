"""Records of arrays that run side by side."""

from __future__ import annotations

from typing import Self

import numpy as np


class Rows:
    """A dataclass of nothing but arrays with a row for each of n things, [n, ...]."""

    def chosen(self, which: np.ndarray) -> Self:
        """Some of them, bool [n]."""
        return type(self)(*(values[which] for values in vars(self).values()))

    def __add__(self, more: Self) -> Self:
        """These, then those."""
        mine, others = vars(self).values(), vars(more).values()
        return type(self)(*(np.concatenate(pair) for pair in zip(mine, others, strict=True)))
