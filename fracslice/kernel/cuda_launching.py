"""Loops over linked scenes on an NVIDIA GPU."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from ..formulas.field import Loops, Precision
from . import cuda_source
from .cuda_code import loaded
from .cuda_driver import require
from .linker import Linked
from .loops import Loop

BLOCK = 128
"""Threads per block."""

_LAUNCH = threading.Lock()
"""Lock around kernel launches: the first of a loop compiles it, which must happen only once."""

LANES = 1 << 18
"""Lanes of a call of a loop: few enough that one call is copied while native code prepares others."""


@dataclass(frozen=True, eq=False)
class CudaLoop:
    """`formulas.field.CompiledLoop` on the GPU, with a thread per lane. Rows are copied there and back.

    Attributes
    ----------
    loop
        Kernel.
    parameters
        Parameters of the scene, on the GPU.
    """

    loop: Any
    parameters: Any

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
        cuda = require()
        result = cuda.to_device(out)
        self.launch(rows.shape[1], cuda.to_device(frame), *cuda.to_device(rows), *result)
        result.copy_to_host(out)

    def launch(self, count: int, frame: Any, *arguments: Any) -> None:
        """Launch the loop on rows in GPU memory, without waiting for it.

        Parameters
        ----------
        count
            Lanes.
        frame
            Frame of the loop.
        *arguments
            Input rows and output rows.
        """
        launched(self.loop, count, self.parameters, frame, *arguments, count)

    def native(self, frame: np.ndarray) -> Callable[..., None]:
        """Return a function for native code; see `FieldLoop.native`."""
        return partial(self, frame)


@lru_cache(maxsize=32)
def compile_loops(linked: Linked, loops: tuple[Loop, ...], precision: Precision) -> Loops:
    """Compile loops for the GPU, with one lane; see `cpu.compile_loops`."""
    module, placed = load_loops(linked, precision, loops), parameters(linked, precision)
    runs = {loop.name: CudaLoop(getattr(module, loop.name), placed) for loop in loops}
    return Loops(1, LANES, runs, on_gpu=True)


def launched(loop: Any, threads: int, *arguments: Any) -> None:
    """Launch a loop without waiting for it.

    Parameters
    ----------
    loop
        Compiled loop.
    threads
        Least number of threads, > 0.
    *arguments
        Arguments of the loop.
    """
    with _LAUNCH:
        loop[-(-threads // BLOCK), BLOCK](*arguments)


def parameters(linked: Linked, precision: Precision) -> Any:
    """Copy the parameters P of a linked scene to the GPU.

    Passing them as launch constants is no faster, and makes launching slower.

    Parameters
    ----------
    linked
        Linked scene.
    precision
        "float32" or "float64".

    Returns
    -------
    DeviceNDArray
        Parameters on the GPU.

    Raises
    ------
    KernelError
        If no GPU can be used.
    """
    return require().to_device(linked.parameters.astype(precision))


def load_loops(linked: Linked, precision: Precision, loops: Sequence[Loop]) -> Any:
    """Load loops over a linked scene. Each is compiled at its first call, for the types of its arguments.

    Parameters
    ----------
    linked
        Linked scene.
    precision
        "float32" or "float64".
    loops
        Loops to load.

    Returns
    -------
    object
        Has the loops as attributes.

    Raises
    ------
    KernelError
        If no GPU can be used.
    """
    require()
    text = cuda_source.module(linked, 32 if precision == "float32" else 64, loops)
    return loaded(text, tuple(loop.name for loop in loops))
