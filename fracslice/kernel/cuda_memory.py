"""Arrays in GPU memory. Numba's simulator has the same functions for those that it simulates."""

from __future__ import annotations

import ctypes
import math
import struct
import weakref
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..errors import KernelError
from .cuda_api import call

Shape = tuple[int, ...]
Kind = tuple[str, int, str]
"""Type of an argument: its dtype, its dimensions, 0 for a number, and the order of an array, "C" or "A"."""


class Memory:
    """Memory that is freed with the last reference to it.

    Attributes
    ----------
    address
        First byte.
    """

    def __init__(self, allocate: str, free: str, size: int) -> None:
        place = ctypes.c_void_p()
        call(allocate, ctypes.byref(place), max(size, 1))
        assert place.value is not None
        self.address = place.value
        weakref.finalize(self, _freed, free, self.address).atexit = False  # the driver ends before Python


def _freed(free: str, address: int) -> None:
    with suppress(KernelError):  # after a fault in a kernel every call fails, and says so
        call(free, address)


@dataclass(frozen=True, eq=False)
class DeviceArray:
    """C-contiguous array in GPU memory, or one of another library.

    Attributes
    ----------
    shape, dtype
        As of an array of NumPy.
    strides
        Bytes from element to element.
    address
        First element.
    owner
        Keeps the memory.
    """

    shape: Shape
    dtype: np.dtype
    strides: Shape
    address: int
    owner: object

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
    """Return an argument of a kernel: its type, and eight bytes for each of its parameters.

    Parameters
    ----------
    value
        A number, or an array on the GPU of any library.
    """
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
