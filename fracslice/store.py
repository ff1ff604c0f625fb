"""Finished work that is kept in a folder, for the next job that asks for the same."""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from .errors import VolumeError
from .formulas.registry import Node
from .kernel.linker import link

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Store:
    """Arrays in files named by the hash of all that they follow from.

    folder: made when first written to. A file that cannot be read, or is not whole, is made again.
    """

    folder: Path

    def get(self, made_of: tuple[object, ...], make: Callable[[], Arrays]) -> Arrays:
        """The arrays made of these parts: those kept, or made now and kept.

        made_of: texts, numbers, tuples of such, and arrays; the program's own text counts too. Raises
        `VolumeError` if the folder cannot be written.
        """
        path = self.folder / f"{_key(made_of)}.npz"
        with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile), np.load(path) as kept:
            return dict(kept)
        made = make()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            _write(path, made)
        except OSError as error:
            raise VolumeError(f"{self.folder}: {error.strerror or error}") from None
        return made


def stored(
    store: Store | None, parts: tuple[object, ...], root: object, make: Callable[[], Arrays]
) -> Arrays:
    """What `make` makes of a scene and other parts, kept in the store if there is one.

    A root that is not a tree of formulas has no text to be known by, and is not kept.
    """
    if store is None or not isinstance(root, Node):
        return make()
    linked = link(root)
    return store.get((*parts, linked.source, linked.parameters), make)


def _write(path: Path, arrays: Arrays) -> None:
    """Beside the place, then renamed: a file with the name is whole."""
    handle, name = tempfile.mkstemp(prefix=".", suffix=".part", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, allow_pickle=False, **arrays)
        os.replace(name, path)
    except BaseException:
        with suppress(FileNotFoundError):
            os.unlink(name)
        raise


def _key(made_of: tuple[object, ...]) -> str:
    digest = hashlib.sha256(_program())
    for part in made_of:
        data = part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode()
        digest.update(len(data).to_bytes(8, "little") + data)
    return digest.hexdigest()[:32]


@cache
def _program() -> bytes:
    """What the arrays depend on beside their parts: the code that samples and meshes."""
    here, digest = Path(__file__).parent, hashlib.sha256()
    texts = [p for folder in ("kernel", "volume", "mesh") for p in sorted((here / folder).glob("*.py"))]
    for path in [*texts, *sorted(here.glob("_native*.so"))]:
        digest.update(path.read_bytes())
    return digest.digest()
