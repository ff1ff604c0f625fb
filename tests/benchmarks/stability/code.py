"""Code never compiled: instructions of the whole kernel by what a scene uses, float32, AVX-512.

A process of its own counts them, because Numba reads the CPU to compile for when it is imported.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator

from fracslice.fields.linker import Linked, link
from fracslice.formulas import Node, mandelbulb, material, sphere, transform, union
from fracslice.rendering.linking import link_frame
from fracslice.rendering.packets import loops
from fracslice.rendering.setup import optics
from fracslice.scene.view import Camera, Fog, Light, Shading, View
from tests.budgets.instructions import CPU, FEATURES, assembly, sizes

from ..runner import Row, Run

BULB = mandelbulb(iterations=8)
CAMERA = Camera(eye=(2, -2, 1))
PLAIN: dict[str, object] = {"camera": CAMERA, "lights": (Light(shadows="no"),)}
SCENES: dict[str, Node] = {
    "sphere": sphere(),
    "sphere in a transform that changes nothing": transform(sphere()),
    "sphere, moved": transform(sphere(), translate=(1, 0, 0)),
    "sphere, turned": transform(sphere(), rotate=(0, 0, 1, 30)),
    "two spheres": union(sphere(), sphere(radius=2)),
    "two spheres with a seam": union(sphere(), sphere(radius=2), smooth=0.1),
    "mandelbulb": BULB,
    "mandelbulb with a palette and glass": material(BULB, colour=(1, 0, 0, 0, 1, 0), clear=0.9),
    "mandelbulb, power 2": mandelbulb(iterations=8, power=2),
    "mandelbulb, power 7.5": mandelbulb(iterations=8, power=7.5),
}
PICTURES: dict[str, tuple[Node, dict[str, object]]] = {
    "picture of the mandelbulb: one light": (BULB, {}),
    "with shadows": (BULB, {"lights": (Light(),)}),
    "with fog": (BULB, {"fog": Fog()}),
    "with a palette": (material(BULB, colour=(1, 0, 0, 0, 1, 0)), {}),
    "with a lens": (BULB, {"camera": Camera(eye=(2, -2, 1), aperture=0.1)}),
    "with reflection": (material(BULB, reflect=0.2), {}),
    "its depth alone": (BULB, {"shading": Shading(mode="depth")}),
}
SMALLEST = {"names": ("sphere",)}


def instructions(name: str) -> int:
    """Instructions of a scene's field, or of a picture of it."""
    if name in SCENES:
        return _count(link(SCENES[name]))
    root, view = PICTURES[name]
    whole = View(**{**PLAIN, **view})  # type: ignore[arg-type]
    seen = whole.camera or CAMERA
    frame = link_frame(root, whole, seen, optics(seen, (32, 32), root, 1e-7))
    return _count(frame.linked, loops(frame))


def _count(linked: Linked, *entries: object) -> int:
    return sizes(assembly(linked, 32, *entries))[1]  # type: ignore[arg-type]


def rows(run: Run, names: tuple[str, ...] = (*SCENES, *PICTURES)) -> Iterator[Row]:
    command = [sys.executable, "-m", __name__, *names]
    given = {**os.environ, "NUMBA_CPU_NAME": CPU, "NUMBA_CPU_FEATURES": FEATURES}
    printed = subprocess.run(command, env=given, check=True, stdout=subprocess.PIPE).stdout
    for name, count in zip(names, json.loads(printed), strict=True):
        yield {"": name, "instructions": count}


if __name__ == "__main__":
    print(json.dumps([instructions(name) for name in sys.argv[1:]]))
