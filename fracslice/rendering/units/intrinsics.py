"""Intrinsics of the render units and loops, functions of the scene that the linker writes.

P: scene parameters. ox, oy, oz, dx, dy, dz: origin and unit direction of a ray. t: distance along the ray.
before, stride: radius of the previous empty ball, and step taken from its centre. side: -1 inside the solid.
path: length of the path before the ray.
"""

from __future__ import annotations

from ...kernel.intrinsics import field, intrinsic

__all__ = ["GIVEN", "background", "camera_ray", "field", "span_box", "step_cone", "step_ray", "surface"]

GIVEN = frozenset({"field"})
"""Intrinsics that units may call before the linker writes them."""


@intrinsic
def camera_ray(px, py, lens_u, lens_v, P):
    """Return the ray through a point of the film and a point of the lens.

    Returns
    -------
    ox, oy, oz, dx, dy, dz : float
        Origin and unit direction.
    """
    raise NotImplementedError


@intrinsic
def span_box(ox, oy, oz, dx, dy, dz, P):
    """Return the interval of a ray in the scene's box.

    Returns
    -------
    enter, leave : float
        Distances along the ray; enter >= leave for a miss.
    """
    raise NotImplementedError


@intrinsic
def step_ray(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a ray: `march.advance` with the scene's parameters.

    Returns
    -------
    t, before, stride, gap : float
        New state; gap is negative at a hit.
    """
    raise NotImplementedError


@intrinsic
def step_cone(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a cone: `march.widen` with the scene's parameters.

    Returns
    -------
    t, before, stride, gap : float
        New state; gap is negative at the end of the free part.
    """
    raise NotImplementedError


@intrinsic
def surface(x, y, z, dx, dy, dz, t, path, steps, side, u, P):
    """Shade a surface point.

    Parameters
    ----------
    x, y, z : float
        Surface point.
    steps : float
        Steps of the ray.
    u : tuple of float
        Random numbers in [0, 1).

    Returns
    -------
    light : tuple of float
        Light towards the ray's origin: red, green, blue.
    onward : tuple of float
        Continued ray: throughput (red, green, blue), origin, direction and side; empty if rays do not
        continue.
    """
    raise NotImplementedError


@intrinsic
def background(dx, dy, dz, P):
    """Return the light of a ray that misses the scene.

    Returns
    -------
    r, g, b : float
        Linear light.
    """
    raise NotImplementedError
