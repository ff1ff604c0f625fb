"""CUDA kernels of the accumulator: statistics, goals, development.

A holds the sums of the picture, CHANNELS per pixel. T holds partial sums, one row per thread; thread b
handles every pixel whose index is b modulo the number of rows, so that the sums are deterministic.
"""

from __future__ import annotations

from ..formulas.vocabulary import maximum, minimum
from ..kernel.cuda_stubs import device, divide, kernel, real, thread, whole
from .accumulator import CHANNELS, COUNT, COVER, GOAL
from .units.pixel import UNKNOWN, encoded, filmic, reinhard, squared_error


@kernel
def clear(A):
    """Set the sums of all pixels to zero.

    Parameters
    ----------
    A : array of real
        Sums of the picture, written.
    """
    k = thread()
    if k < A.size:
        A[k] = real(0)


@kernel
def grid(A, T, width, step):
    """Set the goals of a grid of pixels to one sample.

    Parameters
    ----------
    A : array of real
        Sums of the picture; goals are written.
    T : array of real, shape (threads, 3)
        Partial sums, written: samples to take, largest goal.
    width : int
        Picture width, pixels.
    step : int
        Grid spacing, pixels.
    """
    b = thread()
    if b < T.shape[0]:
        left, last = real(0), real(0)
        k = b
        while k * CHANNELS < A.size:
            row = k // width
            column = k - row * width
            a = k * CHANNELS
            if row % step == 0 and column % step == 0:
                A[a + GOAL] = maximum(A[a + GOAL], real(1))
            left += A[a + GOAL] - A[a + COUNT]
            last = maximum(last, A[a + GOAL])
            k += T.shape[0]
        T[b, 0] = left
        T[b, 1] = last


@kernel
def measure(A, E, T):
    """Compute the squared standard error of each pixel.

    Parameters
    ----------
    A : array of real
        Sums of the picture.
    E : array of real, shape (pixels,)
        Squared errors, written; `UNKNOWN` below 2 samples.
    T : array of real, shape (threads, 3)
        Partial sums, written: squared error, pixels with a known error, samples.
    """
    b = thread()
    if b < T.shape[0]:
        total, known, samples = real(0), real(0), real(0)
        k = b
        while k < E.size:
            a = k * CHANNELS
            n = A[a + COUNT]
            E[k] = squared_error(A[a + 3], A[a + 4], n)
            samples += n
            if n >= real(2):
                total += E[k]
                known += real(1)
            k += T.shape[0]
        T[b, 0] = total
        T[b, 1] = known
        T[b, 2] = samples


@kernel
def judge(A, E, G, T, width, trusted, most, tolerance):
    """Compute the gain of one more sample in each pixel.

    Parameters
    ----------
    A : array of real
        Sums of the picture.
    E : array of real, shape (pixels,)
        Squared errors.
    G : array of real, shape (pixels,)
        Gains, written: -1 for a finished pixel.
    T : array of real, shape (threads, 3)
        Partial results, written: largest gain of an unfinished pixel.
    width : int
        Picture width, pixels.
    trusted : real
        Samples below which an error counts as infinite.
    most : real
        Maximum samples per pixel.
    tolerance : real
        Squared error at which a pixel has converged.
    """
    b = thread()
    if b < T.shape[0]:
        largest = real(0)
        height = E.size // width
        k = b
        while k < E.size:
            row = k // width
            column = k - row * width
            worst, gain = real(0), real(0)
            for y in range(max(row - 1, 0), min(row + 2, height)):
                for x in range(max(column - 1, 0), min(column + 2, width)):
                    near = y * width + x
                    n = A[near * CHANNELS + COUNT]
                    square = E[near] if n >= trusted else real(UNKNOWN)
                    worst = maximum(worst, square)
                    gain = maximum(gain, divide(square, n))
            G[k] = real(-1)
            if A[k * CHANNELS + COUNT] < most and worst > tolerance:
                largest = maximum(largest, gain)
                G[k] = gain
            k += T.shape[0]
        T[b, 0] = largest


@kernel
def choose(A, G, T, most, least):
    """Set the goals of the pixels whose gain is at least `least`.

    Parameters
    ----------
    A : array of real
        Sums of the picture; goals are written.
    G : array of real, shape (pixels,)
        Gains.
    T : array of real, shape (threads, 3)
        Partial sums, written: samples to take, largest goal.
    most : real
        Maximum samples per pixel.
    least : real
        Smallest gain.
    """
    b = thread()
    if b < T.shape[0]:
        left, last = real(0), real(0)
        k = b
        while k < G.size:
            a = k * CHANNELS
            n = A[a + COUNT]
            goal = n
            if G[k] >= least:
                goal = real(1)
                while goal <= n:
                    goal = goal + goal
                goal = minimum(goal, most)
            A[a + GOAL] = goal
            left += goal - n
            last = maximum(last, goal)
            k += T.shape[0]
        T[b, 0] = left
        T[b, 1] = last


@kernel
def show(A, out, width, coarse, exposure, red, green, blue, tone):
    """Develop the picture as `film.develop` does, without bloom.

    Parameters
    ----------
    A : array of real
        Sums of the picture.
    out : array of uint8, shape (pixels, 3)
        sRGB, written.
    width : int
        Picture width, pixels.
    coarse : int
        Grid spacing of the sampled pixels; each is repeated over its cell.
    exposure : real
        Factor on the light.
    red, green, blue : real
        Display colour behind the picture, linear.
    tone : int
        Tone curve: 0 none, 1 filmic, 2 Reinhard.
    """
    k = thread()
    if k < out.shape[0]:
        row = k // width
        column = k - row * width
        a = CHANNELS * ((row - row % coarse) * width + column - column % coarse)
        n = maximum(A[a + COUNT], real(1))
        clear = real(1) - divide(A[a + COVER], n)
        r = exposure * maximum(divide(A[a], n) - clear * red, real(0))
        g = exposure * maximum(divide(A[a + 1], n) - clear * green, real(0))
        b = exposure * maximum(divide(A[a + 2], n) - clear * blue, real(0))
        if tone == 2:
            dim = reinhard(r, g, b)
            r, g, b = r * dim, g * dim, b * dim
        if tone == 1:
            r, g, b = filmic(r), filmic(g), filmic(b)
        out[k, 0] = level(encoded(r + clear * red))
        out[k, 1] = level(encoded(g + clear * green))
        out[k, 2] = level(encoded(b + clear * blue))


@device
def level(c):
    """Quantise to 8 bits.

    Parameters
    ----------
    c : real
        Value, clipped to [0, 1].

    Returns
    -------
    int
        Level of 256.
    """
    return whole(minimum(maximum(c, real(0)), real(1)) * real(255) + real(0.5))


LOOPS = clear, grid, measure, judge, choose, show
