"""Intrinsics of CUDA loops as linters see them.

`cuda_intrinsics` implements them on a GPU, and can be imported only where Numba's CUDA target is available.

One thread does the work of one lane. The numbers of a loop are typed by hand: ``real(0.5)``, ``whole(3)``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .intrinsics import Function, intrinsic
from .loops import Loop


def kernel(function: Callable[..., None]) -> Loop:
    """Decorate a loop that threads are launched on.

    Returns
    -------
    Loop
        Loop without declared arguments.
    """
    return Loop(function)


def device(function: Function) -> Function:
    """Decorate a function that loops call and whose numbers are typed by hand.

    Returns
    -------
    Callable
        The function itself.
    """
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
