"""Layers of a picture for compositing: depth, normals, positions and colours without light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .progressive import Renderer

SAMPLES = {"depth": 1, "position": 1, "trap": 1, "normal": 16, "albedo": 16}
"""Samples per pixel of each layer. A mean of depths or positions across an edge would be of no surface."""
SINGLE = ("depth", "trap")
"""Layers of one channel."""


def layers(renderer: Renderer) -> dict[str, np.ndarray]:
    """Render the layers of a picture, from the same camera.

    Returns
    -------
    dict of str to ndarray of float32, shape (height, width, 3) or (height, width)
        Linear values by `Shading.mode`, and "samples", the samples per pixel. Depth is `film.NOWHERE` where
        no ray hits.
    """
    made = {mode: layer(renderer, mode) for mode in SAMPLES}
    made["samples"] = renderer.crop.within(renderer.accumulator.host().counts).astype(np.float32)
    return made


def layer(renderer: Renderer, mode: str) -> np.ndarray:
    """Render one layer of a picture, from the same camera.

    Parameters
    ----------
    renderer : Renderer
        Renderer of the picture.
    mode : str
        `Shading.mode`, one of `SAMPLES`.

    Returns
    -------
    ndarray of float32, shape (height, width, 3) or (height, width)
        Linear values.
    """
    setup, part, samples = renderer.setup, renderer.crop, SAMPLES[mode]
    camera = replace(setup.camera, aperture=0.0) if samples == 1 else setup.camera
    view = replace(setup.view, camera=camera, shading=replace(setup.view.shading, mode=mode))
    crop = part.left, part.top, part.width, part.height
    of = Renderer(setup.root, view, part.film, renderer.work, renderer.device, crop=crop)
    *_, last = of.passes(samples, tolerance=0.0)
    return last.image[..., 0] if mode in SINGLE else last.image
