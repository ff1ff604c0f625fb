"""Numbers to text, many rows at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray

ROWS = 1 << 16


def rows(template: str, values: NDArray[Any]) -> Iterator[bytes]:
    """Fill the %-template with each row of a 2D array, in blocks of bounded size.

    One formatting call per block: several times faster than one per row.
    """
    block = template * ROWS
    for begin in range(0, len(values), ROWS):
        part = values[begin : begin + ROWS]
        text = block if len(part) == ROWS else template * len(part)
        yield (text % tuple(part.ravel().tolist())).encode("ascii")
