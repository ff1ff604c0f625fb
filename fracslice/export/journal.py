"""What an interrupted job had made, layer by layer."""

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
"""Of a record: the length and the CRC-32 of what follows."""


@dataclass(eq=False)
class Journal:
    """The layers that are made. count: how many."""

    file: BinaryIO
    count: int = 0

    def append(self, layer: bytes) -> None:
        """Keeps the next layer."""
        self.file.write(_HEAD.pack(len(layer), zlib.crc32(layer)) + layer)
        self.count += 1

    def __iter__(self) -> Iterator[bytes]:
        """All layers, in order."""
        self.file.seek(0)
        for _ in range(self.count):
            layer = _read(self.file)
            if layer is None:
                raise ExportError("what was written for the layers cannot be read back")
            yield layer


@contextmanager
def journal(path: str | Path, job: str) -> Iterator[Journal]:
    """The journal of a job whose file is to be at `path`: a `remainder`, up to its last whole layer."""
    with remainder(path, job) as file:
        kept, end = Journal(file), 0
        while _read(file) is not None:
            kept.count, end = kept.count + 1, file.tell()
        file.seek(end)
        file.truncate()
        yield kept


def _read(file: BinaryIO) -> bytes | None:
    """The next record, None where there is no whole one."""
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    size, crc = _HEAD.unpack(head)
    data = file.read(size)
    return data if len(data) == size and zlib.crc32(data) == crc else None
