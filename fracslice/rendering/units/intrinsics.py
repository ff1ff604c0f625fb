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
    """Evaluate the field of the opaque parts of the scene."""
    raise NotImplementedError


@intrinsic
def transparent(x, y, z, P):
    """Evaluate the field of the transparent parts of the scene.

    Returns
    -------
    f, r, g, b, kept : float
        Field value, absorption of red, green and blue per scene unit, and the fraction of the light that
        passes the surface.
    """
    raise NotImplementedError


@intrinsic
def camera_ray(px, py, lens_u, lens_v, P):
    """Return the ray through a point of the film and a point of the lens."""
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

    Parameters
    ----------
    path : float
        Half width of the cone at distance 1.

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
    last : float
        1 if the ray is not continued, else 0.
    u : tuple of float
        Random numbers in [0, 1).

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
    q : float
        Density of the direction; see `units.weights`.
    """
    raise NotImplementedError
