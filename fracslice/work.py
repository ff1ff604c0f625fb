"""How work is done, apart from what is done: threads, progress, and a way to stop it."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

from .errors import Cancelled, SceneError

if TYPE_CHECKING:
    from .formulas.field import Device
    from .store import Store

T = TypeVar("T")
R = TypeVar("R")


_POOL = ThreadPoolExecutor(256, "fracslice")
"""Threads that help, started when first needed and kept: starting one takes longer than many a task."""


def _silent(stage: str, done: float) -> None:
    """Progress that nobody looks at."""


@dataclass(frozen=True)
class Work:
    """threads: how many to use (default: all cores). progress: called as ``progress(stage, fraction)`` from
    time to time. cancel: set it from anywhere and the work stops within a fraction of a second with
    `Cancelled`. store: where samples and surfaces are kept and looked for, if anywhere. device:
    what samples bricks; a GPU's samples can differ from the CPU's in the last place. Raises `SceneError` for
    a number of threads that cannot be."""

    threads: int = field(default_factory=lambda: os.cpu_count() or 1)
    progress: Callable[[str, float], None] = _silent
    cancel: threading.Event = field(default_factory=threading.Event)
    store: Store | None = None
    device: Device = "cpu"

    def __post_init__(self) -> None:
        from .formulas.parameters import Count, validate  # loads NumPy, which help does without

        validate(self, {"threads": Count(1, "how many", least=1, most=1024)}, SceneError)

    def check(self) -> None:
        """Raises `Cancelled` once somebody asked to stop."""
        if self.cancel.is_set():
            raise Cancelled("cancelled")

    def collect(self, task: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """As `map`; returns what the tasks do, in the order of the items."""
        found: dict[int, R] = {}

        def numbered(index: int) -> None:
            found[index] = task(items[index])

        self.map(numbered, range(len(items)))
        return [found[index] for index in range(len(items))]

    def map(self, task: Callable[[T], None], items: Sequence[T]) -> None:
        """Runs `task` on every item, in this thread and others. Tasks write to places of their own, and their
        order must not matter.
        """
        if self.threads == 1 or len(items) <= 1:
            for item in items:
                self.check()
                task(item)
            return
        queue = iter(items)
        lock = threading.Lock()

        def drain() -> None:
            nonlocal queue
            try:
                while not self.cancel.is_set():
                    with lock:
                        item = next(queue, None)
                    if item is None:
                        return
                    task(item)
            except BaseException:
                queue = iter(())
                raise

        helpers = [_POOL.submit(drain) for _ in range(min(self.threads, len(items)) - 1)]
        try:
            drain()
        except KeyboardInterrupt:
            self.cancel.set()
            raise
        finally:
            begun = [helper for helper in helpers if not helper.cancel()]
            wait(begun)
        for helper in begun:
            helper.result()
        self.check()


def chunks(count: int, size: int) -> list[slice]:
    """The slices that cut `count` things into pieces of at most `size`."""
    return [slice(i, min(i + size, count)) for i in range(0, count, size)]


@dataclass(frozen=True)
class Clock:
    """The stages of a job: tells of each as it begins, stops between them when asked to, takes the time."""

    work: Work
    seconds: dict[str, float] = field(default_factory=lambda: {"total": 0.0})

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        self.work.check()
        self.work.progress(stage, 0.0)
        started = time.perf_counter()
        yield
        took = time.perf_counter() - started
        for name in (stage, "total"):
            self.seconds[name] = self.seconds.get(name, 0.0) + took
        self.work.progress(stage, 1.0)
