"""A sky: a colour from the ground over the horizon to the zenith."""

from __future__ import annotations

from ...expr.vocabulary import absolute, sqrt, where
from . import Kind


def sky(dx, dy, dz, zenith, horizon, ground):
    """Return the sky's colour in a direction.

    The colour is interpolated from the horizon to the zenith above and to the ground below.
    """
    zr, zg, zb = zenith
    hr, hg, hb = horizon
    gr, gg, gb = ground
    a = sqrt(absolute(dz))
    up = dz > 0.0
    return (
        hr + a * (where(up, zr + 0.0 * a, gr) - hr),
        hg + a * (where(up, zg + 0.0 * a, gg) - hg),
        hb + a * (where(up, zb + 0.0 * a, gb) - hb),
    )


KIND = Kind("all around")
