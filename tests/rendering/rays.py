"""Rays and where they hit, without the renderer: the oracles of its tests."""

from __future__ import annotations

from itertools import product

import numpy as np

from fracslice.formulas import Node
from fracslice.rendering import Renderer
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.work import Work

LIGHT = (Light(shadows="no"),)


def distances(root: Node, camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """How far the renderer finds the surface along the rays through the pixels' middles, [height, width];
    NaN: nowhere."""
    view = View(camera=camera, lights=LIGHT, shading=Shading(mode="distance"))
    renderer = Renderer(root, view, size, Work(threads=1))
    *_, last = renderer.passes(samples=1)
    return np.where(last.alpha > 0, last.image[..., 0].astype(np.float64), np.nan)


def directions(camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """Unit directions of those rays, [height, width, 3]."""
    width, height = size
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    half = np.tan(np.radians(camera.fov) / 2) / height
    across, down = (2 * x - width) * half, (height - 2 * y) * half
    d = np.array(camera.forward) + across[..., None] * camera.right + down[..., None] * np.array(camera.above)
    return d / np.linalg.norm(d, axis=2, keepdims=True)


def hits_sphere(eye: np.ndarray, d: np.ndarray, radius: float) -> np.ndarray:
    b, c = d @ eye, eye @ eye - radius * radius
    with np.errstate(invalid="ignore"):
        return -b - np.sqrt(b * b - c)


def hits_torus(eye: np.ndarray, d: np.ndarray, radius: float, tube: float) -> np.ndarray:
    """The least positive root of the quartic of each ray."""
    result = np.full(d.shape[:2], np.nan)
    for place in np.ndindex(result.shape):
        v = d[place]
        a, b, c = v @ v, 2 * eye @ v, eye @ eye + radius**2 - tube**2
        quartic = np.polymul([a, b, c], [a, b, c]) - np.pad(
            4 * radius**2 * np.array([v[:2] @ v[:2], 2 * eye[:2] @ v[:2], eye[:2] @ eye[:2]]), (2, 0)
        )
        roots = np.roots(quartic)
        real = roots.real[(abs(roots.imag) < 1e-7) & (roots.real > 0)]
        if len(real):
            result[place] = real.min()
    return result


def hits_sponge(eye: np.ndarray, d: np.ndarray, level: int) -> np.ndarray:
    """The nearest entry into any of the 20^level cubes of a Menger sponge."""
    result = np.full(d.shape[:2], np.inf)
    for centre in sponge(level):
        half = 3.0**-level
        with np.errstate(divide="ignore"):
            a, b = (centre - half - eye) / d, (centre + half - eye) / d
        enter, leave = np.minimum(a, b).max(2), np.maximum(a, b).min(2)
        result = np.where((enter < leave) & (enter > 0), np.minimum(result, enter), result)
    return np.where(np.isfinite(result), result, np.nan)


def sponge(level: int) -> np.ndarray:
    """The centres of the cubes, [20^level, 3]."""
    kept = np.array([c for c in product((-1, 0, 1), repeat=3) if sum(map(abs, c)) >= 2], float)
    centres = np.zeros((1, 3))
    for k in range(level):
        centres = (centres[:, None] + kept * 2 / 3.0 ** (k + 1)).reshape(-1, 3)
    return centres
