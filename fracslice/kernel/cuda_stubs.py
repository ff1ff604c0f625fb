"""The intrinsics of CUDA loops, as linters see them.

`cuda_intrinsics` says what they mean on a GPU, and can be imported only where Numba's CUDA is.

One thread does the work of one lane. The numbers of a loop are typed by hand: ``real(0.5)``, ``whole(3)``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .intrinsics import Function, intrinsic
from .loops import Loop


def kernel(function: Callable[..., None]) -> Loop:
    """Decorates a loop that is started on threads."""
    return Loop(function)


def device(function: Function) -> Function:
    """Decorates a function that loops call, whose numbers are typed by hand."""
    return function


@intrinsic
def real(value: Any) -> Any:
    """A number as wide as the kernel's floats."""
    return float(value)


@intrinsic
def whole(value: Any) -> Any:
    """A whole number of 32 bits."""
    return int(value)


@intrinsic
def thread() -> int:
    """The number of this thread, of all that were started."""
    raise NotImplementedError


@intrinsic
def together() -> None:
    """Waits for the other threads of the warp, so that they go on in step."""
    raise NotImplementedError


@intrinsic
def divide(a: Any, b: Any) -> Any:
    """a / b by the GPU's own division."""
    raise NotImplementedError
