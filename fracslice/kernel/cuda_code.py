"""Machine code of CUDA loops, kept in the cache folder: only compiling it needs Numba."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cache, lru_cache, partial
from types import ModuleType, SimpleNamespace
from typing import Any

from ..common.cache_files import Kept, cache_folder
from ..common.keys import key
from .cuda_api import call, capability
from .cuda_driver import cuda_toolchain, simulated
from .cuda_memory import Kind, argument


@cache
def loaded(text: str, names: tuple[str, ...]) -> Any:
    """Load the loops of a module.

    Parameters
    ----------
    text
        Source text.
    names
        Loops.

    Returns
    -------
    object
        Has the loops as attributes: those of Numba's simulator, or one `CudaFunction` each.
    """
    if simulated():
        return executed(text)
    return SimpleNamespace(**{name: CudaFunction(text, name) for name in names})


@lru_cache(maxsize=8)
def executed(text: str) -> ModuleType:
    """Return the module of a text, whose loops Numba compiles or simulates."""
    module = ModuleType(f"cuda_{key(text)}")
    exec(compile(text, module.__name__, "exec"), module.__dict__)
    return module


class CudaFunction:
    """Loop on the GPU, compiled for each combination of types of its arguments at first use.

    Parameters
    ----------
    text
        Source text of its module.
    name
        Its name there.
    """

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
    """Compile a loop for the GPU.

    Parameters
    ----------
    text
        Source text of its module.
    name
        Its name there.
    kinds
        Types of its arguments.

    Returns
    -------
    bytes
        A line with the name of the entry point, then the machine code.
    """
    from .cuda_intrinsics import types

    def numba_type(dtype: str, dimensions: int, order: str) -> Any:
        element = getattr(types, dtype)
        return types.Array(element, dimensions, order) if dimensions else element

    kernel = getattr(executed(text), name).compile(tuple(numba_type(*kind) for kind in kinds))
    cubin = kernel.library.get_cubin()
    return bytes(f"{kernel.entry_name}\n".encode() + getattr(cubin, "code", cubin))
