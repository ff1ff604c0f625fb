"""Tasks of a job, and their results as files of any file system that fsspec knows."""

from __future__ import annotations

import os
import posixpath
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from secrets import token_hex
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol

from ..common.extras import lacking
from ..common.files import appended
from ..errors import ClusterError

if TYPE_CHECKING:
    from ..work import Work


Contents = bytes | Sequence[bytes | memoryview]
"""Contents of a file, in one block or several."""


class Task(Protocol):
    """Task of a job: enough for any process to make its result. It holds no arrays."""

    @property
    def job(self) -> str:
        """Key of everything that determines the results of the job."""

    @property
    def name(self) -> str:
        """Name within the job: of the file, and on Dask's dashboard."""

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


@dataclass(frozen=True)
class ResultFolder:
    """Results of tasks in a folder, written beside and moved, so that each is whole or absent.

    Attributes
    ----------
    url : str
        Folder that all machines can reach: a path, or any URL of fsspec.

    Raises
    ------
    ClusterError
        If fsspec is not installed, or the folder cannot be used.
    """

    url: str

    @cached_property
    def _place(self) -> tuple[Any, str]:
        """File system and root."""
        if reason := lacking("fsspec", "clusters need"):
            raise ClusterError(reason)
        from fsspec.core import url_to_fs

        try:
            system, root = url_to_fs(self.url)
        except (ImportError, ValueError) as error:
            raise ClusterError(f"{self.url}: {error}") from None
        return system, root

    def has(self, task: Task) -> bool:
        """True if the result of a task is there.

        Parameters
        ----------
        task : Task
            The task.

        Returns
        -------
        bool
        """
        system, root = self._place
        system.invalidate_cache()
        return bool(system.exists(f"{root}/{task.job}/{task.name}"))

    def path(self, name: str) -> str | None:
        """Path of a file of this folder; None if it is no folder of this machine's file system.

        Parameters
        ----------
        name : str
            Name of the file.

        Returns
        -------
        str or None
        """
        if "://" in self.url:
            return None
        os.makedirs(self.url, exist_ok=True)
        return os.path.join(self.url, name)

    def read(self, job: str, name: str, start: int | None = None, end: int | None = None) -> bytes:
        """Read a file of a job, or a range of its bytes.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str
            Name of the file.
        start, end : int, optional
            Range.

        Returns
        -------
        bytes

        Raises
        ------
        ClusterError
            If it cannot be read.
        """
        system, root = self._place
        try:
            return bytes(system.cat_file(f"{root}/{job}/{name}", start=start, end=end))
        except OSError as error:
            raise ClusterError(f"{self.url}: {job}/{name}: {error}") from None

    def append(self, job: str, name: str, file: BinaryIO) -> int:
        """Append a file of a job to another file; the kernel copies between files of this machine.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str
            Name of the file.
        file : file
            Binary file, open for writing.

        Returns
        -------
        int
            Number of bytes.

        Raises
        ------
        ClusterError
            If it cannot be read.
        """
        if "://" in self.url:
            return file.write(self.read(job, name))
        try:
            with open(f"{self._place[1]}/{job}/{name}", "rb") as source:
                return appended(source, file)
        except FileNotFoundError as error:
            raise ClusterError(f"{self.url}: {job}/{name}: {error}") from None

    def write(self, job: str, name: str, data: Contents) -> None:
        """Write a file of a job atomically: beside and moved, or by a conditional put of an object store.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str
            Name of the file.
        data : bytes, or a sequence of blocks
            Contents.

        Raises
        ------
        ClusterError
            If it cannot be written.
        """
        system, root = self._place
        path, part = f"{root}/{job}/{name}", f"{root}/{job}/.{name}.{token_hex(8)}.part"
        try:
            system.makedirs(f"{root}/{job}", exist_ok=True)
            if "://" in self.url:
                with suppress(FileExistsError):  # the same bytes
                    system.pipe_file(path, data if isinstance(data, bytes) else b"".join(data), mode="create")
            else:
                with system.open(part, "wb") as file:
                    file.writelines([data] if isinstance(data, bytes) else data)
                system.mv(part, path)
        except OSError as error:
            raise ClusterError(f"{self.url}: {error}") from None

    def remove(self, job: str, name: str = "") -> None:
        """Remove a file of a job, or all of them; ignore what is not there.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str, optional
            Name of the file.
        """
        system, root = self._place
        with suppress(OSError):
            system.rm(posixpath.join(root, job, name).rstrip("/"), recursive=not name)

    def tidy(self) -> None:
        """Remove the folder if it is empty."""
        system, root = self._place
        with suppress(OSError):
            system.rmdir(root)


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

    def results(self, tasks: Sequence[Task], work: Work, stage: str = "") -> Iterator[bytes]:
        """Results of tasks, in order.

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
        bytes
            Result of each task.

        Raises
        ------
        ClusterError
            If a task fails, or none ends in time.
        Cancelled
            When the work is cancelled.
        """
        following, done = 0, set[int]()
        for index in self.made(tasks, work):
            done.add(index)
            if stage:
                work.progress(stage, len(done) / len(tasks))
            while following in done:
                yield self.pieces.read(tasks[following].job, tasks[following].name)
                following += 1
