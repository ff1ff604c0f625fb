"""Arrays and machine code on a GPU, where there is none: what the driver is told."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fracslice.errors import KernelError
from fracslice.expr import cuda_driver, emitter
from fracslice.expr.graph import NOTHING, Program
from fracslice.expr.loops import loop, shares
from fracslice.fields import cuda
from fracslice.fields.field import Precision
from fracslice.fields.linker import Linked, link
from fracslice.formulas import sphere
from tests.kernel.cuda_host import HostDriver, driven, words

pytestmark = pytest.mark.once


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[HostDriver]:
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "kernels"))
    yield from driven(monkeypatch)


class Driver:
    """Library of a driver that finds some GPUs and fails to allocate."""

    def __init__(self, count: int) -> None:
        def call(*arguments: Any) -> int:
            return 0

        for name in cuda_driver._CALLS:
            setattr(self, name, partial(call))
        self.cuDeviceGetCount = partial(self.counted, count)
        self.cuGetErrorString = partial(self.described)
        self.cuMemAlloc_v2 = partial(lambda *_: 2)

    @staticmethod
    def counted(count: int, place: Any) -> int:
        place._obj.value = count
        return 0

    @staticmethod
    def described(status: int, place: Any) -> int:
        place._obj.value = b"out of memory" if status == 2 else None
        return 0


@pytest.fixture
def anew() -> Iterator[None]:
    """A driver that is looked for, before and after a test."""
    kept = cuda_driver._driver, cuda_driver._context
    for function in kept:
        function.cache_clear()
    yield
    for function in kept:
        function.cache_clear()


def test_a_driver_without_a_gpu_is_none(anew: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: Driver(0))
    assert not cuda_driver.available()


def test_what_the_driver_refuses_is_one_line(anew: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: Driver(1))
    assert cuda_driver.available()
    with pytest.raises(KernelError, match=r"^CUDA: cuMemAlloc: out of memory$"):
        cuda_driver.device_array(4, np.float32)


class TestArrays:
    def test_rows_share_the_memory_of_their_array(self, host: HostDriver) -> None:
        values = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
        array = cuda_driver.to_device(values)
        assert (array.shape, array.dtype, array.size, len(array)) == ((2, 3, 4), np.float32, 24, 2)
        for place in (0, 1, -1, slice(1), slice(1, 2)):
            np.testing.assert_array_equal(array[place].copy_to_host(), values[place])
        first, second = array
        second[1][2:].copy_to_device(np.array([-1, -2], np.float32))
        to = np.empty((3, 4), np.float32)
        assert second.copy_to_host(to) is to
        np.testing.assert_array_equal(to[1], [16, 17, -1, -2])
        np.testing.assert_array_equal(first.copy_to_host(), values[0])
        with pytest.raises(IndexError):
            array[2]

    def test_memory_is_freed_with_the_last_row(self, host: HostDriver) -> None:
        array, pinned = cuda_driver.device_array((2, 3), np.int16), cuda_driver.pinned_array(5, np.float64)
        row, part = array[1], pinned[2:]
        part[:] = 7
        assert (part == 7).all() and len(host.memory) == 2
        del array, pinned
        assert len(host.memory) == 2
        del row
        assert len(host.memory) == 1
        del part
        assert not host.memory

    def test_nothing_is_copied_past_an_array(self, host: HostDriver) -> None:
        array = cuda_driver.device_array(4, np.float32)
        for wrong in (np.empty(5, np.float32), np.empty(4), np.empty(8, np.float32)[::2]):
            with pytest.raises(AssertionError):
                array.copy_to_host(wrong)
            with pytest.raises(AssertionError):
                array.copy_to_device(wrong)

    def test_arrays_of_other_libraries_have_addresses(self, host: HostDriver) -> None:
        own = cuda_driver.device_array((3, 4), np.float32)
        mine = SimpleNamespace(__cuda_array_interface__=own.__cuda_array_interface__)
        assert cuda_driver.address(mine, own.dtype) == own.address == cuda_driver.address(own, own.dtype)
        assert host.synchronised == [1]
        about = {"shape": (4, 3), "typestr": "<f4", "data": (own.address, False), "version": 2}
        for strides in (None, (12, 4)):
            mine.__cuda_array_interface__ = {**about, "strides": strides}
            assert cuda_driver.address(mine, own.dtype) == own.address

    def test_arrays_that_a_loop_cannot_take_are_refused_in_one_line(self, host: HostDriver) -> None:
        about = {"shape": (4, 3), "typestr": "<f4", "strides": (4, 16), "data": (64, False), "version": 2}
        turned = SimpleNamespace(__cuda_array_interface__=about)
        with pytest.raises(
            KernelError, match=r"^CUDA: an array of float32, not C-contiguous: expected float32, C"
        ):
            cuda_driver.address(turned, np.dtype(np.float32))
        with pytest.raises(KernelError, match=r"^CUDA: an array of float64, C-contiguous: expected int32, C"):
            cuda_driver.address(cuda_driver.device_array(3, np.float64), np.dtype(np.int32))


@loop("rwxn")
def scaled(A, W, factor, n):  # type: ignore[no-untyped-def]
    for i in shares(n, 1):
        W[0] = factor
        A[i] = A[i] * W[0]


SCALED = replace(scaled, own=1)


class TestLaunches:
    def function(self, program: Program = NOTHING, precision: Precision = "float32") -> cuda.CudaFunction:
        cuda._functions.cache_clear()  # as in another process
        return cuda.load_functions(program, precision, (SCALED,))["scaled"]

    def test_give_all_parameters_but_what_a_thread_has_to_itself(self, host: HostDriver) -> None:
        array = cuda_driver.device_array(300, np.float32)
        self.function().launch(300, array, 0.5, 300)
        assert host.launches == [(b"scaled", (3, 1, 1, 128, 1, 1), words("qfq", array.address, 0.5, 300))]
        assert host.images[0].startswith(b"code of ") and b".entry scaled(" in host.images[0]
        self.function(precision="float64").launch(1, cuda_driver.device_array(1, np.float64), 0.1, 1)
        assert host.launches[1][2][8:] == words("dq", 0.1, 1)

    def test_compile_once_for_a_text_a_precision_a_gpu_and_a_toolchain(
        self, host: HostDriver, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        made: list[bytes] = []

        def compiled(linked: Linked, *_: object) -> bytes:
            made.append(b"")
            return b""

        monkeypatch.setattr(emitter, "compile_ptx", compiled)
        assert [len(made) for _ in range(2) if self.function()] == [1, 1]
        assert [len(made) for _ in range(2) if self.function(link(sphere()).program)] == [2, 2]
        assert [len(made) for _ in range(2) if self.function(precision="float64")] == [3, 3]
        monkeypatch.setattr(cuda_driver, "capability", lambda: (8, 0))
        assert [len(made) for _ in range(2) if self.function()] == [4, 4]
        monkeypatch.setattr(cuda, "toolchain", lambda: "another")
        assert [len(made) for _ in range(2) if self.function()] == [5, 5]
