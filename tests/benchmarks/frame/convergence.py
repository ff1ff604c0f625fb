"""Samples and CPU time until a picture is clean, for the renderer's samples and random ones.

Random: every round one uniform sample of each pixel. Ours: the renderer as it is, with a tolerance of 0, so
that no pixel is ever done; samples are the pixels' average. The reference is the mean of another 4096 samples
of each pixel; errors are root mean squares over pixels and colours, in linear light. A row says after how
many samples, and in which share of the CPU time, ours has the error of all random rounds.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from fracslice.expr import frontend
from fracslice.formulas import Node, julia, mandelbulb, menger, plane, transform, union
from fracslice.rendering import Renderer, packets
from fracslice.rendering.accumulator import CHANNELS, COUNT, GOAL, PassPlan, tile_order
from fracslice.rendering.units.camera import hashed
from fracslice.scene.view import Camera, Light, View
from fracslice.work import Work

from ..runner import Row, Run

SIZE = (96, 64)
SMALLEST = {"scenes": ("mandelbulb",), "rounds": 4, "truth": 8}
GROUND = plane(offset=-1.1)
SUN = Light(position=(-1, -1.4, 1.2), size=3)
SCENES: dict[str, tuple[Node, View]] = {
    "mandelbulb": (mandelbulb(iterations=5), View(camera=Camera(), lights=(Light(shadows="no"),))),
    "soft shadow": (union(GROUND, menger(level=2)), View(camera=Camera(eye=(2.6, -3, 1.5)), lights=(SUN,))),
    "sky": (
        union(GROUND, transform(julia(iterations=6), rotate=(1, 0, 0, 90))),
        View(camera=Camera(eye=(2.6, -3, 1.5)), lights=(SUN, Light(kind="sky"))),
    ),
    "lens": (
        union(GROUND, menger(level=2)),
        View(camera=Camera(eye=(2, -2.6, 1.2), aperture=0.1), lights=(SUN,)),
    ),
}
Curve = list[tuple[float, float, float]]
"""Samples of a pixel, seconds of the CPU, error."""


def sample(a, pixel, dimension):  # type: ignore[no-untyped-def]
    """A number of its own for every sample, pixel and dimension: the random rounds' own."""
    seed = hashed((pixel * 64 + dimension) & 0xFFFFFFFF)
    return (hashed((a ^ seed) & 0xFFFFFFFF) >> 8) * 5.9604644775390625e-08


def centred(a, pixel, dimension):  # type: ignore[no-untyped-def]
    return sample(a, pixel, dimension)


def renderer(root: Node, view: View) -> Renderer:
    made = Renderer(root, view, SIZE, Work(threads=2), "cpu")
    made.tracer.look_ahead(made.work)
    return made


def mean_of_rounds(of: Renderer, count: int, first: int = 0) -> Iterator[np.ndarray]:
    """The mean after every round of one sample in each pixel, from sample `first` on; float64 [pixels, 3]."""
    sums, pixels, total = np.zeros((SIZE[0] * SIZE[1], CHANNELS), np.float32), tile_order(*SIZE), 0.0
    for n in range(first, first + count):
        sums[:] = 0
        sums[:, COUNT], sums[:, GOAL] = n, n + 1
        of.tracer.add(sums.ravel(), PassPlan(pixels, pixels.size, n + 1), of.work)
        total = total + sums[:, :3].astype(np.float64)
        yield total / (n - first + 1)


def reference(root: Node, view: View, count: int) -> np.ndarray:
    *_, last = mean_of_rounds(renderer(root, view), count, count)
    return last


def ours(root: Node, view: View, exact: np.ndarray, most: int) -> Curve:
    made, curve, spent = Renderer(root, view, SIZE, Work(threads=2), "cpu"), [], 0.0
    start = time.process_time()
    for done in made.passes(10 * most, 0.0):
        spent += time.process_time() - start
        if done.number > 1:
            curve.append((done.samples, spent, error(done.image.reshape(-1, 3), exact)))
        if done.samples > most:
            return curve
        start = time.process_time()
    return curve


def random(root: Node, view: View, exact: np.ndarray, count: int) -> Curve:
    """By the same units, but for the two that make the numbers."""
    kept, packets.sample, packets.centred = (packets.sample, packets.centred), sample, centred
    frontend._function.cache_clear()
    made = renderer(root, view)
    table = np.random.default_rng(1).integers(0, 2**32, (count + 1, 64), np.uint32)
    packets.sample, packets.centred = kept
    frontend._function.cache_clear()
    made.tracer._points = np.ascontiguousarray(table[:, : made.tracer.frame.samples]).view(np.int32)
    curve, spent, start = [], 0.0, time.process_time()
    for n, mean in enumerate(mean_of_rounds(made, count), 1):
        spent += time.process_time() - start
        curve.append((float(n), spent, error(mean, exact)))
        start = time.process_time()
    return curve


def error(picture: np.ndarray, exact: np.ndarray) -> float:
    return float(np.sqrt(((picture - exact) ** 2).mean()))


def rows(
    run: Run, scenes: tuple[str, ...] = tuple(SCENES), rounds: int = 1000, truth: int = 4096, plot: str = ""
) -> Iterator[Row]:
    curves = {}
    for name in scenes:
        root, view = SCENES[name]
        exact = reference(root, view, truth)
        mine, other = curves[name] = ours(root, view, exact, rounds), random(root, view, exact, rounds)
        samples, seconds, _ = next((c for c in mine if c[2] <= other[-1][2]), (np.inf,) * 3)
        row = {"": name, "error of the random rounds": other[-1][2], "samples": float(samples)}
        yield {**row, "share of their CPU time": float(seconds / other[-1][1])}
    if plot:
        draw(curves, plot)


def draw(curves: dict[str, tuple[Curve, Curve]], path: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    _, axes = pyplot.subplots(2, len(curves), figsize=(3.2 * len(curves), 5.6), sharey="col")
    for column, (name, pair) in zip(axes.T, curves.items(), strict=True):
        for label, curve in zip(("fracslice", "random"), pair, strict=True):
            samples, seconds, errors = np.array(curve).T
            for axis, along in zip(column, (samples, seconds), strict=True):
                axis.loglog(along, errors, label=label, linewidth=1.3)
                axis.axhline(pair[1][-1][2], color="0.7", linewidth=0.7, zorder=0)
                axis.grid(alpha=0.25)
        column[0].set(title=name, xlabel="samples a pixel")
        column[1].set(xlabel="seconds of the CPU")
    for axis in axes[:, 0]:
        axis.set_ylabel("root mean square error")
    axes[0, 0].legend(fontsize=8)
    pyplot.tight_layout()
    pyplot.savefig(path, dpi=80)
