"""Errors, tone curves and random numbers of pixels: the same functions for arrays, lanes and threads."""

from __future__ import annotations

from collections.abc import Sequence

from ...expr.vocabulary import exp, log, maximum, minimum, where

UNKNOWN = 1e30
"""Squared error of a pixel with fewer than two samples."""


def clamped(c):
    """Clamp light to [0, 1e4]; NaN becomes 0."""
    return minimum(maximum(where(c == c, c, 0.0), 0.0), 1e4)


def brightness(r, g, b):
    """Return the luminance of a colour as displayed, compressed to [0, 1)."""
    bright = 0.2126 * r + 0.7152 * g + 0.0722 * b
    return bright / (1.0 + bright)


def squared_error(bright, squares, n):
    """Return the squared standard error of a pixel's displayed brightness.

    `n`: samples of the pixel.
    """
    mean = bright / maximum(n, 1.0)
    spread = maximum(squares / maximum(n, 1.0) - mean * mean, 0.0)
    return where(n < 2.0, UNKNOWN, spread / maximum(n - 1.0, 1.0))


def filmic(c):
    """Filmic tone curve: contrast with soft shoulders (Narkowicz 2016, "ACES Filmic Tone Mapping Curve")."""
    a = c * 0.6
    return a * (2.51 * a + 0.03) / (a * (2.43 * a + 0.59) + 0.14)


def reinhard(r, g, b):
    """Return the factor of a luminance tone curve with white at 4; hues are kept (Reinhard et al. 2002)."""
    y = 0.2126 * r + 0.7152 * g + 0.0722 * b
    return (1.0 + y * 0.0625) / (1.0 + y)


def encoded(c):
    """Encode linear light as sRGB (IEC 61966-2-1).

    `c`: clipped to [0, 1]. Returns sRGB in [0, 1].
    """
    a = minimum(maximum(c, 0.0), 1.0)
    power = exp(log(maximum(a, 1e-6)) * 0.4166666666666667)
    return where(a > 0.0031308, 1.055 * power - 0.055, a * 12.92)


def linear(colour: Sequence[float]) -> tuple[float, ...]:
    """Convert an sRGB colour to linear light (IEC 61966-2-1).

    `colour`: sRGB components in [0, 1].
    """
    return tuple(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour)


def reversed_bits(a):
    """Reverse the bits of a 32-bit integer."""
    a = ((a >> 1) & 0x55555555) | ((a & 0x55555555) << 1)
    a = ((a >> 2) & 0x33333333) | ((a & 0x33333333) << 2)
    a = ((a >> 4) & 0x0F0F0F0F) | ((a & 0x0F0F0F0F) << 4)
    a = ((a >> 8) & 0x00FF00FF) | ((a & 0x00FF00FF) << 8)
    return ((a >> 16) & 0x0000FFFF) | ((a & 0x0000FFFF) << 16)


def hashed(a):
    """Hash a 32-bit integer (Wellons 2018, lowbias32)."""
    a = ((a ^ (a >> 16)) * 0x7FEB352D) & 0xFFFFFFFF
    a = ((a ^ (a >> 15)) * 0x846CA68B) & 0xFFFFFFFF
    return a ^ (a >> 16)


def scrambled(a, seed):
    """Owen-scramble a 32-bit fraction; see `fracslice.rendering.accumulator`.

    `a`: bits reversed.
    """
    a = (a ^ (a * 0x3D20ADEA)) & 0xFFFFFFFF
    a = (a + seed) & 0xFFFFFFFF
    a = (a * ((seed >> 16) | 1)) & 0xFFFFFFFF
    a = (a ^ (a * 0x05526C56)) & 0xFFFFFFFF
    a = (a ^ (a * 0x53A22864)) & 0xFFFFFFFF
    return reversed_bits(a)


def seeded(pixel, dimension):
    """Return the seed of a pixel's dimension."""
    return hashed((pixel * 64 + (pixel >> 26) * 0x9E3779B9 + dimension) & 0xFFFFFFFF)


def sample(a, pixel, dimension):
    """Return one coordinate of a sequence point, scrambled for a pixel.

    Parameters
    ----------
    a : int
        Coordinate, bits reversed.
    pixel : int
        Pixel, ``y << 16 | x``.
    dimension : int
        Dimension of the coordinate.
    """
    return (scrambled(a & 0xFFFFFFFF, seeded(pixel, dimension)) >> 8) * 5.9604644775390625e-08


def centred(a, pixel, dimension):
    """Like `sample`, digitally shifted so that the first point of the sequence is 1/2, the pixel's centre.

    `a`: bits reversed.
    """
    seed = seeded(pixel, dimension)
    shifted = scrambled(a & 0xFFFFFFFF, seed) ^ scrambled(0, seed) ^ 0x80000000
    return (shifted >> 8) * 5.9604644775390625e-08
