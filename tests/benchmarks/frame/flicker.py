"""Flicker of a film: mean difference of successive frames of a still camera, in levels of 256.

At equal samples, with noise that moves and with noise that is fixed; and the root mean square error of a
frame beside that of the mean of all frames: the eye averages.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fracslice import read
from fracslice.animation import FilmJob, Timeline
from fracslice.rendering import develop
from fracslice.scene import library
from fracslice.scene.animation import Animation
from fracslice.work import Work

from ..runner import Row, Run

SMALLEST = {"width": 32, "height": 18, "frames": 2, "truth": 16}


def rows(
    run: Run, width: int = 160, height: int = 90, samples: int = 8, frames: int = 8, truth: int = 1024
) -> Iterator[Row]:
    scene = read(library.path("mandelbulb"))

    def levels(noise: str, count: int, number: int) -> np.ndarray:
        timeline = Timeline(replace(scene, animation=Animation(duration=1.0, noise=noise)))
        job = FilmJob(timeline, (width, height), count, 24.0, device="cpu")
        work = Work(run.threads[0])
        return np.array([255 * develop(job.light(k, work), scene.view) for k in range(number)])

    (exact,) = levels("fixed", truth, 1)
    for noise in ("moving", "fixed"):
        shown = levels(noise, samples, frames)
        one, mean = (np.sqrt(((picture - exact) ** 2).mean()) for picture in (shown[0], shown.mean(0)))
        yield {
            "noise": noise,
            "difference of frames": float(abs(np.diff(shown, axis=0)).mean()),
            "error of a frame": float(one),
            "error of the mean": float(mean),
        }
