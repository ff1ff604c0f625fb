"""Reflection of rough surfaces by microfacets.

Trowbridge and Reitz 1975 (GGX of Walter et al. 2007), with Smith's height-correlated shadowing and masking.
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
