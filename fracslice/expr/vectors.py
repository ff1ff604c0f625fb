"""Vectors and directions, in the language of formulas."""

from __future__ import annotations

from .vocabulary import absolute, cos, maximum, rsqrt, sin, sqrt, where

TURN = 6.283185307179586


def normalised(x, y, z):
    """Normalise a vector; the zero vector stays zero."""
    over = rsqrt(maximum(x * x + y * y + z * z, 1e-36))
    return x * over, y * over, z * over


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


def upward(nx, ny, nz, u, v):
    """Sample a direction about a normal with cosine-weighted density (Malley's method)."""
    ax, ay, az, bx, by, bz = frame(nx, ny, nz)
    p, q = disc(u, v)
    h = sqrt(maximum(1.0 - p * p - q * q, 0.0))
    return normalised(p * ax + q * bx + h * nx, p * ay + q * by + h * ny, p * az + q * bz + h * nz)
