"""Execution of a command: threads, progress bar and orderly cancellation by Ctrl-C."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import FrameType
from typing import TYPE_CHECKING

from fracslice.errors import Cancelled, FracsliceError, KeptError

if TYPE_CHECKING:
    from fracslice.work import Work

Progress = Callable[[str, float], None]

NOTHING = "nothing was written"
"""What most commands leave when they are stopped."""


class StoppedError(FracsliceError):
    """A signal stopped the work."""

    def __init__(self, number: int, kept: str) -> None:
        super().__init__(f"stopped; {kept}")
        self.status = 128 + number


@contextmanager
def working(how: int | Work, quiet: bool, kept: str = NOTHING) -> Iterator[Work]:
    """Work that shows its progress on a terminal and is cancelled by SIGINT and SIGTERM."""
    from fracslice.work import Work

    like = Work(how) if isinstance(how, int) else how
    with _bar(quiet) as progress, _cancelled_by_signals(kept) as cancel:
        yield replace(like, progress=progress, cancel=cancel)


@contextmanager
def _bar(quiet: bool) -> Iterator[Progress]:
    """Progress bar on stderr; without a terminal, a function that does nothing."""
    if quiet or not sys.stderr.isatty():
        yield lambda stage, done: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>10}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks = {}
        preparing = bar.add_task("preparing", total=None)  # the first run of a scene compiles for a second

        def progress(stage: str, done: float) -> None:
            bar.update(preparing, visible=False)
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=1.0)
            bar.update(tasks[stage], completed=done)

        yield progress


@contextmanager
def _cancelled_by_signals(kept: str) -> Iterator[threading.Event]:
    """Event set by the first SIGINT or SIGTERM; the second one raises KeyboardInterrupt at once."""
    cancel = threading.Event()
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        cancel.set()
        if len(received) > 1:
            raise KeyboardInterrupt

    try:
        with _handled_by(stop):
            yield cancel
    except KeptError as error:
        raise StoppedError(received[0] if received else signal.SIGINT, str(error)) from None
    except Cancelled:
        raise StoppedError(received[0] if received else signal.SIGINT, kept) from None


@contextmanager
def stopped_at_once() -> Iterator[None]:
    """Let the first SIGINT or SIGTERM end what is done within, which looks at no cancellation."""
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    try:
        with _handled_by(stop):
            yield
    except BaseException:
        if not received:
            raise
    if received:  # also where a parser went on after the exception
        raise StoppedError(received[0], NOTHING)


@contextmanager
def _handled_by(stop: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Handle SIGINT and SIGTERM within."""
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
