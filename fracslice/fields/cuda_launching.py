"""Loops over linked scenes on an NVIDIA GPU: their machine code, kept in the cache, and their launches."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from ..common.cache import Kept, cache_folder, key
from ..expr import cuda_source
from ..expr.cuda_driver import cuda_toolchain, is_simulated, require
from ..expr.cuda_memory import Kind, argument, call, capability
from ..expr.language import Linked
from ..expr.loops import Loop
from .field import Loops, Precision


@cache
def load_module(text: str, names: tuple[str, ...]) -> Any:
    """Load the loops of a module."""
    if is_simulated():
        return execute_module(text)
    return SimpleNamespace(**{name: CudaFunction(text, name) for name in names})


@lru_cache(maxsize=8)
def execute_module(text: str) -> ModuleType:
    """Return the module of a text, whose loops Numba compiles or simulates."""
    module = ModuleType(f"cuda_{key(text)}")
    exec(compile(text, module.__name__, "exec"), module.__dict__)
    return module


class CudaFunction:
    """Loop on the GPU, compiled for each combination of types of its arguments at first use."""

    def __init__(self, text: str, name: str) -> None:
        self._text, self._name = text, name
        self._functions: dict[tuple[Kind, ...], ctypes.c_void_p] = {}

    def __getitem__(self, grid: tuple[int, int]) -> Callable[..., None]:
        """Return a function that launches it, for a number of blocks and the threads of each."""
        return partial(self._launch, *grid)

    def _launch(self, blocks: int, threads: int, *values: Any) -> None:
        kinds, packed = zip(*map(argument, values), strict=True)
        if kinds not in self._functions:
            self._functions[kinds] = self._function(kinds)
        data = b"".join(packed)
        buffer = ctypes.create_string_buffer(data, len(data))
        first = ctypes.addressof(buffer)
        places = (ctypes.c_void_p * (len(data) // 8))(*range(first, first + len(data), 8))
        call("cuLaunchKernel", self._functions[kinds], blocks, 1, 1, threads, 1, 1, 0, None, places, None)

    def _function(self, kinds: tuple[Kind, ...]) -> ctypes.c_void_p:
        """Machine code for types of arguments: cached, or compiled and cached."""
        name = f"{key(self._text, self._name, kinds, capability(), cuda_toolchain())}.cubin"
        kept = Kept(cache_folder()).cached(name, lambda: compiled(self._text, self._name, kinds))
        entry, code = kept.split(b"\n", 1)
        module, function = ctypes.c_void_p(), ctypes.c_void_p()
        call("cuModuleLoadData", ctypes.byref(module), code)
        call("cuModuleGetFunction", ctypes.byref(function), module, entry)
        return function


def compiled(text: str, name: str, kinds: Sequence[Kind]) -> bytes:
    """Compile a loop for the GPU."""
    from ..expr.cuda_intrinsics import types

    def numba_type(dtype: str, dimensions: int, order: str) -> Any:
        element = getattr(types, dtype)
        return types.Array(element, dimensions, order) if dimensions else element

    kernel = getattr(execute_module(text), name).compile(tuple(numba_type(*kind) for kind in kinds))
    cubin = kernel.library.get_cubin()
    return bytes(f"{kernel.entry_name}\n".encode() + getattr(cubin, "code", cubin))


BLOCK = 128
"""Threads per block."""

_LAUNCH = threading.Lock()
"""Lock around kernel launches: the first of a loop compiles it, which must happen only once."""

LANES = 1 << 18
"""Lanes of a call of a loop: few enough that one call is copied while native code prepares others."""


@dataclass(frozen=True, eq=False)
class CudaLoop:
    """`fields.field.CompiledLoop` on the GPU, with a thread per lane. Rows are copied there and back."""

    loop: Any  # kernel
    parameters: Any  # parameters of the scene, on the GPU

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
        cuda = require()
        result = cuda.to_device(out)
        self.launch(rows.shape[1], cuda.to_device(frame), *cuda.to_device(rows), *result)
        result.copy_to_host(out)

    def launch(self, count: int, frame: Any, *arguments: Any) -> None:
        """Launch the loop on rows in GPU memory, without waiting for it."""
        launch(self.loop, count, self.parameters, frame, *arguments, count)

    def native(self, frame: np.ndarray) -> Callable[..., None]:
        """Return a function for native code; see `FieldLoop.native`."""
        return partial(self, frame)


@lru_cache(maxsize=32)
def compile_loops(linked: Linked, loops: tuple[Loop, ...], precision: Precision) -> Loops:
    """Compile loops for the GPU, with one lane; see `cpu.compile_loops`."""
    module, placed = load_loops(linked, precision, loops), parameters(linked, precision)
    runs = {loop.name: CudaLoop(getattr(module, loop.name), placed) for loop in loops}
    return Loops(1, LANES, runs, on_gpu=True)


def launch(loop: Any, threads: int, *arguments: Any) -> None:
    """Launch a loop without waiting for it."""
    with _LAUNCH:
        loop[-(-threads // BLOCK), BLOCK](*arguments)


def parameters(linked: Linked, precision: Precision) -> Any:
    """Copy the parameters P of a linked scene to the GPU.

    Passing them as launch constants is no faster, and makes launching slower.

    `precision`: "float32" or "float64".
    """
    return require().to_device(linked.parameters.astype(precision))


def load_loops(linked: Linked, precision: Precision, loops: Sequence[Loop]) -> Any:
    """Load loops over a linked scene. Each is compiled at its first call, for the types of its arguments.

    `precision`: "float32" or "float64".
    """
    require()
    text = cuda_source.module(linked, 32 if precision == "float32" else 64, loops)
    return load_module(text, tuple(loop.name for loop in loops))
