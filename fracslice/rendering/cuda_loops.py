"""Loops of the accumulator in GPU memory: goals, errors and tones of pixels.

A holds the sums of the picture, CHANNELS per pixel. T holds partial sums, three per thread; thread b handles
every pixel whose index is b modulo the number of threads, so that the sums are deterministic. `n` is the
number of pixels, `width` that of the picture, pixels.
"""

from __future__ import annotations

from ..expr.loops import loop, shares
from ..expr.vocabulary import maximum, minimum
from .accumulator import CHANNELS, COUNT, COVER, GOAL
from .units.pixel import UNKNOWN, encoded, filmic, reinhard, squared_error


@loop("rn")
def empty(A, n):
    """Set n sums to zero."""
    for k in shares(n, 1):
        A[k] = 0.0


@loop("rrnnnn")
def grid(A, T, n, threads, width, step):
    """Set the goals of a grid of pixels, `step` apart, to one sample."""
    for b in shares(threads, 1):
        left = 0.0
        last = 0.0
        for k in range(b, n, threads):
            a = k * CHANNELS
            if k // width % step == 0 and k % width % step == 0:
                A[a + GOAL] = maximum(A[a + GOAL], 1.0)
            left += A[a + GOAL] - A[a + COUNT]
            last = maximum(last, A[a + GOAL])
        T[3 * b] = left
        T[3 * b + 1] = last


@loop("rrrnn")
def measure(A, E, T, n, threads):
    """Compute the squared standard error of each pixel.

    `E`: [n]; `T`: written: pixels with a known error.
    """
    for b in shares(threads, 1):
        total = 0.0
        known = 0.0
        samples = 0.0
        for k in range(b, n, threads):
            a = k * CHANNELS
            count = A[a + COUNT]
            E[k] = squared_error(A[a + 3], A[a + 4], count)
            samples += count
            if count >= 2.0:
                total += E[k]
                known += 1.0
        T[3 * b] = total
        T[3 * b + 1] = known
        T[3 * b + 2] = samples


@loop("rrrrnnnxxx")
def judge(A, E, G, T, n, threads, width, trusted, most, tolerance):
    """Compute the gain of one more sample in each pixel.

    `E`: [n]; `G`: [n], written: -1 for a finished pixel; `T`: written: largest gain of an unfinished pixel;
    `most`: maximum samples per pixel; `tolerance`: squared error at which a pixel has converged.
    """
    for b in shares(threads, 1):
        largest = 0.0
        height = n // width
        for k in range(b, n, threads):
            row = k // width
            column = k % width
            worst = 0.0
            gain = 0.0
            for y in range(max(row - 1, 0), min(row + 2, height)):
                for x in range(max(column - 1, 0), min(column + 2, width)):
                    near = y * width + x
                    count = A[near * CHANNELS + COUNT]
                    square = E[near] if count >= trusted else UNKNOWN
                    worst = maximum(worst, square)
                    gain = maximum(gain, square / count)
            G[k] = -1.0
            if A[k * CHANNELS + COUNT] < most and worst > tolerance:
                largest = maximum(largest, gain)
                G[k] = gain
        T[3 * b] = largest


@loop("rrrnnxx")
def choose(A, G, T, n, threads, most, least):
    """Set the goals of the pixels whose gain is at least `least`.

    `G`: [n]; `most`: maximum samples per pixel.
    """
    for b in shares(threads, 1):
        left = 0.0
        last = 0.0
        for k in range(b, n, threads):
            a = k * CHANNELS
            count = A[a + COUNT]
            goal = count
            if G[k] >= least:
                goal = 1.0
                while goal <= count:
                    goal = goal + goal
                goal = minimum(goal, most)
            A[a + GOAL] = goal
            left += goal - count
            last = maximum(last, goal)
        T[3 * b] = left
        T[3 * b + 1] = last


@loop("rbnnnxxxxn")
def show(A, out, n, width, coarse, exposure, red, green, blue, tone):
    """Develop the picture as `film.develop` does, without bloom.

    `out`: sRGB, [3 n]; `coarse`: grid spacing of the sampled pixels, each of which is repeated over its cell;
    `exposure`: factor on the light; `red`, `green`, `blue`: colour behind the picture, linear; `tone`: 0
    none, 1 filmic, 2 Reinhard.
    """
    for k in shares(n, 1):
        row = k // width
        column = k % width
        a = CHANNELS * ((row - row % coarse) * width + column - column % coarse)
        count = maximum(A[a + COUNT], 1.0)
        clear = 1.0 - A[a + COVER] / count
        r = exposure * maximum(A[a] / count - clear * red, 0.0)
        g = exposure * maximum(A[a + 1] / count - clear * green, 0.0)
        b = exposure * maximum(A[a + 2] / count - clear * blue, 0.0)
        if tone == 2:
            dim = reinhard(r, g, b)
            r, g, b = r * dim, g * dim, b * dim
        if tone == 1:
            r, g, b = filmic(r), filmic(g), filmic(b)
        out[3 * k] = level(encoded(r + clear * red))
        out[3 * k + 1] = level(encoded(g + clear * green))
        out[3 * k + 2] = level(encoded(b + clear * blue))


def level(c):
    """Quantise to 8 bits.

    `c`: clipped to [0, 1].
    """
    return int(minimum(maximum(c, 0.0), 1.0) * 255.0 + 0.5)


LOOPS = empty, grid, measure, judge, choose, show
