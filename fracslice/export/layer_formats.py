"""Formats of layers: how a layer is encoded, how a file holds the encoded layers, and what printers show
of the whole.
"""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from .._slices import Encoding
from ..common.files import flushing, replacing, write_small_file
from ..common.parameters import printable
from ..errors import ExportError
from ..slicing import Layer
from ..slicing.layers import Pictures
from ..slicing.printers import Printer, Resin
from ..work import ahead, in_background
from .resuming import Journal, journal, resumable_folder
from .slice_run import Encode, SliceRun, begin, encoded_layers


@dataclass(frozen=True)
class LayerFormat(ABC):
    """Format of layers."""

    name: str  # name of the format
    encode: Callable[[SliceRun, Layer], bytes]  # encodes a layer of a run
    # encoding of the picture that `encode` asks for; None if it reads a layer in another way
    encoding: Encoding | None = field(default=None, kw_only=True)
    # maximum size of the encoded layers, bytes; None for no limit
    most: int | None = field(default=None, kw_only=True)
    endings: tuple[str, ...] = field(default=(), kw_only=True)  # extensions of files; "" is a folder
    # second extension that printers of an extension read
    also: Mapping[str, str] = field(default_factory=dict, kw_only=True)

    def pictures(self, run: SliceRun) -> Pictures | None:
        """Pictures of a run for `Slicer.map` to make; None if it cannot."""
        return None if self.encoding is None else run.screen.pictures(self.encoding)

    def encoder(self, run: SliceRun) -> Encode:
        """Return the function that encodes the layers of a run."""
        return partial(self.encode, run)

    @abstractmethod
    def write(self, run: SliceRun, path: Path) -> None:
        """Write the layers of a run; an interrupted job resumes."""

    def encoder_for(self, run: SliceRun, path: Path) -> Encode:
        """Return `encoder`, with the file in its errors, once a shard may write this file; see `begin`."""
        try:
            encode = self.encoder(run)
        except ExportError as error:
            raise ExportError(f"{path}: {error}") from None
        begin(run, self.name)
        return encode

    @contextmanager
    def encoded(self, run: SliceRun, path: Path) -> Iterator[Journal]:
        """Encode the layers of a file."""
        encode = self.encoder_for(run, path)
        with journal(path, run.key(self.name)) as layers:
            for data in encoded_layers(run, self.name, encode, layers.count, self.pictures(run)):
                if self.most is not None and layers.size + len(data) > self.most:
                    break  # the journal is removed: the job cannot be resumed
                layers.append(data)
            else:
                yield layers
                return
        raise ExportError(
            f"{path}: {layers.count + 1} of {run.layers} layers are larger than {self.most / 2**30:.2f} GiB: "
            f"expected less, for a {self.name} file; thicker layers or a smaller object"
        )


@dataclass(frozen=True)
class FileFormat(LayerFormat):
    """Format of one file."""

    # writes the encoded layers of a run, with the format's header and trailer, to an open file
    assemble: Callable[[SliceRun, Iterable[bytes], BinaryIO], None]

    def write(self, run: SliceRun, path: Path) -> None:
        with self.encoded(run, path) as layers, replacing(path) as file:
            self.assemble(run, layers, file)


@dataclass(frozen=True)
class FolderFormat(LayerFormat):
    """Format of a folder with a file for each layer, 00000.png, ...; the name is their extension.

    The folder must be new, empty, or left by an interrupted job, which resumes at its first layer that is
    missing, incomplete or another: layers are written by the threads that encode them, in any order.
    """

    others: Callable[[SliceRun], dict[str, bytes]]  # further files of a run by name, written last

    def write(self, run: SliceRun, path: Path) -> None:
        encode, name = self.encoder_for(run, path), f"{{:05d}}.{self.name}".format
        with resumable_folder(path, run.key(self.name), name) as (start, finished):

            def store(index: int, data: bytes) -> None:
                write_small_file(f"{path}/{name(index)}", data)
                finished.add(name(index), data)

            def make(layer: Layer) -> None:
                store(layer.index, encode(layer))

            if run.work.cluster is None:
                for _ in run.slicer.map(make, range(start, run.layers), self.pictures(run)):
                    pass
            else:
                for index, data in enumerate(encoded_layers(run, self.name, encode, start), start):
                    store(index, data)
            for other, data in self.others(run).items():
                with replacing(path / other) as file:
                    file.write(data)


ADDRESSED = 2**32 - 2**25
"""Maximum size of the pictures in a file with offsets of 32 bits, bytes, beside headers and tables."""

_AREA = struct.Struct("<d")
"""Area before the picture in a record, mm^2."""


@dataclass(frozen=True, eq=False)
class PrintData:
    """A print job whose layers are encoded."""

    run: SliceRun  # layers, screen and metadata
    name: str  # name of the file without its extension
    printer: Printer  # the printer
    resin: Resin  # exposure and motion
    journal: Journal  # area and picture of each layer
    picture: Callable[[], NDArray[np.uint8]] | None = None  # returns the picture of the object

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
        return self.resin.seconds(self.areas)

    @cached_property
    def resins(self) -> list[Resin]:
        """Settings of each layer."""
        return self.resin.of_layers(self.areas)

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

        `width`, `height` in pixels. Returns uint8 [height, width, 3].
        """
        if self.picture is None:
            return np.zeros((height, width, 3), np.uint8)
        whole = Image.fromarray(self.picture())
        return np.asarray(ImageOps.fit(whole, (width, height), Image.Resampling.LANCZOS))


@dataclass(frozen=True)
class PrintFormat(LayerFormat):
    """Format of a printer's file, for runs with a printer and a resin."""

    assemble: Callable[[PrintData, BinaryIO], None]  # writes a print job to an open file

    def encoder(self, run: SliceRun) -> Encode:
        if run.screen.printer is None:
            raise ExportError("a print file needs a printer")
        if run.resin is None:
            raise ExportError("a print file needs an exposure: none is known for this printer")
        run.resin.check_depth(float(run.stack.heights.max()))

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
    name: str, encoding: Encoding, assemble: Callable[[PrintData, BinaryIO], None], **options: Any
) -> PrintFormat:
    """Return the format of a printer's file whose layers are encoded pictures."""

    def encode(run: SliceRun, layer: Layer) -> bytes:
        return run.screen.encoded(layer, encoding)

    return PrintFormat(name, encode, assemble, encoding=encoding, **options)


def rgb565(picture: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Convert a picture to 16 bits per pixel.

    `picture`: uint8 [height, width, 3]. Returns uint16 [height, width], red in the five highest bits.
    """
    red, green, blue = np.moveaxis(picture.astype(np.uint16), 2, 0)
    return np.asarray((red >> 3) << 11 | (green >> 2) << 5 | blue >> 3)


def rgb15_runs(picture: NDArray[np.uint8]) -> bytes:
    """Runs of equal pixels of 15 bits; the bit after green marks a pixel that a run length follows.

    `picture`: uint8 [height, width, 3].
    """
    pixels = (rgb565(picture) & ~np.uint16(0x20)).ravel()
    starts = np.flatnonzero(np.diff(pixels, prepend=~pixels[:1]))
    words: list[int] = []
    for value, length in zip(pixels[starts], np.diff(starts, append=len(pixels)), strict=True):
        for done in range(0, int(length), 0xFFE):
            more = min(int(length) - done, 0xFFE) - 1
            words += [int(value) | 0x20, 0x3000 | more] if more else [int(value)]
    return np.array(words, "<u2").tobytes()


def second_stages(resin: Resin) -> tuple[float, float, float, float]:
    """Second stages of the lift and of the way back, mm and mm/min; zeros where there is none."""
    up = (resin.lift_2, resin.lift_speed_2) if resin.lift_2 else (0.0, 0.0)
    return (*up, resin.retract_2, resin.retract_speed_2) if resin.retract_2 else (*up, 0.0, 0.0)
