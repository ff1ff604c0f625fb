"""NVIDIA's driver: availability, arrays in GPU memory, and code that is loaded and launched."""

from __future__ import annotations

import ctypes
import math
import os
import weakref
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..errors import KernelError

NO_GPU = "CUDA: no NVIDIA GPU, or no driver for it, was found on this machine"
"""Message for a missing GPU or driver."""

_PLACE, _SIZE, _NUMBER, _INT = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_uint, ctypes.c_int
_CALLS: dict[str, tuple[Any, ...]] = {
    "cuInit": (_NUMBER,),
    "cuGetErrorString": (_INT, _PLACE),
    "cuDeviceGetCount": (_PLACE,),
    "cuDeviceGet": (_PLACE, _INT),
    "cuDeviceGetAttribute": (_PLACE, _INT, _INT),
    "cuDevicePrimaryCtxRetain": (_PLACE, _INT),
    "cuCtxGetDevice": (_PLACE,),
    "cuCtxSetCurrent": (_PLACE,),
    "cuStreamSynchronize": (_PLACE,),
    "cuMemAlloc_v2": (_PLACE, _SIZE),
    "cuMemFree_v2": (_PLACE,),
    "cuMemAllocHost_v2": (_PLACE, _SIZE),
    "cuMemFreeHost": (_PLACE,),
    "cuMemcpyHtoD_v2": (_PLACE, _PLACE, _SIZE),
    "cuMemcpyDtoH_v2": (_PLACE, _PLACE, _SIZE),
    "cuLinkCreate_v2": (_NUMBER, _PLACE, _PLACE, _PLACE),
    "cuLinkAddData_v2": (_PLACE, _INT, ctypes.c_char_p, _SIZE, ctypes.c_char_p, _NUMBER, _PLACE, _PLACE),
    "cuLinkComplete": (_PLACE, _PLACE, _PLACE),
    "cuLinkDestroy": (_PLACE,),
    "cuModuleLoadData": (_PLACE, _PLACE),
    "cuModuleGetFunction": (_PLACE, _PLACE, ctypes.c_char_p),
    "cuLaunchKernel": (_PLACE, *[_NUMBER] * 7, _PLACE, _PLACE, _PLACE),
}
_MAJOR, _MINOR = 75, 76  # attributes of a device
_PTX = 1  # kind of input of the linker
_MAX_REGISTERS = 0  # option of the linker


def missing() -> str | None:
    """Return the reason why this process cannot use CUDA."""
    return NO_GPU if _driver() is None else None


def available() -> bool:
    """Return True if there is a GPU to compile for."""
    return missing() is None


def require() -> None:
    """Raise `KernelError` if this process cannot use CUDA."""
    if reason := missing():
        raise KernelError(reason)


@lru_cache(maxsize=1)
def _driver() -> ctypes.CDLL | None:
    """Initialised driver; None if there is no GPU."""
    try:
        driver = ctypes.CDLL("nvcuda.dll" if os.name == "nt" else "libcuda.so.1")
    except OSError:
        return None
    for name, arguments in _CALLS.items():
        getattr(driver, name).argtypes = arguments
    count = ctypes.c_int()
    failed = driver.cuInit(0) or driver.cuDeviceGetCount(ctypes.byref(count))
    return driver if not failed and count.value else None


def call(name: str, *arguments: Any) -> None:
    """Call a function of the driver, in the context that CuPy and PyTorch use too."""
    _checked("cuCtxSetCurrent", _context()[1])  # each thread has its own
    _checked(name, *arguments)


def _checked(name: str, *arguments: Any) -> None:
    driver = _driver()
    assert driver is not None
    if status := getattr(driver, name)(*arguments):
        text = ctypes.c_char_p()
        driver.cuGetErrorString(status, ctypes.byref(text))
        raise KernelError(f"CUDA: {name.removesuffix('_v2')}: {(text.value or b'unknown error').decode()}")


@lru_cache(maxsize=1)
def _context() -> tuple[int, int | None]:
    """A device and its primary context: that in use by this thread, else the first."""
    device, context, driver = ctypes.c_int(), ctypes.c_void_p(), _driver()
    assert driver is not None
    if driver.cuCtxGetDevice(ctypes.byref(device)):
        _checked("cuDeviceGet", ctypes.byref(device), 0)
    _checked("cuDevicePrimaryCtxRetain", ctypes.byref(context), device)
    return device.value, context.value


@lru_cache(maxsize=1)
def capability() -> tuple[int, int]:
    """Return the compute capability of the GPU."""
    numbers = ctypes.c_int(), ctypes.c_int()
    for number, attribute in zip(numbers, (_MAJOR, _MINOR), strict=True):
        call("cuDeviceGetAttribute", ctypes.byref(number), attribute, _context()[0])
    return numbers[0].value, numbers[1].value


def assemble(ptx: bytes, registers: int) -> bytes:
    """Return the machine code of a text in PTX, for this GPU.

    `registers`: most registers of a thread.
    """
    state, code, size = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_size_t()
    option, value = ctypes.c_int(_MAX_REGISTERS), ctypes.c_void_p(registers)
    call("cuLinkCreate_v2", 1, ctypes.byref(option), ctypes.byref(value), ctypes.byref(state))
    try:
        call("cuLinkAddData_v2", state, _PTX, ptx, len(ptx) + 1, b"fracslice", 0, None, None)
        call("cuLinkComplete", state, ctypes.byref(code), ctypes.byref(size))
        return ctypes.string_at(code, size.value)
    finally:
        call("cuLinkDestroy", state)


def load_code(code: bytes, names: list[str]) -> list[ctypes.c_void_p]:
    """Load machine code for the rest of the process; return the functions of these names."""
    module, functions = ctypes.c_void_p(), [ctypes.c_void_p() for _ in names]
    call("cuModuleLoadData", ctypes.byref(module), code)
    for function, name in zip(functions, names, strict=True):
        call("cuModuleGetFunction", ctypes.byref(function), module, name.encode())
    return functions


def launch(function: ctypes.c_void_p, blocks: int, threads: int, words: list[bytes]) -> None:
    """Launch a function without waiting for it.

    `words`: eight bytes for each of its parameters.
    """
    data = b"".join(words)
    buffer = ctypes.create_string_buffer(data, len(data))
    first = ctypes.addressof(buffer)
    places = (ctypes.c_void_p * len(words))(*range(first, first + len(data), 8))
    call("cuLaunchKernel", function, blocks, 1, 1, threads, 1, 1, 0, None, places, None)


Shape = tuple[int, ...]


class Memory:
    """Memory that is freed with the last reference to it."""

    def __init__(self, allocate: str, free: str, size: int) -> None:
        place = ctypes.c_void_p()
        call(allocate, ctypes.byref(place), max(size, 1))
        assert place.value is not None
        self.address = place.value
        weakref.finalize(
            self, _free_array, free, self.address
        ).atexit = False  # the driver ends before Python


def _free_array(free: str, address: int) -> None:
    with suppress(KernelError):  # after a fault in a kernel every call fails, and says so
        call(free, address)


@dataclass(frozen=True, eq=False)
class DeviceArray:
    """C-contiguous array in GPU memory."""

    shape: Shape  # as of an array of NumPy
    dtype: np.dtype
    address: int  # first element
    owner: object  # keeps the memory

    @property
    def size(self) -> int:
        """Number of elements."""
        return math.prod(self.shape)

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        about = {"shape": self.shape, "typestr": self.dtype.str, "data": (self.address, False)}
        return {**about, "version": 3, "stream": 1}

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, which: int | slice) -> DeviceArray:
        """Return a row, or consecutive rows, in the same memory."""
        rows = range(len(self))[which]
        if isinstance(rows, range):
            assert rows.step == 1
            shape, first = (len(rows), *self.shape[1:]), rows.start
        else:
            shape, first = self.shape[1:], rows
        step = self.dtype.itemsize * math.prod(self.shape[1:])
        return DeviceArray(shape, self.dtype, self.address + first * step, self.owner)

    def __iter__(self) -> Iterator[DeviceArray]:
        return (self[k] for k in range(len(self)))

    def copy_to_host(self, to: np.ndarray | None = None) -> np.ndarray:
        """Wait for the GPU and return a copy, or fill an array."""
        to = np.empty(self.shape, self.dtype) if to is None else to
        self._like(to)
        call("cuMemcpyDtoH_v2", to.ctypes.data, self.address, to.nbytes)
        return to

    def copy_to_device(self, values: np.ndarray) -> None:
        """Fill this array."""
        self._like(values)
        call("cuMemcpyHtoD_v2", self.address, values.ctypes.data, values.nbytes)

    def _like(self, host: np.ndarray) -> None:
        assert host.flags.c_contiguous and (host.dtype, host.shape) == (self.dtype, self.shape)


def device_array(shape: int | Shape, dtype: np.typing.DTypeLike) -> DeviceArray:
    """Return an array whose values are not set."""
    shape, dtype = (shape,) if isinstance(shape, int) else tuple(shape), np.dtype(dtype)
    memory = Memory("cuMemAlloc_v2", "cuMemFree_v2", math.prod(shape) * dtype.itemsize)
    return DeviceArray(shape, dtype, memory.address, memory)


def to_device(values: np.ndarray) -> DeviceArray:
    """Return a copy in GPU memory."""
    array = device_array(values.shape, values.dtype)
    array.copy_to_device(np.ascontiguousarray(values))
    return array


def pinned_array(shape: int | Shape, dtype: np.typing.DTypeLike) -> np.ndarray:
    """Return an array in page-locked host memory, whose values are not set."""
    shape, dtype = (shape,) if isinstance(shape, int) else tuple(shape), np.dtype(dtype)
    memory = Memory("cuMemAllocHost_v2", "cuMemFreeHost", math.prod(shape) * dtype.itemsize)
    about = {"shape": shape, "typestr": dtype.str, "data": (memory.address, False), "version": 3}
    return np.asarray(SimpleNamespace(__array_interface__=about, memory=memory))  # which the array keeps


def address(array: Any, dtype: np.dtype) -> int:
    """Return the address of an array in GPU memory, after what the stream of another library still does.

    Raises `KernelError` if the array is of another type or not contiguous.
    """
    if isinstance(array, DeviceArray):
        found, place, whole = array.dtype, array.address, True
    else:
        about = array.__cuda_array_interface__
        if stream := about.get("stream"):
            call("cuStreamSynchronize", stream)
        found, place = np.dtype(about["typestr"]), about["data"][0]
        whole = about.get("strides") in (None, _strides(about["shape"], found))
    if found != dtype or not whole:
        order = "C-contiguous" if whole else "not C-contiguous"
        raise KernelError(f"CUDA: an array of {found}, {order}: expected {dtype}, C-contiguous")
    return int(place)


def _strides(shape: Shape, dtype: np.dtype) -> Shape:
    """Bytes from element to element of a C-contiguous array."""
    return tuple(dtype.itemsize * math.prod(shape[k + 1 :]) for k in range(len(shape)))
