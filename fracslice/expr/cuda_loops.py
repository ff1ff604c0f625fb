"""CUDA versions of the loops in `loops`, one thread per point."""

from __future__ import annotations

from .loops import field, kernel, real, thread, whole
from .vocabulary import where


@kernel
def points(P, X, Y, Z, F):
    """Evaluate the field at points; NaN at a point with a NaN.

    `P`: parameters of the scene; `X`, `Y`, `Z`: [n] each, scene units; `F`: [n].
    """
    i = thread()
    if i < F.size:
        x = X[i]
        y = Y[i]
        z = Z[i]
        f = field(x, y, z, P)
        F[i] = where((x == x) & (y == y) & (z == z), f, x + y + z)


@kernel
def bricks(P, ox, oy, oz, h, corners, F):
    """Evaluate the 512 samples of each brick, at ``(ox, oy, oz) + h * (corner + offset)``.

    Parameters
    ----------
    P
        Parameters of the scene.
    ox, oy, oz, h
        Position of grid point (0, 0, 0), and grid spacing, scene units.
    corners
        Grid index of the first sample of each brick, int32 [n, 3].
    F
        Receives the values, [n, 512].
    """
    i = thread()
    b = i >> 9
    s = i & 511
    if b < F.shape[0]:
        x = real(whole(corners[b, 0] + (s >> 6))) * h + ox
        y = real(whole(corners[b, 1] + (s >> 3 & 7))) * h + oy
        z = real(whole(corners[b, 2] + (s & 7))) * h + oz
        F[b, s] = field(x, y, z, P)
