"""Loops around a field, the entry points of a compiled kernel, and the intrinsics that they use.

A loop is a Python function that uses the intrinsics of formulas and of render units, ``while``, array
elements, and the numbers and functions of its module. It becomes a C function.

Here they are implemented on NumPy arrays, so that a loop also runs as plain Python: lanes are a slice, and P
is the field itself, a function of ``x, y, z``. The compiler implements the same names in machine code.

On a GPU a thread has one lane, WIDTH is 1, and the threads share the rounds of the loop over `shares`.
There, a lane is a number: a loop for a GPU only may branch on its condition and assign it to an element.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from .intervals import ARRAYS, Interval
from .vocabulary import where

Function = TypeVar("Function", bound=Callable[..., Any])

WIDTH = sys.maxsize
"""Number of lanes; in Python all elements of an array."""

_INTRINSICS: set[Callable[..., Any]] = set()


def intrinsic(function: Function) -> Function:
    """Decorate a function that the compiler or the linked scene provides under the same name."""
    _INTRINSICS.add(function)
    return function


def is_intrinsic(value: Any) -> bool:
    """Return True if a value is an intrinsic, which loops may call."""
    return callable(value) and value in _INTRINSICS


_INLINE: set[Callable[..., Any]] = set()


def inline(function: Function) -> Function:
    """Decorate a function that is read where it is called. Its operations are the caller's, so that products
    are fused with sums across the call.
    """
    _INLINE.add(function)
    return function


def is_inline(function: Callable[..., Any]) -> bool:
    """Return True if a function is read where it is called."""
    return function in _INLINE


@intrinsic
def shares(count: int, step: int) -> range:
    """Range up to `count`, whose rounds the threads of a GPU share."""
    return range(0, count, step)


@intrinsic
def together() -> None:
    """Wait for the other threads of a GPU's warp."""


@intrinsic
def load(array: np.ndarray, i: int) -> Any:
    """Load lanes.

    `array`: [n]; `i`: first element.
    """
    return array[i : i + WIDTH].copy()


@intrinsic
def store(array: np.ndarray, i: int, lanes: Any) -> None:
    """Store lanes.

    `array`: [n]; `i`: first element.
    """
    array[i : i + WIDTH] = lanes


@intrinsic
def around(centre: Any, half: float) -> Interval:
    """Interval around a centre."""
    return Interval(centre - half, centre + half, ARRAYS).outward()


@intrinsic
def lower(interval: Interval) -> Any:
    """Lower bound of an interval."""
    return interval.lo


@intrinsic
def upper(interval: Interval) -> Any:
    """Upper bound of an interval."""
    return interval.hi


@intrinsic
def gather(i: Any, P: np.ndarray) -> Any:
    """Load an element of P for each lane.

    `i`: whole, possible indices, as reals; `P`: parameters of the scene.
    """
    return P[np.asarray(i).astype(np.intp)]


@intrinsic
def field(x: Any, y: Any, z: Any, P: Any) -> Any:
    """Evaluate the scene's signed field.

    `x`, `y`, `z` in scene units; `P`: parameters of the scene.
    """
    return P(x, y, z)


OPERATIONS = frozenset(("load", "store", "around", "lower", "upper", "gather", "together"))
"""Intrinsics that are operations of a graph; the others are functions of the scene."""

_ELEMENTS = {
    "i": "int32",
    "v": "int32",
    "h": "int16",
    "b": "uint8",
    "f": "float32",
    "d": "float64",
    "n": "int64",
}
OWN = "wv"
"""Letters of workspaces: arrays that a thread of a GPU has to itself, without their being passed."""


def element_type(letter: str, real: np.dtype) -> np.dtype:
    """Return the type of the elements of an array argument, or of a number.

    `letter`: "r" or "w" an array of the kernel's float type, "i" or "v" of int32, "h" of int16, "b" of uint8,
    "f" of float32, "d" of float64; "n" an integer, "x" a float.
    """
    return np.dtype(_ELEMENTS.get(letter, real))


def is_array(letter: str) -> bool:
    """Return True for the letter of an array."""
    return letter not in "nx"


@dataclass(frozen=True)
class Loop:
    """C function over a field."""

    function: Callable[..., None]  # python function of the loop
    # one letter per argument, see `element_type`. The first argument is P by convention
    arguments: str
    # further arguments by name, constant at compile time: functions, and records of numbers
    fixed: tuple[tuple[str, Any], ...] = ()
    # kind of the coordinates that it passes to the field: "lanes", or "interval" for cells
    points: str = "lanes"
    own: int = 0  # numbers in each workspace of a thread of a GPU

    @property
    def name(self) -> str:
        """Name of the function."""
        return self.function.__name__

    def fix(self, **fixed: Any) -> Loop:
        """Return the loop with arguments that are constant at compile time."""
        return replace(self, fixed=tuple(fixed.items()))


def loop(arguments: str, points: str = "lanes") -> Callable[[Callable[..., None]], Loop]:
    """Return a decorator that makes a function a `Loop`."""
    return lambda function: Loop(function, arguments, points=points)


@loop("rrrrrn")
def points(P, X, Y, Z, F, n):
    """Evaluate the field at points; NaN at a point with a NaN.

    `P`: parameters of the scene; `X`, `Y`, `Z`: [n] each, scene units; `F`: [n]; `n`: number of points, a
    multiple of WIDTH.
    """
    for i in shares(n, WIDTH):
        x = load(X, i)
        y = load(Y, i)
        z = load(Z, i)
        f = field(x, y, z, P)
        s = x + y + z
        store(F, i, where(s == s, f, s))


@loop("rxxxxrrrirn")
def bricks(P, ox, oy, oz, h, IX, IY, IZ, corners, F, n, ahead):
    """Evaluate the 512 samples of bricks, at ``(ox, oy, oz) + h * (corner + (IX, IY, IZ))``.

    Parameters
    ----------
    P
        Parameters of the scene.
    ox, oy, oz, h
        Position of grid point (0, 0, 0), and grid spacing, scene units.
    IX, IY, IZ
        Offsets from the corner, [ahead + 512] each: of points that are asked first, then of the samples.
    corners
        Grid index of the first sample of each brick, int32 [n, 3].
    F
        Receives the values, [n, 512].
    n
        Number of bricks.
    ahead
        Number of points that are asked first, a multiple of WIDTH, constant; their values are not kept.
    """
    samples = 512 if WIDTH > 1 else 1  # of a round: a brick, or the one of a thread
    for first in shares(512 * n, samples):
        b = first >> 9
        begin = first & 511
        x0 = corners[3 * b]
        y0 = corners[3 * b + 1]
        z0 = corners[3 * b + 2]
        for s in range(begin - ahead, begin + samples, WIDTH):
            if WIDTH > 1:
                ix, iy, iz = load(IX, s + ahead), load(IY, s + ahead), load(IZ, s + ahead)
            else:  # loads are what a thread waits for
                ix, iy, iz = 1.0 * (s >> 6 & 7), 1.0 * (s >> 3 & 7), 1.0 * (s & 7)
            x = (ix + x0) * h + ox
            y = (iy + y0) * h + oy
            z = (iz + z0) * h + oz
            store(F, 512 * b + max(s, 0), field(x, y, z, P))


bricks = bricks.fix(ahead=0)


@loop("rrrrrrrn", points="interval")
def enclosures(P, FRAME, X, Y, Z, LOW, HIGH, n):
    """Enclose the values of the field on cells.

    `P`: parameters of the scene; `FRAME`: [1], scene units; `X`, `Y`, `Z`: [n] each, scene units; `LOW`,
    `HIGH`: [n]; `n`: number of cells, a multiple of WIDTH.
    """
    half = FRAME[0]
    for i in shares(n, WIDTH):
        x = around(load(X, i), half)
        y = around(load(Y, i), half)
        z = around(load(Z, i), half)
        f = field(x, y, z, P)
        store(LOW, i, lower(f))
        store(HIGH, i, upper(f))
