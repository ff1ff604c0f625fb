"""How quickly pictures become clean: error against samples and seconds, for these samples and for random
ones.

python -m tests.benchmarks.frame.convergence [PLOT.png]

Found: antialiasing and soft shadows reach it after 64 samples; a sky or a lens, whose integrals have four to
six dimensions and edges in all of them, after 256. Independent, shuffled pairs of dimensions were worse in
all four scenes. Random: every round one uniform sample of each pixel, as the paper's 1000 rounds. The true
picture is the mean of 4096 of ours with another scrambling. Prints how many of our samples reach the error of
1000 random rounds.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from fracslice.formulas import Node, julia, mandelbulb, menger, plane, transform, union
from fracslice.render import Renderer, cpu
from fracslice.scene.view import Camera, Light, View
from fracslice.work import Work

SIZE = (96, 64)
STEPS, TRUTH, ROUNDS = 800, 4096, 1000
MARKS = (1, 2, 4, 8, 16, 25, 32, 50, 64, 100, 128, 256, 512, 1000)
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


def mean(
    renderer: Renderer, indices: range, marks: tuple[int, ...] = ()
) -> tuple[np.ndarray, list[tuple[np.ndarray, float]]]:
    """The picture of these samples, and what it was, and when, at the marks."""
    sums, work, seen = np.zeros((SIZE[0] * SIZE[1], 6), np.float32), Work(threads=2), []
    total, start = np.zeros((SIZE[0] * SIZE[1], 3)), time.perf_counter()
    for n, index in enumerate(indices, 1):
        sums[:] = 0
        renderer.tracer.add(sums, cpu.ordered(*SIZE), index, STEPS, work)
        total += sums[:, :3]
        if n in marks:
            seen.append((total / n, time.perf_counter() - start))
    return total / len(indices), seen


def random_point(index: int, dimensions: int) -> np.ndarray:
    return np.random.default_rng(index + 1).integers(0, 2**32, dimensions, np.uint32).view(np.int32)


def errors(root: Node, view: View) -> tuple[np.ndarray, np.ndarray]:
    """[marks, 2]: RMSE and seconds of ours, and of random samples."""
    renderer = Renderer(root, view, SIZE, device="cpu")
    renderer.tracer.look_ahead(STEPS, Work(threads=1))
    sobol = cpu.point
    truth, _ = mean(renderer, range(TRUTH, 2 * TRUTH))
    _, ours = mean(renderer, range(MARKS[-1]), MARKS)
    cpu.point = random_point  # type: ignore[assignment]
    _, random = mean(renderer, range(ROUNDS), MARKS)
    cpu.point = sobol
    return tuple(
        np.array([(np.sqrt(((p - truth) ** 2).mean()), s) for p, s in found]) for found in (ours, random)
    )  # type: ignore[return-value]


def main(plot: str | None = None) -> None:
    curves = {}
    for name, (root, view) in SCENES.items():
        ours, random = curves[name] = errors(root, view)
        reached = next((n for n, e in zip(MARKS, ours[:, 0], strict=True) if e <= random[-1, 0]), None)
        at_100 = ours[MARKS.index(100), 0]
        print(f"{name:12} random: {random[-1, 0]:.5f}; ours after 100: {at_100:.5f}; reached after {reached}")
    if plot:
        draw(curves, plot)


def draw(curves: dict[str, tuple[np.ndarray, np.ndarray]], path: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    _, axes = pyplot.subplots(1, len(curves), figsize=(4 * len(curves), 3.4), sharey=True)
    for axis, (name, pair) in zip(axes, curves.items(), strict=True):
        for label, curve in zip(("Owen-scrambled Sobol", "random"), pair, strict=True):
            axis.loglog(curve[:, 1], curve[:, 0], label=label)
        axis.set(title=name, xlabel="seconds")
    axes[0].set_ylabel("root mean square error")
    axes[0].legend()
    pyplot.tight_layout()
    pyplot.savefig(path, dpi=90)


if __name__ == "__main__":
    main(*sys.argv[1:])
