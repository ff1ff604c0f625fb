"""Transmittance of fog."""

from __future__ import annotations

from ...expr.vocabulary import absolute, exp, maximum, minimum, where


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
