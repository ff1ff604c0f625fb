"""Cache keys: hashes of everything that a result depends on."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

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

    Returns
    -------
    str
        Key of this installation.
    """
    native = (find_spec(f"fracslice.{name}") for name in ("_native", "_slices", "_vdb"))
    compiled = (Path(module.origin) for module in native if module and module.origin)
    scipy = find_spec("scipy")  # importing it for its version takes longer than hashing the program
    assert scipy and scipy.origin
    version = Path(scipy.origin).with_name("version.py")
    return key(texts(*sorted(PACKAGE.rglob("*.py")), *compiled, version), np.__version__)
