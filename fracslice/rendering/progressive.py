"""A picture that sharpens while one looks: passes over the film, each adding a sample where one is still
needed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import RenderError
from ..formulas.parameters import Number, Vector, validated
from ..formulas.registry import Node
from ..kernel.devices import chosen
from ..keys import key, program
from ..scene.view import Camera, Film, View
from ..work import Work
from .accumulator import COARSE, Accumulator, HostAccumulator
from .cpu import BLOCK, CpuTracer
from .linking import Frame, link_frame
from .optics import optics
from .setup import RenderSetup, prepare

STEPS, GROWTH, GROWN = 160, 10, 16
"""Steps of a ray in the first pass; how often as many after GROWN passes, in equal steps between."""
PREVIEWS = (1, 2, 4, 8)
"""How coarse the first pass from a moved camera may be."""
TOLERANCE = 0.002
"""A pixel has converged when its brightness, as shown, is known to half a level of 256."""


SIZE = Vector(None, "pixels across and down", sizes=(2,), least=1, most=32768, whole=True)


@dataclass(frozen=True, eq=False)
class Pass:
    """The picture after one more pass.

    number: of the pass, from 1. samples: per pixel, on average. error: the root mean square of the pixels'
    standard errors, as shown. active: the part of the pixels that this pass was about. rate: samples a
    second.
    """

    number: int
    samples: float
    error: float
    active: float
    rate: float
    film: Film = field(repr=False)
    mode: str = field(repr=False)
    source: Accumulator = field(repr=False)

    @cached_property
    def image(self) -> np.ndarray:
        """float32 [height, width, 3], linear light. Raises `RenderError` if there was another pass since."""
        return self._current().host().mean()

    @cached_property
    def shown(self) -> np.ndarray:
        """uint8 [height, width, 3], sRGB, as the film says. Raises `RenderError` if there was another pass
        since."""
        return self._current().shown(self.film, self.mode)

    def _current(self) -> Accumulator:
        if self.source.passes != self.number:
            raise RenderError(
                f"pass {self.number}: its picture is gone, pass {self.source.passes} is over it"
            )
        return self.source


def _machinery(device: str) -> tuple[Callable[..., Any], Callable[[HostAccumulator], Accumulator]]:
    """What traces, and what keeps the sums."""
    if device == "cpu":
        return CpuTracer, HostAccumulator.of
    from .cuda import CudaTracer
    from .cuda_accumulator import CudaAccumulator

    return CudaTracer, CudaAccumulator.of


class Renderer:
    """Renders one view of one scene. `passes` may be left at any time and asked for again: it goes on where
    it was.

    root: the tree of formulas, depths may be "auto". size: pixels across and down; the film's if not given.
    Raises `SceneError` for a view that cannot be rendered, `RenderError` for a size that cannot be.
    """

    def __init__(
        self,
        root: Node,
        view: View,
        size: tuple[int, int] | None = None,
        work: Work | None = None,
        device: str = "auto",
    ) -> None:
        pixels = (view.film.width, view.film.height) if size is None else size
        self.width, self.height = validated("size", pixels, SIZE, RenderError)
        self.work = work or Work()
        self.device = chosen(device)
        self.setup = prepare(root, view, (self.width, self.height))
        self.dtype = np.dtype(self.setup.precision)
        tracer, self._kept = _machinery(self.device)
        self.tracer = tracer(self._frame(0), self.dtype, self.width, self.height)
        self.accumulator = self._kept(self._empty)
        self._aimed: tuple[Node, bool] | None = None
        self._rate = 0.0

    @property
    def _empty(self) -> HostAccumulator:
        return HostAccumulator.empty(self.width, self.height, self.dtype)

    @property
    def key(self) -> str:
        """Equal for pictures that the same samples make."""
        what: RenderSetup = self.setup
        frames = [self._frame(k).linked for k in range(len(what.roots))]
        parts = [part for frame in frames for part in (frame.source, frame.parameters)]
        return key(program(), self.width, self.height, what.precision, *parts)

    def look(self, camera: Camera, within: float | None = None) -> None:
        """Begins the picture anew from elsewhere; depths and precision stay as they are.

        For steps so short that they suit; a new renderer finds them again. The eye must be outside the
        solid. within: seconds that the first pass may take, going by the passes so far; it is as fine as
        that allows.
        """
        what = self.setup
        seen = optics(camera, (self.width, self.height), what.roots[-1], what.optics.least)
        self.setup = replace(what, camera=camera, optics=seen)
        self._aimed = None
        self.accumulator = self.accumulator.anew(COARSE if within is None else self._affordable(within))

    def _affordable(self, within: float) -> int:
        """How coarse the first pass has to be."""
        for coarse in PREVIEWS:
            if self.width * self.height <= coarse * coarse * self._rate * within:
                return coarse
        return PREVIEWS[-1]

    def save(self, file: BinaryIO) -> None:
        """Writes the picture as it is, so that `resume` goes on with it."""
        self.accumulator.host().save(file, self.key)

    def resume(self, path: str | Path) -> None:
        """Goes on with a file that `save` wrote. Raises `RenderError` if it is of another picture."""
        self.accumulator = self._kept(HostAccumulator.load(path, self.key, self._empty))

    def passes(self, samples: int | None = None, tolerance: float = TOLERANCE) -> Iterator[Pass]:
        """Yields the picture after every pass, until all pixels have so many samples or are within the
        tolerance.

        The first pass has one sample in 16 pixels, the second one in all others; which pixels later ones are
        about, `Accumulator.wanted` says. Raises `RenderError` for numbers that cannot be, and `Cancelled`;
        what was complete before stays valid.
        """
        most = self.setup.view.film.samples if samples is None else samples
        most = validated("samples", most, Film.kinds()["samples"], RenderError)
        tolerance = validated("tolerance", tolerance, Number(TOLERANCE, "an error", least=0), RenderError)
        while True:
            pixels, count = self.accumulator.wanted(most, tolerance)
            if not count:
                return
            yield self._pass(pixels, count)

    def _pass(self, pixels: Any, count: int) -> Pass:
        number = self.accumulator.passes
        limit = STEPS + STEPS * (GROWTH - 1) * min(number, GROWN) // GROWN
        start = time.perf_counter()
        self._aim(number, limit)
        self.accumulator.receive(lambda sums: self.tracer.add(sums, pixels, number, limit, self.work))
        samples, error = self.accumulator.statistics()
        self._rate = count / (time.perf_counter() - start)
        return self._seen(samples, error, count, self._rate)

    def _aim(self, number: int, limit: int) -> None:
        """Points the tracer at the tree of this pass, and looks ahead once for each, where a block of
        pixels has more than one ray."""
        ahead = number > 0 or self.accumulator.coarse < BLOCK
        aimed = self.setup.root(number), ahead
        if aimed != self._aimed:
            self.tracer.aim(self._frame(number))
            if ahead:
                self.tracer.look_ahead(limit, self.work)
            self._aimed = aimed

    def _frame(self, number: int) -> Frame:
        what = self.setup
        return link_frame(what.root(number), what.view, what.camera, what.optics, BLOCK)

    def seen(self) -> Pass:
        """The picture as it is."""
        return self._seen(*self.accumulator.statistics(), 0, 0.0)

    def _seen(self, samples: float, error: float, traced: int, rate: float) -> Pass:
        view, kept = self.setup.view, self.accumulator
        active = traced / (self.width * self.height)
        return Pass(kept.passes, samples, error, active, rate, view.film, view.shading.mode, kept)
