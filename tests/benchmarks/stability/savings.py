"""What is saved, by counts: samples never taken, steps never made, code never compiled.

`python -m tests.benchmarks.stability.savings [--write]`: three tables, a minute.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import numpy as np

from fracslice.formulas import Node, mandelbulb, material, sphere, transform, union
from fracslice.kernel import compile_scene, link
from fracslice.kernel.linker import CALLED, FIELD, Linked
from fracslice.rendering.linking import link_frame
from fracslice.rendering.optics import optics
from fracslice.rendering.packets import loops
from fracslice.scene.view import Camera, Fog, Light, Shading, View
from fracslice.volume import Lattice, sample
from fracslice.volume.bricks import INSIDE, Bricks
from tests.benchmarks.tables import publish, table
from tests.budgets.instructions import CPU, FEATURES, LANES, assembly, sizes
from tests.budgets.workloads import WORKLOADS

VOXELS = 256
BULB = mandelbulb(iterations=8)


def sampled(root: Node) -> Bricks:
    box = root.bounds.box
    return sample(compile_scene(root), root.bounds, Lattice.around(box, max(box.size) / VOXELS))


def bricks() -> Iterator[list[str]]:
    """What of the box and of the inside is sampled."""
    for name, root in WORKLOADS.items():
        found = sampled(root)
        inside, whole = int((found.index == INSIDE).sum()), found.index.size
        share = found.evaluations / (512 * whole)
        per = found.evaluations / found.values.size
        yield [name, f"{whole}", f"{len(found)}", f"{inside}", f"{share:.1%}", f"{per:.2f}"]


def steps() -> Iterator[list[str]]:
    """How many steps of an orbit a lane makes: all, its vector's, and its own, over the kept samples."""
    for name in ("mandelbulb", "julia"):
        root = WORKLOADS[name]
        own, vector = orbit_steps(root, sampled(root))
        yield [name, f"{root['iterations']}", f"{vector:.2f}", f"{own:.2f}"]


def orbit_steps(root: Node, found: Bricks, most: int = 400) -> tuple[float, float]:
    """Steps per sample until it leaves, and until all of its vector have left; the reference counts them."""
    from fracslice.formulas import vocabulary

    linked, alive = link(root), []
    scope = {name: getattr(vocabulary, name) for name in vocabulary.NAMES}
    scope[CALLED] = lambda function: function
    scope["any_of"] = lambda mask: alive.append(mask) or bool(np.any(mask))
    exec(compile(linked.source, "<linked scene>", "exec"), scope)
    picked = found.ijk[:: max(1, len(found) // most)]
    index = picked[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T
    points = np.asarray(found.origin) + found.voxel * index.reshape(-1, 3)
    with np.errstate(all="ignore"):
        scope[FIELD](*points.T, linked.parameters)
    masks = np.array(alive)
    return float(masks.sum(0).mean()), float(masks.reshape(len(masks), -1, LANES[32]).any(2).sum(0).mean())


def code() -> Iterator[list[object]]:
    """Instructions of the field's kernel with and without a part."""
    scenes: dict[str, Node] = {
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
    for name, root in scenes.items():
        yield [name, _instructions(link(root))]
    camera = Camera(eye=(2, -2, 1))
    plain: dict[str, object] = {"camera": camera, "lights": (Light(shadows="no"),)}
    lens = Camera(eye=(2, -2, 1), aperture=0.1)
    pictures: dict[str, tuple[Node, dict[str, object]]] = {
        "picture of the mandelbulb: one light": (BULB, {}),
        "with shadows": (BULB, {"lights": (Light(),)}),
        "with fog": (BULB, {"fog": Fog()}),
        "with a palette": (material(BULB, colour=(1, 0, 0, 0, 1, 0)), {}),
        "with a lens": (BULB, {"camera": lens}),
        "with reflection": (material(BULB, reflect=0.2), {}),
        "its depth alone": (BULB, {"shading": Shading(mode="depth")}),
    }
    for name, (root, view) in pictures.items():
        whole = View(**{**plain, **view})  # type: ignore[arg-type]
        seen = whole.camera or camera
        frame = link_frame(root, whole, seen, optics(seen, (32, 32), root, 1e-7), 4)
        yield [name, _instructions(frame.linked, loops(frame))]


def _instructions(linked: Linked, *entries: object) -> int:
    return sizes(assembly(linked, 32, *entries))[1]  # type: ignore[arg-type]


def main() -> None:
    if os.environ.get("NUMBA_CPU_NAME") != CPU:  # Numba is told before it is imported
        given = {**os.environ, "NUMBA_CPU_NAME": CPU, "NUMBA_CPU_FEATURES": FEATURES}
        sys.exit(
            subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.stability.savings", *sys.argv[1:]], env=given
            ).returncode
        )
    head = [
        "",
        "bricks in the box",
        "sampled",
        "inside, never sampled",
        "evaluations of dense",
        "per kept sample",
    ]
    publish("bricks", table(head, bricks()))
    publish("steps", table(["", "iterations", "until its vector has left", "until it has left"], steps()))
    publish("code", table(["", "instructions"], code()))


if __name__ == "__main__":
    main()
