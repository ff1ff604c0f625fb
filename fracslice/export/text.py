"""Formatting of number arrays as text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS = 1 << 16
"""Rows of a block."""

Text = Callable[[], bytes]
"""Makes a part of a text."""


def number_rows(before: tuple[str, ...], end: str, values: NDArray[Any]) -> Iterator[Text]:
    """Format each row of a large array, in blocks that threads can make at once.

    Parameters
    ----------
    before : tuple of str
        Text before each number of a row.
    end : str
        Text after a row.
    values : ndarray [n, k]
        The rows. A number that is not an integer is written as float32, with the fewest digits that read back
        as the same.

    Yields
    ------
    callable
        Makes the text of a block.
    """
    for begin in range(0, len(values), ROWS):
        yield partial(_block, before, end, values[begin : begin + ROWS])


def _block(before: tuple[str, ...], end: str, values: NDArray[Any]) -> bytes:
    from .._native import text_rows

    whole = values.dtype.kind in "iu"
    given: NDArray[Any] = np.ascontiguousarray(values, np.int64 if whole else np.float32)
    return text_rows(before, end, given)


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
