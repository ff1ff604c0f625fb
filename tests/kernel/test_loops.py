"""Loops are plain Python: what their modules see becomes constants and functions, and they run without a
compiler."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from enum import IntEnum
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest

from fracslice.errors import KernelError
from fracslice.expr import frontend
from fracslice.expr import loops as intrinsics
from fracslice.expr.frontend import kernel_function, loop_function
from fracslice.expr.graph import NOTHING, Entry, Width, text
from fracslice.expr.loops import Loop, inline, load, loop, store
from fracslice.expr.runtime import lane_count
from fracslice.fields.cpu import load_functions
from fracslice.fields.devices import ArrayField
from fracslice.fields.field import Kernel, Precision
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


def shown(loop: Loop) -> str:
    return text(loop_function(loop), width=Width(16))


def test_what_a_loop_sees_is_constants_and_functions() -> None:
    deep = shown(example.fix(setup=Setup(True, 2)))
    assert "doubled(v):\nb0():\n  v0 = mul 2.0, v\n  return v0" in deep
    assert "applied(v):\nb0():\n  v0 = call doubled v\n  return v0" in deep
    assert "set A, 4, v1" in deep and "branch" not in deep
    flat = shown(example.fix(setup=Setup(False, 0)))
    assert "doubled" not in flat and "applied(v):\nb0():\n  return v" in flat
    assert f"set A, n, {STEP}" in flat


def test_copies_for_other_fixed_arguments_are_others() -> None:
    deep, flat = (example.fix(setup=Setup(deep, 2)) for deep in (True, False))
    assert loop_function(deep).identity != loop_function(flat).identity
    assert "call doubled" in shown(deep) and "call doubled" not in shown(Loop(applied_flat, "r"))
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
        shown(Loop(function, "r"))


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
    compiled = load_functions(NOTHING, 64, width, [follow])["follow"]
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


def test_the_identity_of_a_loop_follows_what_it_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    """By it the machine code is kept; no loop is read for it."""
    monkeypatch.setattr(frontend, "syntax", None)
    loops = [example.fix(setup=Setup(*values)) for values in ((True, 2), (True, 3), (False, 2))]
    identities = {loop_function(loop).identity for loop in loops}
    assert len(identities) == 3
    assert loop_function(example.fix(setup=Setup(True, 2))).identity in identities
    before = loop_function(Loop(applied_flat, "r")).identity
    monkeypatch.setattr(sys.modules[__name__], "FLAT", Setup(True, 0))
    assert loop_function(Loop(applied_flat, "r")).identity != before


def test_the_identity_of_a_function_is_the_same_in_every_process() -> None:
    """And follows every number that it or a function that it calls uses."""
    code = (
        "from fracslice.rendering.packets import tile; from fracslice.expr.language import identity; "
        "print(identity(tile.function))"
    )
    one, other = (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert one == other and "COUNT" in one and " at 0x" not in one


FACTOR = 2.0


class Lamp(NamedTuple):
    kind: str
    power: Entry | None = None
    chance: int = 1


@inline
def scaled(factor, c):  # type: ignore[no-untyped-def]
    return tuple(factor * c[k] for k in range(2))


@inline
def brightened(c, P, lamp):  # type: ignore[no-untyped-def]
    a, b = scaled(FACTOR, c)
    if not lamp.power or lamp.kind == "sky":
        return a
    return a + lamp.power * b


@inline
def added(a, b):  # type: ignore[no-untyped-def]
    return a + b


def lit(x, y, u, P, lamp):  # type: ignore[no-untyped-def]
    c = x, y
    return added(*scaled(brightened(c, P, lamp), (u[lamp.chance], 0.0)))


def unlit(x, y, u, P, lamp):  # type: ignore[no-untyped-def]
    return brightened(x, P)


def untied(x, y, u, P, lamp):  # type: ignore[no-untyped-def]
    return added(*u)


def test_inline_functions_are_read_into_their_caller_and_records_decide() -> None:
    """One block without calls, in which products are fused with sums; numbers come from P."""
    x, y, u, numbers = np.array([1.0, 2.0]), np.array([3.0, 5.0]), (0.0, 0.5), np.array([0.0, 7.0])
    lamp, sky = (kernel_function(lit, (("lamp", Lamp(kind, Entry(1))),)) for kind in ("lamp", "sky"))
    np.testing.assert_array_equal(lamp(x, y, u, numbers), 0.5 * (2 * x + 7 * 2 * y))
    np.testing.assert_array_equal(sky(x, y, u, numbers), x)
    assert "call" not in text(lamp) and "b1" not in text(lamp)
    assert "element P" not in text(sky) and text(sky).count("element") == 1
    assert kernel_function(lit, (("lamp", Lamp("lamp", Entry(1))),)) is lamp
    assert kernel_function(lit, (("lamp", Lamp("lamp", Entry(2))),)).identity != lamp.identity


def test_a_kernel_function_follows_what_its_inline_functions_see(monkeypatch: pytest.MonkeyPatch) -> None:
    known = (("lamp", Lamp("sky")),)
    before = kernel_function(lit, known)
    assert before(1.0, 0.0, (0.0, 1.0), ()) == 2
    monkeypatch.setattr(sys.modules[__name__], "FACTOR", 3.0)
    for cache in frontend._function, frontend._read_again:  # as in another process
        cache.cache_clear()
    after = kernel_function(lit, known)
    assert after.identity != before.identity
    assert after(1.0, 0.0, (0.0, 1.0), ()) == 3


@pytest.mark.parametrize(
    ("function", "message"),
    [(unlit, "brightened takes 3 values, found 2"), (untied, "'u' is no tuple of known length")],
)
def test_what_an_inline_function_does_not_take_is_named(function, message: str) -> None:  # type: ignore[no-untyped-def]
    line = function.__code__.co_firstlineno + 1
    with pytest.raises(
        KernelError, match=rf"test_loops.py:{line}: kernel function {function.__name__}: .*{message}"
    ):
        kernel_function(function, (("lamp", Lamp("sky")),)).graph(Width(4))
