"""Layers of a picture for compositing: depth, normals, positions and colours without light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .progressive import Renderer

SAMPLES = {"depth": 1, "position": 1, "normal": 16, "albedo": 16}
"""Samples per pixel of each layer. A mean of depths or positions across an edge would be of no surface."""


def layers(renderer: Renderer) -> dict[str, np.ndarray]:
    """Render the layers of a picture, from the same camera.

    Parameters
    ----------
    renderer : Renderer
        Renderer of the picture.

    Returns
    -------
    dict of str to ndarray of float32, shape (height, width, 3) or (height, width)
        Linear values by `Shading.mode`, and "samples", the samples per pixel. Depth is `film.NOWHERE` where
        no ray hits.
    """
    setup, x = renderer.setup, renderer.setup.optics
    made: dict[str, np.ndarray] = {}
    for mode, samples in SAMPLES.items():
        camera = replace(setup.camera, aperture=0.0) if samples == 1 else setup.camera
        shading = replace(setup.view.shading, mode=mode)
        view = replace(setup.view, camera=camera, shading=shading)
        crop = *x.origin, renderer.width, renderer.height
        of = Renderer(setup.root, view, x.size, renderer.work, renderer.device, crop=crop)
        *_, last = of.passes(samples, tolerance=0.0)
        made[mode] = last.image[..., 0] if mode == "depth" else last.image
    made["samples"] = renderer.accumulator.host().counts.astype(np.float32)
    return made
