"""Decoders of run lengths, written from the formats' descriptions alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np


def picture(runs: Iterator[tuple[int, int]], shape: tuple[int, int]) -> np.ndarray:
    """A picture of runs (value, length), which must fill it exactly."""
    values, lengths = np.array(list(runs)).T
    assert lengths.sum() == shape[0] * shape[1]
    return np.repeat(values.astype(np.uint8), lengths).reshape(shape)


def goo(data: bytes) -> Iterator[tuple[int, int]]:
    """Runs and differences of a .goo layer, as the crate goo 0.1.1 reads them."""
    assert data[0] == 0x55
    assert data[-1] == ~sum(data[1:-1]) & 0xFF
    at, color = 1, 0
    while at < len(data) - 1:
        head = data[at]
        at += 1
        kind, size, length = head >> 6, head >> 4 & 3, head & 15
        if kind == 2:
            color += -length if size & 2 else length
            length = 1
            if size & 1:
                length = data[at]
                at += 1
            yield color, length
            continue
        color = {0: 0, 3: 255}.get(kind, -1)
        if kind == 1:
            color = data[at]
            at += 1
        rest = int.from_bytes(data[at : at + size], "big")
        at += size
        yield color, rest << 4 | length


def rle7(data: bytes) -> Iterator[tuple[int, int]]:
    """catibo, "CTB/CBDDLP file formats": ctb layer data."""
    at = 0
    while at < len(data):
        head, length = data[at], 1
        at += 1
        if head & 0x80:
            first = data[at]
            size = 1 if first < 0x80 else 2 if first < 0xC0 else 3 if first < 0xE0 else 4
            mask = (0x7F, 0x3F, 0x1F, 0x0F)[size - 1]
            length = (first & mask) << 8 * (size - 1) | int.from_bytes(data[at + 1 : at + size], "big")
            at += size
        yield head & 0x7F, length


def rle4(data: bytes) -> Iterator[tuple[int, int]]:
    """Anycubic's PW0 pictures."""
    at = 0
    while at < len(data):
        color, length = data[at] >> 4, data[at] & 15
        at += 1
        if color in (0, 15):
            length = length << 8 | data[at]
            at += 1
        yield color, length


def rle1(data: bytes) -> Iterator[tuple[int, int]]:
    """catibo, "CTB/CBDDLP file formats": cbddlp layer data."""
    for byte in data:
        assert byte & 0x7F
        yield byte >> 7, byte & 0x7F
