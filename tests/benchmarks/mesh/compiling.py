"""CPU time to link and compile deep scenes and those of many elements, as a multiple of a sphere's.

Float32, the kernel of samples alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from fracslice.expr import emitter
from fracslice.expr.loops import bricks, points
from fracslice.expr.runtime import REGISTERS, host, lane_count
from fracslice.fields.linker import link
from fracslice.formulas import Node, bounds, box, sphere, transform, union

from ..runner import Row, Run

SMALLEST = {"scenes": ("a union of 2 spheres",)}


def nested(depth: int) -> Node:
    root = sphere()
    for k in range(depth - 1):
        root = bounds(root, min=(-9 - k, -9, -9), max=(9, 9, 9))
    return root


def balls(count: int) -> Node:
    return union(*(transform(sphere(radius=1 + k), translate=(k + 1, 0, 0)) for k in range(count)))


def mixed(count: int, **values: float) -> Node:
    return union(*(kind() for k in range(count) for kind in (sphere, box)), **values)


BASE = "a sphere"
SCENES = {
    "10 elements inside each other": nested(10),
    "20 elements": nested(20),
    "40 elements": nested(40),
    "a union of 2 spheres": balls(2),
    "a union of 80 spheres": balls(80),
    "a union of 2 spheres and boxes": mixed(1),
    "a union of 80": mixed(40),
    "a smooth union of 80": mixed(40, smooth=0.1),
}


def compiled(root: Node) -> None:
    target = emitter.Target(32, lane_count(32), REGISTERS, *host())
    emitter.compile_object(link(root).program, target, (points, bricks))


def rows(run: Run, scenes: tuple[str, ...] = tuple(SCENES)) -> Iterator[Row]:
    acts = {BASE: partial(compiled, sphere()), **{name: partial(compiled, SCENES[name]) for name in scenes}}
    measured = run.interleaved(acts)
    for name in scenes:
        yield {"": name, "times a sphere": measured.ratio(name, BASE, "cpu_s")}
