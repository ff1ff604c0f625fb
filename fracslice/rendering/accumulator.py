"""What a picture is made of while it is being made: sums over samples, every sample with the same weight."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.lib.npyio import NpzFile

from ..errors import RenderError
from ..scene.view import Film
from .cpu import ordered
from .film import develop
from .packets import CHANNELS

TRUSTED = 8
"""Samples that a pixel has before its spread is believed."""
COARSE = 4
"""The first pass looks at every fourth pixel of every fourth row, unless it is told otherwise."""
NEARLY = 0.999
"""The largest of some numbers is not below so much of their mean, however that is rounded."""

COARSEST, MOST_PASSES = 64, 1 << 24
"""What a saved picture may say of itself."""
HEADER = 1 << 12
"""Bytes of an array in a file that are not its numbers', at most."""
NO_PICTURE = "expected a picture in the making, whole, as it was saved"

FEW = 1 / 256
"""When no more than this share of the pixels is unfinished, there is no choosing among them: a pass costs its
time for a single pixel too.
"""


class Accumulator(Protocol):
    """A picture in the making, wherever its sums are.

    passes: how many are in it. coarse: the pixels between those of the first.
    """

    passes: int
    coarse: int

    def wanted(self, most: int, tolerance: float) -> tuple[Any, int]:
        """The pixels of the next pass, as the tracer takes them, and how many they are.

        First a grid, then the rest, then all that have fewer than TRUSTED samples. From then on a pixel
        that has 2^k samples gets as many again, but not beyond `most`, if its error or a neighbour's is
        above the tolerance, and if that takes at least as much of the error from the picture as it does on
        average in such pixels: most samples go where there is most to gain (Mitchell 1987, "Generating
        Antialiased Images at Low Sampling Densities", for the idea), and a net of samples that was begun is
        completed.
        """

    def receive(self, add: Callable[[Any], None]) -> None:
        """Lets a pass be added to the sums. If it raises anything, the picture stays as it was."""

    def anew(self, coarse: int) -> Accumulator:
        """A picture of the same size without a sample; this one is gone."""

    def statistics(self) -> tuple[float, float]:
        """Samples of a pixel, on average, and the root mean square of the pixels' standard errors, as shown;
        infinite below 2 samples."""

    def shown(self, film: Film, mode: str) -> np.ndarray:
        """The picture as screens show it: uint8 [height, width, 3], sRGB."""

    def host(self) -> HostAccumulator:
        """The same picture in the computer's memory."""


@dataclass(eq=False)
class HostAccumulator:
    """sums: [height * width, 6] of the kernel's float type, see `packets.CHANNELS`."""

    width: int
    height: int
    sums: np.ndarray
    passes: int = 0
    coarse: int = COARSE

    @classmethod
    def empty(cls, width: int, height: int, dtype: np.dtype, coarse: int = COARSE) -> HostAccumulator:
        return cls(width, height, np.zeros((width * height, CHANNELS), dtype), coarse=coarse)

    @classmethod
    def of(cls, other: HostAccumulator) -> HostAccumulator:
        return other

    def host(self) -> HostAccumulator:
        return self

    @property
    def counts(self) -> np.ndarray:
        """Samples of each pixel, [height, width]."""
        return self.sums[:, 5].reshape(self.height, self.width)

    def mean(self) -> np.ndarray:
        """The picture so far: float32 [height, width, 3], linear light; black where there is no sample."""
        return self._spread(self._known())

    def shown(self, film: Film, mode: str) -> np.ndarray:
        return self._spread(levels(develop(self._known(), film, mode)))

    def _known(self) -> np.ndarray:
        """The mean of the pixels that have samples, float32; after the first pass those of its grid."""
        step = self.coarse if self.passes == 1 else 1
        sums = self.sums.reshape(self.height, self.width, CHANNELS)[::step, ::step]
        return np.asarray(sums[..., :3] / np.maximum(sums[..., 5:], 1), np.float32)

    def _spread(self, known: np.ndarray) -> np.ndarray:
        """A picture of the whole film."""
        if self.passes != 1:
            return known
        wide = known.repeat(self.coarse, 0).repeat(self.coarse, 1)
        return np.ascontiguousarray(wide[: self.height, : self.width])

    def statistics(self) -> tuple[float, float]:
        squares = self.squares() if self.passes > 2 else np.array([np.inf])
        known = squares[np.isfinite(squares)]
        error = float(np.sqrt(known.mean())) if known.size else float("inf")
        return float(self.counts.mean(dtype=np.float64)), error

    def squares(self) -> np.ndarray:
        """The squared standard error of each pixel's brightness, as shown: float64 [height, width]; infinite
        below 2 samples."""
        n = self.sums[:, 5].astype(np.float64)
        mean = self.sums[:, 3] / np.maximum(n, 1)
        spread = np.maximum(self.sums[:, 4] / np.maximum(n, 1) - mean * mean, 0)
        squares = np.where(n < 2, np.inf, spread / np.maximum(n - 1, 1))
        return np.asarray(squares.reshape(self.height, self.width))

    def wanted(self, most: int, tolerance: float) -> tuple[np.ndarray, int]:
        first = first_passes(self.width, self.height, self.coarse)
        if self.passes < len(first):
            pixels = first[self.passes]
        else:
            order, mask = ordered(self.width, self.height), self._pressing(most, tolerance)
            pixels = order[mask[order >> 16, order & 65535]]
        return pixels, len(pixels)

    def _pressing(self, most: int, tolerance: float) -> np.ndarray:
        n = self.counts.astype(np.int32)
        squares = np.where(n < TRUSTED, np.inf, self.squares())
        unfinished = (n < most) & (around(squares) > tolerance * tolerance)
        gain = around(squares / n)
        begun = (n & (n - 1)) != 0
        known = gain[unfinished]
        least = NEARLY * known.mean() if known.size > FEW * gain.size else 0.0
        return np.asarray(unfinished & (begun | (gain >= least)))

    def receive(self, add: Callable[[Any], None]) -> None:
        sums = self.sums.copy()
        add(sums)
        self.sums = sums
        self.passes += 1

    def anew(self, coarse: int) -> HostAccumulator:
        return self.empty(self.width, self.height, self.sums.dtype, coarse)

    def save(self, file: BinaryIO, key: str) -> None:
        """Writes it as an .npz file, from which rendering goes on as if it had not stopped. key: of what it
        is a picture."""
        shape = np.array([self.width, self.height, self.passes, self.coarse])
        np.savez(file, sums=self.sums, shape=shape, key=np.array(key))

    @classmethod
    def load(cls, path: str | Path, key: str, like: HostAccumulator) -> HostAccumulator:
        """Reads what `save` wrote. like: a picture of the same size and float type.

        Raises `RenderError` if it is of another picture, or no such file: nothing that native code could trip
        over is let in.
        """
        try:
            with open(path, "rb") as file, NpzFile(file) as stored:
                if str(_small(stored, "key")) != key:
                    raise RenderError(f"{path}: is of another scene, view, size or version")
                width, height, passes, coarse = map(int, _small(stored, "shape"))
                found = cls(width, height, _small(stored, "sums", like.sums.nbytes), passes, coarse)
        except OSError as error:
            raise RenderError(f"{path}: {error.strerror or error}") from None
        except (ValueError, KeyError, EOFError, BadZipFile, NotImplementedError, zlib.error):
            raise RenderError(f"{path}: {NO_PICTURE}") from None
        if not found._fits(like):
            raise RenderError(f"{path}: {NO_PICTURE}")
        return found

    def _fits(self, like: HostAccumulator) -> bool:
        """Whether a picture can go on as one like another."""
        sums, n = self.sums, self.sums[..., -1]
        return (
            (self.width, self.height) == (like.width, like.height)
            and (sums.shape, sums.dtype, sums.flags.c_contiguous) == (like.sums.shape, like.sums.dtype, True)
            and 0 <= self.passes < MOST_PASSES
            and 1 <= self.coarse <= COARSEST
            and bool(((n >= 0) & (n <= self.passes) & (n == np.floor(n))).all())
        )


def _small(stored: NpzFile, name: str, most: int = 0) -> np.ndarray:
    """An array of a file, if it is of about so many bytes at most: a small file can hold a large one."""
    assert stored.zip
    if stored.zip.getinfo(f"{name}.npy").file_size > most + HEADER:
        raise ValueError(name)
    return np.asarray(stored[name])


@lru_cache(maxsize=4)
def first_passes(width: int, height: int, coarse: int) -> tuple[np.ndarray, ...]:
    """The pixels of the passes until each has a sample, as `ordered` has them: a grid, and the others if
    there are any. Read-only."""
    order = ordered(width, height)
    if coarse == 1:
        return (order,)
    first = ((order >> 16) % coarse == 0) & ((order & 65535) % coarse == 0)
    parts = order[first], order[~first]
    for pixels in parts:
        pixels.setflags(write=False)
    return parts


def around(values: np.ndarray) -> np.ndarray:
    """The largest of each pixel's value and its eight neighbours'."""
    padded = np.pad(values, 1, mode="edge")
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.asarray(np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]))


def levels(shown: np.ndarray) -> np.ndarray:
    """sRGB in [0, 1] as uint8."""
    return np.asarray(shown * np.float32(255) + np.float32(0.5), np.uint8)
