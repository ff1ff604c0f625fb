"""What an interrupted job had made, layer by layer, beside the file that it was for."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from fracslice.errors import ExportError
from fracslice.export.files import check_target, reason

_HEAD = struct.Struct("<II")
"""Of a record: the length and the CRC-32 of what follows."""


@dataclass(eq=False)
class Journal:
    """The layers that are made. count: how many."""

    file: BinaryIO
    begin: int
    count: int

    def append(self, layer: bytes) -> None:
        """Keeps the next layer."""
        _write(self.file, layer)
        self.count += 1

    def __iter__(self) -> Iterator[bytes]:
        """All layers, in order."""
        self.file.seek(self.begin)
        for _ in range(self.count):
            layer = _read(self.file)
            if layer is None:
                raise ExportError("what was written for the layers cannot be read back")
            yield layer


@contextmanager
def journal(path: str | Path, said: bytes) -> Iterator[Journal]:
    """The journal of a job whose file is to be at `path`: a hidden file beside it, gone when the block ends,
    kept when it is interrupted.

    said: what determines the layers; a journal of the same goes on after its last whole layer, any other is
    dropped. Raises ExportError for what the file system refuses.
    """
    target = check_target(path)
    part = target.with_name(f".{target.name}.part")
    try:
        with open(part, "r+b" if part.exists() else "w+b") as file:
            if _read(file) != said:
                file.seek(0)
                _write(file, said)
                file.truncate()
            kept = Journal(file, file.tell(), 0)
            end = kept.begin
            while _read(file) is not None:
                kept.count, end = kept.count + 1, file.tell()
            file.seek(end)
            file.truncate()
            yield kept
        os.unlink(part)
    except OSError as error:
        raise ExportError(f"{path}: {reason(error)}") from error


def _write(file: BinaryIO, data: bytes) -> None:
    file.write(_HEAD.pack(len(data), zlib.crc32(data)) + data)


def _read(file: BinaryIO) -> bytes | None:
    """The next record, None where there is no whole one."""
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    size, crc = _HEAD.unpack(head)
    data = file.read(size)
    return data if len(data) == size and zlib.crc32(data) == crc else None
