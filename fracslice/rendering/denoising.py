"""Removal of noise from a picture, guided by its colours without light and its normals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter

from ..common.messages import lacking
from .accumulator import COUNT, COVER, GOAL
from .crops import Crop
from .host_accumulator import HostAccumulator
from .progressive import Pass, Renderer, layer
from .units.pixel import UNKNOWN, squared_error

GUIDES = ("albedo", "normal")
REACH = 5
"""Half width of the window of non-local means, pixels."""
STRICT = 0.45
"""Factor on the standard deviation in the distance of two patches (Rousselle, Knaus and Zwicker 2012)."""
ALIKE = 0.1
"""Distance of colours or normals at which a pixel has a weight of 1/e."""


def advice() -> str:
    """Return what to install for Open Image Denoise."""
    return lacking("pyoidn", "by non-local means; Open Image Denoise, which leaves less noise, needs")


def guides(renderer: Renderer) -> list[np.ndarray]:
    """Render what guides `denoise`: colours without light and normals, float32 (height, width, 3) each."""
    return [layer(renderer, mode) for mode in GUIDES]


def denoise(renderer: Renderer, known: list[np.ndarray] | None = None) -> Pass:
    """Remove the noise of a renderer's picture, by Open Image Denoise or else by non-local means.

    `known`: the picture's `guides`, if they were made before.
    """
    done, host, cut = renderer.seen(), renderer.accumulator.host(), renderer.crop.within
    mean = done.mean
    albedo, normal = known or guides(renderer)
    light = np.ascontiguousarray(mean[..., :3])
    if not advice():
        import pyoidn

        clean = pyoidn.denoise(light, albedo=np.clip(albedo, 0, 1), normal=normal, hdr=True)
    else:
        bright, squares, n = np.moveaxis(cut(host.channels[..., 3 : COUNT + 1]), -1, 0).astype(np.float64)
        variance = squared_error(bright, squares, n)
        clean = non_local_means(light, np.where(variance < UNKNOWN, variance, 1.0), albedo, normal)
    picture = HostAccumulator.empty(renderer.width, renderer.height, np.dtype(np.float32), host.work)
    picture.passes = done.number
    picture.channels[..., :3] = np.maximum(clean, 0)
    picture.channels[..., (COUNT, GOAL)] = 1
    picture.channels[..., COVER] = mean[..., 3]
    return replace(done, source=picture, crop=Crop.of((renderer.width, renderer.height), None))


def non_local_means(
    light: np.ndarray, variance: np.ndarray, albedo: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Replace each pixel by a weighted mean of those around it whose surroundings look alike.

    Buades, Coll and Morel 2005, "A Non-Local Algorithm for Image Denoising", with the distance of patches of
    Rousselle, Knaus and Zwicker 2012, "Adaptive Rendering with Non-Local Means Filtering", which subtracts
    what noise explains. Other colours and normals are other surfaces.

    `light`: float32 (height, width, 3); `variance`: float (height, width); `albedo`, `normal`: float32
    (height, width, 3). Returns float32 (height, width, 3).
    """
    shown = light @ np.array((0.2126, 0.7152, 0.0722), np.float32)
    grey = shown / (1 + shown)
    guide = np.concatenate([albedo, normal], 2) / np.float32(ALIKE)
    noise = np.minimum(uniform_filter(variance.astype(np.float32), 3, mode="nearest"), 1)
    layers = [
        np.pad(a, [(REACH, REACH)] * 2 + [(0, 0)] * (a.ndim - 2), "edge") for a in (light, grey, noise, guide)
    ]
    height, width = grey.shape
    total, weights = np.zeros_like(light), np.zeros_like(grey)
    for down in range(2 * REACH + 1):
        for across in range(2 * REACH + 1):
            there = (slice(down, down + height), slice(across, across + width))
            colour, g, v, other = (a[there] for a in layers)
            distance = (grey - g) ** 2 - (noise + np.minimum(noise, v))
            patch = uniform_filter(distance / (1e-8 + STRICT * STRICT * (noise + v)), 3, mode="nearest")
            unlike = ((guide - other) ** 2).sum(2)
            weight = np.exp(-np.maximum(patch, 0) - unlike)
            total += weight[..., None] * colour
            weights += weight
    return np.asarray(total / weights[..., None], np.float32)
