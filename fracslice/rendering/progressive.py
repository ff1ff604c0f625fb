"""Progressive rendering: each pass adds one sample to the pixels that still need one."""

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
from .parts import PoolTracer
from .sequence import Samples
from .setup import RenderSetup, prepare

STEPS, GROWTH, GROWN = 160, 10, 16
"""Step limit of a ray in the first pass. It grows linearly by a factor of GROWTH over GROWN passes."""
PREVIEWS = (1, 2, 4, 8)
"""Allowed grid spacings, in pixels, of the first pass after a camera move."""
TOLERANCE = 0.002
"""Standard error of displayed brightness at which a pixel has converged: half a level of 256."""


SIZE = Vector(None, "pixels across and down", sizes=(2,), least=1, most=32768, whole=True)


@dataclass(frozen=True, eq=False)
class Pass:
    """The picture after a pass.

    Attributes
    ----------
    number : int
        Number of the pass, from 1.
    samples : float
        Mean samples per pixel.
    error : float
        Root mean square of the pixels' standard errors, in displayed brightness.
    active : float
        Fraction of the pixels sampled in this pass.
    rate : float
        Samples per second.
    film : Film
        Film that develops the picture.
    mode : str
        `Shading.mode` of the picture.
    source : Accumulator
        Accumulator that holds the samples.
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
        """Linear light.

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            Mean of the samples.

        Raises
        ------
        RenderError
            If a later pass has replaced this picture.
        """
        return self._current().host().mean()

    @cached_property
    def shown(self) -> np.ndarray:
        """Developed picture.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            sRGB.

        Raises
        ------
        RenderError
            If a later pass has replaced this picture.
        """
        return self._current().shown(self.film, self.mode)

    def _current(self) -> Accumulator:
        """The accumulator, if it still holds this pass."""
        if self.source.passes != self.number:
            raise RenderError(
                f"pass {self.number}: its picture is gone, pass {self.source.passes} is over it"
            )
        return self.source


def _machinery(device: str) -> tuple[Callable[..., Any], Callable[[HostAccumulator], Accumulator]]:
    """The tracer and the accumulator factory of a device."""
    if device == "cpu":
        return CpuTracer, HostAccumulator.of
    from .cuda import CudaTracer
    from .cuda_accumulator import CudaAccumulator

    return CudaTracer, CudaAccumulator.of


class Renderer:
    """Progressive renderer of one view of one scene.

    Iterating over `passes` can stop and start again at any time; rendering continues from the last pass.

    Parameters
    ----------
    root : Node
        Root of the formula tree; depths may be "auto".
    view : View
        Camera, film, lights, fog and shading.
    size : tuple of int, optional
        Picture width and height, pixels; the film's size by default.
    work : Work, optional
        Threads, progress and cancellation.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.
    samples : Samples, optional
        Part of the sample sequence; its begin, without a shift, by default.

    Raises
    ------
    SceneError
        If the view cannot be rendered.
    RenderError
        If the size is invalid.
    """

    def __init__(
        self,
        root: Node,
        view: View,
        size: tuple[int, int] | None = None,
        work: Work | None = None,
        device: str = "auto",
        samples: Samples | None = None,
    ) -> None:
        pixels = (view.film.width, view.film.height) if size is None else size
        self.width, self.height = validated("size", pixels, SIZE, RenderError)
        self.work = work or Work()
        self.device = chosen(device if self.work.cluster is None else "cpu")
        self.setup = prepare(root, view, (self.width, self.height))
        self.dtype = np.dtype(self.setup.precision)
        tracer, self._kept = _machinery(self.device)
        self.tracer = tracer(self._frame(0), self.dtype, self.width, self.height)
        self.tracer.samples = samples or self.tracer.samples
        if self.work.cluster is not None:
            self.tracer = PoolTracer(root, view, self.tracer)
        self.accumulator = self._kept(self._empty)
        self._aimed: tuple[Node, bool] | None = None
        self._rate = 0.0

    @property
    def _empty(self) -> HostAccumulator:
        """A host accumulator without samples."""
        return HostAccumulator.empty(self.width, self.height, self.dtype, work=self.work)

    @property
    def key(self) -> str:
        """Hash of everything that determines the samples: scene, view, size, precision and program version.

        Returns
        -------
        str
            Equal keys mean equal pictures after equal passes.
        """
        what: RenderSetup = self.setup
        frames = [self._frame(k).linked for k in range(len(what.roots))]
        parts = [part for frame in frames for part in (frame.source, frame.parameters)]
        return key(program(), self.width, self.height, what.precision, self.tracer.samples, *parts)

    def look(self, camera: Camera, within: float | None = None) -> None:
        """Restart the picture from another camera; depths and precision are kept.

        Suitable for moves that leave the level of detail unchanged; otherwise create a new renderer, which
        chooses depths and precision again. The eye must be outside the solid.

        Parameters
        ----------
        camera : Camera
            The new camera.
        within : float, optional
            Time budget of the first pass, seconds. Its grid is the finest that fits, judged by the rate of
            earlier passes.
        """
        what = self.setup
        seen = optics(camera, (self.width, self.height), what.roots[-1], what.optics.least)
        self.setup = replace(what, camera=camera, optics=seen)
        self._aimed = None
        self.accumulator = self.accumulator.anew(COARSE if within is None else self._affordable(within))

    def _affordable(self, within: float) -> int:
        """The finest grid spacing of a first pass that fits the time budget."""
        for coarse in PREVIEWS:
            if self.width * self.height <= coarse * coarse * self._rate * within:
                return coarse
        return PREVIEWS[-1]

    def save(self, file: BinaryIO) -> None:
        """Write the accumulated samples for `resume`.

        Parameters
        ----------
        file : BinaryIO
            Writable binary file.
        """
        self.accumulator.host().save(file, self.key)

    def resume(self, path: str | Path) -> None:
        """Continue from a file written by `save`.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        RenderError
            If the file belongs to another picture or is damaged.
        """
        self.accumulator = self._kept(HostAccumulator.load(path, self.key, self._empty))

    def passes(self, samples: int | None = None, tolerance: float = TOLERANCE) -> Iterator[Pass]:
        """Yield the picture after every pass until all pixels have converged.

        A pixel is finished when it has `samples` samples or its error is within `tolerance`. The first pass
        samples one pixel in 16, the second all others; `Accumulator.wanted` chooses the pixels of later
        passes.

        Parameters
        ----------
        samples : int, optional
            Maximum samples per pixel; the film's `samples` by default.
        tolerance : float
            Standard error of a pixel's displayed brightness at which it has converged.

        Yields
        ------
        Pass
            The picture after a pass.

        Raises
        ------
        RenderError
            If `samples` or `tolerance` is invalid.
        Cancelled
            If the work was cancelled; completed passes stay valid.
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
        self.aim(number, limit)
        self.accumulator.receive(pixels, lambda sums: self.tracer.add(sums, pixels, number, limit, self.work))
        samples, error = self.accumulator.statistics()
        self._rate = count / (time.perf_counter() - start)
        return self._seen(samples, error, count, self._rate)

    def aim(self, number: int, limit: int) -> None:
        """Load the tree of a pass into the tracer; run the cone prepass if a block holds several rays.

        Parameters
        ----------
        number : int
            Number of the pass, from 0.
        limit : int
            Steps per ray.
        """
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
        """Return the current picture without another pass.

        Returns
        -------
        Pass
            The current picture.
        """
        return self._seen(*self.accumulator.statistics(), 0, 0.0)

    def _seen(self, samples: float, error: float, traced: int, rate: float) -> Pass:
        view, kept = self.setup.view, self.accumulator
        active = traced / (self.width * self.height)
        return Pass(kept.passes, samples, error, active, rate, view.film, view.shading.mode, kept)
