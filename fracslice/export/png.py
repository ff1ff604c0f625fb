"""PNG, 8-bit grey."""

from __future__ import annotations

import struct

import numpy as np
from isal.isal_zlib import crc32

from .._slices import Encoding, encoded
from ..slicing import Layer
from .jobs import SliceRun

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def encode(image: np.ndarray) -> bytes:
    """Encode a grey picture as a PNG file.

    Parameters
    ----------
    image : ndarray, uint8 [rows, columns]
        The picture.
    """
    return _file((image.shape[0], image.shape[1]), encoded(image, Encoding.PNG))


def encode_layer(run: SliceRun, layer: Layer) -> bytes:
    """Encode the picture of a layer as a PNG file."""
    return _file(run.screen.shape, run.screen.encoded(layer, Encoding.PNG))


def _file(shape: tuple[int, int], rows: bytes) -> bytes:
    head = struct.pack(">IIBBBBB", shape[1], shape[0], 8, 0, 0, 0, 0)
    return b"".join((SIGNATURE, *_chunk(b"IHDR", head), *_chunk(b"IDAT", rows), *_chunk(b"IEND", b"")))


def _chunk(kind: bytes, data: bytes) -> tuple[bytes, bytes, bytes, bytes]:
    return struct.pack(">I", len(data)), kind, data, struct.pack(">I", crc32(data, crc32(kind)))


def is_whole(data: bytes) -> bool:
    """True if the bytes are a complete, undamaged file of `encode`."""
    if len(data) < _BEFORE + _AFTER:
        return False
    columns, rows = struct.unpack_from(">II", data, len(SIGNATURE) + 8)
    return data == _file((rows, columns), data[_BEFORE:-_AFTER])


_BEFORE, _AFTER = len(SIGNATURE) + 33, 16
"""Bytes before and after the encoded rows."""
