"""Journal of a job's finished layers, from which an interrupted job resumes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from fracslice.errors import ExportError
from fracslice.export.resuming import remainder

_HEAD = struct.Struct("<II")
"""Header of a record: length and CRC-32 of the data."""


@dataclass(eq=False)
class Journal:
    """The finished layers of a job.

    Attributes
    ----------
    file : file
        Binary file, open for reading and writing.
    count : int
        Number of finished layers.
    """

    file: BinaryIO
    count: int = 0

    def append(self, layer: bytes) -> None:
        """Append the next layer.

        Parameters
        ----------
        layer : bytes
            The encoded layer.
        """
        self.file.write(_HEAD.pack(len(layer), zlib.crc32(layer)) + layer)
        self.count += 1

    def __iter__(self) -> Iterator[bytes]:
        """Iterate over all layers in order. Raises `ExportError` if a record cannot be read back."""
        self.file.seek(0)
        for _ in range(self.count):
            layer = _read(self.file)
            if layer is None:
                raise ExportError("what was written for the layers cannot be read back")
            yield layer


@contextmanager
def journal(path: str | Path, job: str) -> Iterator[Journal]:
    """Open the journal of a job: a `remainder`, truncated after its last complete layer.

    Parameters
    ----------
    path : str or path
        The file that the job writes.
    job : str
        Key of everything that determines the bytes.

    Yields
    ------
    Journal

    Raises
    ------
    ExportError
        As `remainder`.
    """
    with remainder(path, job) as file:
        kept, end = Journal(file), 0
        while _read(file) is not None:
            kept.count, end = kept.count + 1, file.tell()
        file.seek(end)
        file.truncate()
        yield kept


def _read(file: BinaryIO) -> bytes | None:
    """Data of the next record; None if it is missing, incomplete or damaged."""
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    size, crc = _HEAD.unpack(head)
    data = file.read(size)
    return data if len(data) == size and zlib.crc32(data) == crc else None
