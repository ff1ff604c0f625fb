"""Loops of the accumulator in host memory: statistics, goals, pixels of a pass.

Conventions:

- A holds the sums of the picture, CHANNELS per pixel. `first` and `rows` are a band of it.
- N, E and R hold samples, squared errors and their ratio on the band and a pixel around it, in rows of
  `stride` numbers: pixel (x, first + y) is at (x + 1, y + 1). G holds gains, width numbers a row.
- T receives sums over the band, added pixel by pixel, so that they do not depend on the number of lanes.
"""

from __future__ import annotations

from ..formulas.vocabulary import maximum, where
from ..kernel.loops import WIDTH, load, loop, store
from .accumulator import CHANNELS, COUNT, GOAL, TRUSTED
from .units.pixel import UNKNOWN, squared_error


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
