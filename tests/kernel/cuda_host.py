"""NVIDIA's driver with host memory in place of a GPU's, and kernels that do nothing."""

from __future__ import annotations

import ctypes
import re
import struct
import sys
from itertools import chain
from typing import Any
from unittest import mock

import numpy as np
import pytest

from fracslice.expr import cuda_driver, cuda_memory
from fracslice.fields import cuda, cuda_launching
from fracslice.formulas import sphere

H200 = (9, 0)


class HostDriver:
    """Stands in for `cuda_api.call`.

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


def driven(patch: pytest.MonkeyPatch) -> HostDriver:
    """A GPU that is there and does nothing."""
    host = HostDriver()
    patch.delenv("NUMBA_ENABLE_CUDASIM", raising=False)
    patch.setattr(cuda_memory, "call", host)
    patch.setattr(cuda_launching, "call", host)
    patch.setattr(cuda_launching, "capability", lambda: H200)
    patch.setattr(cuda_driver, "present", lambda: True)
    return host


def compiles_without_gpu() -> None:
    """Numba compiles for an H100 or H200 where there is none."""
    from numba.cuda import dispatcher
    from numba.cuda.cudadrv import devices

    device = mock.Mock(compute_capability=H200)
    dispatcher.get_current_device = lambda: device
    devices.get_context = lambda *_: mock.Mock(device=device)
    dispatcher._Kernel.bind = lambda kernel: None


def words(kinds: str, *values: float) -> bytes:
    """Parameters: "q" a whole number, "f" or "d" a real, eight bytes each."""
    return b"".join(
        struct.pack(f"<{kind}", value).ljust(8, b"\0") for kind, value in zip(kinds, values, strict=True)
    )


def parameters(text: str, name: str) -> list[int]:
    """Widths in bits of the parameters of a compiled loop."""
    (kernel,) = getattr(cuda_launching.execute_module(text), name).overloads.values()
    (entry,) = re.findall(r"\.entry [^)]*", kernel.library.get_asm_str())
    return [int(bits) for bits in re.findall(r"\.param \.[a-z](\d+)", entry)]


def main() -> None:
    """Evaluate a field; print the number of loops that Numba compiled for that, and whether it was there."""
    made: list[list[int]] = []
    compiled = cuda_launching.compiled

    def checked(text: str, name: str, kinds: tuple[cuda_memory.Kind, ...]) -> bytes:
        code = compiled(text, name, kinds)
        each = ([64] * (5 + 2 * n) if n else [8 * np.dtype(dtype).itemsize] for dtype, n, _ in kinds)
        made.append(list(chain.from_iterable(each)))
        assert parameters(text, name) == made[-1]
        return code

    def imported() -> str:
        compiles_without_gpu()
        return cuda_driver.cuda_toolchain()

    with pytest.MonkeyPatch.context() as patch:
        host = driven(patch)
        patch.setattr(cuda_driver, "_imported", imported)
        patch.setattr(cuda_launching, "compiled", checked)
        kernel = cuda.compile_scene(sphere())
        kernel.points(*np.zeros((3, 4)))
        kernel.bricks(np.zeros((2, 3), np.int32), (0, 0, 0), 1, np.zeros((2, 512), np.float32))
    assert all(code.startswith(b"\x7fELF") for code in host.images[::2])
    assert len(host.launches) == 2
    for (_, _, given), widths in zip(host.launches, made, strict=False):
        assert len(given) == 8 * len(widths)
    print(len(made), "numba.cuda" in sys.modules)


if __name__ == "__main__":
    main()
