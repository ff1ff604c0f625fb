"""A camera on the move: milliseconds from the new place to the picture that is shown, and where they go.

    python -m tests.benchmarks.frame.moving [SCENE] [STEPS]

640 x 360 pixels on the CPU. Fixed: the first pass, of every fourth pixel of every fourth row. Within 30 ms: as
fine as the passes before allow. Full: one sample of every pixel. The bound is the tracing of the same rays
alone, on the same threads: the ratio says what is spent beside it. Medians.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fracslice import read
from fracslice.render import Renderer
from fracslice.render.accumulator import HostAccumulator
from fracslice.scene import library
from fracslice.scene.view import Camera

SIZE, WITHIN = (640, 360), 0.03


def main(name: str = "mandelbulb", steps: str = "40") -> None:
    scene = read(library.path(name))
    start = Camera.around(scene.root.facts.box)
    of = Renderer(scene.root, replace(scene.view, camera=start), SIZE, device="cpu")
    list(of.passes(1))
    cameras = [start.orbited(360 * k / int(steps)) for k in range(int(steps))]

    def fixed(camera: Camera) -> None:
        of.look(camera)
        _ = next(of.passes(1)).shown

    def within(camera: Camera) -> None:
        of.look(camera, WITHIN)
        _ = next(of.passes(1)).shown

    def full(camera: Camera) -> None:
        of.look(camera)
        *_, last = of.passes(1)
        _ = last.shown

    for title, show in {"fixed": fixed, "within 30 ms": within, "full": full}.items():
        times, bounds, rays = np.array([timed(of, show, camera) for camera in cameras]).T
        ratio = np.median(times / bounds)
        print(
            f"{name}, {title:13} {1e3 * np.median(times):6.1f} ms, nine in ten within "
            f"{1e3 * np.quantile(times, 0.9):6.1f} ms, {np.median(rays):7.0f} rays, {ratio:.2f} of the bound"
        )


def timed(of: Renderer, show: Callable[[Camera], None], camera: Camera) -> tuple[float, float, float]:
    """Seconds of the whole, of tracing the same rays, and how many they are."""
    start = time.perf_counter()
    show(camera)
    whole = time.perf_counter() - start
    kept = of.accumulator.host()
    sums, empty = np.zeros_like(kept.sums), HostAccumulator.empty(*SIZE, of.dtype, kept.coarse)
    pixels, _ = empty.wanted(1, 0.0)
    if kept.passes > 1:
        empty.passes = 1
        pixels, _ = empty.wanted(1, 0.0)
    start = time.perf_counter()
    of.tracer.add(sums, pixels, 1, 160, of.work)
    return whole, time.perf_counter() - start, float(len(pixels))


if __name__ == "__main__":
    main(*sys.argv[1:])
