"""Loops are plain Python: what their modules see becomes constants and functions, and they run without a
compiler."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from enum import IntEnum
from types import ModuleType

import numpy as np
import pytest

from fracslice.errors import KernelError
from fracslice.expr import loop_linker
from fracslice.expr import loops as intrinsics
from fracslice.expr.host import lane_count
from fracslice.expr.loop_linker import loop_source
from fracslice.expr.loops import Loop, load, loop, store
from fracslice.fields.cpu import load_functions
from fracslice.fields.field import Kernel, Precision
from fracslice.fields.tree import ArrayField
from fracslice.formulas import box
from fracslice.mesh import roots
from fracslice.rendering import packets

STEP = 3


class Place(IntEnum):
    FIRST = 4


@dataclass(frozen=True)
class Setup:
    deep: bool
    count: int


def doubled(v):  # type: ignore[no-untyped-def]
    return 2.0 * v


def applied(v, function, setup):  # type: ignore[no-untyped-def]
    """A docstring."""
    return function(v) if setup.deep else v


@loop("rn")
def example(A, n, setup):  # type: ignore[no-untyped-def]
    A[Place.FIRST] = applied(A[0], doubled, setup)
    if not setup.count:
        A[n] = STEP
    parts = tuple(A[k] for k in range(setup.count))
    if setup.count:
        A[n] = parts[1]


def test_what_a_loop_sees_is_constants_and_functions() -> None:
    assert loop_source([example.fix(setup=Setup(True, 2))]) == (
        "def l_doubled(v):\n    return 2.0 * v\n\n\n"
        "def l_applied(v):\n    return l_doubled(v)\n\n\n"
        "def example(A, n):\n    A[4] = l_applied(A[0])\n    parts = (A[0], A[1])\n    A[n] = parts[1]"
    )
    assert loop_source([example.fix(setup=Setup(False, 0))]) == (
        "def l_applied(v):\n    return v\n\n\n"
        "def example(A, n):\n    A[4] = l_applied(A[0])\n    A[n] = 3\n    parts = ()"
    )


def test_copies_for_other_fixed_arguments_have_other_names() -> None:
    deep, flat = (example.fix(setup=Setup(deep, 2)) for deep in (True, False))
    text = loop_source([deep, Loop(applied_flat, "r")])
    assert "def l_applied(v):" in text and "def l_applied_(v):" in text
    assert flat.name == "example"


def applied_flat(A):  # type: ignore[no-untyped-def]
    A[0] = applied(A[1], doubled, FLAT)


FLAT = Setup(False, 0)


def wrong_keyword(A):  # type: ignore[no-untyped-def]
    A[0] = 1.0
    A[1] = doubled(v=A[0])


def wrong_name(A):  # type: ignore[no-untyped-def]
    A[0] = np.pi + ModuleType


@pytest.mark.parametrize(
    ("function", "line", "message"),
    [
        (wrong_keyword, 2, "expected arguments by their place"),
        (wrong_name, 1, "'ModuleType' has no value here"),
    ],
)
def test_what_cannot_be_linked_is_one_line_with_its_place(function, line: int, message: str) -> None:  # type: ignore[no-untyped-def]
    place = f"test_loops.py:{function.__code__.co_firstlineno + line}: loop {function.__name__}: .*{message}$"
    with pytest.raises(KernelError, match=place):
        loop_source([Loop(function, "r")])


def to_the_floor(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):  # type: ignore[no-untyped-def]
    """Half of the way to the plane z = 0 at each step."""
    gap = (oz + t * dz) * P[0] - 0.001
    return t + 0.5 * gap, before, stride, gap


def test_packets_followed_by_python_are_those_of_the_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    width = lane_count(64)
    n, m = 3 * width - 5, 3 * width
    rows = np.zeros((len(packets.Row), m))
    rows[packets.Row.oz] = np.random.default_rng(0).uniform(-0.5, 3.0, m)
    rows[packets.Row.dz] = np.where(np.arange(m) % 7 == 3, 1.0, -1.0)
    rows[packets.Row.end] = np.where(np.arange(m) % 5 == 1, -1.0, 9.0)
    follow = Loop(packets.follow, "rrinnnr").fix(step=to_the_floor)
    compiled = load_functions("", 64, width, [follow])["follow"]
    for module in (intrinsics, packets):
        monkeypatch.setattr(module, "WIDTH", width)
    result = []
    for run, last in ((compiled, ()), (packets.follow, (to_the_floor,))):
        own = rows.copy()
        packet, rays = np.zeros(len(packets.Lane) * width), np.zeros(width, np.int32)
        run(own.ravel(), packet, rays, n, m, 20, np.ones(1), *last)
        result.append(own)
    np.testing.assert_allclose(result[0], result[1], rtol=1e-12)
    assert set(result[0][packets.Row.status, :n]) == {1.0, 2.0, 3.0}


def test_roots_of_a_field_that_is_not_linked_move_as_the_compiled_ones_do() -> None:
    """`polish` says how far it moved a root: a row of lanes that was read does not change with what is
    written."""
    root, voxel = box(), 0.1

    class Plain(ArrayField):
        bounds = root.bounds

        def kernel(self, device: str, precision: Precision) -> Kernel:  # type: ignore[override]
            return root.kernel(device, precision)  # type: ignore[arg-type]

    finders = roots.Roots(root, "float64", voxel), roots.Roots(Plain(), "float64", voxel)  # type: ignore[abstract]
    n = finders[0].width
    segments = np.zeros((6, n))
    segments[0], segments[1], segments[3] = 0.45, np.linspace(-0.3, 0.3, n), voxel
    result = []
    for finder in finders:
        out = np.full((5, n), 0.25)
        finder.runs["polish"](finder.frame, segments, out)
        result.append(out)
    np.testing.assert_allclose(result[1], result[0], atol=1e-9)
    assert result[0][4].min() > 0.01


def test_lanes_that_were_loaded_are_values() -> None:
    array = np.zeros(4)
    lanes = load(array, 0)
    store(array, 0, lanes + 1.0)
    assert lanes.max() == 0.0 and array.min() == 1.0


def test_a_loop_is_a_function_of_a_module() -> None:
    def inner(A):  # type: ignore[no-untyped-def]
        A[0] = 1.0

    with pytest.raises(KernelError, match=r"test_loops.py:\d+: loop inner: expected a def in a module"):
        loop_source([Loop(inner, "r")])


def test_the_text_of_loops_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Linking it takes a tenth of a picture of one sample."""
    loops = [example.fix(setup=Setup(True, 2))]
    text = loop_source(loops)
    monkeypatch.setattr(loop_linker, "link_loops", None)
    assert loop_source(loops) == text
    for changed in ([example.fix(setup=Setup(True, 3))], [example.fix(setup=Setup(False, 2))]):
        with pytest.raises(TypeError):
            loop_source(changed)
    monkeypatch.setattr(sys.modules[__name__], "FLAT", Setup(True, 0))
    with pytest.raises(TypeError):
        loop_source([Loop(applied_flat, "r")])


def test_the_identity_of_a_function_is_the_same_in_every_process() -> None:
    """And follows every number that it or a function that it calls uses."""
    code = (
        "from fracslice.rendering.packets import tile; from fracslice.expr.loop_linker import identity; "
        "print(identity(tile.function))"
    )
    one, other = (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert one == other and "COUNT" in one and "0x" not in one
