"""Threads that start at once and take turns as often as can be, so that what they must not share is seen."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


def together(count: int, call: Callable[..., T], *arguments: object) -> list[T]:
    """What so many threads get that make the same call at the same time."""
    barrier, result = threading.Barrier(count), []

    def run() -> None:
        barrier.wait()
        result.append(call(*arguments))

    threads = [threading.Thread(target=run) for _ in range(count)]
    with hurried():
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(result) == count, "a thread raised"
    return result


@contextmanager
def hurried() -> Iterator[None]:
    """The interpreter changes threads about every microsecond, not every five milliseconds."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        yield
    finally:
        sys.setswitchinterval(before)
