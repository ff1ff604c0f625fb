"""Film development: bloom, tone mapping and sRGB encoding."""

from __future__ import annotations

import numpy as np

from ..scene.view import Film
from ..work import Work, chunks
from .units.pixel import encoded, filmic, reinhard

BRIGHT = 1.0
"""Bloom threshold, linear light."""
BAND = 32
"""Rows of a picture per task."""


def develop(image: np.ndarray, film: Film, mode: str = "light", work: Work | None = None) -> np.ndarray:
    """Convert linear light to display values.

    Parameters
    ----------
    image : ndarray of float32, shape (height, width, 3)
        Linear light.
    film : Film
        Exposure, bloom and tone curve.
    mode : str
        `Shading.mode`. Values of modes other than "light" are only clipped to [0, 1].
    work : Work, optional
        Threads; one by default.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        sRGB in [0, 1].
    """
    if mode != "light":
        return np.asarray(np.clip(image, 0, 1), np.float32)
    light, work = np.maximum(image, 0) * np.float32(2.0**film.exposure), work or Work(1)
    if film.bloom:
        light = bloomed(light, film.bloom, work)

    def displayed(rows: slice) -> None:
        part = light[rows]
        if film.tone == "filmic":
            part = filmic(part)
        elif film.tone == "reinhard":
            part = part * reinhard(*np.moveaxis(part, -1, 0))[..., None]
        light[rows] = encoded(part)

    work.map(displayed, chunks(len(light), BAND))
    return np.asarray(light, np.float32)


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


def bloomed(light: np.ndarray, part: float, work: Work) -> np.ndarray:
    """Add bloom to an image.

    Light above `BRIGHT` is spread by four Gaussians of standard deviation 1/256 to 1/32 of the picture's
    height (Spencer et al. 1995, "Physically-Based Glare Effects for Digital Images", as a sum of Gaussians).

    Parameters
    ----------
    light : ndarray of float32, shape (height, width, 3)
        Linear light.
    part : float
        Fraction of the bright light that is spread.
    work : Work
        Threads.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        Linear light.
    """
    from scipy.ndimage import gaussian_filter

    bright = np.maximum(light - BRIGHT, 0)
    spread = [(channel, light.shape[0] / d) for d in (256, 128, 64, 32) for channel in range(3)]
    halos = work.collect(lambda s: gaussian_filter(bright[..., s[0]], s[1], mode="constant"), spread)
    halo = sum(np.stack(halos[k : k + 3], -1) for k in range(0, len(halos), 3)) / (len(halos) // 3)
    return np.asarray(light + part * (halo - bright), np.float32)
