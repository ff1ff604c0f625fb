"""Loops around a field: what a compiled kernel does with it, as source text beside the scene's.

A loop is a Python function in the words of the formulas, which may also call ``field(x, y, z, P)``,
``load(array, i)`` and ``store(array, i, lanes)``. WIDTH is the number of lanes. It becomes a C function.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Loop:
    """A C function over a field.

    arguments: one letter each: "r" a pointer to the kernel's float type, "i" to int32, "n" a whole number.
    The first argument is P by convention.
    """

    name: str
    arguments: str
    source: str


POINTS = Loop(
    "points",
    "rrrrrn",
    """
def points(P, X, Y, Z, F, n):
    for i in range(0, n, WIDTH):
        x = load(X, i)
        y = load(Y, i)
        z = load(Z, i)
        f = field(x, y, z, P)
        s = x + y + z
        store(F, i, where(s == s, f, s))
""",
)
"""Field values at n points, n a multiple of WIDTH; a point with a NaN gives NaN."""

BRICKS = Loop(
    "bricks",
    "rrrrrirn",
    """
def bricks(P, FRAME, I, J, K, corners, F, n):
    h = FRAME[3]
    for b in range(n):
        x0 = corners[3 * b]
        y0 = corners[3 * b + 1]
        z0 = corners[3 * b + 2]
        for s in range(0, 512, WIDTH):
            x = (load(I, s) + x0) * h + FRAME[0]
            y = (load(J, s) + y0) * h + FRAME[1]
            z = (load(K, s) + z0) * h + FRAME[2]
            store(F, 512 * b + s, field(x, y, z, P))
""",
)
"""512 samples of each of n bricks, at ``FRAME[:3] + FRAME[3] * (corner + (I, J, K))``."""
