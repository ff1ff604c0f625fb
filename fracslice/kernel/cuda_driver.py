"""Availability of CUDA: the package, the driver and a GPU."""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..common.extras import lacking
from ..common.keys import key, texts
from ..errors import KernelError

NO_GPU = "CUDA: no NVIDIA GPU, or no driver for it, was found on this machine"
"""Message for a missing GPU or driver."""


def missing() -> str | None:
    """Return the reason why this process cannot use CUDA.

    Returns
    -------
    str
        One line; None if CUDA can be used.
    """
    if reason := lacking("numba_cuda", "CUDA needs", "numba-cuda[cu13]"):
        return reason
    if os.environ.get("NUMBA_ENABLE_CUDASIM") != "1" and not _driver():
        return NO_GPU
    try:
        from . import cuda_intrinsics
    except (ImportError, RuntimeError) as error:
        return f"CUDA cannot be used: {str(error).splitlines()[0]}"
    return None if cuda_intrinsics.cuda.is_available() else NO_GPU


def _driver() -> bool:
    """True if NVIDIA's driver is installed: a fast test without Numba."""
    try:
        ctypes.CDLL("nvcuda.dll" if os.name == "nt" else "libcuda.so.1")
    except OSError:
        return False
    return True


def available() -> bool:
    """Return True if there is a GPU to compile for."""
    return missing() is None


def require() -> Any:
    """Return Numba's ``cuda`` module.

    Returns
    -------
    module
        Module `numba.cuda`.

    Raises
    ------
    KernelError
        If no GPU can be used.
    """
    reason = missing()
    if reason:
        raise KernelError(reason)
    from . import cuda_intrinsics

    return cuda_intrinsics.cuda


@lru_cache(maxsize=1)
def cuda_toolchain() -> str:
    """Return the key of everything besides a module's own text that its machine code depends on."""
    from importlib.metadata import version  # imports an e-mail parser

    source = texts(Path(__file__).parent / "cuda_intrinsics.py")
    versions = (version(name) for name in ("numba-cuda", "numba", "llvmlite"))
    return key(source, *versions, *_numba_settings())


def _numba_settings() -> list[str]:
    """Numba's settings: its environment variables and its file in the current folder."""
    settings = sorted(f"{name}={value}" for name, value in os.environ.items() if name.startswith("NUMBA_"))
    with suppress(OSError):
        settings.append(repr(Path(".numba_config.yaml").read_bytes()))
    return settings
