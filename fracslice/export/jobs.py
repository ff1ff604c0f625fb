"""Slice runs, and the ways in which their layers get into a file or a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path

from fracslice.errors import ExportError
from fracslice.export.resuming import Journal, journal, resumable_folder
from fracslice.files import put, replacing
from fracslice.formulas.parameters import Vector, validate
from fracslice.kernel.objects import toolchain
from fracslice.keys import key, program
from fracslice.mesh.model import Mesh
from fracslice.slicing import Layer, Slicer, Stack
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
    mesh : callable, optional
        Makes the mesh of the object for 3MF files, mm, standing on z = 0 and centred as the layers are.

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
    mesh: Callable[[], Mesh] | None = None

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

    @contextmanager
    def encoded(
        self, path: str | Path, form: str | bytes, encode: Callable[[Layer], bytes]
    ) -> Iterator[Journal]:
        """Encode all layers of a file; an interrupted job resumes.

        Parameters
        ----------
        path : str or path
            The file that the layers are for.
        form : str or bytes
            File format.
        encode : callable
            Encodes a layer.

        Yields
        ------
        Journal
            The encoded layers, to be written before the block ends.

        Raises
        ------
        ExportError
            For an error of the file system.
        """
        with journal(path, self.key(form)) as layers:
            for data in self.slicer.map(encode, range(layers.count, self.layers)):
                layers.append(data)
            yield layers

    def into_file(self, path: str | Path, head: bytes, encode: Callable[[Layer], bytes], tail: bytes) -> Path:
        """Write a head, the encoded layers and a tail to one file; an interrupted job resumes.

        Parameters
        ----------
        path : str or path
            The file to write.
        head, tail : bytes
            Text before and after the layers.
        encode : callable
            Encodes a layer.

        Returns
        -------
        Path

        Raises
        ------
        ExportError
            For an error of the file system.
        """
        with self.encoded(path, head, encode) as layers, replacing(path) as file:
            file.write(head)
            file.writelines(layers)
            file.write(tail)
        return Path(path)

    def into_folder(
        self,
        path: str | Path,
        ending: str,
        encode: Callable[[Layer], bytes],
        is_whole: Callable[[bytes], bool],
        also: Mapping[str, bytes],
    ) -> Path:
        """Write a folder of files 00000.png, ..., one for each layer.

        A folder left by an interrupted run of the same job is resumed after its last complete layer.

        Parameters
        ----------
        path : str or path
            The folder; it must be new, empty, or left by an interrupted job.
        ending : str
            Extension of the files.
        encode : callable
            Encodes a layer.
        is_whole : callable
            True if the bytes are a complete file.
        also : mapping of str to bytes
            Further files by name, written last.

        Returns
        -------
        Path

        Raises
        ------
        ExportError
            For a folder with other files, or an error of the file system.
        """
        folder, name = Path(path), f"{{:05d}}.{ending}".format
        with resumable_folder(folder, self.key(ending), name, is_whole) as start:
            layers = range(start, self.layers)
            for _ in self.slicer.map(lambda k: put(f"{folder}/{name(k.index)}", encode(k)), layers):
                pass
            for other, data in also.items():
                with replacing(folder / other) as file:
                    file.write(data)
        return folder
