"""Machine code as functions of NumPy arrays.

This is the only place where an array becomes an address, beside calls of CUDA's driver (`cuda_memory`), which
copy before they return. Code and arrays are kept alive by the call, or by the native object that holds both
(`fracslice/native/machine.h`), so neither can be freed while in use.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np

from .elf import Image, UnsupportedError
from .loops import Loop


class Function:
    """Compiled loop, called with arrays and integers. Thread-safe; releases the GIL.

    Arrays must be C-contiguous, of the kernel's dtype where the loop has "r" and int32 where it has "i";
    otherwise a call raises `ctypes.ArgumentError`.

    Attributes
    ----------
    arguments
        Arguments of the loop, one letter each.
    address
        Address of the code, valid while this object exists.
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
    """Argument type for ctypes, which calls `from_param` and keeps the array alive until the function
    returns.
    """

    def __init__(self, dtype: np.dtype) -> None:
        self.dtype = dtype

    def from_param(self, array: np.ndarray) -> Any:
        if array.dtype != self.dtype or not array.flags.c_contiguous:
            order = "C-contiguous" if array.flags.c_contiguous else "not C-contiguous"
            raise TypeError(f"an array of {array.dtype}, {order}: expected {self.dtype}, C-contiguous")
        if array.flags.writeable and array.size:
            # Three times as fast as the code below, which read-only and empty arrays need.
            return ctypes.byref(ctypes.c_char.from_buffer(array.data))
        return ctypes.c_void_p(array.ctypes.data)


def loaded(code: bytes, loops: Sequence[Loop], dtype: np.dtype) -> dict[str, Function]:
    """Load the functions of an object file.

    Parameters
    ----------
    code
        Object file.
    loops
        Loops that it contains.
    dtype
        Floating-point type of the kernel.

    Returns
    -------
    dict
        Functions by name.
    """
    try:
        engine: Any = Image(code)
    except UnsupportedError:
        engine = _by_llvm(code)
    return {loop.name: Function(engine, loop, dtype) for loop in loops}


def _by_llvm(code: bytes) -> Any:
    """Execution engine of an object file."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def constant(values: np.ndarray, dtype: np.dtype | str) -> np.ndarray:
    """Return a read-only, C-contiguous copy, which threads may share.

    Parameters
    ----------
    values
        Array to copy.
    dtype
        Type of the copy.

    Returns
    -------
    ndarray
        Read-only array.
    """
    kept = np.array(values, dtype, order="C")
    kept.setflags(write=False)
    return kept
