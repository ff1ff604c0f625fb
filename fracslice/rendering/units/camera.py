"""Camera rays: origin and unit direction."""

from __future__ import annotations

from ...expr.vectors import disc, normalised
from ...expr.vocabulary import cos, maximum, minimum, sin, sqrt, where


def pinhole(px, py, lens_u, lens_v, eye, corner, across, down):
    """Return the ray of a pinhole camera through a film position.

    `across`, `down`: change of direction per pixel.
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

    `across`, `down`: change of direction per pixel.
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


def stereo_half(px, width):
    """Return the picture of two side by side that a film position is in, and the position in that picture.

    `width` in pixels.
    """
    second = where(px < width, -1.0, 1.0 + 0.0 * px)
    return second, px - maximum(second, 0.0) * width


def stereo(px, py, lens_u, lens_v, eye, corner, across, down, offset, half, focus):
    """Return the ray of one of two eyes: of the left one in the left half of the film.

    Both pictures agree at the distance `focus`: the axes are parallel and the films shifted.

    `half` in pixels.
    """
    ex, ey, ez = eye
    cx, cy, cz = corner
    ax, ay, az = across
    bx, by, bz = down
    rx, ry, rz = offset
    second, column = stereo_half(px, half)
    sx = second * rx
    sy = second * ry
    sz = second * rz
    fx = focus * (cx + column * ax + py * bx) - sx
    fy = focus * (cy + column * ay + py * by) - sy
    fz = focus * (cz + column * az + py * bz) - sz
    dx, dy, dz = normalised(fx, fy, fz)
    return ex + sx, ey + sy, ez + sz, dx, dy, dz


def orthographic(px, py, lens_u, lens_v, eye, corner, across, down, forward):
    """Return one of parallel rays.

    `across`, `down`: change of position per pixel.
    """
    cx, cy, cz = corner
    ax, ay, az = across
    bx, by, bz = down
    fx, fy, fz = forward
    ox = cx + px * ax + py * bx
    oy = cy + px * ay + py * by
    oz = cz + px * az + py * bz
    zero = 0.0 * px
    return ox, oy, oz, fx + zero, fy + zero, fz + zero


def fisheye(px, py, lens_u, lens_v, eye, right, up, forward, middle, pixel):
    """Return the ray of an equidistant fisheye: its angle grows evenly from the middle of the film.

    `middle` in pixels; `pixel`: angle of a pixel, radians.
    """
    ex, ey, ez = eye
    rx, ry, rz = right
    ux, uy, uz = up
    fx, fy, fz = forward
    mx, my = middle
    a = pixel * (px - mx)
    b = pixel * (my - py)
    angle = maximum(sqrt(a * a + b * b), 1e-12)
    turned = minimum(angle, 3.141592653589793)
    along = cos(turned)
    aside = sin(turned) / angle
    a = a * aside
    b = b * aside
    dx, dy, dz = normalised(
        along * fx + a * rx + b * ux, along * fy + a * ry + b * uy, along * fz + a * rz + b * uz
    )
    zero = 0.0 * px
    return ex + zero, ey + zero, ez + zero, dx, dy, dz


def equirectangular(px, py, lens_u, lens_v, eye, right, up, forward, width, height, radius):
    """Return the ray of a picture all around: longitude across, latitude down.

    With a radius, there is one such picture for each eye, side by side, and the eyes turn with the longitude
    (Peleg, Ben-Ezra and Pritch 2001, "Omnistereo: Panoramic Stereo Imaging").

    `width`, `height` in pixels.
    """
    ex, ey, ez = eye
    rx, ry, rz = right
    ux, uy, uz = up
    fx, fy, fz = forward
    second, column = stereo_half(px, width)
    longitude = 6.283185307179586 * (column / width - 0.5)
    latitude = 3.141592653589793 * (0.5 - py / height)
    c = cos(longitude)
    s = sin(longitude)
    level = cos(latitude)
    rise = sin(latitude)
    a = level * c
    b = level * s
    dx, dy, dz = normalised(
        a * fx + b * rx + rise * ux, a * fy + b * ry + rise * uy, a * fz + b * rz + rise * uz
    )
    offset = second * radius
    ox = ex + offset * (c * rx - s * fx)
    oy = ey + offset * (c * ry - s * fy)
    oz = ez + offset * (c * rz - s * fz)
    return ox, oy, oz, dx, dy, dz
