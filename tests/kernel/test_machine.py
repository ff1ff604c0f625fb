"""Machine code and the arrays that it reads live as long as anything can run it."""

from __future__ import annotations

import gc
import re
import weakref
from ctypes import ArgumentError
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fracslice
from fracslice._native import RootLoops
from fracslice._slices import Memory, ProbeBounds, Slab
from fracslice.formulas import box, sphere
from fracslice.kernel import CpuKernel, link
from fracslice.kernel.loops import bricks, points
from fracslice.mesh.roots import Roots


def slab_of(entry: Any) -> Slab:
    return Slab(Memory(), entry, ProbeBounds(1, 1, 1, False), (0, 0, 1, 1), [0.0], 9, 9)


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
    slab, loops = slab_of(kernel.entry), RootLoops(16, 1024, *given, (8, 48), 1e-4)
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
    assert (bricks.arguments, points.arguments) == ("rrrrrirn", "rrrrrn")


def test_arrays_become_addresses_in_one_place() -> None:
    package = Path(fracslice.__file__).parent
    address = re.compile(r"\.ctypes\b|c_void_p|__array_interface__|\bbyref\b|addressof|from_buffer")
    result = {
        str(path.relative_to(package)) for path in package.rglob("*.py") if address.search(path.read_text())
    }
    assert result == {"kernel/machine.py", "viewer/screen.py"}  # the latter names X11's result type
