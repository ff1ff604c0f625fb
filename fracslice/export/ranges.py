"""Ranges of layers as tasks of a cluster."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

from fracslice.cluster import Shard
from fracslice.errors import ClusterError, ExportError, SharedError
from fracslice.export.resuming import Journal
from fracslice.slicing import Layer
from fracslice.slicing.layers import SLAB
from fracslice.work import Work

if TYPE_CHECKING:
    from fracslice.export.jobs import SliceRun

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
        """Plan the run.

        Parameters
        ----------
        work : Work
            Threads.

        Returns
        -------
        SliceRun
            The same in every process.
        """

    def encoder(self, run: SliceRun) -> Encode:
        """Return the function that encodes the layers of a run in this format.

        Parameters
        ----------
        run : SliceRun
            The run.

        Returns
        -------
        callable
            Function of a layer.
        """


@dataclass(frozen=True)
class RangeTask:
    """Layers `first` to `end` - 1 of a run, encoded.

    Attributes
    ----------
    recipe : Recipe
        The run.
    job : str
        Key of the run and its encoding.
    first, end : int
        Range.
    """

    recipe: Recipe
    job: str
    first: int
    end: int

    @property
    def name(self) -> str:
        """Name of the range."""
        return f"layers-{self.first:06}-{self.end:06}"

    def make(self, work: Work) -> bytes:
        """Records of the encoded layers; see `Task.make`."""
        run, encode, job = _planned(self.recipe)
        if job != self.job:
            raise ClusterError("the layers planned here are others than those of the job")
        file = io.BytesIO()
        journal = Journal(file)
        for data in run.slicer_with(work).map(encode, range(self.first, self.end)):
            journal.append(data)
        return file.getvalue()


def begin(run: SliceRun, form: str) -> None:
    """Begin to encode the layers of a run, before any file is touched.

    Parameters
    ----------
    run : SliceRun
        The run.
    form : str
        Name of the format.

    Raises
    ------
    SharedError
        For a shard that does not write the output, when its ranges are made.
    """
    pool = run.work.cluster
    if isinstance(pool, Shard) and not pool.first:
        count = pool.share(_tasks(run, form, 0), run.work)
        raise SharedError(f"{count} ranges of layers are made; shard 1 writes the file")


def encoded_layers(run: SliceRun, form: str, encode: Encode, start: int) -> Iterator[bytes]:
    """Encoded layers of a run in order, made by threads here or by the pool of its work.

    Parameters
    ----------
    run : SliceRun
        The run.
    form : str
        Name of the format.
    encode : callable
        Encodes a layer.
    start : int
        First layer.

    Yields
    ------
    bytes
        Encoded layers.
    """
    pool = run.work.cluster
    if pool is None:
        yield from run.slicer.map(encode, range(start, run.layers))
        return
    tasks = _tasks(run, form, start)
    for task, data in zip(tasks, pool.results(tasks, run.work, "slicing"), strict=True):
        for index, layer in enumerate(Journal(io.BytesIO(data), task.end - task.first), task.first):
            if index >= start:
                yield layer
    pool.finished(run.key(form))


def range_size(run: SliceRun) -> int:
    """Layers of a range, the same for any number of workers.

    Parameters
    ----------
    run : SliceRun
        The run.

    Returns
    -------
    int
        Whole slabs.
    """
    return max(SLAB, min(PIXELS // max(run.stack.shape), run.layers // MOST) // SLAB * SLAB)


def _tasks(run: SliceRun, form: str, start: int) -> list[RangeTask]:
    """Ranges of layers from the one of `start` on, the same for any number of workers."""
    if run.recipe is None:
        raise ExportError("a cluster needs the scene of the layers; these are planned by hand")
    size, job = range_size(run), run.key(form)
    return [
        RangeTask(run.recipe, job, first, min(first + size, run.layers))
        for first in range(start // size * size, run.layers, size)
    ]


_PLANNING = threading.Lock()


def _planned(recipe: Recipe) -> tuple[SliceRun, Encode, str]:
    """The run of a recipe, how its layers are encoded, and their key, planned once in a process."""
    with _PLANNING:
        return _kept(recipe)


@lru_cache(maxsize=2)
def _kept(recipe: Recipe) -> tuple[SliceRun, Encode, str]:
    run = recipe.run(Work(threads=1))
    return run, recipe.encoder(run), run.key(recipe.form)
