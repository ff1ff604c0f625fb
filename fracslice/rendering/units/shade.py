"""Surface shading: reflection, refraction, occlusion, palettes, and transmittance of fog."""

from __future__ import annotations

from ...expr.vectors import normalised
from ...expr.vocabulary import absolute, exp, floor, log, maximum, minimum, sqrt, where
from .intrinsics import field


def phong(nx, ny, nz, dx, dy, dz, lx, ly, lz, specular, shininess):
    """Return the diffuse and specular factors of one light (Phong 1975, with Blinn's 1977 half vector)."""
    diffuse = maximum(nx * lx + ny * ly + nz * lz, 0.0)
    hx, hy, hz = normalised(lx - dx, ly - dy, lz - dz)
    cosine = maximum(nx * hx + ny * hy + nz * hz, 1e-6)
    return diffuse, where(diffuse > 0.0, specular * exp(shininess * log(cosine)), 0.0)


def occlusion(x, y, z, nx, ny, nz, P, strength, reach):
    """Estimate ambient occlusion from five field samples along the normal (Evans 2006).

    `reach` in scene units.
    """
    closed = 0.0 * x
    weight = 0.5
    for i in range(5):
        h = reach * (i + 1.0) * 0.2
        f = field(x + h * nx, y + h * ny, z + h * nz, P)
        closed = closed + weight * maximum(1.0 - maximum(f, 0.0) / h, 0.0)
        weight = 0.5 * weight
    return maximum(1.0 - strength * closed, 0.0)


def palette(tone, P, stops, count):
    """Interpolate a cyclic palette; tone 0 and tone 1 are both the first stop.

    `tone`: position in [0, 1].
    """
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


def varied(rough, vary, turn):
    """Return the roughness at a position in a palette."""
    middle = 1.0 - absolute(2.0 * (turn - floor(turn)) - 1.0)
    return minimum(maximum(rough + vary * middle, 0.0), 1.0)


def lacquer(facing, coat):
    """Return the reflectance of a lacquer of refractive index 1.5."""
    cosine = minimum(maximum(facing, 0.0), 1.0)
    return coat * dielectric(cosine, 1.0 - (1.0 - cosine * cosine) / 2.25, 1.0 / 1.5)


def mirrored(dx, dy, dz, nx, ny, nz):
    """Return the direction of reflection."""
    twice = 2.0 * (dx * nx + dy * ny + dz * nz)
    return dx - twice * nx, dy - twice * ny, dz - twice * nz


def fresnel(cosine, least):
    """Reflectance at an angle of incidence (Schlick 1994)."""
    a = 1.0 - minimum(maximum(cosine, 0.0), 1.0)
    a2 = a * a
    return least + (1.0 - least) * a2 * a2 * a


def dielectric(cosine, left, ratio):
    """Reflectance of a transparent surface for unpolarised light (Fresnel 1823)."""
    on = sqrt(maximum(left, 0.0))
    across = (ratio * cosine - on) / maximum(ratio * cosine + on, 1e-9)
    along = (cosine - ratio * on) / maximum(cosine + ratio * on, 1e-9)
    return where(left > 0.0, 0.5 * (across * across + along * along), 1.0)


def bent(dx, dy, dz, nx, ny, nz, cosine, ratio):
    """Return the direction of refraction (Snell's law)."""
    left = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    k = ratio * cosine - sqrt(maximum(left, 0.0))
    return ratio * dx + k * nx, ratio * dy + k * ny, ratio * dz + k * nz, left


def reflects(dx, dy, dz, nx, ny, nz, reflect):
    """Return the reflectance of a mirror and the direction of reflection."""
    cosine = -(dx * nx + dy * ny + dz * nz)
    part = where(reflect > 0.0, fresnel(cosine, reflect), 0.0)
    rx, ry, rz = mirrored(dx, dy, dz, nx, ny, nz)
    return part, rx, ry, rz


def goes_on(dx, dy, dz, nx, ny, nz, side, reflect, clear, index, chance):
    """Return the continuation of a ray at a transparent or mirroring surface.

    A random number chooses between reflection and refraction with Fresnel weights. The normal points to the
    side of the incoming ray.
    """
    cosine = -(dx * nx + dy * ny + dz * nz)
    mirror = where(reflect > 0.0, fresnel(cosine, reflect), 0.0)
    ratio = where(side < 0.0, index + 0.0 * cosine, 1.0 / (index + 0.0 * cosine))
    bx, by, bz, left = bent(dx, dy, dz, nx, ny, nz, cosine, ratio)
    back = maximum(dielectric(maximum(cosine, 0.0), left, ratio), mirror)
    through = (clear > 0.0) & (chance > back)
    rx, ry, rz = mirrored(dx, dy, dz, nx, ny, nz)
    share = where(clear > 0.0, clear + 0.0 * cosine, mirror)
    ex = where(through, bx, rx)
    ey = where(through, by, ry)
    ez = where(through, bz, rz)
    return share, ex, ey, ez, where(through, -1.0, 1.0 + 0.0 * cosine)


def fog(t, density):
    """Transmittance of fog (Beer-Lambert law).

    `t` in scene units; `density`: extinction per scene unit.
    """
    return exp(-density * t)


def thickness(z, density, level, height):
    """Extinction of fog that thins with the height.

    `z`: height; `density`: extinction per scene unit at `level`; it thins to 1/e over `height`.
    """
    return density * exp(minimum((level - z) / height, 40.0))


def height_fog(t, z, dz, density, level, height):
    """Transmittance of fog that thins with the height: the integral of its extinction along a ray.

    `t` in scene units; `z`, `dz`: height of the ray's end, and vertical component of its direction.
    """
    drop = minimum(maximum(t * dz / height, -40.0), 40.0)
    curved = absolute(drop) > 1e-3
    mean = where(curved, (exp(drop) - 1.0) / where(curved, drop, 1.0), 1.0 + 0.5 * drop)
    return exp(-minimum(t * mean * thickness(z, density, level, height), 80.0))
