"""Slice runs: a planned stack, what its files hold besides layers, and ranges of its layers as tasks of a
cluster.
"""

from __future__ import annotations

import io
import json
import math
import threading
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from ..common.cache import key, program
from ..common.messages import format_count
from ..errors import ClusterError, ExportError, SharedError, SliceError
from ..expr.runtime import toolchain
from ..records import SECTIONS
from ..slicing import Layer, Slicer, Stack
from ..slicing.layers import SLAB, MeanSlicer, Pictures
from ..slicing.printers import Resin
from ..slicing.raster import Screen
from ..work import Work
from .resuming import Journal, whole_layers

if TYPE_CHECKING:
    from ..cluster import Contents
    from ..mesh.model import Mesh


Encode = Callable[[Layer], bytes]
"""Encodes a layer."""

PIXELS, MOST = 1 << 20, 64
"""Pixels along the longer side of all layers of a range, about two seconds; most ranges of a small stack."""


class Recipe(Hashable, Protocol):
    """Everything that a run is made from, without arrays; a worker plans it once."""

    @property
    def form(self) -> str:
        """Format of the file."""

    def run(self, work: Work) -> SliceRun:
        """Plan the run."""

    def encoder(self, run: SliceRun) -> Encode:
        """Return the function that encodes the layers of a run in this format."""


@dataclass(frozen=True)
class RangeTask:
    """Layers `first` to `end` - 1 of a run, encoded."""

    stage: ClassVar[str] = "layers"  # first part of its name
    recipe: Recipe  # the run
    job: str  # key of the run and its encoding
    first: int  # range
    end: int

    @classmethod
    def all(cls, run: SliceRun, job: str, start: int = 0) -> list[Self]:
        """Tasks of all layers."""
        if run.recipe is None:
            raise ExportError("a cluster needs the scene of the layers; these are planned by hand")
        size = range_size(run)
        begins = range(start // size * size, run.layers, size)
        return [cls(run.recipe, job, first, min(first + size, run.layers)) for first in begins]

    @property
    def name(self) -> str:
        """Name of the range."""
        return f"{self.stage}-{self.first:06}-{self.end:06}"

    def planned(self, form: str) -> SliceRun:
        """The run, planned once in a process."""
        run = _plan_run(self.recipe)
        if run.key(form) != self.job:
            raise ClusterError("the layers planned here are others than those of the job")
        return run

    def make(self, work: Work) -> Contents:
        """Records of the encoded layers; see `Task.make`."""
        run = self.planned(self.recipe.form)
        encode = self.recipe.encoder(run)
        file = io.BytesIO()
        journal = Journal(file)
        for data in run.slicer_with(work).map(encode, range(self.first, self.end)):
            journal.append(data)
        return file.getvalue()


def begin(run: SliceRun, form: str) -> None:
    """Begin to encode the layers of a run, before any file is touched."""
    pool = run.work.cluster
    if pool is None:
        return
    from ..cluster import Shard

    if isinstance(pool, Shard) and not pool.first:
        count = pool.share(RangeTask.all(run, run.key(form)), run.work)
        raise SharedError(
            f"this shard made {format_count(count, 'range')} of layers; shard 1 writes the file"
        )


def encoded_layers(
    run: SliceRun, form: str, encode: Encode, start: int, pictures: Pictures | None = None
) -> Iterator[bytes]:
    """Encoded layers of a run in order, made by threads here or by the pool of its work."""
    pool = run.work.cluster
    if pool is None:
        yield from run.slicer.map(encode, range(start, run.layers), pictures)
        return
    job = run.key(form)
    tasks = RangeTask.all(run, job, start)
    for task, data in zip(tasks, pool.results(tasks, run.work, "slicing"), strict=True):
        layers = whole_layers(io.BytesIO(data), task.end - task.first)
        for index, layer in enumerate(layers, task.first):
            if index >= start:
                yield layer
    pool.finished(job)


def range_size(run: SliceRun) -> int:
    """Layers of a range, the same for any number of workers."""
    return max(SLAB, min(PIXELS // max(run.stack.shape), run.layers // MOST) // SLAB * SLAB)


_PLANNING = threading.Lock()


def _plan_run(recipe: Recipe) -> SliceRun:
    """The run of a recipe, planned once in a process."""
    with _PLANNING:
        return _keep_range(recipe)


@lru_cache(maxsize=2)
def _keep_range(recipe: Recipe) -> SliceRun:
    return recipe.run(Work(threads=1))


EPOCH = datetime(1980, 1, 1, tzinfo=UTC)
"""Date of files by default, so that equal jobs give equal bytes."""


@dataclass(frozen=True, eq=False)
class SliceRun:
    """A planned stack with all that its files contain besides layers."""

    stack: Stack  # the planned layers
    screen: Screen  # conversion of layers to pictures
    work: Work = field(default_factory=Work)  # threads, progress and cancellation
    resin: Resin | None = None  # exposure and motion; print files need them
    # names and values for the files, "scene_hash" among them
    metadata: dict[str, str] = field(default_factory=dict)
    # makes the mesh of the object for 3MF files, mm, standing on z = 0 and centred as the layers are
    mesh: Callable[[], Mesh] | None = None
    # renders the object for print files: uint8 [height, width, 3], sRGB
    picture: Callable[[], NDArray[np.uint8]] | None = None
    created: datetime = EPOCH  # date in print files, UTC
    sections: int = 1  # sections per layer; the grey level of a pixel is their weighted mean
    recipe: Recipe | None = None  # plans the same run in another process; a cluster needs it

    def __post_init__(self) -> None:
        if self.sections not in SECTIONS:
            raise SliceError(f"sections={self.sections}: expected one of {', '.join(map(str, SECTIONS))}")

    @cached_property
    def slicer(self) -> Slicer:
        """Slicer of the stack."""
        return self.slicer_with(self.work)

    def slicer_with(self, work: Work) -> Slicer:
        """Slicer of the stack with other threads."""
        if self.sections == 1:
            return Slicer(self.stack, work)
        penetration = (self.resin and self.resin.penetration) or math.inf
        return MeanSlicer(self.stack, work, self.sections, penetration)

    @property
    def layers(self) -> int:
        """Number of layers."""
        return len(self.stack.z)

    def key(self, form: str) -> str:
        """Key of everything that determines the bytes of encoded layers."""
        screen = [getattr(self.screen, f.name) for f in fields(self.screen) if f.name != "stack"]
        return key(
            *(program(), toolchain(), form, *self.stack.identity, *screen),
            *(self.resin, self.sections, sorted(self.metadata.items())),
        )

    def describe(self, name: str = "") -> bytes:
        """Manifest of the layers, as JSON."""
        stack, screen = self.stack, self.screen
        manifest = {
            "application": "fracslice",
            "metadata": self.metadata,
            "size_mm": stack.size,
            "pixel_mm": stack.pixel,
            "pixels": screen.shape[::-1],
            "printer": screen.printer.name if screen.printer else None,
            "gamma": screen.gamma,
            "grey_levels": screen.levels,
            "blur_pixels": screen.blur,
            "compensation_mm": screen.compensation,
            "elephant_foot_mm": screen.elephant_foot,
            "mirror": screen.mirrored,
            "layers": [
                {"file": f"{name}{i:05d}.png", "top_mm": round(float(z), 6)} for i, z in enumerate(stack.tops)
            ],
        }
        return json.dumps(manifest, indent=1).encode()
