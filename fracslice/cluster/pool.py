"""Tasks of a job, and pools of processes that make their results."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

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


def run(task: Task, pieces: ResultFolder, work: Work) -> None:
    """Make the result of a task, unless it is there.

    Parameters
    ----------
    task : Task
        The task.
    pieces : ResultFolder
        Where its result belongs.
    work : Work
        Threads.
    """
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
