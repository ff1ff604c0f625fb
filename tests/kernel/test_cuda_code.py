"""Arrays and machine code on a GPU, where there is none: what the driver is told."""

from __future__ import annotations

import ctypes
import gc
import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fracslice.errors import KernelError
from fracslice.expr import cuda_driver, cuda_memory
from fracslice.expr import cuda_memory as cuda_api
from fracslice.fields import cuda_launching
from tests.kernel.cuda_host import HostDriver, driven, words

pytestmark = pytest.mark.once

installed = pytest.mark.skipif(
    importlib.util.find_spec("numba_cuda") is None, reason="numba-cuda is not installed"
)


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[HostDriver]:
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "kernels"))
    yield driven(monkeypatch)
    gc.collect()  # what is left is freed there, too


class Driver:
    """Library of a driver that finds some GPUs and fails to allocate."""

    def __init__(self, count: int) -> None:
        def call(*arguments: Any) -> int:
            return 0

        for name in cuda_api._CALLS:
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
    kept = cuda_api._driver, cuda_api._context
    for function in kept:
        function.cache_clear()
    yield
    for function in kept:
        function.cache_clear()


def test_a_driver_without_a_gpu_is_none(anew: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: Driver(0))
    assert not cuda_api.present()


def test_what_the_driver_refuses_is_one_line(anew: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: Driver(1))
    assert cuda_api.present()
    with pytest.raises(KernelError, match=r"^CUDA: cuMemAlloc: out of memory$"):
        cuda_memory.device_array(4, np.float32)


class TestArrays:
    def test_rows_share_the_memory_of_their_array(self, host: HostDriver) -> None:
        values = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
        array = cuda_memory.to_device(values)
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
        array, pinned = cuda_memory.device_array((2, 3), np.int16), cuda_memory.pinned_array(5, np.float64)
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
        array = cuda_memory.device_array(4, np.float32)
        for wrong in (np.empty(5, np.float32), np.empty(4), np.empty(8, np.float32)[::2]):
            with pytest.raises(AssertionError):
                array.copy_to_host(wrong)
            with pytest.raises(AssertionError):
                array.copy_to_device(wrong)

    def test_numbers_and_arrays_are_arguments_as_of_numba(self, host: HostDriver) -> None:
        for value, kind, packed in (
            (3, "int64", words("q", 3)),
            (-0.5, "float64", words("d", -0.5)),
            (np.float32(0.1), "float32", words("f", 0.1)),
            (np.int32(-2), "int32", words("i", -2)),
        ):
            assert cuda_memory.argument(value) == ((kind, 0, ""), packed)
        row = cuda_memory.device_array((3, 4), np.int16)[1]
        assert cuda_memory.argument(row) == (("int16", 1, "C"), words("q" * 7, 0, 0, 4, 2, row.address, 4, 2))

    def test_arrays_of_other_libraries_are_arguments(self, host: HostDriver) -> None:
        own = cuda_memory.device_array((3, 4), np.float32)
        mine = SimpleNamespace(__cuda_array_interface__=own.__cuda_array_interface__)
        assert cuda_memory.argument(mine) == own.argument
        assert host.synchronised == [1]
        about = {"shape": (4, 3), "typestr": "<f4", "strides": (4, 16), "data": (own.address, False)}
        turned = SimpleNamespace(__cuda_array_interface__={**about, "version": 2})
        fields = 0, 0, 12, 4, own.address, 4, 3, 4, 16
        assert cuda_memory.argument(turned) == (("float32", 2, "A"), words("q" * 9, *fields))


class TestLaunches:
    """Of a loop whose machine code is a stand-in, another one each time."""

    @pytest.fixture
    def made(self, host: HostDriver, monkeypatch: pytest.MonkeyPatch) -> list[tuple[cuda_memory.Kind, ...]]:
        made: list[tuple[cuda_memory.Kind, ...]] = []

        def compiled(text: str, name: str, kinds: tuple[cuda_memory.Kind, ...]) -> bytes:
            made.append(kinds)
            return b"%s\ncode\n%d" % (f"{name} of {text}".encode(), len(made))

        monkeypatch.setattr(cuda_launching, "compiled", compiled)
        return made

    def test_give_all_parameters(self, host: HostDriver, made: list[object]) -> None:
        array = cuda_memory.device_array(2, np.float32)
        cuda_launching.CudaFunction("text", "loop")[3, 128](array, 5, np.float32(0.5))
        fields = 0, 0, 2, 4, array.address, 2, 4, 5, 0.5
        assert host.launches == [(b"loop of text", (3, 1, 1, 128, 1, 1), words("q" * 8 + "f", *fields))]
        assert host.images[0] == b"code\n1"

    def test_compile_once_for_the_types_of_the_arguments(
        self, host: HostDriver, made: list[object], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def launched(text: str = "text", name: str = "loop", value: object = 1) -> int:
            cuda_launching.CudaFunction(text, name)[1, 32](value)
            return len(made)

        assert [launched(), launched(), launched(value=2)] == [1, 1, 1]
        assert [launched(value=2.0), launched(value=np.float32(2)), launched(value=1)] == [2, 3, 3]
        assert [launched("other"), launched(name="other")] == [4, 5]
        monkeypatch.setattr(cuda_launching, "capability", lambda: (8, 0))
        assert launched() == 6
        monkeypatch.setattr(cuda_launching, "cuda_toolchain", lambda: "another")
        assert launched() == 7


@installed
def test_only_the_first_process_needs_numba(tmp_path: Path) -> None:
    """Numba compiles two loops for a GPU, for the parameters that are given, then none."""
    environment = {**os.environ, "FRACSLICE_CACHE": str(tmp_path / "kernels")}
    command = [sys.executable, "-m", "tests.kernel.cuda_host"]
    for needed in ("2 True", "0 False"):
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        assert (done.returncode, done.stdout.strip()) == (0, needed), done.stderr


def test_a_compiler_that_works_is_not_imported_again(
    host: HostDriver, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cuda_driver, "lacking", lambda *_: "")
    monkeypatch.setattr(cuda_driver, "cuda_toolchain", lambda: "toolchain")
    states = iter(["CUDA cannot be used: no libNVVM", "CUDA cannot be used: no libNVVM", None])

    def imported() -> str:
        if reason := next(states):
            raise KernelError(reason)
        return "works"

    monkeypatch.setattr(cuda_driver, "_imported", imported)
    reasons = []
    for _ in range(4):
        cuda_driver._compiler.cache_clear()  # as in another process
        reasons.append(cuda_driver.missing())
    cuda_driver._compiler.cache_clear()
    assert reasons == ["CUDA cannot be used: no libNVVM"] * 2 + [None] * 2
