"""What a view leaves open, chosen for the scene: camera, lights, depth, precision."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import SceneError
from ..formulas.registry import Node
from ..kernel.depth import resolve_depths
from ..scene.view import Camera, Light, View
from .optics import Optics, optics

SUN = Light(kind="sun", position=(-0.6, -1.0, 1.4), colour=(1.0, 0.95, 0.86), strength=1.6, size=2.0)
SKY = Light(
    kind="sky", colour=(0.42, 0.58, 0.85), horizon=(0.82, 0.86, 0.92), ground=(0.35, 0.33, 0.31), strength=0.8
)
DETAIL = (4.0, 1.0, 0.5)
"""The finest detail of the first passes and all later ones, in pixels."""
ROUNDING = {"float32": 2.0**-21, "float64": 2.0**-49}
"""How much nearer than this, relative to the camera's coordinates, float positions cannot be told apart: 4
ulp."""


@dataclass(frozen=True)
class RenderSetup:
    """A scene with nothing left open. roots: with the depths of the first passes and, last, of all later
    ones."""

    roots: tuple[Node, ...]
    view: View
    camera: Camera
    optics: Optics
    precision: str

    def root(self, index: int) -> Node:
        """The tree for pass `index`."""
        return self.roots[min(index, len(self.roots) - 1)]


def prepare(root: Node, view: View, size: tuple[int, int]) -> RenderSetup:
    """Chooses what is open. Raises `SceneError` for a view that shows nothing: from inside the solid, say."""
    camera = view.camera or _whole(root)
    lights = view.lights or (SUN, SKY)
    if sum(light.kind == "sky" for light in lights) > 1:
        raise lights[-1].fail("kind: expected at most one sky")
    pixel = 2 * math.tan(math.radians(camera.fov) / 2) / size[1]
    near = clearance(resolve_depths(root, pixel * math.dist(camera.eye, camera.target)), camera)
    scale = max(map(abs, camera.eye))
    precision = "float32" if pixel * near > 4 * ROUNDING["float32"] * scale else "float64"
    roots = tuple(resolve_depths(root, detail * pixel * near) for detail in DETAIL)
    seen = optics(camera, size, root, ROUNDING[precision] * scale)
    return RenderSetup(roots, replace(view, lights=lights), camera, seen, precision)


def _whole(root: Node) -> Camera:
    if not root.bounds.box.finite:
        raise SceneError("<camera> is missing: expected one in a scene without an end")
    return Camera.around(root.bounds.box)


def clearance(root: Node, camera: Camera) -> float:
    """How far the surface is from the eye, at least, in scene units. root: with its depths.

    Raises `SceneError` from inside the solid.
    """
    f = float(root.kernel("cpu", "float64").points(*(np.array([c]) for c in camera.eye))[0])
    if not f > 0:
        raise camera.fail("eye: expected a place outside the solid")
    nearest = f / root.bounds.lipschitz
    box = root.bounds.box
    gaps = [max(a - e, e - b, 0.0) for a, e, b in zip(box.lo, camera.eye, box.hi, strict=True)]
    return max(nearest, math.hypot(*gaps))
