"""From a point of the film to a ray."""

from __future__ import annotations

from .lights import disc
from .normal import normalised


def pinhole(px, py, lens_u, lens_v, eye, corner, across, down):
    """The ray through pixel position (px, py) of an ideal camera: everything is sharp."""
    ex, ey, ez = eye
    cx, cy, cz = corner
    ax, ay, az = across
    bx, by, bz = down
    dx, dy, dz = normalised(cx + px * ax + py * bx, cy + px * ay + py * by, cz + px * az + py * bz)
    zero = 0.0 * px
    return ex + zero, ey + zero, ez + zero, dx, dy, dz


def lens(px, py, lens_u, lens_v, eye, corner, across, down, right, up, focus):
    """The ray from a point of a thin lens to where the ideal camera's ray meets the plane of focus.

    Cook, Porter, Carpenter 1984, "Distributed Ray Tracing". right, up: the lens' half axes; focus: the
    plane's distance.
    """
    ex, ey, ez = eye
    cx, cy, cz = corner
    ax, ay, az = across
    bx, by, bz = down
    rx, ry, rz = right
    ux, uy, uz = up
    a, b = disc(lens_u, lens_v)
    sx = a * rx + b * ux
    sy = a * ry + b * uy
    sz = a * rz + b * uz
    fx = focus * (cx + px * ax + py * bx) - sx
    fy = focus * (cy + px * ay + py * by) - sy
    fz = focus * (cz + px * az + py * bz) - sz
    dx, dy, dz = normalised(fx, fy, fz)
    return ex + sx, ey + sy, ez + sz, dx, dy, dz
