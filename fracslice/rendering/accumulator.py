"""What a picture is made of while it is being made: sums over samples, every sample with the same weight."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.lib.npyio import NpzFile

from ..errors import RenderError
from ..scene.view import Film
from ..work import Work, chunks
from .cpu import ordered
from .film import develop
from .packets import CHANNELS

TRUSTED = 8
"""Samples that a pixel has before its spread is believed."""
COARSE = 4
"""The first pass looks at every fourth pixel of every fourth row, unless it is told otherwise."""
NEARLY = 0.999
"""The largest of some numbers is not below so much of their mean, however that is rounded."""

BAND = 32
"""Rows of a picture that are judged at once."""
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

    def receive(self, pixels: Any, add: Callable[[Any], None]) -> None:
        """Lets a pass over some pixels be added to the sums. If it raises anything, the picture stays as it
        was."""

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
    work: Work = field(default_factory=lambda: Work(1))
    _squares: np.ndarray | None = None

    @classmethod
    def empty(
        cls, width: int, height: int, dtype: np.dtype, coarse: int = COARSE, work: Work | None = None
    ) -> HostAccumulator:
        sums = np.zeros((width * height, CHANNELS), dtype)
        return cls(width, height, sums, coarse=coarse, work=work or Work(1))

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
        finite = np.isfinite(squares)
        known = squares.ravel() if finite.all() else squares[finite]
        error = float(np.sqrt(known.mean())) if known.size else float("inf")
        return float(self.counts.mean(dtype=np.float64)), error

    def squares(self) -> np.ndarray:
        """The squared standard error of each pixel's brightness, as shown: float64 [height, width]; infinite
        below 2 samples."""
        if self._squares is None:
            self._squares = squared_errors(self.sums)
        return self._squares.reshape(self.height, self.width)

    def wanted(self, most: int, tolerance: float) -> tuple[np.ndarray, int]:
        first = first_passes(self.width, self.height, self.coarse)
        if self.passes < len(first):
            pixels = first[self.passes]
        else:
            order, places = ordered(self.width, self.height), ordered_places(self.width, self.height)
            pixels = order[self._pressing(most, tolerance).ravel().take(places)]
        return pixels, len(pixels)

    def _pressing(self, most: int, tolerance: float) -> np.ndarray:
        n, squares = self.counts.astype(np.int32), self.squares()
        unfinished, gain = np.empty(n.shape, bool), np.empty(n.shape)

        def judge(rows: slice) -> None:
            seen = slice(max(rows.start - 1, 0), rows.stop + 1)
            own = slice(rows.start - seen.start, rows.stop - seen.start)
            trusted = np.where(n[seen] < TRUSTED, np.inf, squares[seen])
            unfinished[rows] = (n[rows] < most) & (around(trusted)[own] > tolerance * tolerance)
            gain[rows] = around(trusted / n[seen])[own]

        self.work.map(judge, chunks(self.height, BAND))
        begun = (n & (n - 1)) != 0
        known = gain[unfinished]
        least = NEARLY * known.mean() if known.size > FEW * gain.size else 0.0
        return np.asarray(unfinished & (begun | (gain >= least)))

    def receive(self, pixels: np.ndarray, add: Callable[[Any], None]) -> None:
        places = places_of(pixels, self.width)
        before = self.sums[places]
        try:
            add(self.sums)
        except BaseException:
            self.sums[places] = before
            raise
        if self._squares is not None:
            self._squares[places] = squared_errors(self.sums[places])
        self.passes += 1

    def anew(self, coarse: int) -> HostAccumulator:
        return self.empty(self.width, self.height, self.sums.dtype, coarse, self.work)

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
                sums = _small(stored, "sums", like.sums.nbytes)
                found = cls(width, height, sums, passes, coarse, like.work)
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


@lru_cache(maxsize=4)
def ordered_places(width: int, height: int) -> np.ndarray:
    """Where in a picture the pixels of `ordered` are. Read-only."""
    places = places_of(ordered(width, height), width)
    places.setflags(write=False)
    return places


def places_of(pixels: np.ndarray, width: int) -> np.ndarray:
    """Where in a picture, row by row, pixels ``y << 16 | x`` are."""
    return np.asarray((pixels >> 16).astype(np.intp) * width + (pixels & 65535))


def squared_errors(sums: np.ndarray) -> np.ndarray:
    """The squared standard error of pixels' brightness, as shown: float64; infinite below 2 samples."""
    n = sums[:, 5].astype(np.float64)
    mean = sums[:, 3] / np.maximum(n, 1)
    spread = np.maximum(sums[:, 4] / np.maximum(n, 1) - mean * mean, 0)
    return np.where(n < 2, np.inf, spread / np.maximum(n - 1, 1))


def around(values: np.ndarray) -> np.ndarray:
    """The largest of each pixel's value and its eight neighbours'."""
    rows = values.copy()
    np.maximum(rows[1:], values[:-1], out=rows[1:])
    np.maximum(rows[:-1], values[1:], out=rows[:-1])
    found = rows.copy()
    np.maximum(found[:, 1:], rows[:, :-1], out=found[:, 1:])
    np.maximum(found[:, :-1], rows[:, 1:], out=found[:, :-1])
    return found


def levels(shown: np.ndarray) -> np.ndarray:
    """sRGB in [0, 1] as uint8."""
    return np.asarray(shown * np.float32(255) + np.float32(0.5), np.uint8)
