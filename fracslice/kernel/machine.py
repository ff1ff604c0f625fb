"""Machine code as functions of NumPy arrays.

Nowhere else does an array become an address. Code and arrays are held by the call, or by the native object
that is given both (`fracslice/native/machine.h`), so neither can be freed while it is in use.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np

from .loops import Loop


class Function:
    """A compiled loop, called with arrays and whole numbers. Safe to call from many threads at once.

    Other threads of the interpreter run meanwhile. Arrays are C-contiguous; their dtype is the kernel's where
    the loop says "r", int32 where it says "i"; a `ctypes.ArgumentError` otherwise.

    arguments: the loop's. address: the code's, valid as long as this object lives.
    """

    def __init__(self, engine: Any, loop: Loop, dtype: np.dtype) -> None:
        kinds = {"r": _Pointer(dtype), "i": _Pointer(np.dtype(np.int32)), "n": ctypes.c_ssize_t}
        self.arguments = loop.arguments
        self.address: int = engine.get_function_address(loop.name)
        self._call = ctypes.CFUNCTYPE(None, *[kinds[a] for a in loop.arguments])(self.address)  # type: ignore[arg-type]
        self._engine = engine

    def __call__(self, *arguments: np.ndarray | int) -> None:
        self._call(*arguments)


class _Pointer:
    """An argument type of ctypes, which calls `from_param` and keeps the array until the function returns."""

    def __init__(self, dtype: np.dtype) -> None:
        self.dtype = dtype

    def from_param(self, array: np.ndarray) -> Any:
        if array.dtype != self.dtype or not array.flags.c_contiguous:
            order = "C-contiguous" if array.flags.c_contiguous else "not C-contiguous"
            raise TypeError(f"an array of {array.dtype}, {order}: expected {self.dtype}, C-contiguous")
        if array.flags.writeable and array.size:
            # A third of the time of the other way, which read-only and empty arrays need.
            return ctypes.byref(ctypes.c_char.from_buffer(array.data))
        return ctypes.c_void_p(array.ctypes.data)


def loaded(code: bytes, loops: Sequence[Loop], dtype: np.dtype) -> dict[str, Function]:
    """The functions of an object file, by name."""
    import llvmlite.binding as llvm

    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return {loop.name: Function(engine, loop, dtype) for loop in loops}


def constant(values: np.ndarray, dtype: np.dtype | str) -> np.ndarray:
    """A copy that nobody can change, C-contiguous: what several threads may read."""
    kept = np.array(values, dtype, order="C")
    kept.setflags(write=False)
    return kept
