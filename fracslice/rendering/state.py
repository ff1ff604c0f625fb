"""Files from which rendering continues exactly."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import BinaryIO
from zipfile import BadZipFile

import numpy as np
from numpy.lib.npyio import NpzFile

from ..errors import RenderError
from .accumulator import COUNT, COVER, GOAL
from .host_accumulator import HostAccumulator

MOST_PASSES, MOST_SAMPLES = 1 << 24, 1 << 20
"""Limits of a saved picture's passes and samples per pixel."""
HEADER = 1 << 12
"""Maximum header size of an array in a file, bytes."""
INVALID = "expected a picture in progress, complete, as it was saved"


def save_state(file: BinaryIO, key: str, picture: HostAccumulator) -> None:
    """Write the sums as an .npz file."""
    shape = np.array([picture.width, picture.height, picture.passes])
    np.savez(file, sums=picture.sums, shape=shape, key=np.array(key))


def load_state(path: str | Path, key: str, like: HostAccumulator) -> HostAccumulator:
    """Read a file written by `save_state`. Its contents are validated before native code sees them."""
    try:
        with open(path, "rb") as file, NpzFile(file) as stored:
            if str(_array(stored, "key")) != key:
                raise RenderError(f"{path}: is of another scene, view, size, seed or version")
            width, height, passes = map(int, _array(stored, "shape"))
            sums = _array(stored, "sums", like.sums.nbytes)
    except OSError as error:
        raise RenderError(f"{path}: {error.strerror or error}") from None
    except (ValueError, KeyError, EOFError, BadZipFile, NotImplementedError, zlib.error):
        raise RenderError(f"{path}: {INVALID}") from None
    saved = HostAccumulator(width, height, sums, passes, like.work)
    if not _fits(saved, like):
        raise RenderError(f"{path}: {INVALID}")
    return saved


def _fits(saved: HostAccumulator, like: HostAccumulator) -> bool:
    """True if a picture is consistent and has the size and float type of another."""
    return (
        (saved.width, saved.height) == (like.width, like.height)
        and (saved.sums.shape, saved.sums.dtype) == (like.sums.shape, like.sums.dtype)
        and 0 <= saved.passes < MOST_PASSES
        and all(_counts(saved.channels[..., channel]) for channel in (COUNT, GOAL, COVER))
        and bool((saved.counts <= saved.channels[..., GOAL]).all())
        and bool((saved.channels[..., COVER] <= saved.counts).all())
    )


def _counts(n: np.ndarray) -> bool:
    """True if all values are numbers of samples."""
    return bool(((n >= 0) & (n <= MOST_SAMPLES) & (n == np.floor(n))).all())


def _array(stored: NpzFile, name: str, most: int = 0) -> np.ndarray:
    """Load an array of at most `most` bytes from a file.

    A small file can expand to a large array.
    """
    assert stored.zip
    if stored.zip.getinfo(f"{name}.npy").file_size > most + HEADER:
        raise ValueError(name)
    return np.asarray(stored[name])
