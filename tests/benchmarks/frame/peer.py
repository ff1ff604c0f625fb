"""A frame of the Mandelbulb, against hand-written AVX-512 C++ on the same rays: ratios of CPU seconds in one
run.

python -m tests.benchmarks.frame.peer [rounds]

Both render 800 x 600 pixels with Phong's shading from the same place, on two threads, in turns. Ours finds
its depth by itself elsewhere; here it is pinned to the peer's ten steps.
"""

from __future__ import annotations

import sys
import tempfile
import time

import numpy as np

from fracslice.formulas import mandelbulb
from fracslice.rendering.accumulator import GOAL, HostAccumulator, Plan, ordered
from fracslice.rendering.cpu import BLOCK, CpuTracer
from fracslice.rendering.linking import link_frame
from fracslice.rendering.optics import optics
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.work import Work

from ..programs import told

WIDTH, HEIGHT, SAMPLES = 800, 600, 16


def tracer() -> CpuTracer:
    camera, root = Camera(eye=(2.2, -2.0, 1.4)), mandelbulb(iterations=10)
    sides = np.array([camera.right, camera.above, camera.forward])
    light = Light(position=tuple(np.array([-0.35, 0.5, -0.8]) @ sides), strength=0.7, shadows="no")
    view = View(camera=camera, lights=(light,), shading=Shading(ambient=0.1))
    seen = optics(camera, (WIDTH, HEIGHT), root, 1e-7)
    return CpuTracer(link_frame(root, view, camera, seen, BLOCK), np.dtype(np.float32), WIDTH, HEIGHT)


def ours(of: CpuTracer, pixels: np.ndarray) -> tuple[float, float]:
    """CPU seconds of the first sample, the look ahead included, and of all of them."""
    work, picture = Work(threads=2), HostAccumulator.empty(WIDTH, HEIGHT, np.dtype(np.float32))
    of.aim(of.frame)
    spent, start = [], time.process_time()
    of.look_ahead(work)
    for goal in (1, SAMPLES):
        picture.channels[..., GOAL] = goal
        of.add(picture.sums, Plan(pixels, goal * pixels.size, goal), work)
        spent.append(time.process_time() - start)
    return spent[0], spent[1]


def peer() -> tuple[float, float]:
    with tempfile.NamedTemporaryFile(suffix=".ppm") as file:
        (found,) = told("frame", file.name, WIDTH, HEIGHT, SAMPLES, "--runs", 1, "--threads", 2)
    return found["cpu_s"], found["cpu16_s"]


def main(rounds: int = 9) -> None:
    of, pixels = tracer(), ordered(WIDTH, HEIGHT)
    ours(of, pixels)
    pairs = np.array([(*ours(of, pixels), *peer()) for _ in range(rounds)])
    mine, other = np.median(pairs[:, :2], 0), np.median(pairs[:, 2:], 0)
    ratios = np.median(pairs[:, :2] / pairs[:, 2:], 0)
    for name, a, b, ratio in zip(("first sample", f"{SAMPLES} samples"), mine, other, ratios, strict=True):
        print(f"{name}: {a:.4f} s, C++ {b:.4f} s, ratio {ratio:.3f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
