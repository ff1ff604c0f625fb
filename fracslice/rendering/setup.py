"""Defaults of a view: camera, lights, depth and precision chosen for the scene; pixel footprint and hit
tolerance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import SceneError
from ..fields.box import possible_cells
from ..fields.depth import resolve_depths
from ..fields.registry import Node
from ..formulas.csg import intersection
from ..formulas.primitives import plane
from ..scene.view import Camera, Light, View


@dataclass(frozen=True)
class Optics:
    """Lengths of a render kernel."""

    size: tuple[int, int]  # film width and height, pixels
    cone: float  # half width of a pixel at distance 1
    # half width of a pixel at distance 0, scene units: half a pixel of parallel rays, or the rounding of
    # positions
    least: float
    rounding: float  # rounding error of positions, scene units
    far: float  # distance beyond which the scene is empty, scene units
    origin: tuple[int, int] = (0, 0)  # upper left pixel of the part of the film that is rendered


def footprint(camera: Camera, size: tuple[int, int]) -> tuple[float, float]:
    """Return the width of a pixel as a function of the distance.

    `size` in pixels. Returns a value in scene units.
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
    Its field estimates the distance (`fields.maps`), and rays step by that: a ray that steps too far
    comes to lie inside the solid and returns. No other field has such a half: not that of folds, of a hybrid
    with them, or of a fractal beside other shapes.
    """
    bounds = root.bounds
    return bounds.lipschitz * (ESTIMATE if bounds.exterior_only and root.escape_time_only else 1.0)


def optics(camera: Camera, size: tuple[int, int], root: Node, least: float) -> Optics:
    """Compute the optics of a picture.

    `size` in pixels; `least` in scene units.
    """
    box = root.bounds.box
    corners = [c for c in box.corners if all(map(math.isfinite, c))]
    far = max([math.dist(camera.eye, c) for c in corners] + [4 * math.dist(camera.eye, camera.target)])
    far = far if box.finite else 25 * far
    growth, base = footprint(camera, size)
    if base:  # parallel rays start at the whole film
        far += base * math.hypot(*size) / 2
    return Optics(size, growth / 2, max(least, base / 2), least, far + camera.stereo)


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
    """Scene and view with all defaults resolved."""

    root: Node  # tree with resolved depths
    view: View  # view with lights
    camera: Camera  # the camera
    optics: Optics  # lengths of the kernel
    precision: str  # "float32" or "float64"


def prepare(root: Node, view: View, size: tuple[int, int]) -> RenderSetup:
    """Resolve the defaults of a view.

    `size` in pixels.
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


def clip_scene(root: Node, camera: Camera) -> Node:
    """Return what the clip plane of a camera leaves of a scene."""
    if not camera.clip:
        return root
    towards = camera.forward
    place = sum(e * f for e, f in zip(camera.eye, towards, strict=True)) + camera.clip
    half = plane(normal=tuple(-f for f in towards), offset=-place)
    return intersection(root, half)


def default_lights(root: Node) -> tuple[Light, ...]:
    """Return the lights of a view without any."""
    box = root.bounds.box
    return (SUN, SKY) if any(map(math.isfinite, box.lo + box.hi)) else (AT_CAMERA,)


def surroundings(root: Node, camera: Camera, pixel: float) -> float:
    """Return a lower bound of the distance from the eye to the surface, at the depth that is visible there.

    The distance depends on the depth, and the depth on the size of a pixel at that distance. The search
    starts at the target's distance and refines until a pixel at the surface is no smaller than the detail.

    `pixel`: size of a pixel at distance 1. Returns a value in scene units.
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

    Returns a value in scene units.
    """
    root = clip_scene(root, camera)
    f = float(root.kernel("cpu", "float64").points(*(np.array([c]) for c in camera.eye))[0])
    if not f > 0:
        raise camera.fail("eye: expected a place outside the solid")
    nearest = f / root.bounds.lipschitz
    box = root.bounds.box
    gaps = [max(a - e, e - b, 0.0) for a, e, b in zip(box.lo, camera.eye, box.hi, strict=True)]
    return max(nearest, math.hypot(*gaps))
