"""Accumulators: per-pixel sums over samples of equal weight."""

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
"""Samples below which a pixel's variance estimate is not used."""
COARSE = 4
"""Default grid spacing of the first pass, pixels."""
NEARLY = 0.999
"""Safety factor: a mean times this does not exceed the largest value, despite rounding."""

BAND = 32
"""Rows of a picture per task."""
COARSEST, MOST_PASSES = 64, 1 << 24
"""Limits of a saved picture's grid spacing and passes."""
HEADER = 1 << 12
"""Maximum header size of an array in a file, bytes."""
NO_PICTURE = "expected a picture in the making, whole, as it was saved"

FEW = 1 / 256
"""Fraction of unfinished pixels up to which all of them are sampled: a pass has a fixed cost even for one
pixel."""


class Accumulator(Protocol):
    """Picture in progress, in host or device memory.

    Attributes
    ----------
    passes : int
        Completed passes.
    coarse : int
        Grid spacing of the first pass, pixels.
    """

    passes: int
    coarse: int

    def wanted(self, most: int, tolerance: float) -> tuple[Any, int]:
        """Select the pixels of the next pass.

        The first pass takes a grid, the second the other pixels. Later passes take all pixels with fewer than
        TRUSTED samples. A pixel with 2^k samples then gets as many again, up to `most`, if two conditions
        hold:

        - its error or a neighbour's is above the tolerance;
        - the samples reduce the error of the picture by at least the mean over all unfinished pixels.

        Samples thus go where the gain is largest (after Mitchell 1987, "Generating Antialiased Images at Low
        Sampling Densities"). A net of samples that was begun is completed.

        Parameters
        ----------
        most : int
            Maximum samples per pixel.
        tolerance : float
            Standard error of displayed brightness at which a pixel has converged.

        Returns
        -------
        pixels : array of int32
            Pixels for the tracer, ``y << 16 | x``.
        count : int
            Number of pixels to sample; 0 when the picture is complete.
        """

    def receive(self, pixels: Any, add: Callable[[Any], None]) -> None:
        """Run a pass and add its samples. If the pass raises, the sums stay unchanged.

        Parameters
        ----------
        pixels : array of int32
            Pixels of the pass.
        add : callable
            Called as ``add(sums)``; adds the samples.
        """

    def anew(self, coarse: int) -> Accumulator:
        """Return an empty accumulator of the same size; this one becomes invalid.

        Parameters
        ----------
        coarse : int
            Grid spacing of the first pass, pixels.

        Returns
        -------
        Accumulator
            The empty accumulator.
        """

    def statistics(self) -> tuple[float, float]:
        """Return the statistics of the picture.

        Returns
        -------
        samples : float
            Mean samples per pixel.
        error : float
            Root mean square of the pixels' standard errors, in displayed brightness; infinite below 2
            samples.
        """

    def shown(self, film: Film, mode: str) -> np.ndarray:
        """Develop the picture.

        Parameters
        ----------
        film : Film
            Exposure, bloom and tone curve.
        mode : str
            `Shading.mode`.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            sRGB.
        """

    def host(self) -> HostAccumulator:
        """Return the picture in host memory.

        Returns
        -------
        HostAccumulator
            The same samples.
        """


@dataclass(eq=False)
class HostAccumulator:
    """Picture in progress in host memory.

    Attributes
    ----------
    width, height : int
        Picture size, pixels.
    sums : ndarray, shape (height * width, 6)
        Sums in the kernel's float type; see `packets.CHANNELS`.
    passes : int
        Completed passes.
    coarse : int
        Grid spacing of the first pass, pixels.
    work : Work
        Threads.
    """

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
        """Create an accumulator without samples.

        Parameters
        ----------
        width, height : int
            Picture size, pixels.
        dtype : dtype
            Kernel float type.
        coarse : int
            Grid spacing of the first pass, pixels.
        work : Work, optional
            Threads; one by default.

        Returns
        -------
        HostAccumulator
            The empty accumulator.
        """
        sums = np.zeros((width * height, CHANNELS), dtype)
        return cls(width, height, sums, coarse=coarse, work=work or Work(1))

    @classmethod
    def of(cls, other: HostAccumulator) -> HostAccumulator:
        """Return the accumulator itself; counterpart of `CudaAccumulator.of`."""
        return other

    def host(self) -> HostAccumulator:
        """Return the accumulator itself."""
        return self

    @property
    def counts(self) -> np.ndarray:
        """Samples of each pixel, shape (height, width)."""
        return self.sums[:, 5].reshape(self.height, self.width)

    def mean(self) -> np.ndarray:
        """Return the mean of the samples.

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            Linear light; black for pixels without samples.
        """
        return self._spread(self._known())

    def shown(self, film: Film, mode: str) -> np.ndarray:
        """Develop the picture; see `Accumulator.shown`."""
        return self._spread(levels(develop(self._known(), film, mode)))

    def _known(self) -> np.ndarray:
        """Mean of the sampled pixels, float32: after the first pass its grid, later the whole picture."""
        step = self.coarse if self.passes == 1 else 1
        sums = self.sums.reshape(self.height, self.width, CHANNELS)[::step, ::step]
        return np.asarray(sums[..., :3] / np.maximum(sums[..., 5:], 1), np.float32)

    def _spread(self, known: np.ndarray) -> np.ndarray:
        """Expand the grid of the first pass to the whole picture."""
        if self.passes != 1:
            return known
        wide = known.repeat(self.coarse, 0).repeat(self.coarse, 1)
        return np.ascontiguousarray(wide[: self.height, : self.width])

    def statistics(self) -> tuple[float, float]:
        """Return the statistics of the picture; see `Accumulator.statistics`."""
        squares = self.squares() if self.passes > 2 else np.array([np.inf])
        finite = np.isfinite(squares)
        known = squares.ravel() if finite.all() else squares[finite]
        error = float(np.sqrt(known.mean())) if known.size else float("inf")
        return float(self.counts.mean(dtype=np.float64)), error

    def squares(self) -> np.ndarray:
        """Return the squared standard error of each pixel's displayed brightness.

        Returns
        -------
        ndarray of float64, shape (height, width)
            Infinite below 2 samples.
        """
        if self._squares is None:
            self._squares = squared_errors(self.sums)
        return self._squares.reshape(self.height, self.width)

    def wanted(self, most: int, tolerance: float) -> tuple[np.ndarray, int]:
        """Select the pixels of the next pass; see `Accumulator.wanted`."""
        first = first_passes(self.width, self.height, self.coarse)
        if self.passes < len(first):
            pixels = first[self.passes]
        else:
            order, places = ordered(self.width, self.height), ordered_places(self.width, self.height)
            pixels = order[self._pressing(most, tolerance).ravel().take(places)]
        return pixels, len(pixels)

    def _pressing(self, most: int, tolerance: float) -> np.ndarray:
        """Mask of the unfinished pixels that the next pass samples."""
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
        """Run a pass and add its samples; see `Accumulator.receive`."""
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
        """Return an empty accumulator of the same size.

        Parameters
        ----------
        coarse : int
            Grid spacing of the first pass, pixels.

        Returns
        -------
        HostAccumulator
            The empty accumulator.
        """
        return self.empty(self.width, self.height, self.sums.dtype, coarse, self.work)

    def save(self, file: BinaryIO, key: str) -> None:
        """Write the sums as an .npz file, from which rendering continues exactly.

        Parameters
        ----------
        file : BinaryIO
            Writable binary file.
        key : str
            Key of the picture; see `Renderer.key`.
        """
        shape = np.array([self.width, self.height, self.passes, self.coarse])
        np.savez(file, sums=self.sums, shape=shape, key=np.array(key))

    @classmethod
    def load(cls, path: str | Path, key: str, like: HostAccumulator) -> HostAccumulator:
        """Read a file written by `save`. Its contents are validated before native code sees them.

        Parameters
        ----------
        path : str or Path
            The file.
        key : str
            Expected key of the picture.
        like : HostAccumulator
            Picture of the expected size and float type.

        Returns
        -------
        HostAccumulator
            The saved picture.

        Raises
        ------
        RenderError
            If the file is missing, damaged or of another picture.
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
        """True if the picture is consistent and has the size and float type of another."""
        sums, n = self.sums, self.sums[..., -1]
        return (
            (self.width, self.height) == (like.width, like.height)
            and (sums.shape, sums.dtype, sums.flags.c_contiguous) == (like.sums.shape, like.sums.dtype, True)
            and 0 <= self.passes < MOST_PASSES
            and 1 <= self.coarse <= COARSEST
            and bool(((n >= 0) & (n <= self.passes) & (n == np.floor(n))).all())
        )


def _small(stored: NpzFile, name: str, most: int = 0) -> np.ndarray:
    """Load an array of at most `most` bytes from a file.

    A small file can expand to a large array.
    """
    assert stored.zip
    if stored.zip.getinfo(f"{name}.npy").file_size > most + HEADER:
        raise ValueError(name)
    return np.asarray(stored[name])


@lru_cache(maxsize=4)
def first_passes(width: int, height: int, coarse: int) -> tuple[np.ndarray, ...]:
    """Return the pixels of the passes until each has a sample: a grid, then the others, if any.

    Parameters
    ----------
    width, height : int
        Picture size, pixels.
    coarse : int
        Grid spacing, pixels.

    Returns
    -------
    tuple of ndarray of int32
        Pixels of each pass, in the order of `ordered`. Read-only.
    """
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
    """Return the picture indices of the pixels of `ordered`.

    Parameters
    ----------
    width, height : int
        Picture size, pixels.

    Returns
    -------
    ndarray of intp, shape (width * height,)
        Row-major indices. Read-only.
    """
    places = places_of(ordered(width, height), width)
    places.setflags(write=False)
    return places


def places_of(pixels: np.ndarray, width: int) -> np.ndarray:
    """Convert pixels to row-major indices of a picture.

    Parameters
    ----------
    pixels : ndarray of int32
        Pixels, ``y << 16 | x``.
    width : int
        Picture width, pixels.

    Returns
    -------
    ndarray of intp
        Row-major indices.
    """
    return np.asarray((pixels >> 16).astype(np.intp) * width + (pixels & 65535))


def squared_errors(sums: np.ndarray) -> np.ndarray:
    """Compute the squared standard error of pixels' displayed brightness.

    Parameters
    ----------
    sums : ndarray, shape (n, 6)
        Sums of the pixels.

    Returns
    -------
    ndarray of float64, shape (n,)
        Infinite below 2 samples.
    """
    n = sums[:, 5].astype(np.float64)
    mean = sums[:, 3] / np.maximum(n, 1)
    spread = np.maximum(sums[:, 4] / np.maximum(n, 1) - mean * mean, 0)
    return np.where(n < 2, np.inf, spread / np.maximum(n - 1, 1))


def around(values: np.ndarray) -> np.ndarray:
    """Return the maximum over each pixel and its eight neighbours.

    Parameters
    ----------
    values : ndarray, shape (height, width)
        One value per pixel.

    Returns
    -------
    ndarray, shape (height, width)
        The maxima.
    """
    rows = values.copy()
    np.maximum(rows[1:], values[:-1], out=rows[1:])
    np.maximum(rows[:-1], values[1:], out=rows[:-1])
    found = rows.copy()
    np.maximum(found[:, 1:], rows[:, :-1], out=found[:, 1:])
    np.maximum(found[:, :-1], rows[:, 1:], out=found[:, :-1])
    return found


def levels(shown: np.ndarray) -> np.ndarray:
    """Quantise sRGB in [0, 1] to uint8.

    Parameters
    ----------
    shown : ndarray of float32
        sRGB in [0, 1].

    Returns
    -------
    ndarray of uint8
        Levels of 256.
    """
    return np.asarray(shown * np.float32(255) + np.float32(0.5), np.uint8)
