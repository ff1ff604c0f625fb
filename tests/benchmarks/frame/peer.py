"""CPU time of a Mandelbulb frame, 800 x 600 with Phong's shading, against hand-written C++ on the same rays.

Same hit test: the C++ program marches the same signed field to its first root by the same rule, each ray from
the box on; that ratio compares programs. Other hit test: it stops half a pixel before the surface by the
estimate of its distance, as ours once did; that ratio is the price of the exact depth. Ours chooses its depth
elsewhere; here it is pinned to the peer's ten steps. Ratios are fracslice / C++.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator

import numpy as np

from fracslice.formulas import mandelbulb
from fracslice.rendering.accumulator import GOAL, HostAccumulator, PassPlan, tile_order
from fracslice.rendering.linking import link_frame
from fracslice.rendering.packets import CpuTracer
from fracslice.rendering.setup import optics
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.work import Work

from ..programs import output
from ..runner import Figures, Row, Run, timed

RUNS = 9
SMALLEST = {"width": 64, "height": 48, "samples": 2}


def tracer(width: int, height: int) -> CpuTracer:
    camera, root = Camera(eye=(2.2, -2.0, 1.4)), mandelbulb(iterations=10)
    sides = np.array([camera.right, camera.above, camera.forward])
    light = Light(position=tuple(np.array([-0.35, 0.5, -0.8]) @ sides), strength=0.7, shadows="no")
    view = View(camera=camera, lights=(light,), shading=Shading(ambient=0.1))
    seen = optics(camera, (width, height), root, 1e-7)
    return CpuTracer(link_frame(root, view, camera, seen), np.dtype(np.float32), width, height)


def ours(of: CpuTracer, pixels: np.ndarray, samples: int, work: Work) -> Figures:
    """CPU seconds of the first sample, the look ahead included, and of all of them."""
    picture = HostAccumulator.empty(of.width, of.height, np.dtype(np.float32))
    of.aim(of.frame)

    def add(goal: int) -> None:
        picture.channels[..., GOAL] = goal
        of.add(picture.sums, PassPlan(pixels, goal * pixels.size, goal), work)

    def first() -> None:
        of.look_ahead(work)
        add(1)

    def others() -> None:
        of.look_ahead(work)
        add(samples)

    once = timed(first)["cpu_s"]
    return {"cpu_s": once, "cpu16_s": once + timed(others)["cpu_s"]}


def rows(run: Run, width: int = 800, height: int = 600, samples: int = 16) -> Iterator[Row]:
    of, pixels, work = tracer(width, height), tile_order(width, height), Work(run.threads[0])
    with tempfile.NamedTemporaryFile(suffix=".ppm") as file:
        given = file.name, width, height, samples, "--runs", 1, "--threads", run.threads[0], "--roots"
        acts = {
            "fracslice": lambda: ours(of, pixels, samples, work),
            "the same hit test": lambda: output("frame", *given, 1)[0],
            "stops half a pixel early": lambda: output("frame", *given, 0)[0],
        }
        measured = run.interleaved(acts)
    for key, name in {"cpu_s": "first sample", "cpu16_s": f"{samples} samples"}.items():
        ratios = {
            f"/ C++, {to}": measured.ratio("fracslice", to, key)
            for to in ("the same hit test", "stops half a pixel early")
        }
        yield {"": name, "CPU s": measured.spread("fracslice", key), **ratios}
