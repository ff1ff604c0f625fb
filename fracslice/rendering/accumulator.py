"""Accumulators: per-pixel sums over samples of equal weight, the goals of the pass under way, in tile
order, the sequence of the samples, and their development: bloom, tone mapping and sRGB encoding.

A digital (0, 16)-sequence in base 16 (Faure 1982, Niederreiter 1987): dimension d multiplies the digits of
the index by the powers of Pascal's matrix that belong to an element of GF(16). Each digit is read out as bits
in an order specific to its dimension. The orders make each pair of dimensions 2k and 2k + 1, which places a
sample on a pixel, a lens or a light, a (0, 2)-sequence in base 2 as well: every 2^m samples are stratified in
all elementary intervals (the idea is that of Ahmed, Pharr, Ostromoukhov and Huang's SZ sequences, 2025).
Sobol's sequence has this property in its first pair only; its fifth and sixth dimensions have twice the error
at 256 samples. Among the orders with this property, a greedy search chose those for which four dimensions, a
pair and an earlier one, form the best nets of 8 to 512 samples in base 2.

The hash-based scrambling is that of Laine and Karras 2011, "Stratified Sampling for Stochastic Transparency",
with the constants of Vegdahl 2021, "Owen Scrambling Based on Dithered Blue Noise Sampling". Burley 2020,
"Practical Hash-based Owen Scrambling", analyses its quality.
"""

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
from ..expr.graph import NOTHING
from ..expr.loops import WIDTH, load, loop, store
from ..expr.runtime import CompiledFunction, lane_count
from ..expr.vocabulary import maximum, where
from ..fields.cpu import load_functions
from ..scene.view import Film, View
from ..work import Work, chunks
from .units.camera import UNKNOWN, encoded, filmic, linear, reinhard, squared_error

BRIGHT = 1.0
"""Bloom threshold, linear light."""
BAND = 32
"""Rows of a picture per task."""
NOWHERE = 1e10
"""Depth and distance where no ray hits, as in Blender."""
LEAST = np.float32(1e-6)
"""Smallest divisor."""


def picture(mean: np.ndarray, mode: str = "light") -> np.ndarray:
    """Return linear light, or in another mode the mean value of the visible surface.

    Parameters
    ----------
    mean : ndarray of float32, shape (height, width, 4)
        Mean of the samples, and the fraction of them whose camera ray hit.
    mode : str
        `Shading.mode`.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        Where no ray hit, depth and distance are `NOWHERE` and other values are 0.
    """
    values, alpha = mean[..., :3], mean[..., 3:]
    if mode == "light":
        return np.ascontiguousarray(values)
    empty = NOWHERE if mode in ("depth", "distance") else 0.0
    return np.where(alpha > 0, values / np.maximum(alpha, LEAST), np.float32(empty))


def develop(mean: np.ndarray, view: View, work: Work | None = None) -> np.ndarray:
    """Convert the mean of the samples to display values.

    The film's background is a display colour: neither exposure nor the tone curve changes it.

    Parameters
    ----------
    mean : ndarray of float32, shape (height, width, 4)
        Mean of the samples, and the fraction of them whose camera ray hit.
    view : View
        The view, with its lights.
    work : Work, optional
        Threads; one by default.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        sRGB in [0, 1]; (height, width, 4) with unassociated alpha for a transparent film.
    """
    film, mode, work = view.film, view.shading.mode, work or Work(1)
    alpha, light = mean[..., 3:], mean[..., :3]
    if mode != "light":
        return over_background(display_values(picture(mean, mode), mode, alpha[..., 0] > 0), alpha, film)
    behind = np.array(linear(film.background if shows_background(view) else (0, 0, 0)), np.float32)
    exposure, bands = np.float32(2.0**film.exposure), chunks(len(mean), BAND)
    shown = np.empty(light.shape, np.float32)

    def exposed(rows: slice) -> None:
        part = light[rows] / np.maximum(alpha[rows], LEAST) if film.transparent else light[rows]
        shown[rows] = np.maximum(part - (1 - alpha[rows]) * behind, 0) * exposure

    work.map(exposed, bands)
    if film.bloom:
        shown = add_bloom(shown, film.bloom, work)

    def toned(rows: slice) -> None:
        part = shown[rows]
        if film.tone == "filmic":
            part = filmic(part)
        elif film.tone == "reinhard":
            part = part * reinhard(*np.moveaxis(part, -1, 0))[..., None]
        shown[rows] = encoded(part + (1 - alpha[rows]) * behind)

    work.map(toned, bands)
    return np.concatenate([shown, alpha], 2) if film.transparent else shown


def smoothed(mean: np.ndarray) -> np.ndarray:
    """Average the light of pixels of one sample with that of their neighbours, without those behind an edge.

    `mean`: float32 (height, width, 4), as of `develop`. Returns the same; pixels whose ray missed stay.
    """
    light, hit = mean[..., :3], (mean[..., 3:] > 0).astype(np.float32)
    sums, counts = _around(light * hit), _around(hit)
    near = np.where(hit > 0, sums / np.maximum(counts, 1), light)
    return np.concatenate([near, mean[..., 3:]], 2)


def _around(values: np.ndarray) -> np.ndarray:
    """Sums over the 3 x 3 pixels around each."""
    padded = np.pad(values, ((1, 1), (1, 1), (0, 0)))
    columns = padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]
    return np.asarray(columns[:-2] + columns[1:-1] + columns[2:])


def shows_background(view: View) -> bool:
    """Return whether rays that miss show the film's background."""
    lit = view.shading.mode == "light"
    return not (view.film.transparent or (lit and (view.fog or any(x.surrounds for x in view.lights))))


def display_values(values: np.ndarray, mode: str, hit: np.ndarray) -> np.ndarray:
    """Map the values of a mode other than "light" to display values.

    `values`: float32 (height, width, 3); `hit`: bool (height, width). Returns float32 (height, width, 3),
    sRGB in [0, 1].
    """
    if mode in ("depth", "distance"):
        values = values.min() / np.maximum(values, LEAST)
    elif mode == "normal":
        values = 0.5 + 0.5 * values
    elif mode == "steps":
        values = np.exp(-0.02 * values)
    elif mode == "position":
        seen = values[hit] if hit.any() else values.reshape(-1, 3)
        low, high = seen.min(0), seen.max(0)
        values = (values - low) / np.maximum(high - low, LEAST)
    else:
        values = encoded(values)
    return np.asarray(np.clip(values, 0, 1), np.float32)


def over_background(shown: np.ndarray, alpha: np.ndarray, film: Film) -> np.ndarray:
    """Place display values on the film's background.

    `shown`: float32 (height, width, 3), sRGB in [0, 1]; `alpha`: float32 (height, width, 1), fraction of
    each pixel that is covered. Returns float32 (height, width, 3), sRGB in [0, 1].
    """
    if film.transparent:
        return np.concatenate([shown, alpha], 2)
    return np.asarray(shown * alpha + (1 - alpha) * np.array(film.background, np.float32), np.float32)


def levels(shown: np.ndarray) -> np.ndarray:
    """Quantise sRGB in [0, 1] to uint8.

    `shown`: sRGB in [0, 1].
    """
    return np.asarray(shown * np.float32(255) + np.float32(0.5), np.uint8)


def add_bloom(light: np.ndarray, part: float, work: Work) -> np.ndarray:
    """Add bloom to an image.

    Light above `BRIGHT` is spread by four Gaussians of standard deviation 1/256 to 1/32 of the picture's
    height (Spencer et al. 1995, "Physically-Based Glare Effects for Digital Images", as a sum of Gaussians).

    `light`: float32 (height, width, 3). Returns float32 (height, width, 3).
    """
    from scipy.ndimage import gaussian_filter

    bright = np.maximum(light - BRIGHT, 0)
    spread = [(channel, light.shape[0] / d) for d in (256, 128, 64, 32) for channel in range(3)]
    halos = work.collect(lambda s: gaussian_filter(bright[..., s[0]], s[1], mode="constant"), spread)
    halo = sum(np.stack(halos[k : k + 3], -1) for k in range(0, len(halos), 3)) / (len(halos) // 3)
    return np.asarray(light + part * (halo - bright), np.float32)


CHANNELS = 8
"""Numbers per pixel: sums of red, green, blue, displayed brightness and its square, sample count, goal,
samples whose camera ray hit.
"""
COUNT, GOAL, COVER = 5, 6, 7
"""Channels of the sample count, of the count at the end of the pass under way, and of the hits."""

TRUSTED = 8
"""Samples below which a pixel's variance estimate is not used."""
COARSE = 4
"""Ratio of the grid spacings of the first passes."""
SOON = 1 << 16
"""Maximum samples of the first pass, so that a large picture shows something soon."""
FIRST, DECAY = 2.0**-10, 4.0
"""Least gain of the first pass that chooses pixels, and the ratio of the least gains of consecutive passes: a
net of twice as many samples has a quarter of the gain."""
UNIFORM = 3
"""Passes before it, after those over grids: nets of 2, 4 and `TRUSTED` samples."""


def grids(width: int, height: int) -> tuple[int, ...]:
    """Return the grid spacings of the first passes, which take one sample in each pixel of their grids.

    All in pixels; the last spacing is 1.
    """
    spacings = [1, COARSE]
    while width * height > SOON * spacings[-1] ** 2:
        spacings.append(spacings[-1] * COARSE)
    return tuple(reversed(spacings))


@dataclass(frozen=True)
class PassPlan:
    """Pixels of a pass."""

    pixels: Any  # pixels for the tracer, ``y << 16 | x``, in tile order
    samples: int  # samples to take; 0 when the picture is complete
    last: int  # largest goal of a pixel


def least_gain(passes: int) -> float:
    """Return the least reduction of the squared error for which a pass takes a sample."""
    return FIRST / DECAY ** (passes - UNIFORM)


def next_choice(passes: int, largest: float) -> int:
    """Return the number of passes after which the next one chooses a pixel.

    `largest`: largest gain of an unfinished pixel.
    """
    while least_gain(passes) > largest:
        passes += 1
    return passes


class Accumulator(Protocol):
    """Picture in progress, in host or device memory.

    Samples are added tile by tile, so that the sums are valid at any time. A pass that was interrupted
    continues where it stopped, since its goals are kept.

    Attributes
    ----------
    width, height : int
        Picture size, pixels.
    sums : array of real, shape (height * width * CHANNELS,)
        Sums of the picture.
    passes : int
        Completed passes.
    """

    width: int
    height: int
    sums: Any
    passes: int

    def plan(self, most: int, tolerance: float) -> PassPlan:
        """Set the goals of the next pass, or return the rest of an interrupted one.

        The first passes take one sample on finer and finer grids of pixels, see `grids`. Later passes double
        the samples of all pixels with fewer than TRUSTED. A pixel then gets as many samples again, up to
        `most`, if two conditions hold:

        - its error or a neighbour's is above the tolerance;
        - a sample reduces the squared error of the picture by at least `least_gain` of the pass.

        Samples thus go where the gain is largest (after Mitchell 1987, "Generating Antialiased Images at Low
        Sampling Densities"), and every pixel has a complete net of them. A pass depends on a pixel and its
        neighbours only, so that a part of a picture has the samples of the whole one. Passes that choose no
        pixel are counted and skipped.

        Parameters
        ----------
        most : int
            Maximum samples per pixel.
        tolerance : float
            Standard error of displayed brightness at which a pixel has converged.

        Returns
        -------
        Plan
            Pixels to sample.
        """

    def anew(self) -> Accumulator:
        """Return an empty accumulator of the same size; this one becomes invalid.

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

    def shown(self, view: View) -> np.ndarray:
        """Develop the picture.

        Parameters
        ----------
        view : View
            View of the picture.

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


@lru_cache(maxsize=4)
def band_order(width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels of a band in tile order, so that the pixels of a packet are neighbours.

    Pixels are ordered by blocks of 64 x 32 pixels; within a block, by tiles of 8 x 4.

    `width` in pixels. Returns pixels int32 (BAND * width,); places intp (BAND * width,).
    """
    y, x = np.divmod(np.arange(BAND * width, dtype=np.int32), np.int32(width))
    places = np.lexsort((x, y, x // 8, y // 4, x // 64))
    pixels = (y << 16 | x)[places]
    for array in (pixels, places):
        array.setflags(write=False)
    return pixels, places


def tile_order(width: int, height: int) -> np.ndarray:
    """Return all pixels of a picture in tile order.

    `width`, `height` in pixels. Returns int32 (width * height,).
    """
    order, _ = band_order(width)
    bands = [order + np.int32(rows.start << 16) for rows in chunks(height, BAND)]
    pixels = np.concatenate(bands)
    return pixels[pixels >> 16 < height]


@lru_cache
def _loops(dtype: np.dtype) -> dict[str, CompiledFunction]:
    """Compiled loops of a float type."""
    bits = dtype.itemsize * 8
    return load_functions(NOTHING, bits, lane_count(bits), LOOPS)


@dataclass(eq=False)
class HostAccumulator:
    """Picture in progress in host memory.

    Attributes
    ----------
    width, height : int
        Picture size, pixels.
    sums : ndarray, shape (height * width * CHANNELS,)
        Sums in the kernel's float type.
    passes : int
        Completed passes.
    work : Work
        Threads.
    """

    width: int
    height: int
    sums: np.ndarray
    passes: int = 0
    work: Work = field(default_factory=lambda: Work(1))

    @classmethod
    def empty(cls, width: int, height: int, dtype: np.dtype, work: Work | None = None) -> HostAccumulator:
        """Create an accumulator without samples.

        Parameters
        ----------
        width, height : int
            Picture size, pixels.
        dtype : dtype
            Kernel float type.
        work : Work, optional
            Threads; one by default.

        Returns
        -------
        HostAccumulator
            The empty accumulator.
        """
        sums = np.zeros(width * height * CHANNELS, dtype)
        return cls(width, height, sums, work=work or Work(1))

    def anew(self) -> HostAccumulator:
        """Return an empty accumulator of the same size; see `Accumulator.anew`."""
        return self.empty(self.width, self.height, self.sums.dtype, self.work)

    def host(self) -> HostAccumulator:
        """Return the accumulator itself; see `Accumulator.host`."""
        return self

    @property
    def channels(self) -> np.ndarray:
        """View of the sums, shape (height, width, CHANNELS)."""
        return self.sums.reshape(self.height, self.width, CHANNELS)

    @property
    def counts(self) -> np.ndarray:
        """Samples of each pixel, shape (height, width)."""
        return self.channels[..., COUNT]

    def mean(self) -> np.ndarray:
        """Return the mean of the samples.

        Returns
        -------
        ndarray of float32, shape (height, width, 4)
            Linear light, and the fraction of the samples whose camera ray hit; pixels without samples have
            the mean of the smallest block around them that has some.
        """
        return self._spread(self._known())

    def shown(self, view: View) -> np.ndarray:
        """Develop the picture; see `Accumulator.shown`."""
        return self._spread(levels(develop(self._known(), view, self.work)))

    def developed(self, view: View) -> np.ndarray:
        """Develop the picture to floats; see `film.develop`."""
        return self._spread(develop(self._known(), view, self.work))

    def _known(self) -> np.ndarray:
        """Mean of the pixels, float32: between passes over grids that of the finer grid's pixels."""
        spacings = grids(self.width, self.height)
        if 0 < self.passes < len(spacings):
            step, finer = spacings[self.passes - 1 : self.passes + 1]
            if not self.channels[: finer + 1 : finer, : finer + 1 : finer, GOAL].all():
                return self._means(step)
        return fill_gaps(self._means(1), self.counts > 0, self.work)

    def _means(self, step: int) -> np.ndarray:
        sums = self.channels[::step, ::step]
        means = np.empty((*sums.shape[:2], 4), np.float32)

        def divided(rows: slice) -> None:
            means[rows] = sums[rows][..., (0, 1, 2, COVER)] / np.maximum(sums[rows, :, COUNT, None], 1)

        self.work.map(divided, chunks(len(sums), BAND))
        return means

    def _spread(self, known: np.ndarray) -> np.ndarray:
        """Expand the pixels of a grid to the whole picture."""
        if known.shape[:2] == (self.height, self.width):
            return known
        step = grids(self.width, self.height)[self.passes - 1]
        wide = known.repeat(step, 0).repeat(step, 1)
        return np.ascontiguousarray(wide[: self.height, : self.width])

    def _banded(self, task: Callable[[int, int, np.ndarray], None]) -> np.ndarray:
        """Run a task on every band, given its first row and rows, and return the sums of each."""
        bands = chunks(self.height, BAND)
        sums = np.zeros((len(bands), 4), self.sums.dtype)

        def run(band: int) -> None:
            task(bands[band].start, bands[band].stop - bands[band].start, sums[band])

        self.work.map(run, range(len(bands)))
        return sums.astype(np.float64)

    def _measure(self, first: int, rows: int, result: np.ndarray) -> tuple[np.ndarray, int]:
        """Planes of `measure` of a band, and numbers per row; its sums go to `result`."""
        real = self.sums.dtype
        lanes, none = lane_count(8 * real.itemsize), np.zeros(1, real)
        stride = -(-self.width // lanes) * lanes + max(lanes, 2)
        planes = np.zeros((3, (rows + 2) * stride + lanes), real)
        numbers = first, rows, self.width, self.height, stride
        _loops(real)["measure"](none, self.sums, *planes, result, *numbers)
        return planes, stride

    def _totals(self) -> np.ndarray:
        """The sums of `measure` over the picture."""

        def measured(first: int, rows: int, result: np.ndarray) -> None:
            self._measure(first, rows, result)

        return np.asarray(self._banded(measured).sum(0))

    def statistics(self) -> tuple[float, float]:
        """Return the statistics of the picture; see `Accumulator.statistics`."""
        total, known, samples, _ = self._totals()
        return float(samples) / (self.width * self.height), float(np.sqrt(total / known)) if known else np.inf

    def plan(self, most: int, tolerance: float) -> PassPlan:
        """Set the goals of the next pass; see `Accumulator.plan`."""
        *_, left = self._totals()
        if left:
            return self._unfinished()
        if self.passes < len(spacings := grids(self.width, self.height)):
            step = spacings[self.passes]
            goals = self.channels[::step, ::step, GOAL]
            np.maximum(goals, 1, out=goals)
            if (plan := self._unfinished()).samples:
                return plan
        self._judge(most, tolerance)
        return self._unfinished()

    def _judge(self, most: int, tolerance: float) -> None:
        """Set the goals of the unfinished pixels with the largest gain."""
        loops, real, pixels = _loops(self.sums.dtype), self.sums.dtype, self.width * self.height
        limit, gains = np.array([tolerance * tolerance], real), np.empty(pixels, real)

        def judged(first: int, rows: int, result: np.ndarray) -> None:
            planes, stride = self._measure(first, rows, result)
            loops["judge"](limit, *planes, gains, result, first, rows, self.width, stride, most)

        def chosen(first: int, rows: int, _: np.ndarray) -> None:
            loops["choose"](least, self.sums, gains, first, rows, self.width, most)

        largest = float(self._banded(judged)[:, 0].max())
        if largest <= 0:
            return
        grid_passes = len(grids(self.width, self.height))
        self.passes = grid_passes + next_choice(self.passes - grid_passes, largest)
        least = np.array([least_gain(self.passes - grid_passes)], real)
        self._banded(chosen)

    def _unfinished(self) -> PassPlan:
        """Pixels that have not reached their goals."""
        unfinished, none = _loops(self.sums.dtype)["unfinished"], np.zeros(1, self.sums.dtype)
        order, _ = band_order(self.width)
        pixels = np.empty((-(-self.height // BAND), len(order)), np.int32)

        def listed(first: int, rows: int, result: np.ndarray) -> None:
            numbers = first, rows, self.width, len(order)
            left = np.empty((rows + 1) * self.width, self.sums.dtype)
            unfinished(none, self.sums, order, pixels[first // BAND], left, result, *numbers)

        sums = self._banded(listed)
        rows = [row[: int(n)] for row, n in zip(pixels, sums[:, 2], strict=True)]
        return PassPlan(np.concatenate(rows), int(sums[:, 0].sum()), int(sums[:, 1].max()))


def fill_gaps(mean: np.ndarray, known: np.ndarray, work: Work) -> np.ndarray:
    """Give each pixel without samples the mean of the smallest block around it that has some.

    `mean`: float32 (height, width, 4), mean of the samples of a pixel; `known`: bool (height, width), true
    for a pixel with samples. Returns float32 (height, width, 4).
    """
    if known.all() or not known.any():
        return mean
    count = _blocks(known.astype(np.float32))
    means = fill_gaps(_blocks(mean) / np.maximum(count, 1)[..., None], count > 0, work)

    def spread(rows: slice) -> None:
        part = means[rows.start // COARSE : -(-rows.stop // COARSE)].repeat(COARSE, 0).repeat(COARSE, 1)
        near = part[: rows.stop - rows.start, : mean.shape[1]]
        np.copyto(mean[rows], near, where=~known[rows, :, None])

    work.map(spread, chunks(len(mean), BAND))
    return mean


def _blocks(values: np.ndarray) -> np.ndarray:
    """Sums over blocks."""
    rows, columns = (np.arange(0, n, COARSE) for n in values.shape[:2])
    return np.asarray(np.add.reduceat(np.add.reduceat(values, columns, 1), rows, 0))


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


@loop("rrrrrrnnnnn")
def measure(P, A, N, E, R, T, first, rows, width, height, stride):
    """Compute the squared error of each pixel of a band and around it, and its ratio to the samples.

    `P`: unused; `A`: sums of the picture; `N`, `E`, `R`: zeros; `T`: pixels with a known error.
    """
    total = 0.0
    known = 0.0
    samples = 0.0
    left = 0.0
    for y in range(max(first - 1, 0), min(first + rows + 1, height)):
        own = 1.0 if y >= first and y < first + rows else 0.0
        begin = (y + 1 - first) * stride + 1
        for x in range(width):
            a = CHANNELS * (y * width + x)
            E[begin + x] = A[a + 3]
            R[begin + x] = A[a + 4]
            N[begin + x] = A[a + COUNT]
            left += own * (A[a + GOAL] - A[a + COUNT])
        for e in range(begin, begin + width, WIDTH):
            store(E, e, squared_error(load(E, e), load(R, e), load(N, e)))
        for e in range(begin, begin + width):
            samples += own * N[e]
            if N[e] >= 2.0:
                total += own * E[e]
                known += own
        for e in range(begin, begin + width, WIDTH):
            n = load(N, e)
            square = where(n > 0.0, where(n < TRUSTED, UNKNOWN, load(E, e)), 0.0)
            store(E, e, square)
            store(R, e, square / maximum(n, 1.0))
    T[0] = total
    T[1] = known
    T[2] = samples
    T[3] = left


@loop("rrrrrrnnnnn")
def judge(P, N, E, R, G, T, first, rows, width, stride, most):
    """Compute the gain of one more sample in each pixel of a band.

    `P`: squared error at which a pixel has converged; `N`, `E`, `R`: samples, squared errors, ratios; `G`:
    written: -1 for a finished pixel; `T`: written: largest gain; `first`, `rows`, `width`, `stride`, `most`:
    maximum samples per pixel.
    """
    largest = 0.0
    for y in range(rows):
        for x in range(0, width, WIDTH):
            e = y * stride + x
            worst = load(E, e)
            gain = load(R, e)
            for near in range(1, 9):
                worst = maximum(worst, load(E, e + near // 3 * stride + near % 3))
                gain = maximum(gain, load(R, e + near // 3 * stride + near % 3))
            store(R, e, where(worst > P[0], gain, -1.0))  # not needed any more
        for x in range(width):
            g = (first + y) * width + x
            G[g] = -1.0
            if N[(y + 1) * stride + x + 1] < most and R[y * stride + x] >= 0.0:
                G[g] = R[y * stride + x]
                largest = max(largest, G[g])
    T[0] = largest


@loop("rrrnnnn")
def choose(P, A, G, first, rows, width, most):
    """Set the goals of the pixels of a band: the next power of two if the gain is at least `P[0]`.

    `P`: smallest gain; `A`, `G`: sums of the picture, whose goals are written, and gains; `first`, `rows`,
    `width`, `most`: maximum samples per pixel.
    """
    for k in range(first * width, (first + rows) * width):
        n = A[CHANNELS * k + COUNT]
        goal = n
        if G[k] >= P[0]:
            goal = 1.0
            while goal <= n:
                goal = goal + goal
            goal = goal if goal < most else most
        A[CHANNELS * k + GOAL] = goal


@loop("rriirrnnnn")
def unfinished(P, A, order, pixels, L, T, first, rows, width, size):
    """List the pixels of a band that have not reached their goals.

    `P`, `A`: unused, and sums of the picture; `L`, `T`: written: samples to take in each pixel and a row of
    zeros.
    """
    total = 0.0
    most = 0.0
    for x in range(width):
        L[rows * width + x] = 0.0
    for k in range(rows * width):
        a = CHANNELS * (first * width + k)
        left = A[a + GOAL] - A[a + COUNT]
        L[k] = left
        total += left
        most = A[a + GOAL] if A[a + GOAL] > most else most
    kept = 0
    for k in range(size):
        y = min(order[k] >> 16, rows)
        if L[y * width + (order[k] & 65535)] > 0.0:
            pixels[kept] = order[k] + (first << 16)
            kept += 1
    T[0] = total
    T[1] = most
    T[2] = kept


LOOPS = measure, judge, choose, unfinished


_DIMENSIONS = (
    (0, (1, 2, 4, 8)), (1, (15, 5, 3, 1)), (6, (15, 5, 3, 1)), (7, (1, 2, 4, 8)),
    (8, (9, 2, 4, 1)), (9, (7, 10, 1, 2)), (14, (7, 10, 1, 2)), (15, (9, 2, 4, 1)),
    (10, (7, 9, 2, 1)), (11, (13, 6, 2, 1)), (12, (11, 6, 1, 2)), (13, (9, 7, 3, 1)),
    (2, (3, 5, 9, 1)), (3, (1, 14, 4, 2)), (4, (7, 9, 2, 1)), (5, (13, 6, 2, 1)),
)  # fmt: skip
"""Element of GF(16) of each dimension, and its bit masks: output bit k of a digit is the parity of the input
bits in mask k.
"""
DIMENSIONS = len(_DIMENSIONS)


@dataclass(frozen=True)
class SampleRange:
    """Part of the sequence that a picture takes."""

    first: int = 0  # index of the first point: pictures of other parts add up to one of more samples
    # number of a digital shift (a constant that is added to all points, without carry); 0 for none
    seed: int = 0

    def points(self, count: int, dimensions: int) -> np.ndarray:
        """Return the points of the part; see `points`.

        Returns int32 (count, dimensions), bit patterns of 32-bit fractions with their bits REVERSED.
        """
        drawn = points(count, dimensions, self.first)
        if not self.seed:
            return drawn
        shift = np.random.Philox(self.seed).random_raw(dimensions).astype(np.uint32)
        return drawn ^ shift.view(np.int32)


def points(count: int, dimensions: int, first: int = 0) -> np.ndarray:
    """Return consecutive points of the sequence.

    Returns int32 (count, dimensions), bit patterns of 32-bit fractions with their bits REVERSED.
    """
    index = np.arange(first, first + count, dtype=np.uint32)[:, None]
    result = np.zeros((count, DIMENSIONS), np.uint32)
    for bit in range(max(first + count - 1, 0).bit_length()):
        columns = np.array([_column(d, bit) for d in range(DIMENSIONS)], np.uint32)
        result ^= (index >> np.uint32(bit) & np.uint32(1)) * columns
    return np.ascontiguousarray(result[:, np.arange(dimensions) % DIMENSIONS]).view(np.int32)


@lru_cache(maxsize=32 * DIMENSIONS)
def _column(dimension: int, bit: int) -> int:
    """Column of the generator matrix of a dimension.

    It holds the bits that an index bit toggles, the first fractional bit lowest.
    """
    element, reads = _DIMENSIONS[dimension]
    place, value, column = bit // 4, 1 << bit % 4, 0
    for digit in range(place, -1, -1):
        if place & digit == digit:  # Pascal's matrix entry is odd (Lucas' theorem)
            column |= sum(((value & read).bit_count() & 1) << 4 * digit + k for k, read in enumerate(reads))
        value = _product(value, element)
    return column


def _product(a: int, b: int) -> int:
    """Product in GF(16), modulo x^4 + x + 1."""
    result = 0
    for bit in range(4):
        result ^= (a << bit) * (b >> bit & 1)
    for bit in (6, 5, 4):
        result ^= (0b10011 << bit - 4) * (result >> bit & 1)
    return result
