"""The words a formula may use, with their NumPy meaning.

A formula is a plain function over ``x, y, z``. It is written once, in these words, Python arithmetic, ``for``
and ``if not any_of(mask): break``. Here the words mean NumPy on arrays (the reference); `fracslice.kernel`
gives the same names a meaning on SIMD lanes and on CUDA threads.

Two rules keep one source fast on all of them: branches on points are `where`, never ``if``; float constants
are written as floats (``2.0 * x``), so that a machine that cares about the width of a literal can set it.
"""

from __future__ import annotations

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
    """True if the condition holds on at least one point: the only way from points to control flow."""
    return bool(np.any(mask))


def rsqrt(a: np.ndarray) -> np.ndarray:
    """1/sqrt(a) of a positive, finite argument; the lanes have an instruction for it."""
    found: np.ndarray = 1.0 / np.sqrt(a)
    return found


def ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a/b of a normal, finite b whose inverse is normal too; a GPU has an instruction for the inverse."""
    found: np.ndarray = a / b
    return found


def orbit(r2: np.ndarray, alive: np.ndarray) -> None:
    """Marks a step of an orbit that is r2 = |w|^2 away from the origin where `alive`; only pictures with
    palettes look.
    """


_FUNCTIONS = ("where", "sqrt", "rsqrt", "ratio", "log", "exp", "sin", "cos", "atan2", "floor")
NAMES = frozenset((*_FUNCTIONS, "minimum", "maximum", "absolute", "any_of"))
