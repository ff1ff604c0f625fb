"""Intrinsics of the renderer's units and loops: functions of the scene, which the linker writes under these
names."""

from __future__ import annotations

from ...kernel.intrinsics import field, intrinsic

__all__ = ["GIVEN", "background", "camera_ray", "field", "span_box", "step_cone", "step_ray", "surface"]

GIVEN = frozenset({"field"})
"""What units may call before it is written."""


@intrinsic
def camera_ray(px, py, lens_u, lens_v, P):
    """The ray through a point of the film and one of the lens: origin and unit direction."""
    raise NotImplementedError


@intrinsic
def span_box(ox, oy, oz, dx, dy, dz, P):
    """Where a ray enters and leaves the scene's box."""
    raise NotImplementedError


@intrinsic
def step_ray(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """`march.advance` with the scene's numbers."""
    raise NotImplementedError


@intrinsic
def step_cone(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """`march.widen` with the scene's numbers."""
    raise NotImplementedError


@intrinsic
def surface(x, y, z, dx, dy, dz, t, path, steps, side, u, P):
    """The light from a point of the surface, and what goes on: shares, origin, direction and side; none where
    rays do not go on. u: random numbers.
    """
    raise NotImplementedError


@intrinsic
def background(dx, dy, dz, P):
    """The light where nothing is."""
    raise NotImplementedError
