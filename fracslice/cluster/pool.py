"""Tasks of a job, pools of processes that make their results, and shards without a scheduler."""

from __future__ import annotations

import re
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

from ..errors import ClusterError
from .result_folder import Contents, NamedResult, ResultFolder

if TYPE_CHECKING:
    from ..work import Work


class Task(NamedResult, Protocol):
    """Task of a job: enough for any process to make its result. It holds no arrays.

    Its name is shown on Dask's dashboard, too.
    """

    def make(self, work: Work) -> Contents:
        """Make the result.

        Parameters
        ----------
        work : Work
            Threads.

        Returns
        -------
        bytes, or a sequence of blocks
            The same on every machine.
        """


def run_task(task: Task, pieces: ResultFolder, work: Work) -> None:
    """Make the result of a task, unless it is there."""
    if not pieces.has(task):
        alone = replace(work, cluster=None)  # a task that shared its own work would wait for itself
        pieces.write(task.job, task.name, task.make(alone))


class Pool(ABC):
    """Processes that make the results of tasks.

    Attributes
    ----------
    pieces : ResultFolder
        Results.
    first : bool
        True for the process that writes the output; False for the other shards of a job.
    """

    pieces: ResultFolder
    first: bool = True

    def finished(self, job: str) -> None:
        """Remove the results of a job whose output is complete.

        Parameters
        ----------
        job : str
            Key of the job.
        """
        self.pieces.remove(job)

    @abstractmethod
    def made(self, tasks: Sequence[Task], work: Work) -> Iterator[int]:
        """Make the results of tasks.

        Parameters
        ----------
        tasks : sequence of Task
            Tasks of one job.
        work : Work
            Cancellation.

        Yields
        ------
        int
            Index of each task, in any order, once its result is there.
        """

    def make(self, tasks: Sequence[Task], work: Work, stage: str = "") -> Iterator[int]:
        """Make the results of tasks, and report the progress.

        Parameters
        ----------
        tasks : sequence of Task
            Tasks of one job.
        work : Work
            Progress and cancellation.
        stage : str, optional
            Label of the progress, which is the share of tasks that are done; none without it.

        Yields
        ------
        int
            Index of each task, in any order, once its result is there.

        Raises
        ------
        ClusterError
            If a task fails, or none ends in time.
        Cancelled
            When the work is cancelled.
        """
        for done, index in enumerate(self.made(tasks, work), 1):
            if stage:
                work.progress(stage, done / len(tasks))
            yield index

    def results(self, tasks: Sequence[Task], work: Work, stage: str = "") -> Iterator[bytes]:
        """Results of tasks, in order.

        Parameters
        ----------
        tasks, work, stage
            As for `make`.

        Yields
        ------
        bytes
            Result of each task.
        """
        following, done = 0, set[int]()
        for index in self.make(tasks, work, stage):
            done.add(index)
            while following in done:
                yield self.pieces.read(tasks[following].job, tasks[following].name)
                following += 1


POLL, PATIENCE = 0.2, 60.0
"""Seconds between two looks for the pieces of others, and until a shard makes them itself."""


@dataclass(frozen=True)
class Shard(Pool):
    """Process `number` of `count` that share a job: it makes every count-th piece and waits for the others'.

    A piece that is still missing after a while without a new one is made here, so that a job ends whatever
    shards run.

    Attributes
    ----------
    pieces : ResultFolder
        Results, in a folder that all shards reach.
    number, count : int
        1 to count; shard 1 writes the output.
    patience : float
        Seconds.
    finished_jobs : list of str
        The job that ended last.
    """

    pieces: ResultFolder
    number: int
    count: int
    patience: float = PATIENCE
    finished_jobs: list[str] = field(default_factory=list, repr=False)

    @property
    def first(self) -> bool:  # type: ignore[override]
        """True for the shard that writes the output."""
        return self.number == 1

    @classmethod
    def read(cls, text: str, pieces: ResultFolder) -> Shard:
        """Parse "3/64".

        Parameters
        ----------
        text : str
            Number and count.
        pieces : ResultFolder
            Results.

        Returns
        -------
        Shard

        Raises
        ------
        ClusterError
            If the text is malformed.
        """
        match = re.fullmatch(r"\s*(\d{1,6})\s*/\s*(\d{1,6})\s*", text)
        if not match or not 1 <= int(match[1]) <= int(match[2]):
            raise ClusterError(f"{text!r}: expected number/count, such as 3/64, from 1/64 to 64/64")
        return cls(pieces, int(match[1]), int(match[2]))

    def share(self, tasks: Sequence[Task], work: Work) -> int:
        """Make this shard's tasks alone.

        Parameters
        ----------
        tasks : sequence of Task
            Tasks of one job.
        work : Work
            Progress and cancellation.

        Returns
        -------
        int
            How many they are.
        """
        return sum(1 for _ in self._own(tasks, work))

    def _own(self, tasks: Sequence[Task], work: Work) -> Iterator[int]:
        for index in range(self.number - 1, len(tasks), self.count):
            work.check()
            run_task(tasks[index], self.pieces, work)
            yield index

    def finished(self, job: str) -> None:
        """Remove the results of the job before, of which all shards are done; see `Pool.finished`."""
        if self.first:
            for old in self.finished_jobs:
                self.pieces.remove(old)
        self.finished_jobs[:] = [job]

    def made(self, tasks: Sequence[Task], work: Work) -> Iterator[int]:
        """Make this shard's tasks, then yield the others' as they come; see `Pool.made`."""
        own = range(self.number - 1, len(tasks), self.count)
        yield from self._own(tasks, work)
        missing = [index for index in range(len(tasks)) if index not in own]
        last = time.monotonic()
        while missing:
            there = [index for index in missing if self.pieces.has(tasks[index])]
            yield from there
            missing = [index for index in missing if index not in there]
            if there:
                last = time.monotonic()
            elif missing and time.monotonic() - last > self.patience:
                index = missing.pop(self.number % len(missing))
                run_task(tasks[index], self.pieces, work)
                yield index
            elif missing:
                work.check()
                work.cancel.wait(POLL)
