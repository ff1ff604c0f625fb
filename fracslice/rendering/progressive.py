"""Progressive rendering: each pass adds one sample to the pixels that still need one."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..common.keys import key, program
from ..common.memory import available_bytes
from ..errors import RenderError
from ..formulas.parameters import Number, Vector
from ..formulas.records import validated
from ..formulas.registry import Node
from ..kernel.devices import chosen
from ..scene.view import Camera, Film, View
from ..work import Work
from .accumulator import Accumulator, PassPlan, grids
from .cpu import BLOCK, CpuTracer
from .crops import Crop
from .host_accumulator import HostAccumulator
from .linking import Frame, link_frame
from .optics import optics
from .passes import Pass
from .sequence import SampleRange
from .setup import clipped, prepare

TOLERANCE = 0.002
"""Standard error of displayed brightness at which a pixel has converged: half a level of 256."""


SIZE = Vector(None, "pixels across and down", sizes=(2,), least=1, most=32768, whole=True)


def _backend(device: str) -> tuple[Callable[..., Any], Callable[[HostAccumulator], Accumulator]]:
    """The tracer and the accumulator factory of a device."""
    if device == "cpu":
        return CpuTracer, HostAccumulator.host
    from .cuda import CudaTracer
    from .cuda_accumulator import CudaAccumulator

    return CudaTracer, CudaAccumulator


def _check_memory(crop: Crop) -> None:
    """Raise `RenderError` if a picture is larger than the memory."""
    free, pixels = available_bytes(), crop.width * crop.height
    if crop.bytes > free:
        raise RenderError(
            f"size: {pixels / 1e6:,.0f} million pixels need {crop.bytes / 1e9:,.0f} GB of memory, "
            f"{free / 1e9:,.0f} GB are free; expected fewer pixels"
        )


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
    crop : tuple of int, optional
        Part of the picture to render: left and upper pixel, width and height; all of it by default.

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
        samples: SampleRange | None = None,
        crop: tuple[int, int, int, int] | None = None,
    ) -> None:
        pixels = (view.film.width, view.film.height) if size is None else size
        film = validated("size", pixels, SIZE, RenderError)
        self.crop = Crop.of(film, crop)
        _check_memory(self.crop)
        self.width, self.height = self.crop.width, self.crop.height
        self.work = work or Work()
        self.device = chosen(device if self.work.cluster is None else "cpu")
        setup = prepare(root, view, film)
        self.setup = replace(setup, optics=replace(setup.optics, origin=self.crop.origin))
        self.dtype = np.dtype(self.setup.precision)
        tracer, self._placed = _backend(self.device)
        self._frame = self._linked()
        self.tracer = tracer(self._frame, self.dtype, *self.crop.size)
        self.tracer.samples = samples or self.tracer.samples
        if self.work.cluster is not None:
            from .parts import PoolTracer

            self.tracer = PoolTracer(root, view, self.tracer, film, crop)
        self.accumulator = self._placed(self._empty)
        self._prepasses = 0

    @property
    def _empty(self) -> HostAccumulator:
        """A host accumulator without samples."""
        work = Work(self.work.threads)  # not cancelled with the passes
        return HostAccumulator.empty(*self.crop.size, self.dtype, work=work)

    @property
    def key(self) -> str:
        """Hash of everything that determines the samples: scene, view, size, precision and program version.

        Returns
        -------
        str
            Equal keys mean equal pictures after equal passes.
        """
        linked, samples = self._frame.linked, self.tracer.samples
        about = self.crop.size, self.setup.precision, samples
        return key(program(), *about, linked.source, linked.parameters)

    def look(self, camera: Camera) -> None:
        """Restart the picture from another camera; depths and precision are kept.

        Suitable for moves that leave the level of detail unchanged; otherwise create a new renderer, which
        chooses depths and precision again. The eye must be outside the solid.

        Parameters
        ----------
        camera : Camera
            The new camera.
        """
        setup = self.setup
        seen = optics(camera, setup.optics.size, setup.root, setup.optics.least)
        seen = replace(seen, origin=setup.optics.origin)
        self.setup = replace(setup, camera=camera, optics=seen)
        self._frame, self._prepasses = self._linked(), 0
        self.tracer.aim(self._frame)
        self.accumulator = self.accumulator.anew()

    def save(self, file: BinaryIO) -> None:
        """Write the accumulated samples for `resume`.

        Parameters
        ----------
        file : BinaryIO
            Writable binary file.
        """
        from .state import save_state

        save_state(file, self.key, self.accumulator.host())

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
        from .state import load_state

        self.accumulator = self._placed(load_state(path, self.key, self._empty))

    def passes(self, samples: int | None = None, tolerance: float = TOLERANCE) -> Iterator[Pass]:
        """Yield the picture after every pass until all pixels have converged.

        A pixel is finished when it has `samples` samples or its error is within `tolerance`. The first passes
        sample grids of pixels, one pixel in 16 and then all others of a picture of up to 1024 x 1024;
        `Accumulator.plan` chooses the pixels of later passes.

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
            If the work was cancelled. The samples taken so far are kept, see `seen`, and the next call
            continues the pass.
        """
        most = self.setup.view.film.samples if samples is None else samples
        most = validated("samples", most, Film.kinds()["samples"], RenderError)
        tolerance = validated("tolerance", tolerance, Number(TOLERANCE, "an error", least=0), RenderError)
        while (plan := self.accumulator.plan(most, tolerance)).samples:
            yield self._pass(plan)

    def _pass(self, plan: PassPlan) -> Pass:
        start = time.perf_counter()
        coarse = len(grids(*self.crop.size)) - 2  # passes with a pixel a block, or less: no prepass pays
        self.prepare(max(self.accumulator.passes - coarse, 0))
        self.tracer.add(self.accumulator.sums, plan, self.work)
        self.accumulator.passes += 1
        samples, error = self.accumulator.statistics()
        return self._seen(samples, error, plan.samples, plan.samples / (time.perf_counter() - start))

    def prepare(self, prepasses: int) -> None:
        """Run cone prepasses.

        Parameters
        ----------
        prepasses : int
            Prepasses to have run, or all if there are fewer.
        """
        wanted = min(prepasses, self.tracer.prepasses)
        if wanted < self._prepasses:
            self.tracer.aim(self._frame)
            self._prepasses = 0
        for _ in range(self._prepasses, wanted):
            self.tracer.look_ahead(self.work)
            self._prepasses += 1

    def _linked(self) -> Frame:
        setup = self.setup
        root = clipped(setup.root, setup.camera)
        return link_frame(root, setup.view, setup.camera, setup.optics, BLOCK)

    def seen(self) -> Pass:
        """Return the current picture without another pass.

        Returns
        -------
        Pass
            The current picture.
        """
        return self._seen(*self.accumulator.statistics(), 0, 0.0)

    def _seen(self, samples: float, error: float, traced: int, rate: float) -> Pass:
        view, source = self.setup.view, self.accumulator
        active = traced / (source.width * source.height)
        return Pass(source.passes, samples, error, active, rate, view, source, self.crop)
