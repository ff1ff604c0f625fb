"""Every value that the Python API takes: accepted and converted once, or refused in one line."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest

from fracslice import MeshJob, Work
from fracslice.bench.measurements import BenchmarkTask
from fracslice.checks.problems import Limits
from fracslice.common.parameters import AUTO, REQUIRED, Count, Number, Vector
from fracslice.errors import FracsliceError
from fracslice.fields.devices import choose_device
from fracslice.fields.registry import Formula
from fracslice.formulas import Node, names, sphere
from fracslice.formulas import get as formula
from fracslice.mesh.simplify import simplify
from fracslice.rendering import Renderer
from fracslice.scene import Print, parse_length, scene
from fracslice.scene.view import PARTS, Camera, Film, View
from fracslice.slicing import SliceJob, adapted, plan_stack
from fracslice.slicing.printers import Resin
from fracslice.slicing.raster import Screen
from fracslice.viewer import picture

from .mesh import shapes

HOSTILE: list[Any] = [
    *("", " ", "nan", "inf", "-1mm", "0.5 furlongs", "1_0mm", "٣mm", "mm", "one", "1\n2", "x" * 200),
    *(-1, -0.5, math.nan, math.inf, -math.inf, 10**400, 10**5000, 1e300, 2.5j),
    *(True, np.True_, object(), b"1mm", {}, set(), [], (), [1, 2, 3, 4, 5], ["a", None]),
    *(np.float64("nan"), np.float32("inf"), np.zeros(300), np.zeros((2, 2)), np.array("1mm")),
]
"""What no length, count, angle, area or time is."""

STACK = plan_stack(sphere(), SliceJob(size=20, layer=5, pixel=1))
CUBE = shapes.cube()

LENGTHS: dict[str, Callable[[Any], Any]] = {
    "MeshJob.size": lambda v: MeshJob(size=v).size,
    "MeshJob.voxel": lambda v: MeshJob(voxel=v).voxel,
    "MeshJob.chord": lambda v: MeshJob(chord=v).chord,
    "MeshJob.simplify": lambda v: MeshJob(simplify=v).simplify,
    "SliceJob.size": lambda v: SliceJob(size=v).size,
    "SliceJob.layer": lambda v: SliceJob(size=20, layer=v).layer[0],
    "SliceJob.pixel": lambda v: SliceJob(size=20, pixel=v).pixels[0],
    "SliceJob.pixel, two": lambda v: SliceJob(size=20, pixel=(0.1, v)).pixels[1],
    "Screen.compensation": lambda v: Screen(STACK, compensation=v).compensation,
    "Limits.wall": lambda v: Limits(wall=v).wall,
    "Limits.floor": lambda v: Limits(floor=v).floor,
    "Limits.deep": lambda v: Limits(deep=v).deep,
    "scene": lambda v: scene(sphere(), size=v).size_mm,
    "parse_length": parse_length,
    "simplify": lambda v: simplify(CUBE, v)[1] and parse_length(v),
    **{
        f"Print.{name}": lambda v, name=name: getattr(Print(**{name: v}), name)
        for name in ("bridge", "gap", "thickness", "hollow", "drain", "base", "raft")
    },
}
"""What takes a length, and what it makes of it."""

NUMBERS: dict[str, Callable[[Any], Any]] = {
    "MeshJob.resolution": lambda v: MeshJob(resolution=v),
    "MeshJob.dust": lambda v: MeshJob(dust=v),
    "SliceJob.up": lambda v: SliceJob(size=20, up=(v, 0, v)),
    "SliceJob.up, all": lambda v: SliceJob(size=20, up=v),
    "Screen.gamma": lambda v: Screen(STACK, gamma=v),
    "Screen.levels": lambda v: Screen(STACK, levels=v),
    "Screen.blur": lambda v: Screen(STACK, blur=v),
    "Resin.exposure": lambda v: Resin(v, 30),
    "adapted": lambda v: adapted(STACK, v),
    "Limits.speck": lambda v: Limits(speck=v),
    "Limits.cup": lambda v: Limits(cup=v),
    "Limits.drop": lambda v: Limits(drop=v),
    "Limits.thin": lambda v: Limits(thin=v),
    "Limits.density": lambda v: Limits(density=v),
    "Work.threads": lambda v: Work(threads=v),
    "Work.device": choose_device,
    "BenchmarkTask.resolutions": lambda v: BenchmarkTask(resolutions=(v,)),
    "BenchmarkTask.repeats": lambda v: BenchmarkTask(repeats=v),
    "BenchmarkTask.limit_s": lambda v: BenchmarkTask(limit_s=v),
    "Renderer.size": lambda v: Renderer(sphere(), View(), (v, 9), device="cpu"),
    "Renderer.size, all": lambda v: Renderer(sphere(), View(), v, device="cpu"),
    "Renderer.device": lambda v: Renderer(sphere(), View(), (8, 8), device=v),
    "Renderer.passes": lambda v: list(Renderer(sphere(), View(), (8, 8), device="cpu").passes(v)),
    "Renderer.passes, tolerance": lambda v: next(
        Renderer(sphere(), View(), (8, 8), device="cpu").passes(1, v), None
    ),
    "picture": lambda v: picture(CUBE, "never.png", (v, 9)),
}
"""What takes other numbers."""


def refused(take: Callable[[Any], Any], value: Any) -> None:
    """Raises one line, whatever the value."""
    with pytest.raises(FracsliceError) as caught:
        take(value)
    assert "\n" not in str(caught.value)
    assert "expected" in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("name", LENGTHS)
def test_lengths_are_numbers_or_text(name: str) -> None:
    given = ["0.5mm", "500um", " 0.05 cm ", 0.5, np.float64(0.5), np.float32(0.5), Fraction(1, 2)]
    made = [LENGTHS[name](value) for value in given]
    assert made == [0.5] * len(given)
    assert {type(value) for value in made} == {float}


@pytest.mark.parametrize("name", LENGTHS)
def test_what_is_no_length_is_refused_in_one_line(name: str) -> None:
    signed = name == "Screen.compensation"
    for value in HOSTILE:
        if not (signed and isinstance(value, (str, int, float)) and value in ("-1mm", -1, -0.5)):
            refused(LENGTHS[name], value)


@pytest.mark.parametrize("name", NUMBERS)
def test_what_is_no_number_is_refused_in_one_line(name: str) -> None:
    for value in HOSTILE:
        if not (name == "SliceJob.up" and isinstance(value, (int, float)) and value in (-1, -0.5)):
            refused(NUMBERS[name], value)


def test_numbers_of_numpy_are_numbers() -> None:
    job = MeshJob(resolution=np.int64(64), dust=np.float32(0.5))
    assert (job.resolution, job.dust) == (64.0, 0.5)
    assert (type(job.resolution), type(job.dust)) == (float, float)
    assert Work(threads=np.int32(2)).threads == 2
    assert Film(width=np.int64(64)) == Film(width=64)
    ball = formula("transform")(sphere(radius=np.float32(0.5)), translate=np.array([1, 2, 3]))
    assert repr(ball) == "transform(sphere(radius=0.5), translate=(1.0, 2.0, 3.0))"


def with_value(what: Formula, inside: list[Node], needed: dict[str, Any], attribute: str, value: Any) -> Any:
    """A formula with one attribute that is not its default."""
    return what(*inside, **needed | {attribute: value})


def elements() -> dict[str, Callable[[Any], Any]]:
    """Every attribute of every formula and of every part of a view, by name."""
    result: dict[str, Callable[[Any], Any]] = {}
    for name in names():
        what = formula(name)
        inside = [sphere() for _ in range(what.children[0])]
        needed = {
            a: (1,) * kind.sizes[0] if isinstance(kind, Vector) else 1
            for a, kind in what.parameters.items()
            if kind.default is REQUIRED
        }
        for attribute, kind in what.parameters.items():
            if isinstance(kind, Number | Count | Vector):
                result[f"{name}.{attribute}"] = partial(with_value, what, inside, needed, attribute)
    for part in PARTS:
        for attribute, kind in part.kinds().items():
            if isinstance(kind, Number | Count | Vector):
                result[f"{part.element}.{attribute}"] = lambda v, p=part, a=attribute: p(**{a: v})
    return result


ELEMENTS = elements()


@pytest.mark.parametrize("name", ELEMENTS)
def test_attributes_take_numbers_or_say_what_they_expect(name: str) -> None:
    for value in [*HOSTILE, AUTO]:
        right = isinstance(value, (int, float, list)) and not isinstance(value, bool)
        if (right and can(ELEMENTS[name], value)) or (isinstance(value, str) and value == AUTO):
            continue  # a negative number or a list of five may be what is wanted
        refused(ELEMENTS[name], value)


def can(take: Callable[[Any], Any], value: Any) -> bool:
    """Whether a value is taken."""
    with suppress(FracsliceError):
        take(value)
        return True
    return False


@pytest.mark.parametrize("move", ["moved", "turned", "orbited"])
def test_a_camera_is_moved_by_numbers(move: str) -> None:
    for value in ("", None, math.nan, math.inf, True, "1"):
        refused(getattr(Camera(), move), value)
    assert getattr(Camera(), move)(np.float32(1)) == getattr(Camera(), move)(1)
