"""Arrays as contents of files."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Files = dict[str, NDArray[Any]]
"""Arrays by name."""

ALIGNED = 64
"""Bytes to whose multiples arrays are aligned in a file."""


def packed(**arrays: NDArray[Any]) -> list[bytes | memoryview]:
    """Blocks of arrays: a header line of JSON, then the arrays, without copies and checksums.

    Parameters
    ----------
    **arrays : ndarray
        Arrays by name.

    Returns
    -------
    list of bytes-like
        For `unpacked`, one after another; they view the arrays.
    """
    about, end = dict[str, tuple[str, tuple[int, ...], int]](), 0
    blocks = list[bytes | memoryview]()
    for name, array in arrays.items():
        plain = np.ascontiguousarray(array)
        about[name] = plain.dtype.str, np.shape(array), end
        blocks += [plain.reshape(-1).view(np.uint8).data, bytes(-plain.nbytes % ALIGNED)]
        end += plain.nbytes + len(blocks[-1])
    head = json.dumps(about).encode()
    return [head + b" " * (-len(head) % ALIGNED + ALIGNED - 1) + b"\n", *blocks]


def unpacked(data: bytes) -> Files:
    """Arrays from bytes of `packed`.

    Parameters
    ----------
    data : bytes
        The blocks in one, which the arrays view.

    Returns
    -------
    dict
        Arrays by name, read-only.
    """
    start = data.index(b"\n") + 1
    arrays: Files = {}
    for name, (kind, shape, begin) in json.loads(data[:start]).items():
        count = math.prod(shape)
        arrays[name] = np.frombuffer(data, kind, count, start + begin).reshape(shape)
    return arrays
