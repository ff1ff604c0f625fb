"""NVIDIA's driver, called without Numba, whose import takes longer than a small job."""

from __future__ import annotations

import ctypes
import os
from functools import lru_cache
from typing import Any

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
    """Call a function of the driver, in the context that Numba, CuPy and PyTorch use too.

    Parameters
    ----------
    name
        Function; there must be a GPU.
    *arguments
        Its arguments.

    Raises
    ------
    KernelError
        If it fails.
    """
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
