"""A scheduler and workers of Dask as processes that a test may kill."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from tests import waiting

SECONDS = 600.0
"""Until something that must happen has happened: only a test that fails waits this long."""

wait_until = partial(waiting.wait_until, seconds=SECONDS)


class Cluster:
    """Processes of one scheduler."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.file = folder, folder / "scheduler.json"
        self.processes: list[subprocess.Popen[bytes]] = []
        self._start("scheduler", "--port", "0", "--host", "127.0.0.1", "--no-dashboard", "--no-show")
        wait_until(lambda: self.file.exists() and self.file.read_text().strip())
        self.address: str = json.loads(self.file.read_text())["address"]

    def worker(self, *more: str) -> subprocess.Popen[bytes]:
        """Start a worker of one thread."""
        return self._start("worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", *more)

    def _start(self, kind: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(self.file), *options]
        log = (self.folder / f"{time.monotonic_ns()}.log").open("wb")
        environment = {**os.environ, "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "60s"}
        started = subprocess.Popen(command, stdout=log, stderr=log, cwd=self.folder, env=environment)
        self.processes.append(started)
        return started

    def end_workers(self) -> None:
        """Kill the workers, stopped ones too."""
        scheduler, *workers = self.processes
        for process in workers:
            process.kill()
            process.wait(SECONDS)
        self.processes = [scheduler]

    def end(self) -> None:
        """Kill all that were started."""
        self.end_workers()
        self.processes[0].kill()
        self.processes[0].wait(SECONDS)
