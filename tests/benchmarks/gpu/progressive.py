"""The renderer's passes on a real GPU, host included: ``python -m tests.benchmarks.gpu.progressive [a.png]``.

1920 x 1080 pixels of the Mandelbulb with a soft sun and a sky, then a moving camera at 640 x 360. Prints
milliseconds of a pass as the renderer yields it (statistics, choice of pixels), with and without the shown
picture in the computer's memory, against tracing all pixels: the ratio is what keeping the picture costs.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fracslice.export.images import write_image
from fracslice.formulas import mandelbulb
from fracslice.kernel import cuda
from fracslice.rendering import Renderer
from fracslice.rendering.accumulator import CHANNELS, GOAL, Plan, ordered
from fracslice.scene.view import Camera, Film, Light, View

VIEW = View(
    camera=Camera(eye=(0.0, -2.6, 0.6)),
    film=Film(samples=4096),
    lights=(Light(size=2), Light(kind="sky", strength=0.5)),
)
WARM, ROUNDS = 24, 20


def main(picture: str | None = None) -> None:
    numba_cuda = cuda.require()
    of = Renderer(mandelbulb(), VIEW, (1920, 1080), device="cuda")
    passes = of.passes(tolerance=0.0)
    for _ in range(WARM):
        last = next(passes)
        _ = last.shown

    def without() -> None:
        next(passes)

    def shown() -> None:
        _ = next(passes).shown

    pixels = numba_cuda.to_device(ordered(1920, 1080))

    sums = np.zeros((1920 * 1080, CHANNELS), of.dtype)
    sums[:, GOAL] = 2 * ROUNDS
    placed = numba_cuda.to_device(sums.ravel())

    def traced() -> None:
        of.tracer.add(placed, Plan(pixels, pixels.size, 1), of.work)
        numba_cuda.synchronize()

    alone = median(traced)
    for name, run in {"tracing every pixel": traced, "pass": without, "pass and its picture": shown}.items():
        took, active = median(run), next(passes).active
        note = "" if run is traced else f", of {active:.2f} samples a pixel"
        print(f"1080p {name:22} {took:7.2f} ms, {took / alone:.2f} of the tracing of all{note}")
    statistics = median(lambda: of.accumulator.statistics())
    wanted = median(lambda: of.accumulator.plan(4096, 0.0))
    tones = median(lambda: of.accumulator.shown(VIEW.film, "light"))
    print(f"1080p statistics {statistics:.2f} ms, choice {wanted:.2f} ms, tones and download {tones:.2f} ms")
    moving()
    if picture:
        *_, last = Renderer(mandelbulb(), VIEW, (1920, 1080), device="cuda").passes(64)
        write_image(Path(picture), last.shown / np.float32(255), last.image)


def moving() -> None:
    """From a new camera to its picture: coarse, and one sample in every pixel."""
    of = Renderer(mandelbulb(), VIEW, (640, 360), device="cuda")
    list(of.passes(1))
    camera = iter(Camera(eye=(0.0, -2.6, 0.6)).orbited(3.0 * k) for k in range(1000))

    def coarse() -> None:
        of.look(next(camera))
        _ = next(of.passes(1)).shown

    def full() -> None:
        of.look(next(camera))
        *_, last = of.passes(1)
        _ = last.shown

    coarse(), full()
    print(f"640x360, moved camera: first pass {median(coarse):.2f} ms, every pixel {median(full):.2f} ms")


def median(run: Callable[[], object]) -> float:
    """Milliseconds of the clock."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


if __name__ == "__main__":
    main(*sys.argv[1:])
