"""Camera rays, and errors, tone curves and random numbers of pixels: the same functions for arrays,
lanes and threads.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...expr.vocabulary import cos, disc, exp, log, maximum, minimum, normalised, sin, sqrt, where

UNKNOWN = 1e30
"""Squared error of a pixel with fewer than two samples."""


def clamped(c):
    """Clamp light to [0, 1e4]; NaN becomes 0."""
    return minimum(maximum(where(c == c, c, 0.0), 0.0), 1e4)


def brightness(r, g, b):
    """Return the luminance of a colour as displayed, compressed to [0, 1)."""
    bright = 0.2126 * r + 0.7152 * g + 0.0722 * b
    return bright / (1.0 + bright)


def squared_error(bright, squares, n):
    """Return the squared standard error of a pixel's displayed brightness.

    `n`: samples of the pixel.
    """
    mean = bright / maximum(n, 1.0)
    spread = maximum(squares / maximum(n, 1.0) - mean * mean, 0.0)
    return where(n < 2.0, UNKNOWN, spread / maximum(n - 1.0, 1.0))


def filmic(c):
    """Filmic tone curve: contrast with soft shoulders (Narkowicz 2016, "ACES Filmic Tone Mapping Curve")."""
    a = c * 0.6
    return a * (2.51 * a + 0.03) / (a * (2.43 * a + 0.59) + 0.14)


def reinhard(r, g, b):
    """Return the factor of a luminance tone curve with white at 4; hues are kept (Reinhard et al. 2002)."""
    y = 0.2126 * r + 0.7152 * g + 0.0722 * b
    return (1.0 + y * 0.0625) / (1.0 + y)


def encoded(c):
    """Encode linear light as sRGB (IEC 61966-2-1).

    `c`: clipped to [0, 1]. Returns sRGB in [0, 1].
    """
    a = minimum(maximum(c, 0.0), 1.0)
    power = exp(log(maximum(a, 1e-6)) * 0.4166666666666667)
    return where(a > 0.0031308, 1.055 * power - 0.055, a * 12.92)


def linear(colour: Sequence[float]) -> tuple[float, ...]:
    """Convert an sRGB colour to linear light (IEC 61966-2-1).

    `colour`: sRGB components in [0, 1].
    """
    return tuple(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour)


def reversed_bits(a):
    """Reverse the bits of a 32-bit integer."""
    a = ((a >> 1) & 0x55555555) | ((a & 0x55555555) << 1)
    a = ((a >> 2) & 0x33333333) | ((a & 0x33333333) << 2)
    a = ((a >> 4) & 0x0F0F0F0F) | ((a & 0x0F0F0F0F) << 4)
    a = ((a >> 8) & 0x00FF00FF) | ((a & 0x00FF00FF) << 8)
    return ((a >> 16) & 0x0000FFFF) | ((a & 0x0000FFFF) << 16)


def hashed(a):
    """Hash a 32-bit integer (Wellons 2018, lowbias32)."""
    a = ((a ^ (a >> 16)) * 0x7FEB352D) & 0xFFFFFFFF
    a = ((a ^ (a >> 15)) * 0x846CA68B) & 0xFFFFFFFF
    return a ^ (a >> 16)


def scrambled(a, seed):
    """Owen-scramble a 32-bit fraction; see `fracslice.rendering.accumulator`.

    `a`: bits reversed.
    """
    a = (a ^ (a * 0x3D20ADEA)) & 0xFFFFFFFF
    a = (a + seed) & 0xFFFFFFFF
    a = (a * ((seed >> 16) | 1)) & 0xFFFFFFFF
    a = (a ^ (a * 0x05526C56)) & 0xFFFFFFFF
    a = (a ^ (a * 0x53A22864)) & 0xFFFFFFFF
    return reversed_bits(a)


def seeded(pixel, dimension):
    """Return the seed of a pixel's dimension."""
    return hashed((pixel * 64 + (pixel >> 26) * 0x9E3779B9 + dimension) & 0xFFFFFFFF)


def sample(a, pixel, dimension):
    """Return one coordinate of a sequence point, scrambled for a pixel.

    Parameters
    ----------
    a : int
        Coordinate, bits reversed.
    pixel : int
        Pixel, ``y << 16 | x``.
    dimension : int
        Dimension of the coordinate.
    """
    return (scrambled(a & 0xFFFFFFFF, seeded(pixel, dimension)) >> 8) * 5.9604644775390625e-08


def centred(a, pixel, dimension):
    """Like `sample`, digitally shifted so that the first point of the sequence is 1/2, the pixel's centre.

    `a`: bits reversed.
    """
    seed = seeded(pixel, dimension)
    shifted = scrambled(a & 0xFFFFFFFF, seed) ^ scrambled(0, seed) ^ 0x80000000
    return (shifted >> 8) * 5.9604644775390625e-08


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
