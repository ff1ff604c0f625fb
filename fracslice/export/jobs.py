"""What the layer formats have in common: the run of a job, and files that an interrupted job goes on with."""

from __future__ import annotations

import hashlib
import json
import os
import struct
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from isal.isal_zlib import crc32

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


@dataclass(frozen=True, eq=False)
class Stored:
    """The members of a ZIP file, uncompressed and without times; their list comes at its end."""

    file: BinaryIO
    members: list[zipfile.ZipInfo]

    @property
    def names(self) -> set[str]:
        return {info.filename for info in self.members}

    def add(self, name: str, data: bytes) -> None:
        info = _info(name, crc32(data), len(data))
        info.header_offset = _end(self.members)
        self.file.write(info.FileHeader())
        self.file.write(data)
        self.members.append(info)

    def close(self) -> None:
        with zipfile.ZipFile(self.file, "w") as archive:
            archive.filelist.extend(self.members)


@contextmanager
def resumable_zip(path: Path, first: tuple[str, bytes]) -> Iterator[Stored]:
    """A stored ZIP file that appears at `path` when the block ends; what an interrupted block wrote is kept
    beside it.

    first: name and content of the first member; a remainder that begins with the same goes on, any other is
    dropped. Raises ExportError for what the file system refuses.
    """
    target = check_target(path)
    part = target.with_name(f".{target.name}.part")
    try:
        with open(part, "r+b" if part.exists() else "w+b") as file:
            whole = _members(file)
            if whole and (whole[0].filename != first[0] or _content(file, whole[0]) != first[1]):
                whole = []
            file.seek(_end(whole))
            file.truncate()
            archive = Stored(file, whole)
            if not whole:
                archive.add(*first)
            yield archive
            archive.close()
        part.replace(target)
    except OSError as error:
        raise ExportError(f"{path}: {reason(error)}") from error


_HEADER = struct.Struct("<4s5H3L2H")


def _members(file: BinaryIO) -> list[zipfile.ZipInfo]:
    """The stored members at the start of a file that are whole."""
    found: list[zipfile.ZipInfo] = []
    while len(head := file.read(_HEADER.size)) == _HEADER.size:
        signature, _, flags, method, _, _, crc, size, _, name_size, extra_size = _HEADER.unpack(head)
        if signature != b"PK\x03\x04" or method != 0 or flags & 8:
            break
        name = file.read(name_size).decode()
        file.seek(extra_size, 1)
        data = file.read(size)
        if len(data) != size or crc32(data) != crc:
            break
        info = _info(name, crc, size)
        info.header_offset = _end(found)
        found.append(info)
    return found


def _info(name: str, crc: int, size: int) -> zipfile.ZipInfo:
    """A stored member that carries no time."""
    info = zipfile.ZipInfo(name)
    info.CRC, info.file_size, info.compress_size = crc, size, size
    info.external_attr = 0o644 << 16
    return info


def _end(members: list[zipfile.ZipInfo]) -> int:
    """Where the next one goes."""
    if not members:
        return 0
    last = members[-1]
    return last.header_offset + _HEADER.size + len(last.filename.encode()) + last.file_size


def _content(file: BinaryIO, info: zipfile.ZipInfo) -> bytes:
    file.seek(_end([info]) - info.file_size)
    return file.read(info.file_size)
