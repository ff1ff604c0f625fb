"""What a surface does with light."""

from __future__ import annotations

from ...formulas.vocabulary import absolute, exp, log, maximum, minimum, sqrt, where
from .intrinsics import field
from .normal import normalised


def phong(nx, ny, nz, dx, dy, dz, lx, ly, lz, specular, shininess):
    """Diffuse and specular factors of one light (Phong 1975, with Blinn's 1977 half vector).

    n: unit normal; d: unit direction of the ray; l: unit direction to the light.
    """
    diffuse = maximum(nx * lx + ny * ly + nz * lz, 0.0)
    hx, hy, hz = normalised(lx - dx, ly - dy, lz - dz)
    cosine = maximum(nx * hx + ny * hy + nz * hz, 1e-6)
    return diffuse, where(diffuse > 0.0, specular * exp(shininess * log(cosine)), 0.0)


def occlusion(x, y, z, nx, ny, nz, P, strength, reach):
    """How open a point is: the field along the normal against the distance walked (Evans 2006; five
    samples)."""
    closed = 0.0 * x
    weight = 0.5
    for i in range(5):
        h = reach * (i + 1.0) * 0.2
        f = field(x + h * nx, y + h * ny, z + h * nz, P)
        closed = closed + weight * maximum(1.0 - maximum(f, 0.0) / h, 0.0)
        weight = 0.5 * weight
    return maximum(1.0 - strength * closed, 0.0)


def fog(t, density):
    """The part of the light that comes through (Beer and Lambert)."""
    return exp(-density * t)


def palette(tone, P, stops, count):
    """A colour between stops; tone 0 is the first of them, 1 the first again: the palette is a ring."""
    r = 0.0 * tone
    g = 0.0 * tone
    b = 0.0 * tone
    place = tone * count
    for k in range(count):
        near = absolute(place - k)
        weight = maximum(1.0 - minimum(near, count - near), 0.0)
        r = r + weight * stops[3 * k]
        g = g + weight * stops[3 * k + 1]
        b = b + weight * stops[3 * k + 2]
    return r, g, b


def mirrored(dx, dy, dz, nx, ny, nz):
    """The direction of a reflection."""
    twice = 2.0 * (dx * nx + dy * ny + dz * nz)
    return dx - twice * nx, dy - twice * ny, dz - twice * nz


def fresnel(cosine, least):
    """The part that is reflected at an angle: `least` head on, all at grazing (Schlick 1994)."""
    a = 1.0 - minimum(maximum(cosine, 0.0), 1.0)
    a2 = a * a
    return least + (1.0 - least) * a2 * a2 * a


def bent(dx, dy, dz, nx, ny, nz, cosine, ratio):
    """The direction of a refraction, and what is below zero where all is reflected (Snell).

    cosine: of the angle between the normal and the ray's reverse; ratio: of the refractive indices, here over
    there.
    """
    left = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    k = ratio * cosine - sqrt(maximum(left, 0.0))
    return ratio * dx + k * nx, ratio * dy + k * ny, ratio * dz + k * nz, left


def reflects(dx, dy, dz, nx, ny, nz, reflect):
    """The part that a mirror reflects, and where to."""
    cosine = -(dx * nx + dy * ny + dz * nz)
    part = where(reflect > 0.0, fresnel(cosine, reflect), 0.0)
    rx, ry, rz = mirrored(dx, dy, dz, nx, ny, nz)
    return part, rx, ry, rz


def goes_on(dx, dy, dz, nx, ny, nz, side, reflect, clear, index, chance):
    """The part of the light that goes on, one direction for it, and -1 if that is through the surface.

    n points to where the ray comes from. Between reflection and refraction chance decides, as Fresnel's law
    weighs them.
    """
    cosine = -(dx * nx + dy * ny + dz * nz)
    glass = (index - 1.0) / (index + 1.0)
    mirror = where(reflect > 0.0, fresnel(cosine, reflect), 0.0)
    ratio = where(side < 0.0, index + 0.0 * cosine, 1.0 / (index + 0.0 * cosine))
    bx, by, bz, left = bent(dx, dy, dz, nx, ny, nz, cosine, ratio)
    back = maximum(fresnel(cosine, maximum(glass * glass, reflect)), where(left < 0.0, 1.0, 0.0 * left))
    through = (clear > 0.0) & (chance > back)
    rx, ry, rz = mirrored(dx, dy, dz, nx, ny, nz)
    share = where(clear > 0.0, clear + 0.0 * cosine, mirror)
    ex = where(through, bx, rx)
    ey = where(through, by, ry)
    ez = where(through, bz, rz)
    return share, ex, ey, ez, where(through, -1.0, 1.0 + 0.0 * cosine)
