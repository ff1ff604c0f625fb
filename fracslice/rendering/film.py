"""Film development: bloom, tone mapping and sRGB encoding."""

from __future__ import annotations

import numpy as np

from ..scene.view import Film

BRIGHT = 1.0
"""Bloom threshold, linear light."""


def develop(image: np.ndarray, film: Film, mode: str = "light") -> np.ndarray:
    """Convert linear light to display values.

    Parameters
    ----------
    image : ndarray of float32, shape (height, width, 3)
        Linear light.
    film : Film
        Exposure, bloom and tone curve.
    mode : str
        `Shading.mode`. Values of modes other than "light" are only clipped to [0, 1].

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        sRGB in [0, 1].
    """
    if mode != "light":
        return np.asarray(np.clip(image, 0, 1), np.float32)
    light = np.maximum(image, 0) * np.float32(2.0**film.exposure)
    if film.bloom:
        light = bloomed(light, film.bloom)
    return encode(TONES[film.tone](light))


def bloomed(light: np.ndarray, part: float) -> np.ndarray:
    """Add bloom to an image.

    Light above `BRIGHT` is spread by four Gaussians of standard deviation 1/256 to 1/32 of the picture's
    height (Spencer et al. 1995, "Physically-Based Glare Effects for Digital Images", as a sum of Gaussians).

    Parameters
    ----------
    light : ndarray of float32, shape (height, width, 3)
        Linear light.
    part : float
        Fraction of the bright light that is spread.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        Linear light.
    """
    from scipy.ndimage import gaussian_filter

    bright = np.maximum(light - BRIGHT, 0)
    widths = [light.shape[0] / d for d in (256, 128, 64, 32)]
    halo = sum(gaussian_filter(bright, (w, w, 0), mode="constant") for w in widths) / len(widths)
    return np.asarray(light + part * (halo - bright), np.float32)


def filmic(light: np.ndarray) -> np.ndarray:
    """Filmic tone curve: contrast with soft shoulders (Narkowicz 2016, "ACES Filmic Tone Mapping Curve").

    Parameters
    ----------
    light : ndarray of float32, shape (height, width, 3)
        Linear light.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        Tone-mapped light.
    """
    a = light * np.float32(0.6)
    return np.asarray(a * (2.51 * a + 0.03) / (a * (2.43 * a + 0.59) + 0.14), np.float32)


def reinhard(light: np.ndarray) -> np.ndarray:
    """Luminance tone curve with white at 4; bright colours keep their hue (Reinhard et al. 2002).

    Parameters
    ----------
    light : ndarray of float32, shape (height, width, 3)
        Linear light.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        Tone-mapped light.
    """
    y = (light * np.array([0.2126, 0.7152, 0.0722], np.float32)).sum(-1)
    return np.asarray(light * ((1 + y / 16) / (1 + y))[..., None], np.float32)


def plain(light: np.ndarray) -> np.ndarray:
    """Identity tone curve; `encode` clips the result at white.

    Parameters
    ----------
    light : ndarray of float32, shape (height, width, 3)
        Linear light.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        The same array.
    """
    return light


TONES = {"filmic": filmic, "reinhard": reinhard, "none": plain}


def encode(light: np.ndarray) -> np.ndarray:
    """Encode linear light as sRGB (IEC 61966-2-1).

    Parameters
    ----------
    light : ndarray of float32, shape (height, width, 3)
        Linear light, clipped to [0, 1].

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        sRGB in [0, 1].
    """
    a = np.clip(light, 0, 1)
    return np.asarray(np.where(a <= 0.0031308, a * 12.92, 1.055 * a ** (1 / 2.4) - 0.055), np.float32)
