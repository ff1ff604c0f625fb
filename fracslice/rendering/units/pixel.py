"""Errors and tone curves of pixels: the same functions for arrays, lanes and threads."""

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
