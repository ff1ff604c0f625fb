"""A picture in the making that stays on the GPU: only numbers of its statistics, and what is shown, leave
it."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import lru_cache
from typing import Any

import numpy as np

from ..formulas.field import Precision
from ..kernel.cuda import launched, load_loops, require
from ..kernel.linker import Linked
from ..scene.view import Film
from .accumulator import FEW, NEARLY, TRUSTED, HostAccumulator, first_passes
from .cpu import ordered

PARTS = 8192
"""Threads that sum over a picture, each over every 8192nd pixel, so that sums come out the same every
time."""
GONE = -1
"""As many passes as no picture has: the memory is another's."""
TONES = {"none": 0, "filmic": 1, "reinhard": 2}

LOOPS = """
@kernel
def clear(A):
    k = cuda.grid(1)
    if k < A.shape[0]:
        for c in range(A.shape[1]):
            A[k, c] = real(0)


@kernel
def measure(A, E, T):
    b = cuda.grid(1)
    if b < T.shape[0]:
        total, known, samples = real(0), real(0), real(0)
        k = b
        while k < E.size:
            n = A[k, 5]
            E[k] = real(1e30)
            samples += n
            if n >= real(2):
                mean = divide(A[k, 3], n)
                spread = maximum(divide(A[k, 4], n) - mean * mean, real(0))
                E[k] = divide(spread, n - real(1))
                total += E[k]
                known += real(1)
            k += T.shape[0]
        T[b, 0] = total
        T[b, 1] = known
        T[b, 2] = samples


@kernel
def judge(A, E, G, T, width, trusted, most, tolerance):
    b = cuda.grid(1)
    if b < T.shape[0]:
        total, unfinished = real(0), real(0)
        height = E.size // width
        k = b
        while k < E.size:
            row = k // width
            column = k - row * width
            worst, gain = real(0), real(0)
            for y in range(max(row - 1, 0), min(row + 2, height)):
                for x in range(max(column - 1, 0), min(column + 2, width)):
                    near = y * width + x
                    square = E[near] if A[near, 5] >= trusted else real(1e30)
                    worst = maximum(worst, square)
                    gain = maximum(gain, divide(square, A[near, 5]))
            n = whole(A[k, 5])
            G[k] = real(-1)
            if A[k, 5] < most and worst > tolerance:
                total += gain
                unfinished += real(1)
                G[k] = gain if n & (n - 1) == 0 else real(1e30)
            k += T.shape[0]
        T[b, 0] = total
        T[b, 1] = unfinished


@kernel
def choose(G, order, pixels, T, width, least):
    b = cuda.grid(1)
    if b < T.shape[0]:
        chosen = real(0)
        k = b
        while k < pixels.size:
            pixel = order[k]
            pixels[k] = -1
            if G[(pixel >> 16) * width + (pixel & 65535)] >= least:
                pixels[k] = pixel
                chosen += real(1)
            k += T.shape[0]
        T[b, 0] = chosen


@kernel
def show(A, out, width, coarse, exposure, tone):
    k = cuda.grid(1)
    if k < out.shape[0]:
        row = k // width
        column = k - row * width
        a = (row - row % coarse) * width + column - column % coarse
        scale = divide(exposure, maximum(A[a, 5], real(1)))
        r = A[a, 0] * scale
        g = A[a, 1] * scale
        b = A[a, 2] * scale
        if tone == 2:
            y = real(0.2126) * r + real(0.7152) * g + real(0.0722) * b
            dim = divide(real(1) + y * real(0.0625), real(1) + y)
            r, g, b = r * dim, g * dim, b * dim
        if tone == 1:
            r, g, b = filmic(r), filmic(g), filmic(b)
        if tone >= 0:
            r, g, b = encoded(r), encoded(g), encoded(b)
        out[k, 0] = level(r)
        out[k, 1] = level(g)
        out[k, 2] = level(b)


@device
def filmic(c):
    a = c * real(0.6)
    return divide(a * (real(2.51) * a + real(0.03)), a * (real(2.43) * a + real(0.59)) + real(0.14))


@device
def encoded(c):
    a = minimum(maximum(c, real(0)), real(1))
    if a <= real(0.0031308):
        return a * real(12.92)
    return real(1.055) * exp(log(a) * real(0.4166666666666667)) - real(0.055)


@device
def level(c):
    return whole(minimum(maximum(c, real(0)), real(1)) * real(255) + real(0.5))
"""
"""clear: no sample in any pixel. measure: the squared error of each pixel. judge: what a sample more in each
is worth, 1e30 if it must be, -1 if it need not. choose: the pixels that are worth as much. show: as
`film.develop` does, but for bloom."""


class CudaAccumulator:
    """The face of `HostAccumulator`, with arrays of the GPU. Raises `KernelError` if there is no GPU."""

    def __init__(self, start: HostAccumulator) -> None:
        cuda = self._cuda = require()
        self.width, self.height = start.width, start.height
        self.passes, self.coarse = start.passes, start.coarse
        self.dtype, pixels = start.sums.dtype, start.width * start.height
        precision: Precision = "float32" if self.dtype == np.float32 else "float64"
        self._loops = load_loops(Linked("", np.zeros(1)), precision, LOOPS)
        self.sums = cuda.to_device(start.sums)
        self._first_passes = lru_cache(maxsize=4)(self._sent)
        self._order = cuda.to_device(ordered(self.width, self.height))
        self._pixels = cuda.device_array(pixels, np.int32)
        self._squares, self._gains = (cuda.device_array(pixels, self.dtype) for _ in range(2))
        self._parts = cuda.device_array((min(PARTS, pixels), 3), self.dtype)
        self._shown = cuda.device_array((pixels, 3), np.uint8)

    @classmethod
    def of(cls, other: HostAccumulator) -> CudaAccumulator:
        return cls(other)

    def anew(self, coarse: int) -> CudaAccumulator:
        fresh = copy(self)
        fresh.passes, fresh.coarse, self.passes = 0, coarse, GONE
        launched(self._loops.clear, len(self.sums), self.sums)
        return fresh

    def host(self) -> HostAccumulator:
        return HostAccumulator(self.width, self.height, self.sums.copy_to_host(), self.passes, self.coarse)

    def _sent(self, coarse: int) -> list[Any]:
        return [self._cuda.to_device(pixels) for pixels in first_passes(self.width, self.height, coarse)]

    def _summed(self, loop: Any, *arguments: Any) -> np.ndarray:
        """Runs a loop over PARTS; returns the sums, float64 [3]."""
        launched(loop, len(self._parts), *arguments)
        total: np.ndarray = self._parts.copy_to_host().sum(0, dtype=np.float64)
        return total

    def statistics(self) -> tuple[float, float]:
        total, known, samples = self._summed(self._loops.measure, self.sums, self._squares, self._parts)
        return samples / (self.width * self.height), math.sqrt(total / known) if known else math.inf

    def wanted(self, most: int, tolerance: float) -> tuple[Any, int]:
        first = self._first_passes(self.coarse)
        if self.passes < len(first):
            return first[self.passes], first[self.passes].size
        self.statistics()
        real = self.dtype.type
        judged = (self.sums, self._squares, self._gains, self._parts, self.width)
        limits = (real(TRUSTED), real(most), real(tolerance * tolerance))
        total, unfinished, _ = self._summed(self._loops.judge, *judged, *limits)
        least = real(NEARLY * total / unfinished if unfinished > FEW * self.width * self.height else 0.0)
        chosen = (self._gains, self._order, self._pixels, self._parts, self.width, least)
        return self._pixels, int(self._summed(self._loops.choose, *chosen)[0])

    def receive(self, add: Callable[[Any], None]) -> None:
        add(self.sums)
        self.passes += 1

    def shown(self, film: Film, mode: str) -> np.ndarray:
        if film.bloom and mode == "light":
            return self.host().shown(film, mode)
        lit = mode == "light"
        tone, exposure = TONES[film.tone] if lit else -1, 2.0**film.exposure if lit else 1.0
        coarse = self.coarse if self.passes == 1 else 1
        given = (self.width, coarse, self.dtype.type(exposure), tone)
        launched(self._loops.show, len(self._shown), self.sums, self._shown, *given)
        return np.asarray(self._shown.copy_to_host().reshape(self.height, self.width, 3))
