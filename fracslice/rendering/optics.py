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
        Smallest hit tolerance, scene units: the rounding error of positions.
    far : float
        Distance beyond which the scene is empty, scene units.
    origin : tuple of int
        Upper left pixel of the part of the film that is rendered.
    """

    size: tuple[int, int]
    cone: float
    least: float
    far: float
    origin: tuple[int, int] = (0, 0)


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
    return Optics(size, math.tan(math.radians(camera.fov) / 2) / size[1], least, far)
