"""NVIDIA's driver with host memory in place of a GPU's, and threads that run in turn on the CPU."""

from __future__ import annotations

import ctypes
import gc
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from fracslice.expr import cuda_driver
from fracslice.expr.graph import Program
from fracslice.expr.loops import OWN, Loop, element_type, is_array
from fracslice.expr.runtime import CompiledFunction
from fracslice.fields import cpu as lanes
from fracslice.fields import cuda
from fracslice.fields.field import Precision

H200 = (9, 0)


class HostDriver:
    """Stands in for `cuda_driver.call`.

    memory: what is allocated, by address. images: loaded code. launches: entry, grid and 8-byte parameters.
    """

    def __init__(self) -> None:
        self.memory: dict[int, Any] = {}
        self.images: list[bytes] = []
        self.launches: list[tuple[bytes, tuple[int, ...], bytes]] = []
        self.synchronised: list[int] = []

    def __call__(self, name: str, *arguments: Any) -> None:
        getattr(self, name.removesuffix("_v2"))(*arguments)

    def cuMemAlloc(self, place: Any, size: int) -> None:
        memory = ctypes.create_string_buffer(size)
        place._obj.value = ctypes.addressof(memory)
        self.memory[place._obj.value] = memory

    def cuMemFree(self, address: int) -> None:
        del self.memory[address]

    def cuMemAllocHost(self, place: Any, size: int) -> None:
        self.cuMemAlloc(place, size)

    def cuMemFreeHost(self, address: int) -> None:
        self.cuMemFree(address)

    def cuMemcpyHtoD(self, to: int, of: int, size: int) -> None:
        assert self.holds(to, size)
        ctypes.memmove(to, of, size)

    def cuMemcpyDtoH(self, to: int, of: int, size: int) -> None:
        assert self.holds(of, size)
        ctypes.memmove(to, of, size)

    def holds(self, address: int, size: int) -> bool:
        return any(b <= address and address + size <= b + len(m) for b, m in self.memory.items())

    def cuStreamSynchronize(self, stream: int) -> None:
        self.synchronised.append(stream)

    def cuLinkCreate(self, count: int, options: Any, values: Any, state: Any) -> None:
        assert (count, options._obj.value) == (1, 0)
        state._obj.value = 1

    def cuLinkAddData(self, state: Any, kind: int, text: bytes, size: int, *_: Any) -> None:
        assert (kind, size) == (1, len(text) + 1)
        self.code = ctypes.create_string_buffer(b"code of " + text)

    def cuLinkComplete(self, state: Any, code: Any, size: Any) -> None:
        code._obj.value, size._obj.value = ctypes.addressof(self.code), len(self.code) - 1

    def cuLinkDestroy(self, state: Any) -> None:
        pass

    def cuModuleLoadData(self, module: Any, image: bytes) -> None:
        self.images.append(image)

    def cuModuleGetFunction(self, function: Any, module: Any, entry: bytes) -> None:
        self.images.append(entry)
        function._obj.value = len(self.images)

    def cuLaunchKernel(self, function: Any, *given: Any) -> None:
        *grid, shared, stream, places, extra = given
        assert (shared, stream, extra) == (0, None, None)
        words = b"".join(ctypes.string_at(place, 8) for place in places)
        self.launches.append((self.images[function.value - 1], tuple(grid), words))


def driven(patch: pytest.MonkeyPatch) -> Iterator[HostDriver]:
    """A fixture: a GPU that is there and does nothing."""
    host = HostDriver()
    patch.setattr(cuda_driver, "call", host)
    patch.setattr(cuda_driver, "capability", lambda: H200)
    patch.setattr(cuda_driver, "missing", lambda: None)
    kept = cuda._functions, cuda._kernel, cuda.compile_loops
    yield host
    for cached in kept:
        cached.cache_clear()
    gc.collect()  # what is left is freed there, too


@dataclass(frozen=True)
class Threads:
    """Stands in for `cuda.CudaFunction`: all threads, one after the other, with one lane of the CPU each."""

    function: CompiledFunction
    loop: Loop
    real: np.dtype

    def launch(self, threads: int, *values: Any) -> None:
        left = iter(values)
        own = [np.zeros(self.loop.own) for letter in self.loop.arguments if letter in OWN]
        places = iter(array.ctypes.data for array in own)
        kinds, given = [], []
        for letter in self.loop.arguments:
            dtype = element_type(letter, self.real)
            if letter in OWN:
                given.append(next(places))
            else:
                value = next(left)
                given.append(cuda_driver.address(value, dtype) if is_array(letter) else value)
            kinds.append(ctypes.c_void_p if is_array(letter) else np.ctypeslib.as_ctypes_type(dtype))
        ctypes.CFUNCTYPE(None, *kinds)(self.function.address)(*given)  # type: ignore[arg-type]


def runs_on_cpu(patch: pytest.MonkeyPatch) -> Iterator[HostDriver]:
    """A fixture: a GPU whose threads the CPU runs."""

    def functions(program: Program, precision: Precision, loops: tuple[Loop, ...]) -> Mapping[str, Threads]:
        real = np.dtype(precision)
        made = lanes.load_functions(program, 8 * real.itemsize, 1, loops)
        return {loop.name: Threads(made[loop.name], loop, real) for loop in loops}

    for host in driven(patch):
        patch.setattr(cuda, "_functions", functions)
        yield host


def words(kinds: str, *values: float) -> bytes:
    """Parameters: "q" a whole number, "f" or "d" a real, eight bytes each."""
    return b"".join(
        struct.pack(f"<{kind}", value).ljust(8, b"\0") for kind, value in zip(kinds, values, strict=True)
    )
