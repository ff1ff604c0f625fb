"""Workers on this machine: processes that are started for a job."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from fracslice.cluster import connect, workers
from fracslice.errors import ClusterError

pytest.importorskip("distributed")


def test_local_workers_are_processes(tmp_path: Path) -> None:
    with connect("local:2", str(tmp_path / "pieces"), 2) as pool:
        result = pool.client.scheduler_info(n_workers=-1)["workers"].values()
        arenas = pool.client.run(os.getenv, "MALLOC_ARENA_MAX").values()
        blocked = pool.client.run(signal.pthread_sigmask, signal.SIG_BLOCK, [])
    assert [worker["nthreads"] for worker in result] == [1, 1] and set(arenas) == {"1"}
    assert all(signal.SIGINT in of for of in blocked.values()), "Ctrl-C is for the client"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_local_workers_that_do_not_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from dask import config

    failing = pytest.raises(ClusterError, match="local:1: no worker started: No module named 'nobodys'")
    with config.set({"distributed.worker.preload": ["nobodys"]}), failing, connect("local:1", "x"):
        pass
    monkeypatch.setattr(workers, "START", 0.1)
    late = pytest.raises(ClusterError, match=r"local:1: no worker started within 0\.1 s")
    with late, connect("local:1", "x"):
        pass
