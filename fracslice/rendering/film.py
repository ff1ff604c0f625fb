"""Film development: bloom, tone mapping and sRGB encoding."""

from __future__ import annotations

import numpy as np

from ..scene.view import Film, View
from ..work import Work, chunks
from .units.pixel import encoded, filmic, linear, reinhard

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
