"""Functions that a formula may use, with their NumPy implementation; vectors and directions made of
them.

A formula is a plain function of ``x, y, z``. It is written once, with these functions, Python arithmetic,
``for`` and ``if not any_of(mask): break``. Here the functions act on NumPy arrays (the reference);
`fracslice.expr` implements the same names for SIMD lanes and CUDA threads.

Two rules keep one source fast on all targets. Branches on points use `where`, never ``if``. Float constants
are written as floats (``2.0 * x``), so that each target can set the width of literals.
"""

from __future__ import annotations

from typing import Any

import numpy as np

where = np.where
sqrt = np.sqrt
log = np.log
exp = np.exp
sin = np.sin
cos = np.cos
atan2 = np.arctan2
floor = np.floor
minimum = np.minimum
maximum = np.maximum
absolute = np.abs


def any_of(mask: np.ndarray) -> bool:
    """Whether a condition holds at any point: the only way for points to affect control flow.

    Parameters
    ----------
    mask
        Condition at each point.

    Returns
    -------
    bool
    """
    return bool(np.any(mask))


def rsqrt(a: np.ndarray) -> np.ndarray:
    """Reciprocal square root; SIMD units have an instruction for it.

    Parameters
    ----------
    a
        Positive, finite numbers.

    Returns
    -------
    ndarray
        1/sqrt(a).
    """
    result: np.ndarray = 1.0 / np.sqrt(a)
    return result


def ratio(a: np.ndarray | float, b: np.ndarray) -> np.ndarray:
    """Quotient; GPUs have an instruction for the reciprocal.

    Parameters
    ----------
    a
        Dividend.
    b
        Divisor: normal, finite numbers whose reciprocal is normal, too.

    Returns
    -------
    ndarray
        a/b.
    """
    result: np.ndarray = a / b
    return result


def orbit(r2: np.ndarray, alive: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> None:
    """Record a step of an orbit for the palettes of pictures; elsewhere it does nothing.

    Parameters
    ----------
    r2
        |w|^2 after the step.
    alive
        Mask of the points whose orbit is still running.
    x, y, z
        w after the step.
    """


def cell_middle(a: np.ndarray) -> np.ndarray:
    """Number near the middle of the values of a cell; of a point its own. For code of the kernel alone.

    Parameters
    ----------
    a
        Numbers, or intervals.

    Returns
    -------
    ndarray
        Numbers, or intervals of one number.
    """
    return a


def cell_extent(a: np.ndarray) -> np.ndarray:
    """Largest distance of the values of a cell from `cell_middle`.

    Parameters
    ----------
    a
        Numbers, or intervals.

    Returns
    -------
    ndarray
        Numbers, or intervals of one number.
    """
    return 0.0 * a


def solid_distance(x: np.ndarray, y: np.ndarray, z: np.ndarray, solid: Any) -> np.ndarray:
    """Signed distance to a triangle model, by native code. For the formula of models alone.

    Parameters
    ----------
    x, y, z
        Coordinates, of one shape.
    solid
        The model, a `functions.InMemory`.

    Returns
    -------
    ndarray
    """
    distances: np.ndarray = solid.distances(*np.broadcast_arrays(x, y, z))
    return distances


def outline_distance(x: np.ndarray, y: np.ndarray, outline: Any) -> np.ndarray:
    """Signed distance to an outline in a plane, or height above it, by native code. For formulas of files.

    Parameters
    ----------
    x, y
        Coordinates, of one shape.
    outline
        The outline or relief, a `functions.InMemory`.

    Returns
    -------
    ndarray
    """
    distances: np.ndarray = outline.distances(*np.broadcast_arrays(x, y))
    return distances


_FUNCTIONS = ("where", "sqrt", "rsqrt", "ratio", "log", "exp", "sin", "cos", "atan2", "floor")
NAMES = frozenset((*_FUNCTIONS, "minimum", "maximum", "absolute", "any_of"))
OF_CELLS = frozenset(("cell_middle", "cell_extent"))
"""Functions that only code of the kernel calls."""
OF_FILES = frozenset(("solid_distance", "outline_distance"))
"""Functions that only the formulas of files call: a point, and what lies in memory."""
ALL = NAMES | OF_CELLS | OF_FILES
__all__ = sorted(NAMES)


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
