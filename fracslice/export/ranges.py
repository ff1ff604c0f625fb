"""Ranges of layers as tasks of a cluster."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol

from fracslice.cluster import Shard
from fracslice.errors import ClusterError, ExportError, SharedError
from fracslice.export.resuming import Journal
from fracslice.keys import key
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

    def write(self, run: SliceRun) -> None:
        """Write a run in its format, which calls `begin` before anything else.

        Parameters
        ----------
        run : SliceRun
            The run.
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
        planned = _planned(self.recipe)
        if planned.job != self.job:
            raise ClusterError("the layers planned here are others than those of the job")
        file = io.BytesIO()
        journal = Journal(file)
        for data in planned.run.slicer_with(work).map(planned.encode, range(self.first, self.end)):
            journal.append(data)
        return file.getvalue()


class Encoding(Exception):  # noqa: N818  no error: it ends the writing of a file that a worker does not write
    """How a format encodes the layers of a run.

    Parameters
    ----------
    run : SliceRun
        The run.
    job : str
        Key of the encoded layers.
    encode : callable
        Encodes a layer.
    """

    def __init__(self, run: SliceRun, job: str, encode: Encode) -> None:
        self.run, self.job, self.encode = run, job, encode


class Asking:
    """In the place of a pool: a run asks its format how it encodes layers."""


def begin(run: SliceRun, form: str | bytes, encode: Encode) -> None:
    """Begin to encode the layers of a run, before any file is touched.

    Parameters
    ----------
    run : SliceRun
        The run.
    form : str or bytes
        File format.
    encode : callable
        Encodes a layer.

    Raises
    ------
    SharedError
        For a shard that does not write the output, when its ranges are made.
    Encoding
        If the run asks.
    """
    pool: Any = run.work.cluster
    if isinstance(pool, Asking):
        raise Encoding(run, _key(run, form), encode)
    if isinstance(pool, Shard) and not pool.first:
        count = pool.share(_tasks(run, form, 0), run.work)
        raise SharedError(f"{count} ranges of layers are made; shard 1 writes the file")


def encoded_layers(run: SliceRun, form: str | bytes, encode: Encode, start: int) -> Iterator[bytes]:
    """Encoded layers of a run in order, made by threads here or by the pool of its work.

    Parameters
    ----------
    run : SliceRun
        The run.
    form : str or bytes
        File format.
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
    pool.finished(_key(run, form))


def _key(run: SliceRun, form: str | bytes) -> str:
    """Key of the encoded layers of a run; files of other formats may name theirs alike."""
    return key(run.recipe.form if run.recipe else "", run.key(form))


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


def _tasks(run: SliceRun, form: str | bytes, start: int) -> list[RangeTask]:
    """Ranges of layers from the one of `start` on, the same for any number of workers."""
    if run.recipe is None:
        raise ExportError("a cluster needs the scene of the layers; these are planned by hand")
    size, job = range_size(run), _key(run, form)
    return [
        RangeTask(run.recipe, job, first, min(first + size, run.layers))
        for first in range(start // size * size, run.layers, size)
    ]


_PLANNING = threading.Lock()


def _planned(recipe: Recipe) -> Encoding:
    """The run of a recipe and its encoding, planned once in a process."""
    with _PLANNING:
        return _kept(recipe)


@lru_cache(maxsize=2)
def _kept(recipe: Recipe) -> Encoding:
    run = recipe.run(Work(threads=1))
    try:
        recipe.write(replace(run, work=replace(run.work, cluster=Asking())))  # type: ignore[arg-type]
    except Encoding as encoding:
        return encoding
    raise ExportError("this format has no layers of its own")
