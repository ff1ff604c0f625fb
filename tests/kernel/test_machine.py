"""Machine code and the arrays that it reads live as long as anything can run it."""

from __future__ import annotations

import ctypes
import gc
import re
import weakref
from ctypes import ArgumentError
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest

import fracslice
from fracslice._native import RootLoops
from fracslice._slices import FieldSlab, Memory, ProbeBounds
from fracslice.expr import runtime
from fracslice.expr.loops import bricks, points
from fracslice.expr.runtime import Image, UnsupportedError
from fracslice.fields.cpu import CpuKernel
from fracslice.fields.linker import link
from fracslice.formulas import box, mandelbulb, sphere
from fracslice.mesh.roots import Roots


def slab_of(entry: Any) -> FieldSlab:
    return FieldSlab(Memory(), entry, ProbeBounds(1, 1, 1, False), (0, 0, 1, 1), [0.0], 9, 9)


def test_arrays_of_another_kind_are_refused() -> None:
    kernel = CpuKernel(link(sphere()))
    points, parameters = kernel.entry
    rows = np.zeros((4, kernel.width), np.float32)
    points(parameters, *rows, kernel.width)
    with pytest.raises(ArgumentError, match=r"float64, C-contiguous: expected float32"):
        points(parameters, *rows.astype(np.float64), kernel.width)
    with pytest.raises(ArgumentError, match=r"not C-contiguous"):
        points(parameters, *np.zeros((4, 2 * kernel.width), np.float32)[:, ::2], kernel.width)
    corners, out = np.zeros((2, 3), np.int64), np.zeros((2, 512), np.float32)
    with pytest.raises(ArgumentError, match=r"int64, C-contiguous: expected int32"):
        kernel.bricks(corners, (0, 0, 0), 1, out)


def test_native_objects_hold_the_code_and_the_arrays() -> None:
    """A field for slices and the loops for roots, after everything else that knew the kernel is gone."""
    kernel, exact = CpuKernel(link(box())), CpuKernel(link(box()), "float64")
    fast, slow = Roots(box(), "float32", 0.1), Roots(box(), "float64", 0.1)
    given = fast.native("find"), slow.native("find"), slow.native("polish"), exact.entry
    held = [weakref.ref(part) for tuple_ in (kernel.entry, exact.entry) for part in tuple_]
    slab, loops = slab_of(kernel.entry), RootLoops(16, 1024, *given, 1e-4)
    del kernel, exact, fast, slow, given
    gc.collect()
    assert all(part() is not None for part in held)
    del slab, loops
    gc.collect()
    assert all(part() is None for part in held)


def test_native_objects_refuse_other_loops() -> None:
    kernel = CpuKernel(link(sphere()))
    with pytest.raises(TypeError, match="other arguments"):
        slab_of((kernel._bricks, kernel._parameters))
    with pytest.raises(RuntimeError):
        slab_of((kernel._points, kernel._parameters.astype(np.float64)))
    assert (bricks.arguments, points.arguments) == ("rxxxxrrrirn", "rrrrrn")


def test_arrays_become_addresses_in_one_place() -> None:
    package = Path(fracslice.__file__).parent
    address = re.compile(r"\.ctypes\b|c_void_p|__array_interface__|\bbyref\b|addressof|from_buffer")
    result = {
        str(path.relative_to(package)) for path in package.rglob("*.py") if address.search(path.read_text())
    }
    own = {"viewer/window.py"}  # names X11's result type
    driver = {"fields/cuda.py", "expr/cuda_driver.py"}  # which returns when it has copied
    assert result == {"expr/runtime.py"} | own | driver


def test_a_file_that_the_loader_does_not_know_is_left_to_llvm(monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine code and values are the same."""
    points = np.random.default_rng(0).uniform(-1, 1, (3, 1000))
    linked = link(mandelbulb(power=8, iterations=4))
    own = CpuKernel(linked)
    monkeypatch.setattr(runtime, "KIND", b"")
    other = CpuKernel(linked)
    assert isinstance(own._points._engine, Image)
    assert not isinstance(other._points._engine, Image)
    np.testing.assert_array_equal(own.points(*points), other.points(*points))


@pytest.mark.parametrize("model", ["small", "large"])
def test_relocations_of_both_code_models(model: str) -> None:
    """Constants, a call within the file and, where none is too far away, one of the C library."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    text = """
    @table = internal constant [4 x double] [double 1.5, double 2.5, double 3.5, double 4.5]
    declare i8* @memset(i8*, i32, i64)
    define void @zero(i8* %p, i64 %n) {
      call i8* @memset(i8* %p, i32 0, i64 %n)
      ret void
    }
    define void @f(i8* %p, i64 %n) noinline {
      %q = bitcast i8* %p to double*
      %e = getelementptr [4 x double], [4 x double]* @table, i64 0, i64 %n
      %v = load double, double* %e
      store double %v, double* %q
      %r = getelementptr i8, i8* %p, i64 8
      call void @zero(i8* %r, i64 16)
      ret void
    }"""
    if model == "small":
        text = text.replace("call i8* @memset(i8* %p, i32 0, i64 %n)", "store i8 0, i8* %p")
    module = llvm.parse_assembly(text)
    triple = llvm.Target.from_triple(llvm.get_process_triple())
    target = triple.create_target_machine(opt=0, reloc="pic", codemodel=model)
    image, values = Image(target.emit_object(module)), np.full(4, 1e-310)
    call = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_ssize_t)(image.get_function_address("f"))
    call(values.ctypes.data, 2)
    assert values[0] == 3.5
    assert values[1] != values[3] == 1e-310
    assert values[2] == (0 if model == "large" else 1e-310)


def test_a_damaged_or_foreign_file_is_refused_before_anything_runs() -> None:
    for code in (b"", b"MZ" * 64, runtime.MAGIC + bytes(100)):
        with pytest.raises(UnsupportedError):
            Image(code)
