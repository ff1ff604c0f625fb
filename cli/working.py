"""How a command works: threads, a bar that shows how far it is, and Ctrl-C to stop it in an orderly way."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import FrameType

from fracslice.errors import Cancelled, FracsliceError
from fracslice.work import Work

Progress = Callable[[str, float], None]


class StoppedError(FracsliceError):
    """A signal ended the work; the exit status is the shell's convention for it, 130 for Ctrl-C."""

    def __init__(self, number: int) -> None:
        super().__init__("stopped; nothing was written")
        self.status = 128 + number


@contextmanager
def working(how: int | Work, quiet: bool) -> Iterator[Work]:
    """Work that shows its progress if somebody may be looking, and is cancelled by SIGINT and SIGTERM.

    how: the work that it is like, or the number of its threads.
    """
    like = Work(how) if isinstance(how, int) else how
    with _bar(quiet) as progress, _cancelled_by_signals() as cancel:
        yield replace(like, progress=progress, cancel=cancel)


@contextmanager
def _bar(quiet: bool) -> Iterator[Progress]:
    if quiet or not sys.stderr.isatty():
        yield lambda stage, done: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>10}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks = {}

        def progress(stage: str, done: float) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=1.0)
            bar.update(tasks[stage], completed=done)

        yield progress


@contextmanager
def _cancelled_by_signals() -> Iterator[threading.Event]:
    """An event that the first SIGINT or SIGTERM sets; the second one interrupts at once."""
    cancel = threading.Event()
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        cancel.set()
        if len(received) > 1:
            raise KeyboardInterrupt

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield cancel
    except Cancelled:
        raise StoppedError(received[0] if received else signal.SIGINT) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
