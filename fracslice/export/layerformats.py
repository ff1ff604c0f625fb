"""Formats of layers: how a layer is encoded, and how a file or a folder holds the encoded layers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import BinaryIO

from .._slices import Encoding
from ..common.files import put, replacing
from ..errors import ExportError
from ..slicing import Layer
from ..slicing.slab import Pictures
from .jobs import SliceRun
from .ranges import Encode, begin, encoded_layers
from .resuming import Journal, journal, resumable_folder


@dataclass(frozen=True)
class LayerFormat(ABC):
    """Format of layers.

    Attributes
    ----------
    name : str
        Name of the format.
    encode : callable
        Encodes a layer of a run.
    encoding : Encoding or None
        Encoding of the picture that `encode` asks for; None if it reads a layer in another way.
    most : int or None
        Maximum size of the encoded layers, bytes; None for no limit.
    """

    name: str
    encode: Callable[[SliceRun, Layer], bytes]
    encoding: Encoding | None = field(default=None, kw_only=True)
    most: int | None = field(default=None, kw_only=True)

    def pictures(self, run: SliceRun) -> Pictures | None:
        """Pictures of a run for `Slicer.map` to make; None if it cannot."""
        return None if self.encoding is None else run.screen.pictures(self.encoding)

    def encoder(self, run: SliceRun) -> Encode:
        """Return the function that encodes the layers of a run.

        Returns
        -------
        callable
            Function of a layer.

        Raises
        ------
        ExportError
            If the format cannot hold the run.
        """
        return partial(self.encode, run)

    @abstractmethod
    def write(self, run: SliceRun, path: Path) -> None:
        """Write the layers of a run; an interrupted job resumes.

        Parameters
        ----------
        run : SliceRun
            The layers to write.
        path : Path
            The file or folder to write.

        Raises
        ------
        ExportError
            If the format cannot hold the run, or for an error of the file system.
        """

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
        """Encode the layers of a file.

        Parameters
        ----------
        run : SliceRun
            The layers to write.
        path : Path
            The file that they are for.

        Yields
        ------
        Journal
            The encoded layers, to be written before the block ends.

        Raises
        ------
        ExportError
            As for `write`, and as soon as the layers are larger than `most`.
        """
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
    """Format of one file.

    Attributes
    ----------
    assemble : callable
        Writes the encoded layers of a run, with the format's header and trailer, to an open file.
    """

    assemble: Callable[[SliceRun, Iterable[bytes], BinaryIO], None]

    def write(self, run: SliceRun, path: Path) -> None:
        with self.encoded(run, path) as layers, replacing(path) as file:
            self.assemble(run, layers, file)


@dataclass(frozen=True)
class FolderFormat(LayerFormat):
    """Format of a folder with a file for each layer, 00000.png, ...; the name is their extension.

    The folder must be new, empty, or left by an interrupted job, which resumes at its first layer that is
    missing or incomplete: layers are written by the threads that encode them, in any order.

    Attributes
    ----------
    is_whole : callable
        True if the bytes are a complete file of a layer.
    others : callable
        Further files of a run by name, written last.
    """

    is_whole: Callable[[bytes], bool]
    others: Callable[[SliceRun], dict[str, bytes]]

    def write(self, run: SliceRun, path: Path) -> None:
        encode, name = self.encoder_for(run, path), f"{{:05d}}.{self.name}".format
        with resumable_folder(path, run.key(self.name), name, self.is_whole) as start:

            def make(layer: Layer) -> None:
                put(f"{path}/{name(layer.index)}", encode(layer))

            if run.work.cluster is None:
                for _ in run.slicer.map(make, range(start, run.layers), self.pictures(run)):
                    pass
            else:
                for index, data in enumerate(encoded_layers(run, self.name, encode, start), start):
                    put(f"{path}/{name(index)}", data)
            for other, data in self.others(run).items():
                with replacing(path / other) as file:
                    file.write(data)
