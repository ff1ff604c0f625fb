"""The renderer's passes on a real GPU, host included, against tracing all pixels; and a moving camera.

1920 x 1080 pixels of the Mandelbulb with a soft sun and a sky; the camera moves at 640 x 360. A pass as the
renderer yields it chooses its pixels; the picture is the one shown, in the computer's memory.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracslice.expr.cuda_driver import to_device
from fracslice.formulas import mandelbulb
from fracslice.rendering import Renderer
from fracslice.rendering.accumulator import CHANNELS, GOAL, PassPlan, tile_order
from fracslice.scene.view import Camera, Film, Light, View

from ..runner import Row, Run, Spread

VIEW = View(
    camera=Camera(eye=(0.0, -2.6, 0.6)),
    film=Film(samples=4096),
    lights=(Light(size=2), Light(kind="sky", strength=0.5)),
)
WARM = 24
RUNS = 20


def rows(run: Run) -> Iterator[Row]:
    of = Renderer(mandelbulb(), VIEW, (1920, 1080), device="cuda")
    passes = of.passes(tolerance=0.0)
    for _ in range(WARM):
        last = next(passes)
        _ = last.shown

    def shown() -> None:
        _ = next(passes).shown

    pixels = to_device(tile_order(1920, 1080))
    sums = np.zeros((1920 * 1080, CHANNELS), of.dtype)
    sums[:, GOAL] = 3 * RUNS
    placed = to_device(sums.ravel())

    def traced() -> None:
        of.tracer.add(placed, PassPlan(pixels, pixels.size, 1), of.work)
        placed[:1].copy_to_host()  # waits for the GPU

    moved = Renderer(mandelbulb(), VIEW, (640, 360), device="cuda")
    list(moved.passes(1))
    cameras = iter(Camera(eye=(0.0, -2.6, 0.6)).orbited(3.0 * k) for k in range(1000))

    def coarse() -> None:
        moved.look(next(cameras))
        _ = next(moved.passes(1)).shown

    def full() -> None:
        moved.look(next(cameras))
        *_, last = moved.passes(1)
        _ = last.shown

    acts = {
        "tracing every pixel": traced,
        "pass": lambda: _done(next(passes)),
        "pass and its picture": shown,
        "statistics": lambda: _done(of.accumulator.statistics()),
        "choice of pixels": lambda: _done(of.accumulator.plan(4096, 0.0)),
        "tones and download": lambda: _done(of.accumulator.shown(VIEW.film, "light")),
        "moved camera, 640 x 360, first pass": coarse,
        "moved camera, 640 x 360, every pixel": full,
    }
    measured = run.interleaved(acts)
    for name in acts:
        ms = Spread.of([1e3 * figures["wall_s"] for figures in measured[name]])
        yield {
            "": name,
            "ms": ms,
            "/ tracing every pixel": measured.ratio(name, "tracing every pixel", "wall_s"),
        }


def _done(_: object) -> None:
    """Let a result go."""
