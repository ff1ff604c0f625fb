"""A picture that sharpens while one looks: passes over the film, each adding a sample where one is still
needed."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import RenderError
from ..formulas.registry import Node
from ..scene.view import Camera, View
from ..work import Work
from .accumulator import Accumulator
from .cpu import BLOCK, CpuTracer, ordered
from .linking import Frame, link_frame, optics
from .setting import Setting, settle

if TYPE_CHECKING:
    from .cuda import CudaTracer

COARSE = 4
"""The first pass looks at every fourth pixel of every fourth row."""
STEPS, GROWTH, GROWN = 160, 10, 16
"""Steps of a ray in the first pass; how often as many after GROWN passes, in equal steps between."""
TOLERANCE = 0.002
"""A pixel has converged when its brightness, as shown, is known to half a level of 256."""


@dataclass(frozen=True, eq=False)
class Pass:
    """The picture after one more pass.

    image: float32 [height, width, 3], linear light. number: of the pass, from 1. samples: per pixel, on
    average. error: the root mean square of the pixels' standard errors, as shown. active: the part of the
    pixels that this pass was about. rate: samples a second.
    """

    image: np.ndarray
    number: int
    samples: float
    error: float
    active: float
    rate: float


def chosen(device: str) -> str:
    """The device to use, "cpu" or "cuda"; "auto" takes the GPU if there is one. Raises `RenderError` if
    there is none."""
    if device == "cpu":
        return device
    from ..kernel.cuda import missing

    reason = missing()
    if reason and device == "cuda":
        raise RenderError(f"device cuda: {reason}")
    return "cpu" if reason else "cuda"


def _tracer(device: str) -> Callable[..., CpuTracer | CudaTracer]:
    if device == "cpu":
        return CpuTracer
    from .cuda import CudaTracer

    return CudaTracer


class Renderer:
    """Renders one view of one scene. `passes` may be left at any time and asked for again: it goes on where
    it was.

    root: the tree of formulas, depths may be "auto". size: pixels across and down; the film's if not given.
    Raises `SceneError` for a view that cannot be rendered.
    """

    def __init__(
        self,
        root: Node,
        view: View,
        size: tuple[int, int] | None = None,
        work: Work | None = None,
        device: str = "auto",
    ) -> None:
        self.width, self.height = size or (view.film.width, view.film.height)
        self.work = work or Work()
        self.device = chosen(device)
        self.setting = settle(root, view, (self.width, self.height))
        dtype = np.dtype(self.setting.precision)
        self.tracer = _tracer(self.device)(self._frame(0), dtype, self.width, self.height)
        self.accumulator = Accumulator.empty(self.width, self.height, dtype, self.key)
        self._order = ordered(self.width, self.height)
        self._aimed: Node | None = None

    @property
    def key(self) -> str:
        """Equal for pictures that the same samples make."""
        what: Setting = self.setting
        numbers = [self._frame(k).linked for k in range(len(what.roots))]
        text = "".join(n.source + repr(n.parameters.tolist()) for n in numbers)
        return hashlib.sha256(f"{self.width} {self.height} {what.precision} {text}".encode()).hexdigest()[:20]

    def look(self, camera: Camera) -> None:
        """Begins the picture anew from elsewhere; depths and precision stay as they are.

        For steps so short that they suit; a new renderer finds them again. The eye must be outside the solid.
        """
        what = self.setting
        seen = optics(camera, (self.width, self.height), what.roots[-1], what.optics.least)
        self.setting = replace(what, camera=camera, optics=seen)
        self._aimed = None
        self.accumulator = Accumulator.empty(self.width, self.height, self.accumulator.sums.dtype, self.key)

    def resume(self, path: str | Path) -> None:
        """Goes on with a file that `accumulator.save` wrote. Raises `RenderError` if it is of another
        picture."""
        self.accumulator = Accumulator.load(path, self.key)

    def passes(self, samples: int | None = None, tolerance: float = TOLERANCE) -> Iterator[Pass]:
        """Yields the picture after every pass, until all pixels have so many samples or are within the
        tolerance.

        The first pass has one sample in 16 pixels, the second one in every pixel. Raises `Cancelled`; what
        was complete before stays valid.
        """
        most = self.setting.view.film.samples if samples is None else samples
        while self.accumulator.passes < most + 1:
            pixels = self._wanted(tolerance)
            if not len(pixels):
                return
            yield self._pass(pixels)

    def _wanted(self, tolerance: float) -> np.ndarray:
        """The pixels of the next pass, in order."""
        number, x, y = self.accumulator.passes, self._order & 65535, self._order >> 16
        if number > 1:
            wanted = self.accumulator.unfinished(tolerance)[y, x]
        else:
            wanted = ((x % COARSE == 0) & (y % COARSE == 0)) == (number == 0)
        return np.asarray(self._order[wanted])

    def _pass(self, pixels: np.ndarray) -> Pass:
        number = self.accumulator.passes
        limit = STEPS + STEPS * (GROWTH - 1) * min(number, GROWN) // GROWN
        self._aim(number, limit)
        start = time.perf_counter()
        sums = self.accumulator.sums.copy()
        self.tracer.add(sums, pixels, max(number - 1, 0), limit, self.work)
        self.accumulator.sums = sums
        self.accumulator.passes += 1
        return self.seen(len(pixels), len(pixels) / (time.perf_counter() - start))

    def _aim(self, number: int, limit: int) -> None:
        """Points the tracer at the tree of this pass, and looks ahead once for each."""
        root = self.setting.root(number)
        if root is not self._aimed:
            self.tracer.aim(self._frame(number))
            self.tracer.look_ahead(limit, self.work)
            self._aimed = root

    def _frame(self, number: int) -> Frame:
        what = self.setting
        return link_frame(what.root(number), what.view, what.camera, what.optics, BLOCK)

    def seen(self, traced: int = 0, rate: float = 0.0) -> Pass:
        """The picture as it is, after a pass over so many pixels."""
        found, image = self.accumulator, self.accumulator.mean()
        if found.passes == 1:
            y, x = np.mgrid[: self.height, : self.width] // COARSE * COARSE
            image = image[y, x]
        errors = found.errors()
        known = errors[np.isfinite(errors)]
        error = float(np.sqrt(np.mean(known.astype(np.float64) ** 2))) if known.size else float("inf")
        return Pass(image, found.passes, float(found.counts.mean()), error, traced / errors.size, rate)
