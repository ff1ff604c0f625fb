"""Lengths that a kernel of the renderer follows from."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..formulas.registry import Node
from ..scene.view import Camera


@dataclass(frozen=True)
class Optics:
    """What the kernel has to know of lengths: the film's size in pixels, a pixel's half width at distance 1,
    the smallest distance that counts, how far there is anything."""

    size: tuple[int, int]
    cone: float
    least: float
    far: float


def optics(camera: Camera, size: tuple[int, int], root: Node, least: float) -> Optics:
    """The optics of a picture of this many pixels."""
    box = root.bounds.box
    corners = [c for c in box.corners if all(map(math.isfinite, c))]
    far = max([math.dist(camera.eye, c) for c in corners] + [4 * math.dist(camera.eye, camera.target)])
    far = far if box.finite else 25 * far
    return Optics(size, math.tan(math.radians(camera.fov) / 2) / size[1], least, far)
