"""Reflection of rough surfaces by microfacets, and weights of its sampling and that of lights.

Trowbridge and Reitz 1975 (GGX of Walter et al. 2007), with Smith's height-correlated shadowing and masking.

The power heuristic of Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo
Rendering". Each ray carries the density with which the surface took its direction; 0 for a ray of the camera,
a mirror or glass, for which no light is sampled.
"""

from __future__ import annotations

from ...expr.vectors import TURN, frame, normalised
from ...expr.vocabulary import cos, floor, maximum, rsqrt, sin, sqrt, where
from .environment import bounded
from .intrinsics import gather
from .shade import fresnel, mirrored

SMOOTHEST = 1e-3
"""Smallest square of the roughness."""
CELLS = 15.0
"""Cells along each side of the table of `lost`."""
WIDE = 2.0
"""Density of a direction below which a ray was scattered widely."""
DULL = 0.5
"""Least roughness of surfaces that such a ray meets."""
LACQUER = 0.1
"""Roughness with which a lacquer reflects a light; what it mirrors is sharp."""


def width(rough):
    """Return the parameter of the distribution: the square of the roughness (Burley 2012)."""
    return maximum(rough * rough, SMOOTHEST)


def hidden(cosine, a):
    """Smith's Lambda: the area of microfacets hidden in a direction, relative to the visible one.

    `a`: width of the distribution.
    """
    c2 = maximum(cosine * cosine, 1e-8)
    return 0.5 * (sqrt(1.0 + a * a * maximum(1.0 - c2, 0.0) / c2) - 1.0)


def tinted(cosine, least):
    """Reflectance at an angle of incidence; 0 for a surface that does not reflect."""
    return where(least > 0.0, fresnel(cosine, least), 0.0)


def highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough):
    """Return the reflection of a light, but for Fresnel's factor."""
    a = width(rough)
    hx, hy, hz = normalised(lx - dx, ly - dy, lz - dz)
    nl = nx * lx + ny * ly + nz * lz
    nv = maximum(-(nx * dx + ny * dy + nz * dz), 1e-4)
    nh = nx * hx + ny * hy + nz * hz
    spread = nh * nh * (a * a - 1.0) + 1.0
    facets = a * a / maximum(spread * spread, 1e-12)
    seen = 1.0 / (1.0 + hidden(nv, a) + hidden(nl, a))
    return where(nl > 0.0, 0.25 * facets * seen / nv, 0.0), lx * hx + ly * hy + lz * hz


def glossy(dx, dy, dz, nx, ny, nz, rough, u, v):
    """Sample a reflected ray by the visible microfacets (Heitz 2018)."""
    a = width(rough)
    ax, ay, az, bx, by, bz = frame(nx, ny, nz)
    vx, vy = -(ax * dx + ay * dy + az * dz), -(bx * dx + by * dy + bz * dz)
    vz = maximum(-(nx * dx + ny * dy + nz * dz), 1e-4)
    px, py, pz = normalised(a * vx, a * vy, vz)
    across = px * px + py * py
    over = where(across > 1e-12, rsqrt(maximum(across, 1e-12)), 0.0)
    tx, ty = where(across > 1e-12, -py * over, 1.0), px * over
    sx, sy, sz = -pz * ty, pz * tx, px * ty - py * tx
    r = sqrt(u)
    p, q = r * cos(TURN * v), r * sin(TURN * v)
    s = 0.5 * (1.0 + pz)
    q = (1.0 - s) * sqrt(maximum(1.0 - p * p, 0.0)) + s * q
    w = sqrt(maximum(1.0 - p * p - q * q, 0.0))
    mx, my, mz = p * tx + q * sx + w * px, p * ty + q * sy + w * py, q * sz + w * pz
    mx, my, mz = normalised(a * mx, a * my, maximum(mz, 1e-6))
    hx = mx * ax + my * bx + mz * nx
    hy = mx * ay + my * by + mz * ny
    hz = mx * az + my * bz + mz * nz
    ex, ey, ez = mirrored(dx, dy, dz, hx, hy, hz)
    nl = nx * ex + ny * ey + nz * ez
    seen = 1.0 + hidden(vz, a)
    weight = where(nl > 0.0, seen / (seen + hidden(nl, a)), 0.0)
    return ex, ey, ez, weight, -(dx * hx + dy * hy + dz * hz)


def dulled(rough, q):
    """Return the roughness of a surface to a ray.

    A ray that was scattered widely hardly ever meets a light in a sharp reflection, and is far too bright
    then: the reflection is widened (Kaplanyan and Dachsbacher 2013, "Path Space Regularization").

    `q`: density of the ray's direction.
    """
    wide = (q > 0.0) & (q < WIDE) & (rough > 0.0)
    return where(wide, maximum(rough, DULL), rough)


def lost(cosine, rough, table, P):
    """Return the light that one reflection by microfacets loses to others, relative to what it reflects.

    Others reflect it again, as the first one does (Turquin 2019, "Practical Multiple Scattering Compensation
    for Microfacet Models").

    `table`: share that is reflected at each roughness and root of the cosine, both from 0 to 1.
    """
    a = CELLS * rough
    b = CELLS * sqrt(maximum(cosine, 0.0))
    i = bounded(floor(a), CELLS)
    j = bounded(floor(b), CELLS)
    place = table + (CELLS + 1.0) * i + j
    a = a - i
    b = b - j
    low = (1.0 - b) * gather(place, P) + b * gather(place + 1.0, P)
    place = place + CELLS + 1.0
    high = (1.0 - b) * gather(place, P) + b * gather(place + 1.0, P)
    return where(rough > 0.0, 1.0 / ((1.0 - a) * low + a * high) - 1.0, 0.0)


HALF_TURN = 3.141592653589793


def heuristic(taken, other):
    """Return the weight of a sample."""
    ratio = other / maximum(taken, 1e-12)
    return where(taken > 0.0, 1.0 / (1.0 + ratio * ratio), 0.0)


def facet_density(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough):
    """Return the density with which `glossy.glossy` takes a direction.

    `lx`, `ly`, `lz`: unit direction of reflection.
    """
    a = width(rough)
    value, _ = highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough)
    there = hidden(nx * lx + ny * ly + nz * lz, a)
    back = hidden(maximum(-(nx * dx + ny * dy + nz * dz), 1e-4), a)
    return value * (1.0 + there + back) / ((1.0 + back) * HALF_TURN)


def weights(dense, diffuse, nx, ny, nz, dx, dy, dz, lx, ly, lz, rough, share, free):
    """Return the weights of a light's sample for scattered and for reflected light."""
    facets = share * facet_density(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough)
    scattered = heuristic(dense, (1.0 - share) * diffuse / HALF_TURN)
    reflected = where(rough > 0.0, heuristic(dense, facets), 1.0)
    return where(free > 0.5, 1.0, scattered), where(free > 0.5, 1.0, reflected)


def mixed_weights(dense, likely, rough, free):
    """Return the weights of a light's sample where all rays that continue have one density."""
    weight = where(free > 0.5, 1.0, heuristic(dense, likely))
    return weight, where(rough > 0.0, weight, 1.0)


def density_onward(chosen, nx, ny, nz, dx, dy, dz, ex, ey, ez, rough, share):
    """Return the density of a continued ray.

    `nx`, `ny`, `nz`, `dx`, `dy`, `dz`, `ex`, `ey`, `ez`: unit normal, direction of the ray, direction of the
    continued ray.
    """
    facets = share * facet_density(nx, ny, nz, dx, dy, dz, ex, ey, ez, rough)
    cosine = maximum(nx * ex + ny * ey + nz * ez, 0.0)
    mirror = where(rough > 0.0, facets, 0.0)
    return where(chosen, mirror, (1.0 - share) * cosine / HALF_TURN)


def sun_density(dx, dy, dz, towards, spread):
    """Return the density with which `scene.lights.sun` takes a direction."""
    lx, ly, lz = towards
    cosine = dx * lx + dy * ly + dz * lz
    s2 = spread * spread
    inside = cosine * sqrt(1.0 + s2) > 1.0
    return where(inside, 1.0 / (HALF_TURN * s2 * maximum(cosine * cosine * cosine, 1e-6)), 0.0)


def behind(q, dense):
    """Return the weight of a picture of the surroundings for a ray that misses the scene.

    `q`: density of the ray.
    """
    return where(q > 0.0, heuristic(q, dense), 1.0)


def sunshine(q, dense):
    """Return the light of a sun for a ray that misses the scene.

    `q`: density of the ray.
    """
    return where(q > 0.0, HALF_TURN * dense * heuristic(q, dense), 0.0)
