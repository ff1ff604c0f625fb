"""CUDA kernels of the accumulator: statistics, pixel selection, development.

A holds the sums of the picture, shape (pixels, CHANNELS). T holds partial sums, one row per thread; thread b
handles every pixel whose index is b modulo the number of rows, so that the sums are deterministic.
"""

from __future__ import annotations

from ..formulas.vocabulary import exp, log, maximum, minimum
from ..kernel.cuda_stubs import device, divide, kernel, real, thread, whole


@kernel
def clear(A):
    """Set the sums of all pixels to zero.

    Parameters
    ----------
    A : array of real, shape (pixels, CHANNELS)
        Sums of the picture, written.
    """
    k = thread()
    if k < A.shape[0]:
        for c in range(A.shape[1]):
            A[k, c] = real(0)


@kernel
def measure(A, E, T):
    """Compute the squared standard error of each pixel.

    Parameters
    ----------
    A : array of real, shape (pixels, CHANNELS)
        Sums of the picture.
    E : array of real, shape (pixels,)
        Squared errors, written; 1e30 below 2 samples.
    T : array of real, shape (threads, 3)
        Partial sums, written: squared error, pixels with a known error, samples.
    """
    b = thread()
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
    """Compute the gain of one more sample in each pixel.

    Parameters
    ----------
    A : array of real, shape (pixels, CHANNELS)
        Sums of the picture.
    E : array of real, shape (pixels,)
        Squared errors.
    G : array of real, shape (pixels,)
        Gains, written: 1e30 for a pixel that must be sampled, -1 for a finished one.
    T : array of real, shape (threads, 3)
        Partial sums, written: gain, unfinished pixels.
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
    """Select the pixels whose gain is at least `least`.

    Parameters
    ----------
    G : array of real, shape (pixels,)
        Gains.
    order : array of int32, shape (pixels,)
        All pixels, ``y << 16 | x``, in tile order.
    pixels : array of int32, shape (pixels,)
        Selection, written: the pixel, or -1.
    T : array of real, shape (threads, 3)
        Partial sums, written: selected pixels.
    width : int
        Picture width, pixels.
    least : real
        Smallest gain.
    """
    b = thread()
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
    """Develop the picture as `film.develop` does, without bloom.

    Parameters
    ----------
    A : array of real, shape (pixels, CHANNELS)
        Sums of the picture.
    out : array of uint8, shape (pixels, 3)
        sRGB, written.
    width : int
        Picture width, pixels.
    coarse : int
        Grid spacing of the sampled pixels; each is repeated over its cell.
    exposure : real
        Factor on the light.
    tone : int
        Tone curve: 0 none, 1 filmic, 2 Reinhard; below 0, no sRGB encoding.
    """
    k = thread()
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
    """Filmic tone curve of `film.filmic`.

    Parameters
    ----------
    c : real
        Linear light.

    Returns
    -------
    real
        Tone-mapped light.
    """
    a = c * real(0.6)
    return divide(a * (real(2.51) * a + real(0.03)), a * (real(2.43) * a + real(0.59)) + real(0.14))


@device
def encoded(c):
    """sRGB encoding of `film.encode`.

    Parameters
    ----------
    c : real
        Linear light.

    Returns
    -------
    real
        sRGB in [0, 1].
    """
    a = minimum(maximum(c, real(0)), real(1))
    if a <= real(0.0031308):
        return a * real(12.92)
    return real(1.055) * exp(log(a) * real(0.4166666666666667)) - real(0.055)


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


LOOPS = clear, measure, judge, choose, show
