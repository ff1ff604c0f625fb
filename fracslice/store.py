"""Cache of finished results in a folder, for later jobs with the same input."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .common.cache import Kept, key, program
from .errors import ExportError, VolumeError
from .expr.runtime import toolchain
from .fields.field import Field

Arrays = Mapping[str, np.ndarray]

NAME = "name of the file"
"""Entry of a file that holds its name."""


@dataclass(frozen=True)
class Store:
    """Cache of arrays in files named by the hash of everything that they depend on.

    An unreadable or incomplete file is recomputed. A folder that other users can write to is not used
    (`common.cache.Kept`).
    """

    folder: Path  # cache folder, created by the first write

    def get(self, made_of: tuple[object, ...], make: Callable[[], Arrays]) -> Arrays:
        """Return cached arrays, or compute and cache them."""
        kept, name = Kept(self.folder), f"{key(program(), toolchain(), *made_of)}.npz"
        value = kept.get(name, partial(_read_arrays, name))
        if value is not None:
            return value
        made = make()
        try:
            kept.put(name, partial(_write, name, made))
        except ExportError as error:
            raise VolumeError(str(error)) from None
        return made


def stored(store: Store | None, parts: tuple[object, ...], root: Field, make: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of a field: cached if there is a store, else computed."""
    return make() if store is None else store.get((*parts, root.key), make)


def _read_arrays(name: str, file: BinaryIO) -> Arrays | None:
    """Read the arrays of a file; None if it is incomplete or was written under another name."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            found = dict(arrays)
            return found if str(found.pop(NAME)) == name else None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        return None


def _write(name: str, arrays: Arrays, file: BinaryIO) -> None:
    np.savez(file, allow_pickle=False, **arrays, **{NAME: np.array(name)})
