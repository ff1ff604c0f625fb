"""Finished work that is kept in a folder, for the next job that asks for the same."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .errors import VolumeError
from .files import Kept
from .kernel import Field
from .kernel.objects import toolchain
from .keys import key, program

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Store:
    """Arrays in files named by the hash of all that they follow from.

    folder: made when first written to. A file that cannot be read, or is not whole, is made again; a folder
    that others can write is not used (`files.Kept`).
    """

    folder: Path

    def get(self, made_of: tuple[object, ...], make: Callable[[], Arrays]) -> Arrays:
        """The arrays made of these parts: those kept, or made now and kept.

        made_of: as `keys.key` takes them; the program's own text counts too. Raises `VolumeError` if the
        folder cannot be written.
        """
        kept, name = Kept(self.folder), f"{key(program(), toolchain(), *made_of)}.npz"
        found = kept.get(name, _read)
        if found is not None:
            return found
        made = make()
        try:
            kept.put(name, partial(_write, made))
        except OSError as error:
            raise VolumeError(f"{self.folder}: {error.strerror or error}") from None
        return made


def stored(store: Store | None, parts: tuple[object, ...], root: Field, make: Callable[[], Arrays]) -> Arrays:
    """What `make` makes of a field and other parts, kept in the store if there is one."""
    return make() if store is None else store.get((*parts, root.key), make)


def _read(file: BinaryIO) -> Arrays | None:
    """The arrays in a file; None where it is not whole."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            return dict(arrays)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        return None


def _write(arrays: Arrays, file: BinaryIO) -> None:
    np.savez(file, allow_pickle=False, **arrays)
