"""TIFF and OpenEXR files of floats, written while the rows of the picture are made."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

import numpy as np

from ..work import chunks
from .colour_png import STRIP


@contextmanager
def _named(file: BinaryIO, folder: Path | None) -> Iterator[Path]:
    """Temporary file, for libraries that only write to named ones; its contents are copied to the file."""
    with TemporaryDirectory(prefix=".fracslice-", dir=folder) as temporary:
        yield (path := Path(temporary) / "picture")
        with open(path, "rb") as written:
            shutil.copyfileobj(written, file)


def write_tiff(
    file: BinaryIO,
    shape: tuple[int, ...],
    bands: Iterable[np.ndarray],
    text: Mapping[str, str],
    folder: Path | None = None,
) -> None:
    """Write a TIFF file by tifffile: 32-bit floats, uncompressed.

    The bytes do not depend on the bands.

    Parameters
    ----------
    file : BinaryIO
        Writable binary file.
    shape : tuple of int
        Height, width, and 3 or 4 channels of the picture.
    bands : iterable of ndarray, float32 [rows, width, channels]
        Linear red, green and blue, and alpha that they are multiplied by, from the top; all but the last have
        a multiple of `STRIP` rows.
    text : mapping of str to str
        Keywords and texts of the metadata, in the description.
    folder : Path, optional
        Folder for a temporary file.
    """
    from tifffile import imwrite

    def strips() -> Iterator[bytes]:
        for band in bands:
            for rows in chunks(len(band), STRIP):
                yield np.ascontiguousarray(band[rows], "<f4").tobytes()

    with _named(file, folder) as path:
        imwrite(
            path,
            strips(),
            shape=shape,
            dtype="<f4",
            rowsperstrip=STRIP,
            photometric="rgb",
            extrasamples=["assocalpha"] if shape[2] == 4 else None,
            description="\n".join(f"{k}: {v}" for k, v in text.items()).encode(),
            metadata=None,
            software=False,
        )


def write_exr(
    file: BinaryIO,
    shape: tuple[int, ...],
    bands: Iterable[np.ndarray],
    names: Sequence[str],
    text: Mapping[str, str],
    folder: Path | None = None,
) -> None:
    """Write an OpenEXR file (Academy Software Foundation): 32-bit floats, losslessly compressed.

    The bytes do not depend on the bands.

    Parameters
    ----------
    file : BinaryIO
        Writable binary file.
    shape : tuple of int
        Height and width of the picture, and its number of channels.
    bands : iterable of ndarray, float32 [rows, width, channels]
        Values of the channels, from the top.
    names : sequence of str
        Names of the channels.
    text : mapping of str to str
        Keywords and texts of the metadata.
    folder : Path, optional
        Folder for a temporary file.
    """
    import Imath
    import OpenEXR

    header = OpenEXR.Header(shape[1], shape[0])
    header["compression"] = Imath.Compression(Imath.Compression.ZIP_COMPRESSION)
    header["channels"] = {name: Imath.Channel(Imath.PixelType(Imath.PixelType.FLOAT)) for name in names}
    header |= {keyword: value.encode() for keyword, value in text.items()}
    with _named(file, folder) as path:
        output = OpenEXR.OutputFile(str(path), header)
        for band in bands:
            rows = {name: np.ascontiguousarray(band[..., k], "<f4") for k, name in enumerate(names)}
            output.writePixels({name: values.tobytes() for name, values in rows.items()}, len(band))
        output.close()
