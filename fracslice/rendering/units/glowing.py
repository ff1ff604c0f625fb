"""Rays towards bodies that glow: to points of their bounding boxes, uniform by volume.

A ray is sent to a body, or as the surface reflects and scatters. Its light is divided by the density of all
together: the balance heuristic of Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte
Carlo Rendering", with one sample. The ray itself finds what it meets, so that boxes need not fit.
"""

from __future__ import annotations

from ...expr.vectors import normalised
from ...expr.vocabulary import absolute, maximum, where
from .glossy import HALF_TURN, facet_density
from .march import span

SENT = 0.5
"""Largest share of the rays that are sent to bodies, where one is above the horizon."""


def prominence(x, y, z, nx, ny, nz, body):
    """Return the weight with which a body is chosen."""
    cx, cy, cz, hx, hy, hz, power = body
    px, py, pz = cx - x, cy - y, cz - z
    height = px * nx + py * ny + pz * nz + hx * absolute(nx) + hy * absolute(ny) + hz * absolute(nz)
    outside = maximum(maximum(absolute(px) - hx, absolute(py) - hy), absolute(pz) - hz)
    squared = px * px + py * py + pz * pz + hx * hx + hy * hy + hz * hz
    return where((height > 0.0) & (outside > 0.0), power / squared, 0.0)


def smallness(x, y, z, body):
    """Return the part of `SENT` for a body: rays of the surface meet a large one anyhow."""
    cx, cy, cz, hx, hy, hz, power = body
    px, py, pz = cx - x, cy - y, cz - z
    ratio = (hx * hx + hy * hy + hz * hz) / (px * px + py * py + pz * pz)
    return 1.0 / (1.0 + ratio * ratio)


def sent_share(x, y, z, nx, ny, nz, P, bodies, count):
    """Return the share of the rays that are sent to bodies."""
    total = 0.0 * x
    small = 0.0 * x
    for k in range(count):
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        total = total + weight
        small = small + weight * smallness(x, y, z, bodies[k])
    return where(total > 0.0, SENT * small / maximum(total, 1e-30), 0.0)


def towards_body(x, y, z, nx, ny, nz, u, v, w, choice, P, bodies, count):
    """Return the direction to a point of a body's box."""
    total = 0.0 * x
    px, py, pz = nx, ny, nz
    for k in range(count):
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        total = total + weight
    goal = choice * total
    before = 0.0 * x
    for k in range(count):
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        taken = (weight > 0.0) & (before <= goal)
        before = before + weight
        cx, cy, cz, hx, hy, hz, power = bodies[k]
        px = where(taken, cx + (2.0 * u - 1.0) * hx - x, px)
        py = where(taken, cy + (2.0 * v - 1.0) * hy - y, py)
        pz = where(taken, cz + (2.0 * w - 1.0) * hz - z, pz)
    return normalised(px, py, pz)


def body_density(x, y, z, nx, ny, nz, dx, dy, dz, P, bodies, count):
    """Return the density with which `towards_body` takes a direction."""
    total = 0.0 * x
    density = 0.0 * x
    for k in range(count):
        cx, cy, cz, hx, hy, hz, power = bodies[k]
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        a, b = span(x, y, z, dx, dy, dz, (cx - hx, cy - hy, cz - hz), (cx + hx, cy + hy, cz + hz))
        solid = maximum(b - a, 0.0) * (a * a + a * b + b * b) / (24.0 * hx * hy * hz)
        total = total + weight
        density = density + weight * solid
    return density / maximum(total, 1e-30)


def mixed_density(sent, beside, nx, ny, nz, dx, dy, dz, lx, ly, lz, rough, share):
    """Return the density of a ray from a rough or a scattering surface.

    `nx`, `ny`, `nz`, `dx`, `dy`, `dz`, `lx`, `ly`, `lz`: unit normal, direction of the ray that arrives,
    direction of the one that continues.
    """
    facets = where(rough > 0.0, facet_density(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough), 0.0)
    cosine = maximum(nx * lx + ny * ly + nz * lz, 0.0)
    return sent * beside + (1.0 - sent) * (share * facets + (1.0 - share) * cosine / HALF_TURN)
