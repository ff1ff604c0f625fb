"""Packages of 3MF: ZIP archives with a model as text, in one stream or joined from deflated blocks."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from isal.isal_zlib import crc32, crc32_combine
from numpy.typing import NDArray

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
TYPES = (
    HEAD + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
RELATIONS = (
    HEAD + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
SMALL = ("[Content_Types].xml", TYPES.encode()), ("_rels/.rels", RELATIONS.encode())
"""Members of a package besides the model."""

LEVEL = 3  # of deflate: a third of the time of the default 6, for files a twentieth larger

LAST_BLOCK = zlib.compressobj(wbits=-zlib.MAX_WBITS).flush()
"""Empty block that ends a deflate stream."""


class TextSum(NamedTuple):
    """Checksum and length of a text."""

    crc: int  # CRC-32, and bytes
    size: int


Fragment = Callable[[BinaryIO], TextSum]
"""Appends a text to a file, deflated and ended at a byte, so that another one may follow."""


def deflate(text: bytes) -> tuple[bytes, TextSum]:
    """Deflate a text by itself."""
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    blocks = packer.compress(text) + packer.flush(zlib.Z_FULL_FLUSH)
    return blocks, TextSum(crc32(text), len(text))


def append(blocks: tuple[bytes, TextSum], file: BinaryIO) -> TextSum:
    """Append a deflated text to a file; a `Fragment` once its first argument is given."""
    file.write(blocks[0])
    return blocks[1]


def combine_checksums(one: TextSum, other: TextSum) -> TextSum:
    """Checksum and length of two texts, one after the other."""
    return TextSum(crc32_combine(one.crc, other.crc, other.size), one.size + other.size)


def join(file: BinaryIO, fragments: Iterable[Fragment], is_large: bool) -> None:
    """Write a package whose model is made of fragments. Its members carry no time."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        for name, text in SMALL:
            archive.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)
        info, whole = zipfile.ZipInfo("3D/3dmodel.model"), TextSum(0, 0)
        info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o600 << 16
        info.header_offset, info.CRC = file.tell(), 0
        file.write(info.FileHeader(is_large))
        start = file.tell()
        for fragment in fragments:
            whole = combine_checksums(whole, fragment(file))
        file.write(LAST_BLOCK)
        archive.start_dir = file.tell()
        info.CRC, info.file_size, info.compress_size = *whole, archive.start_dir - start
        file.seek(info.header_offset)
        file.write(info.FileHeader(is_large))
        file.seek(archive.start_dir)
        archive.filelist.append(info)


def package(file: BinaryIO, model: Iterable[bytes], is_large: bool, level: int) -> None:
    """Write a package with one model, deflated as one stream. Its members carry no time."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=level) as archive:
        for name, texts in (*((name, [text]) for name, text in SMALL), ("3D/3dmodel.model", model)):
            with archive.open(name, "w", force_zip64=is_large) as member:
                member.writelines(texts)


ROWS = 1 << 16
"""Rows of a block."""

Text = Callable[[], bytes]
"""Makes a part of a text."""


def number_rows(before: tuple[str, ...], end: str, values: NDArray[Any]) -> Iterator[Text]:
    """Format each row of a large array, in blocks that threads can make at once."""
    for begin in range(0, len(values), ROWS):
        yield partial(_block, before, end, values[begin : begin + ROWS])


def _block(before: tuple[str, ...], end: str, values: NDArray[Any]) -> bytes:
    from .._native import text_rows

    whole = values.dtype.kind in "iu"
    given: NDArray[Any] = np.ascontiguousarray(values, np.int64 if whole else np.float32)
    return text_rows(before, end, given)


def rows(template: str, values: NDArray[Any]) -> Iterator[bytes]:
    """Format each row of an array by a %-template, in blocks of bounded size.

    One formatting call per block is several times faster than one per row.
    """
    block = template * ROWS
    for begin in range(0, len(values), ROWS):
        part = values[begin : begin + ROWS]
        text = block if len(part) == ROWS else template * len(part)
        yield (text % tuple(part.ravel().tolist())).encode("ascii")
