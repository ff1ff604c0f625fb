"""Availability of CUDA: the package, the driver and a GPU."""

from __future__ import annotations

import os
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..common.cache import key, texts
from ..common.messages import lacking
from ..errors import KernelError
from . import cuda_memory
from .cuda_memory import present
from .host import kept_text

NO_GPU = "CUDA: no NVIDIA GPU, or no driver for it, was found on this machine"
"""Message for a missing GPU or driver."""


def missing() -> str | None:
    """Return the reason why this process cannot use CUDA."""
    if reason := lacking("numba_cuda", "CUDA needs", "numba-cuda[cu13]"):
        return reason
    if not is_simulated() and not present():
        return NO_GPU
    try:
        _compiler()
    except KernelError as error:
        return str(error)
    return None


def is_simulated() -> bool:
    """Return True if Numba's simulator takes the place of a GPU."""
    return os.environ.get("NUMBA_ENABLE_CUDASIM") == "1"


@lru_cache(maxsize=1)
def _compiler() -> str:
    """Key of a compiler that works: cached, or imported, which takes longer than a small job."""
    return kept_text("compilers", (cuda_toolchain(),), _imported)


def _imported() -> str:
    try:
        from . import cuda_intrinsics
    except (ImportError, RuntimeError) as error:
        raise KernelError(f"CUDA cannot be used: {str(error).splitlines()[0]}") from error
    if not cuda_intrinsics.cuda.is_available():
        raise KernelError(NO_GPU)
    return cuda_toolchain()


def available() -> bool:
    """Return True if there is a GPU to compile for."""
    return missing() is None


def require() -> Any:
    """Return the functions that allocate arrays."""
    reason = missing()
    if reason:
        raise KernelError(reason)
    if not is_simulated():
        return cuda_memory
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
