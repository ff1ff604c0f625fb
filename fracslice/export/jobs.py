"""Shared parts of the layer formats: the slice run, and archives that are written layer by layer."""

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
    """A planned stack with the screen, exposure and metadata of its files.

    Attributes
    ----------
    stack : Stack
        The planned layers.
    screen : Screen
        Conversion of layers to pictures.
    work : Work
        Threads, progress and cancellation.
    exposure : (float, float)
        Exposure of each layer and of the first, s.
    metadata : dict of str to str
        Names and values for the files, "scene_hash" among them.

    Raises
    ------
    ExportError
        For an invalid exposure.
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
        """Slicer of the stack."""
        return Slicer(self.stack, self.work)

    @property
    def layers(self) -> int:
        """Number of layers."""
        return len(self.stack.z)

    def key(self, form: str | bytes) -> str:
        """Key of everything that determines the bytes of the layers.

        Parameters
        ----------
        form : str or bytes
            File format.

        Returns
        -------
        str
        """
        stack = [getattr(self.stack, f.name) for f in fields(self.stack) if f.name != "root"]
        screen = [getattr(self.screen, f.name) for f in fields(self.screen) if f.name != "stack"]
        field = self.stack.root.key
        return key(
            program(), toolchain(), form, field, *stack, *screen, self.exposure, sorted(self.metadata.items())
        )

    def describe(self) -> bytes:
        """Manifest of the layers, as JSON."""
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
    """A ZIP file of stored members without times; the central directory is written at the end.

    Attributes
    ----------
    file : file
        Binary file, open for reading and writing.
    members : list of ZipInfo
        The members written so far.
    """

    file: BinaryIO
    members: list[zipfile.ZipInfo]

    @property
    def names(self) -> set[str]:
        """Names of the members."""
        return {info.filename for info in self.members}

    def add(self, name: str, data: bytes) -> None:
        """Append a member.

        Parameters
        ----------
        name : str
            Name of the member.
        data : bytes
            Contents.
        """
        info = _info(name, crc32(data), len(data))
        info.header_offset = _end(self.members)
        self.file.write(info.FileHeader())
        self.file.write(data)
        self.members.append(info)

    def close(self) -> None:
        """Write the central directory."""
        with zipfile.ZipFile(self.file, "w") as archive:
            archive.filelist.extend(self.members)


@contextmanager
def resumable_zip(path: Path, job: str) -> Iterator[Stored]:
    """Write a stored ZIP file that appears at `path` when the block ends.

    An interrupted block leaves a `remainder`; the next one resumes after its last complete member.

    Parameters
    ----------
    path : Path
        The file to write.
    job : str
        Key of everything that determines the bytes.

    Yields
    ------
    Stored

    Raises
    ------
    ExportError
        As `remainder`.
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
    """Complete stored members at the start of a file."""
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
    """Header of a stored member without a time."""
    info = zipfile.ZipInfo(name)
    info.CRC, info.file_size, info.compress_size = crc, size, size
    info.external_attr = 0o644 << 16
    return info


def _end(members: list[zipfile.ZipInfo]) -> int:
    """Offset of the next member."""
    if not members:
        return 0
    last = members[-1]
    return last.header_offset + _HEADER.size + len(last.filename.encode()) + last.file_size
