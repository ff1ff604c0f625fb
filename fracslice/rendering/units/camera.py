"""Camera rays."""

from __future__ import annotations

from .lights import disc
from .normal import normalised


def pinhole(px, py, lens_u, lens_v, eye, corner, across, down):
    """Return the ray of a pinhole camera through a film position.

    Parameters
    ----------
    px, py : float
        Film position, pixels.
    lens_u, lens_v : float
        Random numbers in [0, 1) for the lens.
    eye : tuple of float
        Position of the camera.
    corner : tuple of float
        Direction to the film's upper left corner.
    across, down : tuple of float
        Change of direction per pixel, to the right and down.

    Returns
    -------
    ox, oy, oz, dx, dy, dz : float
        Origin and unit direction.
    """
    ex, ey, ez = eye
    cx, cy, cz = corner
    ax, ay, az = across
    bx, by, bz = down
    dx, dy, dz = normalised(cx + px * ax + py * bx, cy + px * ay + py * by, cz + px * az + py * bz)
    zero = 0.0 * px
    return ex + zero, ey + zero, ez + zero, dx, dy, dz


def lens(px, py, lens_u, lens_v, eye, corner, across, down, right, up, focus):
    """Return the ray of a thin-lens camera (Cook, Porter, Carpenter 1984, "Distributed Ray Tracing").

    The ray runs from a point of the lens to the intersection of the pinhole ray with the plane of focus.

    Parameters
    ----------
    px, py : float
        Film position, pixels.
    lens_u, lens_v : float
        Random numbers in [0, 1) for the lens.
    eye : tuple of float
        Position of the camera.
    corner : tuple of float
        Direction to the film's upper left corner.
    across, down : tuple of float
        Change of direction per pixel, to the right and down.
    right, up : tuple of float
        Half axes of the lens.
    focus : float
        Distance of the plane of focus.

    Returns
    -------
    ox, oy, oz, dx, dy, dz : float
        Origin and unit direction.
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
