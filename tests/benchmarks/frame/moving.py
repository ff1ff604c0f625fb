"""A camera on the move: milliseconds from the new place to the picture that is shown, and where they go.

    python -m tests.benchmarks.frame.moving [SCENE] [STEPS]

640 x 360 pixels on the CPU, medians of CPU time (both threads') and of the clock's. Fixed: the first pass, of
every fourth pixel of every fourth row. Within 30 ms: as fine as the passes before allow. Full: one sample of
every pixel. The bound is the CPU time of tracing the same rays alone: the ratio says what is spent beside it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fracslice import read
from fracslice.rendering import Renderer
from fracslice.rendering.accumulator import GOAL, HostAccumulator, Plan, ordered
from fracslice.scene import library
from fracslice.scene.view import Camera

SIZE, WITHIN = (640, 360), 0.03


def main(name: str = "mandelbulb", steps: str = "40") -> None:
    scene = read(library.path(name))
    start = Camera.around(scene.root.bounds.box)
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
        clock, spent, bounds, rays = np.median([timed(of, show, camera) for camera in cameras], 0)
        print(
            f"{name}, {title:13} {1e3 * clock:6.1f} ms, {1e3 * spent:6.1f} ms of the CPU, {rays:7.0f} rays, "
            f"{spent / bounds:.2f} of the bound"
        )


def timed(of: Renderer, show: Callable[[Camera], None], camera: Camera) -> tuple[float, ...]:
    """Seconds of the clock and of the CPU, those of tracing the same rays, and how many they are."""
    start, busy = time.perf_counter(), time.process_time()
    show(camera)
    clock, spent = time.perf_counter() - start, time.process_time() - busy
    kept = of.accumulator.host()
    picture, pixels = HostAccumulator.empty(*SIZE, kept.sums.dtype), ordered(*SIZE)
    picture.channels[..., GOAL] = 1
    pixels = pixels[kept.counts[pixels >> 16, pixels & 65535] > 0]
    busy = time.process_time()
    of.tracer.add(picture.sums, Plan(pixels, len(pixels), 1), of.work)
    return clock, spent, time.process_time() - busy, float(len(pixels))


if __name__ == "__main__":
    main(*sys.argv[1:])
