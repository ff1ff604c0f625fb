"""Multiple importance sampling of lights by their own distribution and by that of the surface.

The power heuristic of Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo
Rendering". Each ray carries the density with which the surface took its direction; 0 for a ray of the camera,
a mirror or glass, for which no light is sampled.
"""

from __future__ import annotations

from ...expr.vocabulary import maximum, sqrt, where
from .glossy import hidden, highlight, width

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
