"""Lights, as seen from a point: unit direction to the light, its distance, fraction of its strength."""

from __future__ import annotations

from ...expr.vocabulary import absolute, cos, maximum, rsqrt, sin, sqrt, where
from .march import normalised

TURN = 6.283185307179586


def frame(x, y, z):
    """Return two unit vectors orthogonal to a unit vector and to each other.

    Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    """
    sign = where(z < 0.0, -1.0, 1.0 + 0.0 * z)
    a = -1.0 / (sign + z)
    b = x * y * a
    return 1.0 + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y


def disc(u, v):
    """Map the unit square to the unit disc, uniformly by area.

    Neighbours in the square stay neighbours, so fewer samples suffice than with radius and angle (Shirley and
    Chiu 1997, "A Low Distortion Map Between Disk and Square").
    """
    a = 2.0 * u - 1.0
    b = 2.0 * v - 1.0
    wide = absolute(a) > absolute(b)
    r = where(wide, a, b)
    over = where(wide, b, a)
    angle = 0.7853981633974483 * over / where(absolute(r) > 1e-9, r, 1e-9)
    p = r * cos(angle)
    q = r * sin(angle)
    return where(wide, p, q), where(wide, q, p)


def sun(x, y, z, u, v, towards, spread, far):
    """Sample a sun: a disc in the sky."""
    lx, ly, lz = towards
    zero = 0.0 * x
    ax, ay, az, bx, by, bz = frame(lx + zero, ly + zero, lz + zero)
    p, q = disc(u, v)
    p = spread * p
    q = spread * q
    dx, dy, dz = normalised(lx + p * ax + q * bx, ly + p * ay + q * by, lz + p * az + q * bz)
    return dx, dy, dz, far + zero, 1.0 + zero


def sharp_sun(x, y, z, u, v, towards, far):
    """Sample a point-like sun, which casts sharp shadows."""
    lx, ly, lz = towards
    zero = 0.0 * x
    return lx + zero, ly + zero, lz + zero, far + zero, 1.0 + zero


def lamp(x, y, z, u, v, position, radius):
    """Sample a spherical lamp. Strength is that at distance 1 and falls with the squared distance."""
    px, py, pz = position
    h = 1.0 - 2.0 * u
    r = radius * sqrt(maximum(1.0 - h * h, 0.0))
    lx = px - x + r * cos(TURN * v)
    ly = py - y + r * sin(TURN * v)
    lz = pz - z + radius * h
    d2 = maximum(lx * lx + ly * ly + lz * lz, 1e-12)
    over = rsqrt(d2)
    return lx * over, ly * over, lz * over, d2 * over, over * over


def sharp_lamp(x, y, z, u, v, position):
    """Sample a point lamp, which casts sharp shadows."""
    px, py, pz = position
    lx = px - x
    ly = py - y
    lz = pz - z
    d2 = maximum(lx * lx + ly * ly + lz * lz, 1e-12)
    over = rsqrt(d2)
    return lx * over, ly * over, lz * over, d2 * over, over * over


def upward(nx, ny, nz, u, v):
    """Sample a direction about a normal with cosine-weighted density (Malley's method)."""
    ax, ay, az, bx, by, bz = frame(nx, ny, nz)
    p, q = disc(u, v)
    h = sqrt(maximum(1.0 - p * p - q * q, 0.0))
    return normalised(p * ax + q * bx + h * nx, p * ay + q * by + h * ny, p * az + q * bz + h * nz)


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
