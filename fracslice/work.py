"""Execution of a job: threads, tasks in the background, progress and cancellation."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import Cancelled, SceneError

if TYPE_CHECKING:
    from .cluster import Pool
    from .fields.field import Device
    from .store import Store

T = TypeVar("T")
R = TypeVar("R")


_HERE = threading.local()


def _mark() -> None:
    _HERE.is_worker = True


class _Threads(ThreadPoolExecutor):
    """Threads as far as the system starts them: where no more fit into the memory, those there are do all."""

    def _adjust_thread_count(self) -> None:
        try:
            super()._adjust_thread_count()
        except RuntimeError as error:
            if not self._threads:
                raise MemoryError(str(error)) from None


POOL = _Threads(256, "fracslice", initializer=_mark)
"""Worker threads, started on demand and kept: starting a thread takes longer than many tasks."""

_CALLED = 2
"""Threads that each thread of `Work.map` calls: quick tasks are done before many are called."""

_AHEAD = 2
"""Results of `Work.ordered` in memory, times the number of threads."""


def _silent(stage: str, done: float) -> None:
    """Ignore progress."""


@dataclass(frozen=True)
class Work:
    """Execution settings of a job.

    Attributes
    ----------
    threads
        Number of threads, at most 1024; default: all cores.
    progress
        Called as ``progress(stage, fraction)`` from time to time, from any thread.
    cancel
        Event that any thread may set; the job then raises `Cancelled` within a fraction of a second.
    store
        Cache of samples and surfaces, or None.
    device
        Device that samples bricks. Samples of a GPU can differ from those of the CPU in the last place.
    cluster
        Pool of other processes for tasks, or a client of Dask; None for threads alone.

    Raises
    ------
    SceneError
        For an invalid number of threads.
    """

    threads: int = field(default_factory=lambda: os.cpu_count() or 1)
    progress: Callable[[str, float], None] = _silent
    cancel: threading.Event = field(default_factory=threading.Event)
    store: Store | None = None
    device: Device = "cpu"
    cluster: Pool | None = None

    def __post_init__(self) -> None:
        if hasattr(self.cluster, "scheduler_info"):
            from .cluster import Workers

            object.__setattr__(self, "cluster", Workers.of(self.cluster))
        from .common.parameters import (
            Count,  # imports NumPy, which --help does not need
            validate_value,
        )

        kind = Count(1, "how many", least=1, most=1024)
        object.__setattr__(self, "threads", validate_value("threads", self.threads, kind, SceneError))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy without progress, cancellation and pool, which belong to a process."""
        return partial(Work, self.threads, store=self.store, device=self.device), ()

    def check(self) -> None:
        """Raise `Cancelled` if cancellation was requested.

        Raises
        ------
        Cancelled
            If `cancel` is set.
        """
        if self.cancel.is_set():
            raise Cancelled("cancelled")

    def collect(self, task: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Run a task on every item, as `map` does, and return the results.

        Parameters
        ----------
        task
            Function of one item.
        items
            Items.

        Returns
        -------
        list
            Results in the order of the items.

        Raises
        ------
        Cancelled
            If `cancel` is set.
        """
        results: dict[int, R] = {}

        def numbered(index: int) -> None:
            results[index] = task(items[index])

        self.map(numbered, range(len(items)))
        return [results[index] for index in range(len(items))]

    def ordered(self, task: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        """Yield the results of a task in the order of the items, computed a few items ahead.

        Within a task of another job it computes in the thread of that task, so that workers never wait for
        workers.

        Parameters
        ----------
        task
            Function of one item.
        items
            Items.

        Yields
        ------
        R
            Results in the order of the items.

        Raises
        ------
        Cancelled
            If `cancel` is set.
        """
        if self.threads == 1 or getattr(_HERE, "is_worker", False):
            for item in items:
                self.check()
                yield task(item)
            return
        lock, waiting, ahead = threading.Lock(), iter(items), deque[Future[R]]()

        def fill(_: Future[R] | None = None) -> None:
            with lock:
                # Callbacks come after `result`, late on a busy machine: ask the futures.
                running = sum(not future.done() for future in ahead)
                free = min(self.threads - running, _AHEAD * self.threads - len(ahead))
                begun = [POOL.submit(task, item) for item in islice(waiting, max(free, 0))]
                ahead.extend(begun)
            for future in begun:
                future.add_done_callback(fill)

        try:
            fill()
            while ahead:
                result = ahead[0].result()
                with lock:
                    ahead.popleft()
                fill()
                self.check()
                yield result
        except KeyboardInterrupt:
            self.cancel.set()
            raise
        finally:
            with lock:
                waiting = iter(())
            wait([future for future in ahead if not future.cancel()])

    def map(self, task: Callable[[T], None], items: Sequence[T]) -> None:
        """Run a task on every item, in this thread and in workers.

        Tasks must write to disjoint places and must not depend on their order.

        Parameters
        ----------
        task
            Function of one item.
        items
            Items.

        Raises
        ------
        Cancelled
            If `cancel` is set.
        """
        if self.threads == 1 or len(items) <= 1:
            for item in items:
                self.check()
                task(item)
            return
        lock, queue = threading.Lock(), deque(items)
        most, helpers = min(self.threads, len(items)) - 1, list[Future[None]]()

        def drain() -> None:
            try:
                with lock:  # one item is for this thread
                    for _ in range(min(_CALLED, most - len(helpers), len(queue) - 1)):
                        helpers.append(POOL.submit(drain))
                while not self.cancel.is_set():
                    with lock:
                        if not queue:
                            return
                        item = queue.popleft()
                    task(item)
            except BaseException:
                with lock:
                    queue.clear()
                raise

        try:
            drain()
        except KeyboardInterrupt:
            self.cancel.set()
            raise
        finally:
            with lock:
                queue.clear()  # what is left of cancelled work calls no more helpers
            begun = [helper for helper in helpers if not helper.cancel()]
            wait(begun)
        for helper in begun:
            helper.result()
        self.check()


def chunks(count: int, size: int) -> list[slice]:
    """Split a range of indices into slices."""
    return [slice(i, min(i + size, count)) for i in range(0, count, size)]


@contextmanager
def in_background(task: Callable[[], R], threads: int) -> Iterator[Callable[[], R]]:
    """Run a task in another thread during a block; without other threads, when its result is asked for."""
    if threads == 1:
        yield cache(task)
        return
    begun = POOL.submit(task)
    try:
        yield cache(partial(_result, begun, task))
    finally:
        if not begun.cancel():
            wait([begun])


def ahead(items: Iterator[T]) -> Iterator[T]:
    """Compute each item in another thread while the consumer uses the one before."""
    following = partial(next, items, None)
    coming = POOL.submit(following)
    try:
        while (item := _result(coming, following)) is not None:
            coming = POOL.submit(following)
            yield item
    finally:
        if not _taken_back(coming):
            wait([coming])


def _result(begun: Future[R], task: Callable[[], R]) -> R:
    """Result of a task of the pool, or of the same task done here."""
    return task() if _taken_back(begun) else begun.result()


def _taken_back(begun: Future[Any]) -> bool:
    """Take back, in a worker, a task that no other has begun: workers never wait for workers."""
    return getattr(_HERE, "is_worker", False) and begun.cancel()
