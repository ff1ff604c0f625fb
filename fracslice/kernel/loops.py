"""Loops around a field, the entry points of a compiled kernel.

A loop is a Python function that uses the intrinsics of formulas and of `intrinsics`, ``while``, array
elements, and the numbers and functions of its module. It becomes a C function.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ..formulas.vocabulary import where
from .intrinsics import WIDTH, around, field, load, lower, store, upper


@dataclass(frozen=True)
class Loop:
    """C function over a field.

    Attributes
    ----------
    function
        Python function of the loop.
    arguments
        One letter per argument: "r" a pointer to the kernel's float type, "i" to int32, "n" an integer. The
        first argument is P by convention.
    fixed
        Further arguments by name, constant at compile time: functions, and records of numbers.
    points
        Kind of the coordinates that it passes to the field: "lanes", or "interval" for cells.
    """

    function: Callable[..., None]
    arguments: str = ""
    fixed: tuple[tuple[str, Any], ...] = ()
    points: str = "lanes"

    @property
    def name(self) -> str:
        """Name of the function."""
        return self.function.__name__

    def fix(self, **fixed: Any) -> Loop:
        """Return the loop with arguments that are constant at compile time."""
        return replace(self, fixed=tuple(fixed.items()))


def loop(arguments: str, points: str = "lanes") -> Callable[[Callable[..., None]], Loop]:
    """Return a decorator that makes a function a `Loop`.

    Parameters
    ----------
    arguments
        Arguments of the loop, one letter each.
    points
        Kind of the coordinates that it passes to the field.
    """
    return lambda function: Loop(function, arguments, points=points)


@loop("rrrrrn")
def points(P, X, Y, Z, F, n):
    """Evaluate the field at points; NaN at a point with a NaN.

    Parameters
    ----------
    P
        Parameters of the scene.
    X, Y, Z
        Coordinates, [n] each, scene units.
    F
        Receives the values, [n].
    n
        Number of points, a multiple of WIDTH.
    """
    for i in range(0, n, WIDTH):
        x = load(X, i)
        y = load(Y, i)
        z = load(Z, i)
        f = field(x, y, z, P)
        s = x + y + z
        store(F, i, where(s == s, f, s))


@loop("rrrrrirn")
def bricks(P, FRAME, IX, IY, IZ, corners, F, n):
    """Evaluate the 512 samples of bricks, at ``FRAME[:3] + FRAME[3] * (corner + (IX, IY, IZ))``.

    Parameters
    ----------
    P
        Parameters of the scene.
    FRAME
        Position of grid point (0, 0, 0), then grid spacing, [4], scene units.
    IX, IY, IZ
        Offsets of the samples from the corner, [512] each.
    corners
        Grid index of the first sample of each brick, int32 [n, 3].
    F
        Receives the values, [n, 512].
    n
        Number of bricks.
    """
    h = FRAME[3]
    for b in range(n):
        x0 = corners[3 * b]
        y0 = corners[3 * b + 1]
        z0 = corners[3 * b + 2]
        for s in range(0, 512, WIDTH):
            x = (load(IX, s) + x0) * h + FRAME[0]
            y = (load(IY, s) + y0) * h + FRAME[1]
            z = (load(IZ, s) + z0) * h + FRAME[2]
            store(F, 512 * b + s, field(x, y, z, P))


@loop("rrrrrrrn", points="interval")
def enclosures(P, FRAME, X, Y, Z, LOW, HIGH, n):
    """Enclose the values of the field on cells.

    Parameters
    ----------
    P
        Parameters of the scene.
    FRAME
        Half the size of the cells, [1], scene units.
    X, Y, Z
        Centres of the cells, [n] each, scene units.
    LOW, HIGH
        Receive the bounds, [n].
    n
        Number of cells, a multiple of WIDTH.
    """
    half = FRAME[0]
    for i in range(0, n, WIDTH):
        x = around(load(X, i), half)
        y = around(load(Y, i), half)
        z = around(load(Z, i), half)
        f = field(x, y, z, P)
        store(LOW, i, lower(f))
        store(HIGH, i, upper(f))
