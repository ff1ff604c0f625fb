"""Formatting of number arrays as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray

ROWS = 1 << 16


def rows(template: str, values: NDArray[Any]) -> Iterator[bytes]:
    """Format each row of an array by a %-template, in blocks of bounded size.

    One formatting call per block is several times faster than one per row.

    Parameters
    ----------
    template : str
        Template with as many fields as a row has items.
    values : ndarray [n, k]
        The rows.

    Yields
    ------
    bytes
        ASCII text of a block.
    """
    block = template * ROWS
    for begin in range(0, len(values), ROWS):
        part = values[begin : begin + ROWS]
        text = block if len(part) == ROWS else template * len(part)
        yield (text % tuple(part.ravel().tolist())).encode("ascii")
