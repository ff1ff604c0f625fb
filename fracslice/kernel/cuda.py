"""The CUDA back end: a scene's field on an NVIDIA GPU, by numba-cuda.

Importing this is cheap and always possible. `available` says whether there is a GPU; what needs one raises
`KernelError` with a line that says what is missing. The machine code is kept in the cache folder, beside
the text that it was made of.
"""

from __future__ import annotations

import atexit
import ctypes
import importlib.util
import math
import os
import shutil
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO

import numpy as np

from ..errors import KernelError
from ..extras import lacking
from ..files import Kept
from ..formulas.field import Kernel, Precision
from ..formulas.registry import Node
from ..keys import key, texts
from . import cuda_source
from .cuda_loops import bricks, points
from .linker import Linked, link
from .loops import Loop
from .objects import cache_folder

BLOCK = 128
"""Threads of a block."""

_LAUNCH = threading.Lock()
"""Numba's first launch of a kernel may happen once only, and launching holds the interpreter anyway."""

LOOPS = points, bricks

NO_GPU = "CUDA: no NVIDIA GPU, or no driver for it, was found on this machine"


def missing() -> str | None:
    """What keeps this process from using CUDA, in one line; None if nothing does."""
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
    """Whether NVIDIA's driver is there: known at once, without Numba."""
    try:
        ctypes.CDLL("nvcuda.dll" if os.name == "nt" else "libcuda.so.1")
    except OSError:
        return False
    return True


def available() -> bool:
    """Whether there is a GPU to compile for."""
    return missing() is None


def require() -> Any:
    """Numba's ``cuda`` module. Raises `KernelError` if there is no GPU to use."""
    reason = missing()
    if reason:
        raise KernelError(reason)
    from . import cuda_intrinsics

    return cuda_intrinsics.cuda


class CudaKernel(Kernel):
    """The compiled field of one scene on the GPU."""

    batch = 1 << 22

    def __init__(self, linked: Linked, precision: Precision = "float32") -> None:
        self._cuda = require()
        self.dtype = np.dtype(precision)
        self._loops = load_loops(linked, precision, LOOPS)
        self._parameters = parameters(linked, precision)

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        shape = np.shape(x)
        if np.size(x) == 0:
            return np.empty(shape, self.dtype)
        coordinates = np.empty((3, np.size(x)), self.dtype)
        with np.errstate(over="ignore"):
            for row, values in zip(coordinates, (x, y, z), strict=True):
                row[:] = np.ravel(values)
        placed = self._cuda.to_device(coordinates)
        out = self._cuda.device_array(coordinates.shape[1], self.dtype)
        self.points_on_device(placed[0], placed[1], placed[2], out)
        found: np.ndarray = out.copy_to_host()
        return found.reshape(shape)

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """`Kernel.bricks`, whose values can differ from those of `points` in the last place."""
        assert corners.dtype == np.int32 and corners.flags.c_contiguous and out.flags.c_contiguous
        assert out.dtype == self.dtype and out.shape == (len(corners), 512)
        if len(corners):
            filled = self._cuda.device_array(out.shape, self.dtype)
            self.bricks_on_device(self._cuda.to_device(corners), origin, voxel, filled)
            filled.copy_to_host(out)

    def points_on_device(self, x: Any, y: Any, z: Any, out: Any) -> None:
        """`points` on arrays of the GPU (Numba's, CuPy's, PyTorch's, ...), 1-D and of the kernel's dtype.
        Copies nothing and does not wait for the GPU."""
        launched(self._loops.points, math.prod(out.shape), self._parameters, x, y, z, out)

    def bricks_on_device(
        self, corners: Any, origin: tuple[float, float, float], voxel: float, out: Any
    ) -> None:
        """`bricks` on arrays of the GPU. Copies nothing and does not wait for the GPU."""
        frame = [self.dtype.type(v) for v in (*origin, voxel)]
        launched(self._loops.bricks, math.prod(out.shape), self._parameters, *frame, corners, out)


def launched(loop: Any, threads: int, *arguments: Any) -> None:
    """Starts a loop on at least so many threads, more than 0; does not wait for them."""
    with _LAUNCH:
        loop[-(-threads // BLOCK), BLOCK](*arguments)


@lru_cache(maxsize=32)
def _kernel(source: str, values: bytes, precision: Precision) -> CudaKernel:
    return CudaKernel(Linked(source, np.frombuffer(values)), precision)


def compile_scene(root: Node, precision: Precision = "float32") -> CudaKernel:
    """The kernel of a scene tree whose depths are resolved. Raises `KernelError`, also if there is no GPU."""
    linked = link(root)
    return _kernel(linked.source, linked.parameters.tobytes(), precision)


def parameters(linked: Linked, precision: Precision) -> Any:
    """A linked scene's P, on the GPU. As constants of the launch it is no faster, and launching is slower."""
    return require().to_device(linked.parameters.astype(precision))


def load_loops(linked: Linked, precision: Precision, loops: Sequence[Loop]) -> ModuleType:
    """Loops over a linked scene, as attributes of a module; each is compiled for the types of its first
    call's arguments.

    Raises `KernelError` if there is no GPU.
    """
    require()
    text = cuda_source.module(linked, 32 if precision == "float32" else 64, loops)
    name = f"cuda_{key(text, _toolchain())}"
    return sys.modules.get(name) or _imported(name, text)


@lru_cache(maxsize=1)
def _toolchain() -> str:
    """The key of everything beside the module's own text that the machine code depends on."""
    words = texts(Path(__file__).parent / "cuda_intrinsics.py")
    versions = (version(name) for name in ("numba-cuda", "numba", "llvmlite"))
    return key(words, *versions, *_numba_settings())


def _numba_settings() -> list[str]:
    """What Numba is told to do otherwise: its variables and its file in the current folder."""
    told = sorted(f"{name}={value}" for name, value in os.environ.items() if name.startswith("NUMBA_"))
    with suppress(OSError):
        told.append(repr(Path(".numba_config.yaml").read_bytes()))
    return told


def _imported(name: str, text: str) -> ModuleType:
    """Numba caches the machine code of a function beside its file, so the text becomes a file that stays; one
    for this process alone where others could write it.
    """
    path = _kept(cache_folder(), name, text) or _kept(_own_folder(), name, text)
    assert path
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return sys.modules.setdefault(name, module)


@lru_cache(maxsize=1)
def _own_folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="fracslice-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _kept(folder: Path, name: str, text: str) -> Path | None:
    """The file with this text; None if it cannot be kept. Its date is that of the first who wrote it, which
    Numba's cache asks for."""
    kept, file, whole = Kept(folder), f"{name}.py", text.encode()
    if kept.get(file, _read) != whole:
        with suppress(OSError):
            kept.put(file, lambda to: to.write(whole))
        if kept.get(file, _read) != whole:
            return None
    return Path(os.path.realpath(folder), file)


def _read(file: BinaryIO) -> bytes:
    return file.read()
