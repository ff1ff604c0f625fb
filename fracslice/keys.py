"""Names of what is kept: hashes of everything that it follows from."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent


def key(*parts: object) -> str:
    """Equal for equal parts in the same order, and different otherwise.

    parts: arrays, bytes, texts, and what `repr` tells all of: numbers, records, tuples of such.
    """
    digest = hashlib.sha256()
    for part in parts:
        for data in _told(part):
            digest.update(len(data).to_bytes(8, "little"))
            digest.update(data)
    return digest.hexdigest()[:32]


def _told(part: object) -> tuple[bytes | memoryview, ...]:
    if isinstance(part, np.ndarray):
        array = np.ascontiguousarray(part)
        return f"{part.dtype.str} {part.shape}".encode(), array.reshape(-1).view(np.uint8).data
    return (b"bytes", part) if isinstance(part, bytes) else (b"", repr(part).encode())


def texts(*paths: Path) -> str:
    """The key of what is in these files."""
    return key(*(path.read_bytes() for path in paths))


@cache
def program() -> str:
    """The key of the whole program and of what computes for it."""
    native = (find_spec(f"{__package__}.{name}") for name in ("_native", "_slices"))
    compiled = (Path(found.origin) for found in native if found and found.origin)
    versions = (version(name) for name in ("numpy", "scipy"))
    return key(texts(*sorted(HERE.rglob("*.py")), *compiled), *versions)
