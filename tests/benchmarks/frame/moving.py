"""A camera on the move at 640 x 360 on the CPU: milliseconds from its new place to the picture.

Coarse: the first pass, of every fourth pixel of every fourth row. Full: one sample of every pixel. The last
column: CPU time over that of tracing the same rays alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from fracslice import read
from fracslice.rendering import Renderer
from fracslice.rendering.accumulator import GOAL, HostAccumulator, PassPlan, tile_order
from fracslice.scene import library
from fracslice.scene.view import Camera

from ..runner import Figures, Row, Run, Spread, timed

SMALLEST = {"cameras": 2, "width": 32, "height": 16}


def rows(run: Run, cameras: int = 40, width: int = 640, height: int = 360) -> Iterator[Row]:
    scene = read(library.path("mandelbulb"))
    start = Camera.around(scene.root.bounds.box)
    of = Renderer(scene.root, replace(scene.view, camera=start), (width, height), device="cpu")
    list(of.passes(1))

    def coarse(camera: Camera) -> None:
        of.look(camera)
        _ = next(of.passes(1)).shown

    def full(camera: Camera) -> None:
        of.look(camera)
        *_, last = of.passes(1)
        _ = last.shown

    for name, show in {"coarse": coarse, "full": full}.items():
        result = [moved(of, show, start.orbited(360 * k / cameras)) for k in range(cameras)]
        spread = {key: Spread.of([figures[key] for figures in result]) for key in result[0]}
        row = {"": name, "ms": spread["wall_ms"], "CPU ms": spread["cpu_ms"], "rays": spread["rays"]}
        yield {**row, "of tracing the rays": spread["of the bound"]}


def moved(of: Renderer, show: Callable[[Camera], None], camera: Camera) -> Figures:
    """Milliseconds of a picture from a new place, the rays, and the CPU time over that of tracing them."""
    whole = timed(lambda: show(camera))
    kept = of.accumulator.host()
    size = of.width, of.height
    picture, pixels = HostAccumulator.empty(*size, kept.sums.dtype), tile_order(*size)
    picture.channels[..., GOAL] = 1
    pixels = pixels[kept.counts[pixels >> 16, pixels & 65535] > 0]
    plan = PassPlan(pixels, len(pixels), 1)
    bound = timed(lambda: of.tracer.add(picture.sums, plan, of.work))["cpu_s"]
    spent = {"wall_ms": 1e3 * whole["wall_s"], "cpu_ms": 1e3 * whole["cpu_s"]}
    return {**spent, "rays": float(len(pixels)), "of the bound": whole["cpu_s"] / bound}
