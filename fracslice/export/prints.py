"""Print jobs: the encoded pictures of all layers, and what printers show of the whole."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from .._slices import Encoding
from ..background import ahead, in_background
from ..common.files import flushing, replacing
from ..errors import ExportError
from ..formulas.conversion import printable
from ..slicing import Layer
from ..slicing.printers import Printer
from .jobs import SliceRun
from .layerformats import LayerFormat
from .ranges import Encode
from .resins import Resin
from .resuming import Journal

ADDRESSED = 2**32 - 2**25
"""Maximum size of the pictures in a file with offsets of 32 bits, bytes, beside headers and tables."""

_AREA = struct.Struct("<d")
"""Area before the picture in a record, mm^2."""


@dataclass(frozen=True, eq=False)
class PrintData:
    """A print job whose layers are encoded.

    Attributes
    ----------
    run : SliceRun
        Layers, screen and metadata.
    name : str
        Name of the file without its extension.
    printer : Printer
        The printer.
    resin : Resin
        Exposure and motion.
    journal : Journal
        Area and picture of each layer.
    picture : callable or None
        Returns the picture of the object.
    """

    run: SliceRun
    name: str
    printer: Printer
    resin: Resin
    journal: Journal
    picture: Callable[[], NDArray[np.uint8]] | None = None

    def __iter__(self) -> Iterator[bytes]:
        """Iterate over the encoded pictures; some are read by another thread while those before are used."""
        groups = self.journal.groups()
        records = chain.from_iterable(ahead(groups) if self.run.work.threads > 1 else groups)
        return (record[_AREA.size :] for record in records)

    @cached_property
    def areas(self) -> NDArray[np.float64]:
        """Areas of the layers, mm^2, float64 [n]."""
        return np.frombuffer(b"".join(self.journal.begins), "<f8")

    @property
    def sizes(self) -> list[int]:
        """Sizes of the encoded pictures, bytes."""
        return [size - _AREA.size for size in self.journal.sizes]

    @property
    def layers(self) -> int:
        """Number of layers."""
        return self.run.layers

    @property
    def tops(self) -> NDArray[np.float64]:
        """Upper faces of the layers, mm."""
        return self.run.stack.tops

    @property
    def heights(self) -> NDArray[np.float64]:
        """Layer heights, mm."""
        return self.run.stack.heights

    @cached_property
    def exposures(self) -> NDArray[np.float64]:
        """Exposure of each layer, s."""
        return self.resin.exposures(self.layers)

    @property
    def volume_ml(self) -> float:
        """Volume of the solid, ml."""
        return float(self.areas @ self.heights) / 1000

    @property
    def weight_g(self) -> float:
        """Weight, g."""
        return self.volume_ml * self.resin.density

    @property
    def cost(self) -> float:
        """Price of the resin."""
        return self.volume_ml * self.resin.price / 1000

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return self.resin.seconds(self.layers)

    @property
    def mirrored(self) -> bool:
        """True if the pictures are mirrored along x."""
        return self.run.screen.mirrored

    @property
    def title(self) -> bytes:
        """Name of the printer, ASCII."""
        return self.printer.title.encode("ascii", "replace")

    def preview(self, width: int, height: int) -> NDArray[np.uint8]:
        """Picture of the object, cut from one for all sizes.

        Parameters
        ----------
        width, height : int
            Size, pixels.

        Returns
        -------
        uint8 [height, width, 3]
            sRGB; black if the run has no pictures.
        """
        if self.picture is None:
            return np.zeros((height, width, 3), np.uint8)
        whole = Image.fromarray(self.picture())
        return np.asarray(ImageOps.fit(whole, (width, height), Image.Resampling.LANCZOS))


@dataclass(frozen=True)
class PrintFormat(LayerFormat):
    """Format of a printer's file, for runs with a printer and a resin.

    Attributes
    ----------
    assemble : callable
        Writes a print job to an open file.
    """

    assemble: Callable[[PrintData, BinaryIO], None]

    def encoder(self, run: SliceRun) -> Encode:
        if run.screen.printer is None:
            raise ExportError("a print file needs a printer")
        if run.resin is None:
            raise ExportError("a print file needs an exposure: none is known for this printer")

        def record(layer: Layer) -> bytes:
            data = self.encode(run, layer)
            return _AREA.pack(layer.area) + data

        return record

    def write(self, run: SliceRun, path: Path) -> None:
        drawn = nullcontext(None) if run.picture is None else in_background(run.picture, run.work.threads)
        with (
            drawn as picture,
            self.encoded(run, path) as journal,
            replacing(path) as file,
            flushing(file),
        ):
            assert run.screen.printer and run.resin
            name = printable(path.stem)
            job = PrintData(run, name, run.screen.printer, run.resin, journal, picture)
            self.assemble(job, file)
            # Those of an earlier or another process, too.
            run.slicer.areas.update(enumerate(job.areas.tolist()))


def pixel_format(
    name: str, encoding: Encoding, assemble: Callable[[PrintData, BinaryIO], None], most: int | None = None
) -> PrintFormat:
    """Return the format of a printer's file whose layers are encoded pictures.

    Parameters
    ----------
    name, assemble, most
        As for `PrintFormat`.
    encoding : Encoding
        Encoding of the pictures.
    """

    def encode(run: SliceRun, layer: Layer) -> bytes:
        return run.screen.encoded(layer, encoding)

    return PrintFormat(name, encode, assemble, encoding=encoding, most=most)


def rgb565(picture: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Convert a picture to 16 bits per pixel.

    Parameters
    ----------
    picture : uint8 [height, width, 3]
        sRGB.

    Returns
    -------
    uint16 [height, width]
        Red in the five highest bits, green in six, blue in the five lowest.
    """
    red, green, blue = np.moveaxis(picture.astype(np.uint16), 2, 0)
    return np.asarray((red >> 3) << 11 | (green >> 2) << 5 | blue >> 3)
