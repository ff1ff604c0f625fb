"""Intrinsics of the render units and loops: functions of the scene that the linker writes."""

from __future__ import annotations

from ...kernel.intrinsics import field, gather, intrinsic

__all__ = [
    "GIVEN",
    "background",
    "blocker",
    "camera_ray",
    "field",
    "gather",
    "span_box",
    "step_cone",
    "step_ray",
    "surface",
    "transparent",
]

GIVEN = frozenset({"blocker", "field", "gather", "transparent"})
"""Intrinsics that units may call before the linker writes them."""


@intrinsic
def blocker(x, y, z, P):
    """Evaluate the field of the opaque parts of the scene.

    Parameters
    ----------
    x, y, z : float
        Coordinates, scene units.
    P : array of float
        Scene parameters.

    Returns
    -------
    float
        Field value.
    """
    raise NotImplementedError


@intrinsic
def transparent(x, y, z, P):
    """Evaluate the field of the transparent parts of the scene.

    Parameters
    ----------
    x, y, z : float
        Coordinates, scene units.
    P : array of float
        Scene parameters.

    Returns
    -------
    f, r, g, b, kept : float
        Field value, absorption of red, green and blue per scene unit, and the fraction of the light that
        passes the surface.
    """
    raise NotImplementedError


@intrinsic
def camera_ray(px, py, lens_u, lens_v, P):
    """Return the ray through a point of the film and a point of the lens.

    Parameters
    ----------
    px, py : float
        Film position, pixels.
    lens_u, lens_v : float
        Random numbers in [0, 1) for the lens.
    P : array of float
        Scene parameters.

    Returns
    -------
    ox, oy, oz, dx, dy, dz : float
        Origin and unit direction.
    """
    raise NotImplementedError


@intrinsic
def span_box(ox, oy, oz, dx, dy, dz, P):
    """Return the interval of a ray in the scene's box.

    Parameters
    ----------
    ox, oy, oz, dx, dy, dz : float
        Origin and unit direction of the ray.
    P : array of float
        Scene parameters.

    Returns
    -------
    enter, leave : float
        Distances along the ray; enter >= leave for a miss.
    """
    raise NotImplementedError


@intrinsic
def step_ray(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a ray: `march.advance` with the scene's parameters.

    Parameters
    ----------
    ox, oy, oz, dx, dy, dz : float
        Origin and unit direction of the ray.
    t, before, stride : float
        Distance along the ray, radius of the previous ball, step taken from its centre.
    side : float
        -1 inside the solid, 1 outside.
    path : float
        Length of the path before this ray.
    P : array of float
        Scene parameters.

    Returns
    -------
    t, before, stride, gap : float
        New state; gap is negative at a hit.
    """
    raise NotImplementedError


@intrinsic
def step_cone(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a cone: `march.widen` with the scene's parameters.

    Parameters
    ----------
    ox, oy, oz, dx, dy, dz : float
        Origin and unit direction of the ray.
    t, before, stride : float
        Distance along the ray, radius of the previous ball, step taken from its centre.
    side : float
        Unused.
    path : float
        Half width of the cone at distance 1.
    P : array of float
        Scene parameters.

    Returns
    -------
    t, before, stride, gap : float
        New state; gap is negative at the end of the free part.
    """
    raise NotImplementedError


@intrinsic
def surface(x, y, z, dx, dy, dz, t, path, steps, side, last, u, P):
    """Shade a surface point.

    Parameters
    ----------
    x, y, z : float
        Surface point.
    dx, dy, dz : float
        Unit direction of the ray.
    t : float
        Distance along the ray.
    path : float
        Length of the path before this ray.
    steps : float
        Steps of the ray.
    side : float
        -1 inside the solid, 1 outside.
    last : float
        1 if the ray is not continued, else 0.
    u : tuple of float
        Random numbers in [0, 1).
    P : array of float
        Scene parameters.

    Returns
    -------
    light : tuple of float
        Light towards the ray's origin: red, green, blue.
    onward : tuple of float
        Continued ray: throughput (red, green, blue), origin, direction, side and density; empty if rays do
        not continue.
    """
    raise NotImplementedError


@intrinsic
def background(dx, dy, dz, q, P):
    """Return the light of a ray that misses the scene.

    Parameters
    ----------
    dx, dy, dz : float
        Unit direction of the ray.
    q : float
        Density of the direction; see `units.weights`.
    P : array of float
        Scene parameters.

    Returns
    -------
    r, g, b : float
        Linear light.
    """
    raise NotImplementedError
