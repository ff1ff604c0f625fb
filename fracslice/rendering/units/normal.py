"""Surface normals."""

from __future__ import annotations

from ...formulas.vocabulary import maximum, rsqrt
from .intrinsics import field


def normalised(x, y, z):
    """Normalise a vector; the zero vector stays zero."""
    over = rsqrt(maximum(x * x + y * y + z * z, 1e-36))
    return x * over, y * over, z * over


def normal(x, y, z, h, P):
    """Return the unit normal from four field samples at the corners of a tetrahedron (Quilez 2015).

    Parameters
    ----------
    h : float
        Half edge of the cube that contains the corners.
    """
    gx, gy, gz = 0.0 * x, 0.0 * x, 0.0 * x
    for k in range(4):
        sy = 1.0 if k > 1 else -1.0
        sz = 1.0 if k % 2 == 1 else -1.0
        sx = sy * sz
        f = field(x + sx * h, y + sy * h, z + sz * h, P)
        gx = gx + sx * f
        gy = gy + sy * f
        gz = gz + sz * f
    over = 1.0 / h
    return normalised(gx * over, gy * over, gz * over)
