"""Connection to a scheduler, or to workers that are started here."""

from __future__ import annotations

import logging
import re
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from typing import Any

from ..common.messages import lacking
from ..errors import ClusterError
from . import workers
from .result_folder import ResultFolder

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
def connect(where: str, store: str, threads: int = 1) -> Iterator[workers.Workers]:
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
            client = Client(scheduler, timeout=workers.CONNECT, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ClusterError(f"{where}: no scheduler answers: {error}") from None
        yield workers.Workers(stack.enter_context(client), ResultFolder(store))


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
