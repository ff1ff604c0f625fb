"""Arrays: quantiles, records of arrays of equal length, the transfer function of sRGB, other libraries."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray


def quantile(values: np.ndarray, share: float) -> float:
    """Return a quantile, interpolated linearly between neighbours in rank."""
    rank = (values.size - 1) * share
    low = min(math.floor(rank), max(values.size - 2, 0))
    high = min(low + 1, values.size - 1)
    ordered = np.partition(values, [low, high, values.size - 1], axis=None)
    if math.isnan(ordered[-1]):
        return math.nan
    return float(ordered[low] + (ordered[high] - ordered[low]) * (rank - low))


def weighted_quantiles(values: np.ndarray, weights: np.ndarray, *shares: float) -> list[float]:
    """Return values below which these shares of the weight lie."""
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(weights[order])
    at = np.searchsorted(upto, np.array(shares) * upto[-1])
    quantiles: list[float] = values[order][np.minimum(at, len(values) - 1)].tolist()
    return quantiles


class Rows:
    """Base of dataclasses whose fields are all arrays with one row per item, [n, ...]."""

    def chosen(self, which: np.ndarray | slice) -> Self:
        """Select rows.

        `which`: bool [n].
        """
        return type(self)(*(values[which] for values in vars(self).values()))

    def __add__(self, more: Self) -> Self:
        """Append the rows of another record."""
        return type(self).joined([self, more])

    @classmethod
    def joined(cls, records: Sequence[Self]) -> Self:
        """Concatenate records."""
        arrays = zip(*(vars(record).values() for record in records), strict=True)
        return cls(*(np.concatenate(some) for some in arrays))


def to_linear(shown: NDArray[Any]) -> NDArray[Any]:
    """Convert display values to linear light."""
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def from_linear(light: NDArray[Any]) -> NDArray[Any]:
    """Convert linear light to display values."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def on_host(given: Any) -> np.ndarray:
    """Array of NumPy or of another library, by DLPack, without a copy. Raises BufferError for a GPU's."""
    if isinstance(given, np.ndarray) or not hasattr(given, "__dlpack__"):
        return np.asarray(given)
    try:
        return np.from_dlpack(given)
    except (BufferError, RuntimeError, TypeError):
        raise BufferError("expected an array in the memory of the CPU, of numbers that NumPy has") from None


def of_library(values: np.ndarray, given: Any) -> Any:
    """Values as an array of the library of another one, such as PyTorch, where it takes them by DLPack."""
    if isinstance(given, np.ndarray) or not hasattr(given, "__dlpack__"):
        return values
    library = sys.modules[type(given).__module__.partition(".")[0]]
    return library.from_dlpack(values) if hasattr(library, "from_dlpack") else values
