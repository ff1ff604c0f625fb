"""Defaults of a view: camera, lights, depth and precision chosen for the scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import SceneError
from ..formulas.csg import intersection
from ..formulas.primitives import plane
from ..formulas.registry import Node
from ..kernel.cells import possible_cells
from ..kernel.depth import resolve_depths
from ..scene.view import Camera, Light, View
from .optics import Optics, footprint, optics

SUN = Light(kind="sun", position=(-0.6, -1.0, 1.4), colour=(1.0, 0.95, 0.86), strength=1.6, size=2.0)
SKY = Light(
    kind="sky", colour=(0.42, 0.58, 0.85), horizon=(0.82, 0.86, 0.92), ground=(0.35, 0.33, 0.31), strength=0.8
)
AT_CAMERA = Light(kind="camera")
CELLS = 1 << 13
"""Maximum cells in the search for the object's extent."""

DETAIL = 0.5
"""Finest detail, pixels."""
FINER = 4.0
"""Ratio of details in the search for the depth at which the eye is outside the solid."""
ROUNDING = {"float32": 2.0**-21, "float64": 2.0**-49}
"""Resolution of float positions, relative to the camera's coordinates: 4 ulp."""


@dataclass(frozen=True)
class RenderSetup:
    """Scene and view with all defaults resolved.

    Attributes
    ----------
    root : Node
        Tree with resolved depths.
    view : View
        View with lights.
    camera : Camera
        The camera.
    optics : Optics
        Lengths of the kernel.
    precision : str
        "float32" or "float64".
    """

    root: Node
    view: View
    camera: Camera
    optics: Optics
    precision: str


def prepare(root: Node, view: View, size: tuple[int, int]) -> RenderSetup:
    """Resolve the defaults of a view.

    Parameters
    ----------
    root : Node
        Root of the formula tree; depths may be "auto".
    view : View
        The view.
    size : tuple of int
        Picture width and height, pixels.

    Returns
    -------
    RenderSetup
        The resolved scene and view.

    Raises
    ------
    SceneError
        If the view is invalid: the eye is inside the solid, there are two skies, or an unbounded scene has no
        camera.
    """
    camera = view.camera or _whole(root, size[0] / size[1])
    lights = view.lights or default_lights(root)
    if sum(light.surrounds for light in lights) > 1:
        raise lights[-1].fail("kind: expected at most one sky or environment")
    growth, base = footprint(camera, size)
    near = surroundings(root, camera, growth) if growth else 0.0
    pixel, scale = growth * near + base, max(map(abs, camera.eye))
    precision = "float32" if pixel > 4 * ROUNDING["float32"] * scale else "float64"
    resolved, _ = _around_eye(root, camera, DETAIL * pixel)
    seen = optics(camera, size, root, ROUNDING[precision] * scale)
    return RenderSetup(resolved, replace(view, lights=lights), camera, seen, precision)


def clipped(root: Node, camera: Camera) -> Node:
    """Return what the clip plane of a camera leaves of a scene.

    Parameters
    ----------
    root : Node
        Root of the formula tree.
    camera : Camera
        The camera.

    Returns
    -------
    Node
        The tree itself without a clip plane.
    """
    if not camera.clip:
        return root
    towards = camera.forward
    place = sum(e * f for e, f in zip(camera.eye, towards, strict=True)) + camera.clip
    half = plane(normal=tuple(-f for f in towards), offset=-place)
    return intersection(root, half)


def default_lights(root: Node) -> tuple[Light, ...]:
    """Return the lights of a view without any.

    Parameters
    ----------
    root : Node
        Root of the formula tree.

    Returns
    -------
    tuple of Light
        A sun and a sky; a light at the camera if the scene has no end on any side, since it shadows both.
    """
    box = root.bounds.box
    return (SUN, SKY) if any(map(math.isfinite, box.lo + box.hi)) else (AT_CAMERA,)


def surroundings(root: Node, camera: Camera, pixel: float) -> float:
    """Return a lower bound of the distance from the eye to the surface, at the depth that is visible there.

    The distance depends on the depth, and the depth on the size of a pixel at that distance. The search
    starts at the target's distance and refines until a pixel at the surface is no smaller than the detail.

    Parameters
    ----------
    root : Node
        Root of the formula tree; depths may be "auto".
    camera : Camera
        The camera.
    pixel : float
        Size of a pixel at distance 1.

    Returns
    -------
    float
        Distance, scene units.

    Raises
    ------
    SceneError
        If the eye is inside the solid at every depth.
    """
    detail = pixel * math.dist(camera.eye, camera.target)
    known, near = _around_eye(root, camera, detail)
    while known is not root and pixel * near < detail:
        detail /= FINER
        known, near = _around_eye(root, camera, detail)
    return near


def _around_eye(root: Node, camera: Camera, detail: float) -> tuple[Node, float]:
    """Tree resolved for a detail, or the coarsest finer one outside of which the eye lies; its clearance."""
    finest = ROUNDING["float64"] * max(map(abs, camera.eye))
    while True:
        known = resolve_depths(root, detail)
        try:
            return known, clearance(known, camera)
        except SceneError:
            if known is root or detail < finest:
                raise
        detail /= FINER


def _whole(root: Node, aspect: float) -> Camera:
    """A camera whose view contains every cell that the solid may occupy."""
    box = root.bounds.box
    if not box.finite:
        raise SceneError("<camera> is missing: expected one in a scene without an end")
    known = resolve_depths(root, max(box.size) / CELLS ** (1 / 3)).conservative()
    kernel = known.kernel("cpu", "float64")
    cells, _, step = possible_cells(lambda p: kernel.points(*p), known.bounds.lipschitz, box, CELLS)
    if not cells.size:
        return Camera.around(box, aspect=aspect)
    corners = cells[:, :, None] + (np.indices((2, 2, 2)).reshape(3, 1, 8) - 0.5) * step[:, None, None]
    return Camera.around(box, corners.reshape(3, -1), aspect)


def clearance(root: Node, camera: Camera) -> float:
    """Return a lower bound of the distance from the eye to the surface.

    Parameters
    ----------
    root : Node
        Tree with resolved depths.
    camera : Camera
        The camera.

    Returns
    -------
    float
        Distance, scene units.

    Raises
    ------
    SceneError
        If the eye is inside the solid.
    """
    root = clipped(root, camera)
    f = float(root.kernel("cpu", "float64").points(*(np.array([c]) for c in camera.eye))[0])
    if not f > 0:
        raise camera.fail("eye: expected a place outside the solid")
    nearest = f / root.bounds.lipschitz
    box = root.bounds.box
    gaps = [max(a - e, e - b, 0.0) for a, e, b in zip(box.lo, camera.eye, box.hi, strict=True)]
    return max(nearest, math.hypot(*gaps))
