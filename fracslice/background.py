"""One task, or the next item, in another thread while this one goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import wait
from contextlib import contextmanager
from functools import cache
from typing import TypeVar

from .work import POOL

T = TypeVar("T")
R = TypeVar("R")


@contextmanager
def in_background(task: Callable[[], R], threads: int) -> Iterator[Callable[[], R]]:
    """Run a task in another thread during a block; without other threads, when its result is asked for.

    Parameters
    ----------
    task
        Function without arguments.
    threads
        Number of threads of the job.

    Yields
    ------
    callable
        Waits for the task and returns its result.
    """
    if threads == 1:
        yield cache(task)
        return
    begun = POOL.submit(task)
    try:
        yield begun.result
    finally:
        begun.cancel()
        wait([begun])


def ahead(items: Iterator[T]) -> Iterator[T]:
    """Compute each item in another thread while the consumer uses the one before.

    Parameters
    ----------
    items
        Items other than None.

    Yields
    ------
    object
        The same items.
    """
    coming = POOL.submit(next, items, None)
    try:
        while (item := coming.result()) is not None:
            coming = POOL.submit(next, items, None)
            yield item
    finally:
        wait([coming])
