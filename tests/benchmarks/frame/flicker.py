"""Flicker of a film: mean difference of successive frames of a still camera, in levels of 256.

At equal samples, with noise that moves and with noise that is fixed; and the root mean square error of a
frame beside that of the mean of all frames: the eye averages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fracslice import read
from fracslice.animation import FilmJob, Timeline, film
from fracslice.animation.film import gradual_depths
from fracslice.formulas import Node
from fracslice.rendering import develop
from fracslice.scene import library
from fracslice.scene.reader import reads
from fracslice.scene.view import Animation, Camera, View
from fracslice.work import Work

from ..runner import Row, Run

ZOOM = """<scene version="1"><solid size="80mm"><mandelbulb/></solid><camera target="0.9 0.1 0.2"/>
<animation duration="{frames}s" noise="fixed"/>
<track of="camera.eye" keys="0s: 1.8 0 0; {frames}s: 1.25 0.05 0.1" curve="linear"/></scene>"""
SMALLEST = {"zoom": 3, "width": 32, "height": 18, "frames": 2, "truth": 16}


def rows(
    run: Run,
    width: int = 160,
    height: int = 90,
    samples: int = 8,
    frames: int = 8,
    truth: int = 1024,
    zoom: int = 48,
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
    for name, kind in (("zoom, depths change by shares", gradual_depths), ("zoom, one depth", one_depth)):
        yield {"noise": name, "largest step of the difference": popping(kind, zoom, run.threads[0])}


def popping(depths: Callable[..., list[Node]], frames: int, threads: int) -> float:
    """Largest rise from one difference of successive frames to the next one, in a zoom with fixed noise."""
    job = FilmJob(Timeline(reads(ZOOM.format(frames=frames))), (64, 48), 16, 1.0, device="cpu")
    given, film.gradual_depths = film.gradual_depths, depths
    try:
        shown = [255 * develop(job.light(k, Work(threads)), View()) for k in range(frames)]
    finally:
        film.gradual_depths = given
    return float(np.diff(abs(np.diff(shown, axis=0)).mean((1, 2, 3))).max(initial=0.0))


def one_depth(root: Node, camera: Camera, size: tuple[int, int], count: int) -> list[Node]:
    """The depth of a picture."""
    return [root] * count
