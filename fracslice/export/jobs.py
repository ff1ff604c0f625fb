"""What the layer formats have in common: the run of a job, and files that an interrupted job goes on with."""

from __future__ import annotations

import hashlib
import json
import os
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from fracslice.errors import ExportError
from fracslice.export.files import check_target, reason, replacing
from fracslice.slicing import Slicer, Stack
from fracslice.slicing.raster import Screen
from fracslice.work import Work


@dataclass(frozen=True, eq=False)
class SliceRun:
    """A planned stack, how its layers become pictures, and what files say about it.

    exposure: seconds per layer, first layers. metadata: names and values, among them "scene_hash".
    """

    stack: Stack
    screen: Screen
    work: Work = field(default_factory=Work)
    exposure: tuple[float, float] = (8.0, 35.0)
    metadata: dict[str, str] = field(default_factory=dict)

    @property
    def slicer(self) -> Slicer:
        return Slicer(self.stack, self.work)

    @property
    def layers(self) -> int:
        return len(self.stack.z)

    def describe(self) -> bytes:
        """All that determines the layers, as JSON: equal for equal jobs."""
        stack, screen = self.stack, self.screen
        said = {
            "application": "fracslice",
            "metadata": self.metadata,
            "field": hashlib.sha256(repr(stack.root).encode()).hexdigest(),
            "size_mm": stack.size,
            "pixel_mm": stack.pixel,
            "pixels": screen.shape[::-1],
            "printer": screen.printer.name if screen.printer else None,
            "gamma": screen.gamma,
            "compensation_mm": screen.compensation,
            "mirror": screen.mirror,
            "layers": [
                {"file": f"{i:05d}.png", "top_mm": round(float(z), 6)} for i, z in enumerate(stack.tops)
            ],
        }
        return json.dumps(said, indent=1).encode()


JOB = "job.json"
"""What an unfinished folder says of itself."""


def resumable_folder(
    folder: Path, said: bytes, name: Callable[[int], str], is_whole: Callable[[bytes], bool]
) -> int:
    """Makes the folder of a job, or finds how many layers of it an interrupted one left; they must be whole.

    name: of each layer's file. Raises ExportError for a folder with anything else in it.
    """
    try:
        folder.mkdir(exist_ok=True)
        names = set(os.listdir(folder))
        if not names:
            with replacing(folder / JOB) as file:
                file.write(said)
            return 0
        if JOB not in names or (folder / JOB).read_bytes() != said:
            raise ExportError(
                f"{folder}: the folder is not empty, and what is in it is not this job interrupted"
            )
        index = 0
        while name(index) in names and is_whole((folder / name(index)).read_bytes()):
            index += 1
        return index
    except OSError as error:
        raise ExportError(f"{folder}: {reason(error)}") from error


@contextmanager
def resumable_zip(path: Path, first: tuple[str, bytes]) -> Iterator[tuple[zipfile.ZipFile, set[str]]]:
    """A stored ZIP file that appears at `path` when the block ends; what an interrupted block wrote is kept
    beside it.

    first: name and content of the first member; a remainder that begins with the same goes on, any other is
    dropped. Yields the archive and the names it has already. Raises ExportError for what the file system
    refuses.
    """
    target = check_target(path)
    part = target.with_name(f".{target.name}.part")
    try:
        with open(part, "r+b" if part.exists() else "w+b") as file:
            whole = _members(file)
            file.seek(0)
            if not whole or whole[0].filename != first[0] or _content(file, whole[0]) != first[1]:
                whole = []
            file.seek(_end(whole[-1]) if whole else 0)
            file.truncate()
            with zipfile.ZipFile(file, "w") as archive:
                archive.filelist.extend(whole)
                archive.NameToInfo.update({info.filename: info for info in whole})
                if not whole:
                    add(archive, *first)
                try:
                    yield archive, set(archive.NameToInfo)
                except BaseException:
                    _leave(archive, file)
                    raise
        part.replace(target)
    except OSError as error:
        raise ExportError(f"{path}: {reason(error)}") from error


def add(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    """A stored member that carries no time."""
    info = zipfile.ZipInfo(name)
    info.external_attr = _ATTRIBUTES
    archive.writestr(info, data)


def _leave(archive: zipfile.ZipFile, file: BinaryIO) -> None:
    """No list of members at the end of a remainder: its members are found by themselves."""
    archive._didModify = False  # type: ignore[attr-defined]
    with suppress(OSError):
        file.flush()


_ATTRIBUTES = 0o644 << 16
_HEADER = struct.Struct("<4s5H3L2H")


def _members(file: BinaryIO) -> list[zipfile.ZipInfo]:
    """The stored members at the start of a file that are whole."""
    found: list[zipfile.ZipInfo] = []
    while len(head := file.read(_HEADER.size)) == _HEADER.size:
        signature, _, flags, method, _, _, crc, size, _, name_size, extra_size = _HEADER.unpack(head)
        if signature != b"PK\x03\x04" or method != 0 or flags & 8:
            break
        info = zipfile.ZipInfo(file.read(name_size).decode())
        file.seek(extra_size, 1)
        data = file.read(size)
        if len(data) != size or zlib.crc32(data) != crc:
            break
        info.header_offset = found[-1].header_offset + _length(found[-1]) if found else 0
        info.CRC, info.file_size, info.compress_size = crc, size, size
        info.external_attr = _ATTRIBUTES
        found.append(info)
    return found


def _length(info: zipfile.ZipInfo) -> int:
    return _HEADER.size + len(info.filename.encode()) + info.file_size


def _end(info: zipfile.ZipInfo) -> int:
    return info.header_offset + _length(info)


def _content(file: BinaryIO, info: zipfile.ZipInfo) -> bytes:
    file.seek(_end(info) - info.file_size)
    return file.read(info.file_size)
