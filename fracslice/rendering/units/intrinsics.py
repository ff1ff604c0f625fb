"""Intrinsics of the render units and loops: functions of the scene that the linker writes."""

from __future__ import annotations

from ...expr.loops import field, gather, intrinsic

__all__ = [
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


@intrinsic
def blocker(x, y, z, P):
    """Evaluate the field of the opaque parts of the scene."""
    raise NotImplementedError


@intrinsic
def transparent(x, y, z, P):
    """Evaluate the field of the transparent parts of the scene.

    Returns f, r, g, b, kept green and blue per scene unit.
    """
    raise NotImplementedError


@intrinsic
def camera_ray(px, py, lens_u, lens_v, P):
    """Return the ray through a point of the film and a point of the lens."""
    raise NotImplementedError


@intrinsic
def span_box(ox, oy, oz, dx, dy, dz, P):
    """Return the interval of a ray in the scene's box."""
    raise NotImplementedError


@intrinsic
def step_ray(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a ray: `march.advance` with the scene's parameters."""
    raise NotImplementedError


@intrinsic
def step_cone(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a cone: `march.widen` with the scene's parameters."""
    raise NotImplementedError


@intrinsic
def surface(x, y, z, dx, dy, dz, t, path, steps, side, last, q, u, P):
    """Shade a surface point.

    `q`: density of the direction of the ray; `u`: random numbers in [0, 1).
    """
    raise NotImplementedError


@intrinsic
def background(dx, dy, dz, q, P):
    """Return the light of a ray that misses the scene.

    `q`: density of the direction.
    """
    raise NotImplementedError
