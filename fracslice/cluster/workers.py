"""Workers of a Dask cluster, connection to their scheduler or to workers that are started here, and the
identity by which two processes make the same bytes.
"""

from __future__ import annotations

import logging
import os
import pickle
import platform
import re
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from secrets import token_hex
from typing import TYPE_CHECKING, Any

from ..common.cache import program, warn
from ..common.memory import keep_memory_of_tasks
from ..common.messages import lacking
from ..errors import ClusterError
from ..version import __version__
from .pool import Pool, Task, run_task
from .result_folder import ResultFolder

if TYPE_CHECKING:
    from distributed import Client, Future

    from ..work import Work


@dataclass(frozen=True)
class Identity:
    """What two processes must share to make the same bytes."""

    # version of fracslice and of Python; keys of the program's text and of the processor's instructions
    version: str
    python: str
    program: str
    processor: str

    @classmethod
    def here(cls) -> Identity:
        """Identity of this process."""
        from ..expr.runtime import toolchain

        return cls(__version__, platform.python_version(), program(), toolchain())

    def difference(self, expected: Identity) -> str:
        """Describe the first difference; "" if there is none."""
        for name, own, other in (
            ("fracslice", self.version, expected.version),
            ("Python", self.python, expected.python),
            ("program text", self.program[:8], expected.program[:8]),
            ("processor", self.processor[:8], expected.processor[:8]),
        ):
            if own != other:
                return f"{name} {own}, expected {other}"
        return ""


HIDDEN = ".fracslice-pieces"
"""Folder of the results where none is named."""

POLL, CONNECT = 0.05, 20.0
"""Seconds between two looks for results, and until a scheduler answers."""


TASK = """try:
    from fracslice.cluster.workers import on_worker
except ImportError as error:
    from distributed import get_worker
    raise ImportError(get_worker().address, str(error)) from None
on_worker(*__import__("pickle").loads(arguments))
"""
"""Text of a task: a worker that cannot unpickle what it receives would end."""


class UnfitWorkerError(ClusterError):
    """Worker that would make other bytes: its address, and the difference."""


def on_worker(pickled: bytes, pieces: ResultFolder, expected: Identity) -> None:
    """Make the result of a task on a worker, in one thread.

    Nothing is returned: a value would have to be fetched from a worker that may be gone. Exceptions travel
    through the scheduler.
    """
    from distributed import get_worker

    from ..work import Work

    if difference := Identity.here().difference(expected):
        raise UnfitWorkerError(get_worker().address, difference)
    keep_memory_of_tasks()  # Dask starts workers with MALLOC_TRIM_THRESHOLD_=65536
    run_task(pickle.loads(pickled), pieces, Work(threads=1))


@dataclass(frozen=True, eq=False)
class Workers(Pool):
    """Workers of a Dask scheduler, each thread of which makes a task at a time.

    What counts is whether a result is in the folder: if no task ends for a while, all that are missing are
    submitted once more, since the same task twice does no harm.

    Attributes
    ----------
    client : distributed.Client
        Connection to the scheduler.
    pieces : ResultFolder
        Results.
    patience : float
        Seconds without a result until missing tasks are submitted once more; doubled every time.
    limit : float
        Seconds without a result until the job fails.
    """

    client: Client
    pieces: ResultFolder
    patience: float = 60.0
    limit: float = 1800.0

    @classmethod
    def of(cls, client: Client) -> Workers:
        """Workers of a client, with results in a hidden folder of the current one.

        Parameters
        ----------
        client : distributed.Client
            Connection to the scheduler.

        Returns
        -------
        Workers

        """
        return cls(client, ResultFolder(os.path.abspath(HIDDEN)))

    def made(self, tasks: Sequence[Task], work: Work) -> Iterator[int]:
        """Submit tasks and yield them as they end; see `Pool.made`."""
        missing = []
        for index, task in enumerate(tasks):
            if self.pieces.has(task):
                yield index
            else:
                missing.append(index)
        if missing:
            yield from _Attempt(self, tasks).made(missing, work)


class _Attempt:
    """Futures of the tasks that are missing."""

    def __init__(self, pool: Workers, tasks: Sequence[Task]) -> None:
        from distributed import as_completed

        self.pool, self.tasks, self.expected = pool, tasks, Identity.here()
        self.token, self.count = token_hex(3), 0
        self.address = pool.client.scheduler.address
        self.refused: set[str] = set()
        self.futures: dict[Future, int] = {}
        self.queue: Any = as_completed(loop=pool.client.loop)

    def made(self, indices: list[int], work: Work) -> Iterator[int]:
        """Indices of tasks as their results come."""
        pool, missing = self.pool, set(indices)
        last, patience = time.monotonic(), pool.patience
        try:
            self.submit(indices)
            while missing:
                work.check()
                if pool.client.status == "closed":
                    raise self.silent()
                for index in self.ended():
                    if index in missing:
                        missing.discard(index)
                        last, patience = time.monotonic(), pool.patience
                        yield index
                quiet = time.monotonic() - last
                if quiet > pool.limit:
                    workers = len(self.known())
                    raise ClusterError(f"no task ended within {pool.limit:g} s; {workers} workers")
                if quiet > patience:
                    patience += quiet
                    self.submit(sorted(missing))
                work.cancel.wait(POLL)
        finally:
            with suppress(Exception):  # the scheduler may be gone
                pool.client.cancel(list(self.futures), force=True)

    def submit(self, indices: Sequence[int]) -> None:
        """Submit tasks under new names, preferably to workers that fit and are not stuck with one."""
        self.count += 1
        known = self.known()
        if not known:
            warn(f"{self.address}: no worker yet; the job waits {self.pool.limit / 60:g} min for one")
        fit = [address for address in known if address not in self.refused]
        if self.refused and not fit:
            raise ClusterError("no worker fits: none has the fracslice and the Python of this process")
        free = [address for address in fit if address not in self.busy] or fit
        where = {"workers": free, "allow_other_workers": True} if len(free) < len(known) else {}
        for index in indices:
            task = self.tasks[index]
            key = f"{task.name}-{task.job[:8]}{self.token}{self.count:x}"
            arguments = pickle.dumps((pickle.dumps(task), self.pool.pieces, self.expected))
            future = self.pool.client.submit(
                exec, TASK, {"arguments": arguments}, key=key, pure=False, **where
            )
            self.futures[future] = index
            self.queue.add(future)

    def known(self) -> dict[str, Any]:
        """Workers of the scheduler, by address."""
        client = self.pool.client
        try:
            about = client.sync(client.scheduler.identity, n_workers=-1, callback_timeout=CONNECT)
        except (OSError, TimeoutError):
            raise self.silent() from None
        workers: dict[str, Any] = about["workers"]
        return workers

    def silent(self) -> ClusterError:
        """Error of a scheduler that is gone or hangs."""
        return ClusterError(
            f"{self.address}: the scheduler does not answer; the same command goes on with what is there"
        )

    @property
    def busy(self) -> set[str]:
        """Workers that have kept a task of an earlier submission."""
        if self.count < 2:
            return set()
        client, own = self.pool.client, {future.key for future in self.futures}
        try:
            processing = client.sync(client.scheduler.processing, workers=None, callback_timeout=CONNECT)
        except (OSError, TimeoutError):
            return set()
        return {address for address, keys in processing.items() if own & set(keys)}

    def ended(self) -> Iterator[int]:
        """Indices of tasks whose futures have ended since the last look."""
        while self.queue.has_ready():
            future = self.queue.next()
            index = self.futures.pop(future)
            if future.cancelled():
                continue  # submitted once more when it is missed
            error = future.exception(timeout=CONNECT)
            if error is None:
                yield index
                continue
            if isinstance(error, UnfitWorkerError | ImportError) and len(error.args) == 2:
                self.refuse(*error.args)
            elif type(error).__name__ == "KilledWorker":
                warn(
                    f"{self.tasks[index].name}: its workers ended, one by one; their memory may be too small"
                )
            else:
                raise ClusterError(f"{self.tasks[index].name}: {error or type(error).__name__}") from error
            self.submit([index])

    def refuse(self, address: str, difference: str) -> None:
        """Remember a worker that makes other bytes; warn once."""
        self.refused.add(address)
        warn(f"worker {address} is not used: {difference}")


START = 300.0
"""Seconds until a local worker has started."""

SETTINGS = {
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_ARENA_MAX": 1,
}
"""Local workers measure themselves seldom: at Dask's defaults it takes 5 % of a processor each. Their threads
share one heap of glibc, which keeps freed memory for the next task; a heap of a thread's own returns it.
"""


@contextmanager
def connect(where: str, store: str, threads: int = 1) -> Iterator[Workers]:
    """Connect to a scheduler, or start workers here.

    Parameters
    ----------
    where : str
        Address of a scheduler, such as "tcp://host:8786"; or "local" or "local:4" for processes here.
    store : str
        Folder of the results, see `ResultFolder`.
    threads : int
        Threads of all local workers together.

    Yields
    ------
    Workers

    Raises
    ------
    ClusterError
        If Dask is not installed, the text is malformed, or no scheduler answers.
    """
    if reason := lacking("distributed", "clusters need"):
        raise ClusterError(reason)
    from distributed import Client

    kind, _, count = where.partition(":")
    with ExitStack() as stack:
        if kind == "local":
            if count and not 1 <= int(count if count.isdigit() else 0) <= 1024:
                raise ClusterError(f"{where!r}: expected local, local:N or the address of a scheduler")
            scheduler = stack.enter_context(_local(int(count or threads), threads))
        elif not re.fullmatch(r"\w+://.+|[^/]+:\d+", where):
            raise ClusterError(f"{where!r}: expected local, local:N or the address of a scheduler")
        else:
            scheduler = where
        log = logging.getLogger("distributed.client")
        stack.callback(log.setLevel, log.level)
        log.setLevel(logging.CRITICAL)  # a scheduler that is gone is an error of the job
        try:
            client = Client(scheduler, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ClusterError(f"{where}: no scheduler answers: {error}") from None
        yield Workers(stack.enter_context(client), ResultFolder(store))


@contextmanager
def _local(count: int, threads: int) -> Iterator[Any]:
    """Cluster of processes here, which share some threads."""
    import dask
    from distributed import LocalCluster

    each = max(1, threads // count)
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(SETTINGS))
        with interrupts_later():
            try:
                cluster = LocalCluster(
                    n_workers=count,
                    threads_per_worker=each,
                    memory_limit=None,
                    dashboard_address=None,
                    scheduler_kwargs={"dashboard_address": ":0"},
                    silence_logs=logging.CRITICAL,
                    death_timeout=START,
                )
            except (AssertionError, TimeoutError):  # Dask asserts that a worker that it ends has started
                raise ClusterError(f"local:{count}: no worker started within {START:g} s") from None
            except (OSError, RuntimeError) as error:
                raise ClusterError(f"local:{count}: no worker started: {error.__cause__ or error}") from None
        yield stack.enter_context(cluster)


@contextmanager
def interrupts_later() -> Iterator[None]:
    """Delay Ctrl-C to the end of the block; processes that start in it never receive one.

    A terminal interrupts all of its processes. The one that started the others ends them.
    """
    if not hasattr(signal, "pthread_sigmask"):  # as on Windows
        yield
        return
    resource_tracker.ensure_running()  # it would unblock the signal when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
