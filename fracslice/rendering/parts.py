"""Parts of a pass as tasks of a cluster."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..common.keys import key
from ..errors import ClusterError
from ..formulas.registry import Node
from ..scene import Scene
from ..scene.reader import reads
from ..scene.view import View
from ..scene.writer import to_xml
from ..work import Work
from .accumulator import CHANNELS, PassPlan
from .cpu import CpuTracer
from .linking import Frame
from .sequence import SampleRange

if TYPE_CHECKING:
    from ..cluster import ResultFolder
    from .progressive import Renderer

SAMPLES, PIXELS = 1 << 22, 1 << 20
"""Samples of a task, about two seconds, and most pixels."""

INPUT = "input"
"""Name of the file with the pixels of a pass and their sums."""


@dataclass(frozen=True)
class PartTask:
    """Samples of some pixels of a pass.

    Attributes
    ----------
    scene : str
        XML of the scene.
    film : tuple of int
        Width and height of the film, pixels.
    crop : tuple of int or None
        Part of the film that is rendered.
    samples : SampleRange
        Part of the sample sequence.
    size : tuple of int
        Width and height of the picture, pixels.
    dtype : str
        Float type of the sums.
    pieces : ResultFolder
        Folder with the input of the pass.
    job : str
        Key of the pass: its frame, pixels and sums.
    frame : str
        Key of the linked frame.
    number : int
        Number of the pass.
    prepasses : int
        Cone prepasses that were run.
    last : int
        Largest goal of a pixel.
    start, end, count : int
        Pixels of this part, and of the pass.
    """

    scene: str
    film: tuple[int, int]
    crop: tuple[int, int, int, int] | None
    samples: SampleRange
    size: tuple[int, int]
    dtype: str
    pieces: ResultFolder
    job: str
    frame: str
    number: int
    prepasses: int
    last: int
    start: int
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
    return key(frame.linked.source, frame.linked.parameters)


class PoolTracer:
    """Tracer whose samples other processes make, in parts of a pass; used as a `CpuTracer`.

    Parameters
    ----------
    root : Node
        Root of the formula tree.
    view : View
        View of the picture.
    tracer : CpuTracer
        Tracer of the same frame, which the sums are for.
    film : tuple of int
        Width and height of the film, pixels.
    crop : tuple of int or None
        Part of the film that is rendered.
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
        step = max(1, min(PIXELS, SAMPLES * count // max(plan.samples, 1)))
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
    from .progressive import Renderer

    of = scene, film, crop, samples
    if getattr(_OWN, "of", None) != of:
        read = reads(scene)
        _OWN.renderer = Renderer(read.root, read.view, film, Work(threads=1), "cpu", samples, crop)
        _OWN.of = of
    renderer: Renderer = _OWN.renderer
    return renderer
