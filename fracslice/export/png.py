"""PNG, 8-bit grey, by a fast deflate: ISA-L, about 3 GB/s on layers of a print."""

from __future__ import annotations

import struct
import threading

import numpy as np

SIGNATURE = b"\x89PNG\r\n\x1a\n"
LEVEL = 1
"""Of ISA-L. Measured on 900 x 960 layers of a Mandelbulb: 0.29 ms and 27.6 kB; zlib-ng's level 1 0.41 ms
and 34.9 kB, libdeflate's 2.4 ms and 26.0 kB, zlib's 1.7 ms and 31.0 kB.
"""


_kept = threading.local()


def canvas(rows: int, columns: int) -> np.ndarray:
    """A black picture, uint8 [rows, columns], that `encode` takes without a copy.

    The calling thread's own: black again, and another picture, at the next call. Laying the pages of a new
    one would take as long as the deflate.
    """
    filtered: np.ndarray | None = getattr(_kept, "filtered", None)
    if filtered is None or filtered.shape != (rows, columns + 1):
        filtered = _kept.filtered = np.empty((rows, columns + 1), np.uint8)
    filtered[:] = 0
    return filtered[:, 1:]


def _is_canvas(image: np.ndarray, base: np.ndarray) -> bool:
    same = base.shape == (len(image), image.shape[1] + 1) and base.strides == image.strides
    return same and image.ctypes.data == base.ctypes.data + 1 and not base[:, 0].any()


def encode(image: np.ndarray) -> bytes:
    """A grey picture, uint8 [rows, columns], as a PNG file.

    No row filter: on layers, filtering the differences of rows made the files a third larger in the same
    time.
    """
    from isal import isal_zlib

    rows, columns = image.shape
    filtered = image.base
    if filtered is None or not _is_canvas(image, filtered):
        filtered = np.zeros((rows, columns + 1), np.uint8)
        filtered[:, 1:] = image
    head = struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", isal_zlib.compress(filtered, LEVEL)), (b"IEND", b""))
    return SIGNATURE + b"".join(
        struct.pack(">I", len(data))
        + kind
        + data
        + struct.pack(">I", isal_zlib.crc32(data, isal_zlib.crc32(kind)))
        for kind, data in parts
    )


def is_whole(data: bytes) -> bool:
    """Whether the bytes begin and end as a PNG file does."""
    return data.startswith(SIGNATURE) and data.endswith(b"IEND\xaeB`\x82")
