"""What the layer formats have in common: the run of a job, and archives that are written layer by layer."""

from __future__ import annotations

import json
import struct
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import BinaryIO

from isal.isal_zlib import crc32

from fracslice.errors import ExportError
from fracslice.export.files import into_place
from fracslice.export.resuming import remainder
from fracslice.formulas.parameters import Vector, validate
from fracslice.kernel.objects import toolchain
from fracslice.keys import key, program
from fracslice.slicing import Slicer, Stack
from fracslice.slicing.raster import Screen
from fracslice.work import Work

EXPOSURE = Vector((8.0, 35.0), "seconds of each layer, and of the first", sizes=(2,), above=0)


@dataclass(frozen=True, eq=False)
class SliceRun:
    """A planned stack, how its layers become pictures, and what files say about it.

    exposure: seconds per layer, first layers. metadata: names and values, among them "scene_hash". Raises
    `ExportError` for seconds that cannot be.
    """

    stack: Stack
    screen: Screen
    work: Work = field(default_factory=Work)
    exposure: tuple[float, float] = (8.0, 35.0)
    metadata: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        validate(self, {"exposure": EXPOSURE}, ExportError)

    @property
    def slicer(self) -> Slicer:
        return Slicer(self.stack, self.work)

    @property
    def layers(self) -> int:
        return len(self.stack.z)

    def key(self, form: str | bytes) -> str:
        """The key of all that the bytes of the layers follow from. form: of the file."""
        stack = [getattr(self.stack, f.name) for f in fields(self.stack) if f.name != "root"]
        screen = [getattr(self.screen, f.name) for f in fields(self.screen) if f.name != "stack"]
        field = self.stack.root.key
        return key(
            program(), toolchain(), form, field, *stack, *screen, self.exposure, sorted(self.metadata.items())
        )

    def describe(self) -> bytes:
        """What files say of the layers, as JSON."""
        stack, screen = self.stack, self.screen
        manifest = {
            "application": "fracslice",
            "metadata": self.metadata,
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
        return json.dumps(manifest, indent=1).encode()


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
def resumable_zip(path: Path, job: str) -> Iterator[Stored]:
    """A stored ZIP file that appears at `path` when the block ends; what an interrupted block wrote is a
    `remainder`, gone on with after its last whole member.
    """
    with remainder(path, job) as file:
        whole = _members(file)
        file.seek(_end(whole))
        file.truncate()
        archive = Stored(file, whole)
        yield archive
        archive.close()
        into_place(file, path)


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
