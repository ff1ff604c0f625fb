"""Progressive rendering: each pass adds one sample to the pixels that still need one, here or as tasks of
a cluster.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ..common.cache import key, program
from ..common.memory import available_bytes
from ..common.parameters import Number, Pixels, picture_size, validate_value
from ..errors import ClusterError, RenderError
from ..fields.devices import choose_device, for_field
from ..fields.registry import Node
from ..scene import Scene, reads, to_xml
from ..scene.view import Camera, Film, View
from ..work import Work
from .accumulator import (
    CHANNELS,
    COARSE,
    Accumulator,
    HostAccumulator,
    PassPlan,
    SampleRange,
    develop,
    grids,
    levels,
    picture,
    smoothed,
)
from .linking import Frame, link_frame
from .packets import CpuTracer
from .setup import clip_scene, optics, prepare

if TYPE_CHECKING:
    from ..cluster import ResultFolder


BYTES = 4 * (CHANNELS + 4 + 3)
"""Memory of a pixel: its sums, their mean and the developed picture."""
MARGIN = 16
"""Pixels around a crop that are rendered with it: errors decide on the samples of neighbours, one pixel
farther in every pass that chooses pixels."""
CROP = Pixels(None, "left, top, width and height, pixels")


@dataclass(frozen=True)
class Crop:
    """Part of a film that is rendered."""

    left: int  # the part, pixels
    top: int
    width: int
    height: int
    film: tuple[int, int]  # width and height of the film, pixels

    @classmethod
    def of(cls, film: tuple[int, int], crop: tuple[int, int, int, int] | None) -> Crop:
        """Validate a crop.

        `film` in pixels; `crop`: left and upper pixel.
        """
        if crop is None:
            return cls(0, 0, *film, film)
        x, y, width, height = validate_value("crop", crop, CROP, RenderError)
        if width < 1 or height < 1 or x + width > film[0] or y + height > film[1]:
            raise RenderError(
                f"crop={x},{y},{width},{height}: expected a part of {film[0]} x {film[1]} pixels"
            )
        return cls(x, y, width, height, film)

    @property
    def origin(self) -> tuple[int, int]:
        """Upper left pixel of the crop with its margin, in the grid of the first pass."""
        return _grid(self.left), _grid(self.top)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the crop with its margin, pixels."""
        x, y = self.origin
        right = min(self.left + self.width + MARGIN, self.film[0])
        bottom = min(self.top + self.height + MARGIN, self.film[1])
        return right - x, bottom - y

    @property
    def bytes(self) -> int:
        """Memory that its picture needs."""
        width, height = self.size
        return BYTES * width * height

    def within(self, pixels: np.ndarray) -> np.ndarray:
        """Cut the margin off.

        `pixels`: ndarray (rows, columns, ...), values of `size` pixels. Returns ndarray (height, width,
        ...).
        """
        x, y = self.origin
        rows, columns = slice(self.top - y, None), slice(self.left - x, None)
        return np.ascontiguousarray(pixels[rows, columns][: self.height, : self.width])


def _grid(first: int) -> int:
    """First pixel of the margin before a pixel."""
    return max(first - MARGIN, 0) // COARSE * COARSE


PASS_SAMPLES, PIXELS = 1 << 22, 1 << 20
"""Samples of a task, about two seconds, and most pixels."""

INPUT = "input"
"""Name of the file with the pixels of a pass and their sums."""


@dataclass(frozen=True)
class PartTask:
    """Samples of some pixels of a pass."""

    scene: str  # XML of the scene
    film: tuple[int, int]  # width and height of the film, pixels
    crop: tuple[int, int, int, int] | None  # part of the film that is rendered
    samples: SampleRange  # part of the sample sequence
    size: tuple[int, int]  # width and height of the picture, pixels
    dtype: str  # float type of the sums
    pieces: ResultFolder  # folder with the input of the pass
    job: str  # key of the pass: its frame, pixels and sums
    frame: str  # key of the linked frame
    number: int  # number of the pass
    prepasses: int  # cone prepasses that were run
    last: int  # largest goal of a pixel
    start: int  # pixels of this part, and of the pass
    end: int
    count: int

    @property
    def name(self) -> str:
        """Name of the part."""
        return f"pass-{self.number:04}-pixels-{self.start:010}"

    def make(self, work: Work) -> bytes:
        """Sums of the pixels after the pass; see `Task.make`."""
        of = _renderer(self.scene, self.film, self.crop, self.samples)
        of.prepare(self.prepasses)
        if of.dtype.name != self.dtype or frame_key(of.tracer.frame) != self.frame:
            raise ClusterError("the frame linked here is another than that of the job")
        width, dtype = 4 * self.count, of.dtype
        pixels = np.frombuffer(self._input(4 * self.start, 4 * self.end), np.int32)
        row = CHANNELS * dtype.itemsize
        data = self._input(width + row * self.start, width + row * self.end)
        sums, places = np.zeros((self.size[0] * self.size[1], CHANNELS), dtype), _places(pixels, self.size)
        sums[places] = np.frombuffer(data, dtype).reshape(-1, CHANNELS)
        of.tracer.add(sums.reshape(-1), PassPlan(pixels, len(pixels), self.last), work)
        return bytes(sums[places].tobytes())

    def _input(self, start: int, end: int) -> bytes:
        return self.pieces.read(self.job, INPUT, start, end)


def frame_key(frame: Frame) -> str:
    """Key of a linked frame."""
    return key(frame.linked.program.identity, frame.linked.parameters)


class PoolTracer:
    """Tracer whose samples other processes make, in parts of a pass; used as a `CpuTracer`.

    `film` in pixels.
    """

    def __init__(
        self,
        root: Node,
        view: View,
        tracer: CpuTracer,
        film: tuple[int, int],
        crop: tuple[int, int, int, int] | None,
    ) -> None:
        self.scene, self.tracer = to_xml(Scene(root, 1.0, view=view)), tracer
        self._part = film, crop
        self._passes, self._prepasses = 0, 0

    @property
    def frame(self) -> Frame:
        """The frame."""
        return self.tracer.frame

    @property
    def prepasses(self) -> int:
        """Cone prepasses."""
        return self.tracer.prepasses

    @property
    def samples(self) -> SampleRange:
        """Part of the sequence."""
        return self.tracer.samples

    def aim(self, frame: Frame) -> None:
        """Load another frame; see `CpuTracer.aim`."""
        self.tracer.aim(frame)
        self._prepasses = 0

    def look_ahead(self, work: Work) -> None:
        """Leave the next cone prepass to the workers."""
        self._prepasses += 1

    def add(self, sums: np.ndarray, plan: PassPlan, work: Work) -> None:
        """Add samples to pixels up to their goals; see `CpuTracer.add`."""
        pool, size = work.cluster, (self.tracer.width, self.tracer.height)
        assert pool is not None
        state, places = sums.reshape(-1, CHANNELS), _places(plan.pixels, size)
        frame, count = frame_key(self.frame), len(plan.pixels)
        known = np.ascontiguousarray(plan.pixels), state[places]
        job = key(frame, size, self.samples, self._prepasses, *known)
        of = self.scene, *self._part, self.samples, size, sums.dtype.name, pool.pieces, job, frame
        about = *of, self._passes, self._prepasses, plan.last
        step = max(1, min(PIXELS, PASS_SAMPLES * count // max(plan.samples, 1)))
        tasks = [PartTask(*about, start, min(start + step, count), count) for start in range(0, count, step)]
        pool.pieces.write(job, INPUT, b"".join(part.tobytes() for part in known))
        parts = pool.results(tasks, work)
        for task, data in zip(tasks, parts, strict=True):
            state[places[task.start : task.end]] = np.frombuffer(data, sums.dtype).reshape(-1, CHANNELS)
        pool.finished(job)
        self._passes += 1


def _places(pixels: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Row-major indices of pixels ``y << 16 | x``."""
    return np.asarray((pixels >> 16).astype(np.intp) * size[0] + (pixels & 65535))


_OWN = threading.local()


def _renderer(
    scene: str, film: tuple[int, int], crop: tuple[int, int, int, int] | None, samples: SampleRange
) -> Renderer:
    """Renderer of a frame, the last one of this thread."""

    of = scene, film, crop, samples
    if getattr(_OWN, "of", None) != of:
        read = reads(scene, files_outside=True)
        _OWN.renderer = Renderer(read.root, read.view, film, Work(threads=1), "cpu", samples, crop)
        _OWN.of = of
    renderer: Renderer = _OWN.renderer
    return renderer


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
        Samples of this pass per pixel of the picture.
    rate : float
        Samples per second.
    view : View
        View that develops the picture, with its lights.
    source : Accumulator
        Accumulator that holds the samples, with a margin around the picture.
    crop : Crop
        The picture in the film.
    """

    number: int
    samples: float
    error: float
    active: float
    rate: float
    view: View = field(repr=False)
    source: Accumulator = field(repr=False)
    crop: Crop = field(repr=False)

    @cached_property
    def mean(self) -> np.ndarray:
        """Mean of the samples.

        Returns
        -------
        ndarray of float32, shape (height, width, 4)
            Linear light, and the fraction of the samples whose camera ray hit.

        Raises
        ------
        RenderError
            If a later pass has replaced this picture.
        """
        return self.crop.within(self._current().host().mean())

    @property
    def image(self) -> np.ndarray:
        """Linear light, or the values of another mode; see `film.picture`."""
        return picture(self.mean, self.view.shading.mode)

    @property
    def alpha(self) -> np.ndarray:
        """Fraction of the samples whose camera ray hit, float32 [height, width]."""
        return np.ascontiguousarray(self.mean[..., 3])

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
        return self.crop.within(self._current().shown(self.view))

    @property
    def smooth(self) -> np.ndarray:
        """Developed picture with less noise and less detail: each pixel has the light around it.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            sRGB; the picture as it is in a mode other than "light".
        """
        if self.view.shading.mode != "light":
            return self.shown
        return levels(develop(smoothed(self.mean), self.view))

    @cached_property
    def developed(self) -> np.ndarray:
        """Developed picture in floats.

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            sRGB in [0, 1].

        Raises
        ------
        RenderError
            If a later pass has replaced this picture.
        """
        return self.crop.within(self._current().host().developed(self.view))

    def _current(self) -> Accumulator:
        """The accumulator, if it still holds this pass."""
        if self.source.passes != self.number:
            raise RenderError(
                f"pass {self.number}: its picture was replaced by that of pass {self.source.passes}"
            )
        return self.source


TOLERANCE = 0.002
"""Standard error of displayed brightness at which a pixel has converged: half a level of 256."""


SIZE = picture_size(None, "pixels across and down")


def _backend(device: str) -> tuple[Callable[..., Any], Callable[[HostAccumulator], Accumulator]]:
    """The tracer and the accumulator factory of a device."""
    if device == "cpu":
        return CpuTracer, HostAccumulator.host
    from .cuda import CudaAccumulator, CudaTracer

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
        film = validate_value("size", pixels, SIZE, RenderError)
        self.crop = Crop.of(film, crop)
        _check_memory(self.crop)
        self.width, self.height = self.crop.width, self.crop.height
        self.work = work or Work()
        self.device = for_field(root, choose_device(device if self.work.cluster is None else "cpu"))
        setup = prepare(root, view, film)
        self.setup = replace(setup, optics=replace(setup.optics, origin=self.crop.origin))
        self.dtype = np.dtype(self.setup.precision)
        tracer, self._placed = _backend(self.device)
        self._frame = self._linked()
        self.tracer = tracer(self._frame, self.dtype, *self.crop.size)
        self.tracer.samples = samples or self.tracer.samples
        if self.work.cluster is not None:
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
        return key(program(), *about, linked.program.identity, linked.parameters)

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
        seen = optics(camera, setup.optics.size, setup.root, setup.optics.rounding)
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
        from .accumulator import save_state

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
        from .accumulator import load_state

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
        most = validate_value("samples", most, Film.kinds()["samples"], RenderError)
        tolerance = validate_value(
            "tolerance", tolerance, Number(TOLERANCE, "an error", least=0), RenderError
        )
        while (plan := self.accumulator.plan(most, tolerance)).samples:
            yield self._pass(plan)

    def draft(self) -> Pass:
        """Take the first sample of every pixel at once, in place of the first passes.

        Returns
        -------
        Pass
            The picture, whose error is unknown.

        Raises
        ------
        Cancelled
            If the work was cancelled.
        """
        self.accumulator.passes = len(grids(*self.crop.size)) - 1
        plan = self.accumulator.plan(1, math.inf)
        self._trace(plan)
        return self._seen(1.0, math.inf, plan.samples, 0.0)

    def _trace(self, plan: PassPlan) -> None:
        coarse = len(grids(*self.crop.size)) - 2  # passes with a pixel a block, or less: no prepass pays
        self.prepare(max(self.accumulator.passes - coarse, 0))
        self.tracer.add(self.accumulator.sums, plan, self.work)
        self.accumulator.passes += 1

    def _pass(self, plan: PassPlan) -> Pass:
        start = time.perf_counter()
        self._trace(plan)
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
        root = clip_scene(setup.root, setup.camera)
        return link_frame(root, setup.view, setup.camera, setup.optics)

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


SAMPLES = {"depth": 1, "position": 1, "trap": 1, "normal": 16, "albedo": 16}
"""Samples per pixel of each layer. A mean of depths or positions across an edge would be of no surface."""
SINGLE = ("depth", "trap")
"""Layers of one channel."""


def layers(renderer: Renderer) -> dict[str, np.ndarray]:
    """Render the layers of a picture, from the same camera.

    Returns float32 (height, width, 3), the samples per pixel.
    """
    made = {mode: layer(renderer, mode) for mode in SAMPLES}
    made["samples"] = renderer.crop.within(renderer.accumulator.host().counts).astype(np.float32)
    return made


def layer(renderer: Renderer, mode: str) -> np.ndarray:
    """Render one layer of a picture, from the same camera.

    Returns float32 (height, width, 3).
    """
    setup, part, samples = renderer.setup, renderer.crop, SAMPLES[mode]
    camera = replace(setup.camera, aperture=0.0) if samples == 1 else setup.camera
    view = replace(setup.view, camera=camera, shading=replace(setup.view.shading, mode=mode))
    crop = part.left, part.top, part.width, part.height
    of = Renderer(setup.root, view, part.film, renderer.work, renderer.device, crop=crop)
    *_, last = of.passes(samples, tolerance=0.0)
    return last.image[..., 0] if mode in SINGLE else last.image
