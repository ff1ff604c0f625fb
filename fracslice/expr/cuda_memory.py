"""Arrays in GPU memory, by NVIDIA's driver, which is called without Numba."""

from __future__ import annotations

import ctypes
import math
import os
import struct
import weakref
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..errors import KernelError

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
    "cuModuleLoadData": (_PLACE, _PLACE),
    "cuModuleGetFunction": (_PLACE, _PLACE, ctypes.c_char_p),
    "cuLaunchKernel": (_PLACE, *[_NUMBER] * 7, _PLACE, _PLACE, _PLACE),
}
_MAJOR, _MINOR = 75, 76  # attributes of a device


def present() -> bool:
    """Return True if the driver is installed and finds a GPU."""
    return _driver() is not None


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
    """Call a function of the driver, in the context that Numba, CuPy and PyTorch use too."""
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


Shape = tuple[int, ...]
Kind = tuple[str, int, str]
"""Type of an argument: its dtype, its dimensions, 0 for a number, and the order of an array, "C" or "A"."""


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
    """C-contiguous array in GPU memory, or one of another library."""

    shape: Shape  # as of an array of NumPy
    dtype: np.dtype
    strides: Shape  # bytes from element to element
    address: int  # first element
    owner: object  # keeps the memory

    @property
    def size(self) -> int:
        """Number of elements."""
        return math.prod(self.shape)

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        about = {"shape": self.shape, "typestr": self.dtype.str, "strides": self.strides}
        return {**about, "data": (self.address, False), "version": 3, "stream": 1}

    @cached_property
    def argument(self) -> tuple[Kind, bytes]:
        """Type, and what Numba's code takes: two pointers of its own, sizes, address, shape and strides."""
        order = "C" if self.strides == _contiguous(self.shape, self.dtype) else "A"
        fields = (0, 0, self.size, self.dtype.itemsize, self.address, *self.shape, *self.strides)
        return (self.dtype.name, len(self.shape), order), struct.pack(f"<{len(fields)}q", *fields)

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
        strides = self.strides[len(self.shape) - len(shape) :]
        return DeviceArray(shape, self.dtype, strides, self.address + first * self.strides[0], self.owner)

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


def _contiguous(shape: Shape, dtype: np.dtype) -> Shape:
    return tuple(dtype.itemsize * math.prod(shape[k + 1 :]) for k in range(len(shape)))


def device_array(shape: int | Shape, dtype: np.typing.DTypeLike) -> DeviceArray:
    """Return an array whose values are not set."""
    shape, dtype = (shape,) if isinstance(shape, int) else tuple(shape), np.dtype(dtype)
    memory = Memory("cuMemAlloc_v2", "cuMemFree_v2", math.prod(shape) * dtype.itemsize)
    return DeviceArray(shape, dtype, _contiguous(shape, dtype), memory.address, memory)


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


def argument(value: Any) -> tuple[Kind, bytes]:
    """Return an argument of a kernel: its type, and eight bytes for each of its parameters."""
    if isinstance(value, DeviceArray):
        return value.argument
    if hasattr(value, "__cuda_array_interface__"):
        return _foreign(value, value.__cuda_array_interface__).argument
    number = (
        value if isinstance(value, np.generic) else (np.int64, np.float64)[isinstance(value, float)](value)
    )
    return (number.dtype.name, 0, ""), number.tobytes().ljust(8, b"\0")


def _foreign(array: Any, interface: dict[str, Any]) -> DeviceArray:
    """Array of another library, after what its stream still does."""
    if stream := interface.get("stream"):
        call("cuStreamSynchronize", stream)
    shape, dtype = interface["shape"], np.dtype(interface["typestr"])
    strides = interface.get("strides") or _contiguous(shape, dtype)
    return DeviceArray(shape, dtype, strides, interface["data"][0], array)
