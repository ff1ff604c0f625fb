"""Loops around a field, the entry points of a compiled kernel, and the intrinsics that they use.

A loop is a Python function that uses the intrinsics of formulas and of `intrinsics`, ``while``, array
elements, and the numbers and functions of its module. It becomes a C function.

Here they are implemented on NumPy arrays, so that a loop also runs as plain Python: lanes are a slice, and P
is the field itself, a function of ``x, y, z``. The compiler implements the same names in machine code.

`cuda_intrinsics` implements them on a GPU, and can be imported only where Numba's CUDA target is available.

One thread does the work of one lane. The numbers of a loop are typed by hand: ``real(0.5)``, ``whole(3)``.
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


@dataclass(frozen=True)
class Loop:
    """C function over a field."""

    function: Callable[..., None]  # python function of the loop
    # one letter per argument: "r" a pointer to the kernel's float type, "i" to int32, "n" an integer. The
    # first argument is P by convention
    arguments: str = ""
    # further arguments by name, constant at compile time: functions, and records of numbers
    fixed: tuple[tuple[str, Any], ...] = ()
    # kind of the coordinates that it passes to the field: "lanes", or "interval" for cells
    points: str = "lanes"

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

    `P`: parameters of the scene; `FRAME`: [1], scene units; `X`, `Y`, `Z`: [n] each, scene units; `LOW`,
    `HIGH`: [n]; `n`: number of cells, a multiple of WIDTH.
    """
    half = FRAME[0]
    for i in range(0, n, WIDTH):
        x = around(load(X, i), half)
        y = around(load(Y, i), half)
        z = around(load(Z, i), half)
        f = field(x, y, z, P)
        store(LOW, i, lower(f))
        store(HIGH, i, upper(f))


def kernel(function: Callable[..., None]) -> Loop:
    """Decorate a loop that threads are launched on."""
    return Loop(function)


def device(function: Function) -> Function:
    """Decorate a function that loops call and whose numbers are typed by hand."""
    return function


@intrinsic
def real(value: Any) -> Any:
    """Return a number of the kernel's float type."""
    return float(value)


@intrinsic
def whole(value: Any) -> Any:
    """Return a 32-bit integer."""
    return int(value)


@intrinsic
def thread() -> int:
    """Return the global index of this thread."""
    raise NotImplementedError


@intrinsic
def together() -> None:
    """Synchronise the threads of the warp."""
    raise NotImplementedError


@intrinsic
def divide(a: Any, b: Any) -> Any:
    """Return a / b by the GPU's own division."""
    raise NotImplementedError
