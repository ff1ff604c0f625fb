"""Times of a job's stages."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from ..work import Work


@dataclass(frozen=True)
class Clock:
    """Stage timer of a job: reports progress, checks for cancellation between stages and measures time.

    Attributes
    ----------
    work
        Execution settings.
    seconds
        Wall-clock time per stage, and "total", in seconds. Stages may overlap.
    begun
        Time of the start, s.
    """

    work: Work
    seconds: dict[str, float] = field(default_factory=lambda: {"total": 0.0})
    begun: float = field(default_factory=time.perf_counter)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Time a stage; a repeated stage adds up.

        Parameters
        ----------
        stage
            Name of the stage.

        Raises
        ------
        Cancelled
            If cancellation was requested before the stage began.
        """
        self.work.check()
        self.work.progress(stage, 0.0)
        started = time.perf_counter()
        yield
        ended = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + ended - started
        self.seconds["total"] = ended - self.begun
        self.work.progress(stage, 1.0)
