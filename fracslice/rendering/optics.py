"""Lengths that a render kernel depends on: film size, pixel footprint, hit tolerance, far distance."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..formulas.registry import Node
from ..scene.view import Camera


@dataclass(frozen=True)
class Optics:
    """Lengths of a render kernel.

    Attributes
    ----------
    size : tuple of int
        Film width and height, pixels.
    cone : float
        Half width of a pixel at distance 1.
    least : float
        Half width of a pixel at distance 0, scene units: half a pixel of parallel rays, or the rounding of
        positions.
    rounding : float
        Rounding error of positions, scene units.
    far : float
        Distance beyond which the scene is empty, scene units.
    origin : tuple of int
        Upper left pixel of the part of the film that is rendered.
    """

    size: tuple[int, int]
    cone: float
    least: float
    rounding: float
    far: float
    origin: tuple[int, int] = (0, 0)


def footprint(camera: Camera, size: tuple[int, int]) -> tuple[float, float]:
    """Return the width of a pixel as a function of the distance.

    Parameters
    ----------
    camera : Camera
        The camera.
    size : tuple of int
        Film width and height, pixels.

    Returns
    -------
    tuple of float
        Growth with the distance, and width at distance 0, scene units.
    """
    width, height = size
    tangent = 2 * math.tan(math.radians(min(camera.fov, 178.0)) / 2) / height
    if camera.kind == "orthographic":
        return 0.0, tangent * math.dist(camera.eye, camera.target)
    if camera.kind == "fisheye":
        return math.radians(camera.fov) / height, 0.0
    if camera.kind == "equirectangular":
        return math.pi / min(height, width / (4 if camera.stereo else 2)), 0.0
    return tangent, 0.0


ESTIMATE = 0.5
"""Lipschitz bound of rays, as part of the guaranteed one, for fractals with a potential."""


def ray_bound(root: Node) -> float:
    """Return the Lipschitz bound that rays step by.

    Half of the guaranteed bound of a fractal with a potential is for sets like a needle, by Koebe's theorem.
    Its field estimates the distance (`formulas.escape`), and rays step by that: a ray that steps too far
    comes to lie inside the solid and returns. No other field has such a half: not that of folds, of a hybrid
    with them, or of a fractal beside other shapes.

    Parameters
    ----------
    root : Node
        Root of the formula tree.
    """
    bounds = root.bounds
    return bounds.lipschitz * (ESTIMATE if bounds.exterior_only and root.escape_time_only else 1.0)


def optics(camera: Camera, size: tuple[int, int], root: Node, least: float) -> Optics:
    """Compute the optics of a picture.

    Parameters
    ----------
    camera : Camera
        The camera.
    size : tuple of int
        Film width and height, pixels.
    root : Node
        Root of the formula tree; its bounds limit the far distance.
    least : float
        Smallest hit tolerance, scene units.

    Returns
    -------
    Optics
        Lengths for the kernel.
    """
    box = root.bounds.box
    corners = [c for c in box.corners if all(map(math.isfinite, c))]
    far = max([math.dist(camera.eye, c) for c in corners] + [4 * math.dist(camera.eye, camera.target)])
    far = far if box.finite else 25 * far
    growth, base = footprint(camera, size)
    if base:  # parallel rays start at the whole film
        far += base * math.hypot(*size) / 2
    return Optics(size, growth / 2, max(least, base / 2), least, far + camera.stereo)
