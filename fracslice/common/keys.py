"""Cache keys: hashes of everything that a result depends on."""

from __future__ import annotations

import hashlib
import os
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from .cache_files import Kept, cache_folder

PACKAGE = Path(__file__).parents[1]


def key(*parts: object) -> str:
    """Hash some values: equal for equal values in the same order, different otherwise.

    Parameters
    ----------
    *parts
        Arrays, bytes, text, and values that `repr` describes completely: numbers, records, tuples of these.

    Returns
    -------
    str
        First 32 hexadecimal digits of a SHA-256 digest.
    """
    digest = hashlib.sha256()
    for part in parts:
        for data in _identity(part):
            digest.update(len(data).to_bytes(8, "little"))
            digest.update(data)
    return digest.hexdigest()[:32]


def _identity(part: object) -> tuple[bytes | memoryview, ...]:
    """Bytes that identify a value: type and shape, then contents."""
    if isinstance(part, np.ndarray):
        array = np.ascontiguousarray(part)
        return f"{part.dtype.str} {part.shape}".encode(), array.reshape(-1).view(np.uint8).data
    return (b"bytes", part) if isinstance(part, bytes) else (b"", repr(part).encode())


def texts(*paths: Path) -> str:
    """Hash the contents of files.

    Parameters
    ----------
    *paths
        Files to read.

    Returns
    -------
    str
        Key of their contents.
    """
    return key(*(path.read_bytes() for path in paths))


@cache
def program() -> str:
    """Hash the program, its native modules and the libraries that it computes with.

    The hash is cached for the sizes, times and inodes of the files: reading hundreds of files takes a tenth
    of a small slice job.

    Returns
    -------
    str
        Key of this installation.
    """
    native = (find_spec(f"fracslice.{name}") for name in ("_native", "_slices", "_vdb"))
    compiled = (module.origin for module in native if module and module.origin)
    scipy = find_spec("scipy")  # importing it for its version takes longer than hashing the program
    assert scipy and scipy.origin
    files = [*_sources(str(PACKAGE)), *compiled, os.path.join(os.path.dirname(scipy.origin), "version.py")]
    states = [(f, s.st_size, s.st_mtime_ns, s.st_ctime_ns, s.st_ino) for f in files for s in (os.stat(f),)]
    kept = Kept(cache_folder() / "programs")

    def hashed() -> bytes:
        return key(texts(*map(Path, files)), np.__version__).encode()

    return kept.cached(f"{key(states, np.__version__)}.txt", hashed).decode()


def _sources(folder: str) -> list[str]:
    """Python files of a folder and its folders, sorted by folder."""
    entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    own = [entry.path for entry in entries if entry.name.endswith(".py")]
    return own + [path for entry in entries if entry.is_dir() for path in _sources(entry.path)]
