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
from fracslice.keys import key
from fracslice.slicing import Layer, Slicer
from fracslice.slicing.layers import SLAB
from fracslice.work import Work

if TYPE_CHECKING:
    from fracslice.export.jobs import SliceRun

Encode = Callable[["SliceRun", Layer], bytes]
"""Function of a module that encodes a layer of a run."""

PIXELS, MOST = 1 << 20, 64
"""Pixels along the longer side of all layers of a range, about two seconds; most ranges of a small stack."""


class Recipe(Hashable, Protocol):
    """Everything that a run is made from, without arrays; hashable, so that a worker plans it once."""

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


@dataclass(frozen=True)
class RangeTask:
    """Layers `first` to `end` - 1 of a run, encoded.

    Attributes
    ----------
    recipe : Recipe
        The run.
    encode : callable
        Encodes a layer.
    job : str
        Key of the run and its encoding.
    first, end : int
        Range.
    """

    recipe: Recipe
    encode: Encode
    job: str
    first: int
    end: int

    @property
    def name(self) -> str:
        """Name of the range."""
        return f"layers-{self.first:06}-{self.end:06}"

    def make(self, work: Work) -> bytes:
        """Records of the encoded layers; see `Task.make`."""
        run = _planned(self.recipe)
        if job_key(run, self.encode) != self.job:
            raise ClusterError("the layers planned here are others than those of the job")
        file = io.BytesIO()
        journal = Journal(file)
        for data in Slicer(run.stack, work).map(_bound(run, self.encode), range(self.first, self.end)):
            journal.append(data)
        return file.getvalue()


def job_key(run: SliceRun, encode: Encode) -> str:
    """Key of the encoded layers of a run.

    Parameters
    ----------
    run : SliceRun
        The run.
    encode : callable
        Encodes a layer.

    Returns
    -------
    str
    """
    return key(run.key(f"{encode.__module__}.{encode.__qualname__}"))


def encoded_layers(run: SliceRun, encode: Encode, start: int) -> Iterator[bytes]:
    """Encoded layers of a run in order, made by threads here or by the pool of its work.

    Parameters
    ----------
    run : SliceRun
        The run.
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
        yield from run.slicer.map(_bound(run, encode), range(start, run.layers))
        return
    tasks = _tasks(run, encode, start)
    for task, data in zip(tasks, pool.results(tasks, run.work, "slicing"), strict=True):
        layers = Journal(io.BytesIO(data), task.end - task.first)
        for index, layer in enumerate(layers, task.first):
            if index >= start:
                yield layer
    pool.finished(job_key(run, encode))


def refuse_shards(run: SliceRun, encode: Encode) -> None:
    """Make the ranges of a shard that does not write the output, and end.

    Parameters
    ----------
    run : SliceRun
        The run.
    encode : callable
        Encodes a layer.

    Raises
    ------
    SharedError
        For such a shard, when its ranges are made.
    """
    pool = run.work.cluster
    if isinstance(pool, Shard) and not pool.first:
        count = pool.share(_tasks(run, encode, 0), run.work)
        raise SharedError(f"{count} ranges of layers are made; shard 1 writes the file")


def _tasks(run: SliceRun, encode: Encode, start: int) -> list[RangeTask]:
    """Ranges of layers from the one of `start` on, the same for any number of workers."""
    if run.recipe is None:
        raise ExportError("a cluster needs the scene of the layers; these are planned by hand")
    size = max(SLAB, min(PIXELS // max(run.stack.shape), run.layers // MOST) // SLAB * SLAB)
    job = job_key(run, encode)
    return [
        RangeTask(run.recipe, encode, job, first, min(first + size, run.layers))
        for first in range(start // size * size, run.layers, size)
    ]


def _bound(run: SliceRun, encode: Encode) -> Callable[[Layer], bytes]:
    return lambda layer: encode(run, layer)


_PLANNING = threading.Lock()


def _planned(recipe: Recipe) -> SliceRun:
    """The run of a recipe, planned once in a process."""
    with _PLANNING:
        return _kept(recipe)


@lru_cache(maxsize=2)
def _kept(recipe: Recipe) -> SliceRun:
    return recipe.run(Work(threads=1))
