"""Benchmark runs of fracslice and of other programs: every measurement in its own child process, one after
the other.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from statistics import median
from typing import Any

from ..cluster import Shard
from ..common.cache import key, program
from ..common.files import temporary_folder
from ..common.memory import MAXRSS, own_peak_mb, peak_rss_mb
from ..common.messages import format_count
from ..common.parameters import Count, Number, attribute, validate, validate_value
from ..errors import BenchError, FracsliceError, SharedError
from ..work import Work
from .measure import METHODS, WORKLOADS

PLACES = ("{workload}", "{resolution}", "{output}")


@dataclass(frozen=True)
class Peer:
    """External program to compare with."""

    name: str  # name in the report
    # command with {workload}, {resolution} and {output}, the mesh file in scene units that it writes
    command: tuple[str, ...]

    @classmethod
    def read(cls, text: str) -> Peer:
        """Parse NAME=COMMAND."""
        name, _, command = text.partition("=")
        missing = [place for place in PLACES if place not in command]
        if not name or missing:
            raise BenchError(
                f"peer {text!r}: expected NAME=COMMAND with {{workload}}, {{resolution}} and {{output}}"
            )
        try:
            return cls(name, tuple(shlex.split(command)))
        except ValueError as error:
            raise BenchError(f"peer {text!r}: {str(error).lower()}") from None


FIGURES = ("wall_s", "cpu_s", "peak_mb", "evaluations")
"""Figures that a peer may report itself, in place of those of its process."""


@dataclass(frozen=True)
class BenchmarkTask:
    """Benchmark task."""

    workloads: tuple[str, ...] = tuple(WORKLOADS)  # names in `WORKLOADS`
    resolutions: tuple[int, ...] = (64, 128, 256)  # voxels along the cube
    peers: tuple[Peer, ...] = ()  # external programs
    # runs per measurement; their median is reported
    repeats: int = attribute(Count, 3, "runs of each", least=1, most=100)
    # time limit per run, seconds. A slower method is not run at finer resolutions of the workload
    limit_s: float = attribute(Number, 60.0, "seconds", above=0)

    def __post_init__(self) -> None:
        for name in self.workloads:
            if name not in WORKLOADS:
                raise BenchError(f"workload {name!r}: expected one of {', '.join(WORKLOADS)}")
        validate(self, BenchError)
        for n in self.resolutions:
            validate_value("resolution", n, RESOLUTION, BenchError)


RESOLUTION = Count(256, "voxels along the cube", least=16, most=2048)


@dataclass(frozen=True)
class Measurement:
    """Result of one method."""

    workload: str  # name of the workload
    resolution: int  # voxels along the cube
    method: str  # name of the method or peer
    # wall_s, cpu_s, error_voxels and other figures of the method; empty if it failed
    numbers: dict[str, float]
    failed: str = ""  # error message, or ""


def measure(task: BenchmarkTask, work: Work) -> list[Measurement]:
    """Run a benchmark. A failed method is reported, and the others continue."""
    methods: list[str | Peer] = [name for name in METHODS if "scikit" not in name or find_spec("skimage")]
    result: dict[tuple[int, int, int], Measurement] = {}
    slow = set[tuple[str, int]]()
    for turn, resolution in enumerate(sorted(task.resolutions)):
        cases = [
            (row, column, MeasureTask(name, resolution, method, task.repeats))
            for row, name in enumerate(task.workloads)
            for column, method in enumerate([*methods, *task.peers])
            if (name, column) not in slow
        ]
        for (row, column, case), data in zip(
            cases, _results([case for *_, case in cases], work), strict=True
        ):
            seconds, one = json.loads(data)
            result[row, turn, column] = Measurement(**one)
            if seconds > task.limit_s * task.repeats:
                slow.add((case.workload, column))
    work.progress("measuring", 1.0)
    return [result[place] for place in sorted(result)]


def _results(cases: Sequence[MeasureTask], work: Work) -> Iterator[bytes]:
    """Results of measurements, in order, one after the other here, or by the pool of the work."""
    if (pool := work.cluster) is None:
        for done, case in enumerate(cases):
            work.progress("measuring", done / len(cases))
            yield case.make(work)
    elif isinstance(pool, Shard) and not pool.first:
        made = format_count(pool.share(cases, work), "measurement")
        raise SharedError(f"this shard made {made}; shard 1 writes the report")
    else:
        yield from pool.results(cases, work, "measuring")
        pool.finished(cases[0].job)


@dataclass(frozen=True)
class MeasureTask:
    """Measurement as a task."""

    workload: str  # name of the workload
    resolution: int  # voxels along the cube
    method: str | Peer  # workloads, resolutions, peers and repeats
    repeats: int  # runs, of which the median is reported

    @property
    def job(self) -> str:
        """Key of all measurements of a resolution."""
        return key(program(), "bench", self.resolution, self.repeats)

    @property
    def name(self) -> str:
        """Name of the measurement."""
        return f"{self.workload}-{self.resolution:04}-{key(self.method)[:8]}"

    def make(self, work: Work) -> bytes:
        """Seconds and `Measurement` as JSON; see `Task.make`."""
        name = self.method.name if isinstance(self.method, Peer) else self.method
        begun, of = time.perf_counter(), (self.workload, self.resolution)
        try:
            runs = list(_runs(self.repeats, *of, self.method, work))
            one = Measurement(*of, name, {each: median(run[each] for run in runs) for each in runs[0]})
        except _FailedError as error:
            one = Measurement(*of, name, {}, str(error))
        return json.dumps([time.perf_counter() - begun, asdict(one)]).encode()


class _FailedError(FracsliceError):
    """A child process ended without a result."""


def _runs(
    repeats: int, workload: str, resolution: int, method: str | Peer, work: Work
) -> Iterator[dict[str, float]]:
    about = {"workload": workload, "resolution": resolution, "threads": work.threads}
    for _ in range(repeats):
        if isinstance(method, Peer):
            yield _peer(method, about, work)
        else:
            yield _child(about | {"method": method}, work)


def _child(asked: dict[str, Any], work: Work) -> dict[str, float]:
    output, _ = _run_command([sys.executable, "-m", "fracslice.bench.measure"], json.dumps(asked), work)
    figures: dict[str, float] = json.loads(output)
    return figures


def _peer(peer: Peer, about: dict[str, Any], work: Work) -> dict[str, float]:
    """Run a peer and measure its mesh.

    Time and memory are those of its process, unless it reports its own.
    """
    with temporary_folder() as folder:
        path = folder / "mesh.ply"
        places = {"workload": about["workload"], "resolution": about["resolution"], "output": path}
        command = [word.format(**places) for word in peer.command]
        output, used = _run_command(command, "", work)
        with suppress(ValueError, IndexError):
            figures = json.loads(output.splitlines()[-1])
            used |= {key: float(figures[key]) for key in FIGURES if key in figures}
        if not path.exists():
            raise _FailedError(f"{command[0]} wrote no mesh")
        return used | _child(about | {"mesh": str(path)}, work)


def _run_command(command: list[str], text: str, work: Work) -> tuple[str, dict[str, float]]:
    """Run a command; return its output, time and memory. Raises `_FailedError`, `Cancelled`."""
    start = time.perf_counter()
    with tempfile.TemporaryFile() as fed, tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        fed.write(text.encode())
        fed.seek(0)
        try:
            child = subprocess.Popen(command, stdin=fed, stdout=out, stderr=err)
        except OSError as error:
            raise _FailedError(f"{command[0]}: {error.strerror}") from None
        status, usage, peak = _wait_for_child(child, work)
        wall = time.perf_counter() - start
        out.seek(0)
        err.seek(0)
        if status:
            lines = err.read().decode(errors="replace").strip().splitlines()
            raise _FailedError(lines[-1] if lines else f"{command[0]} ended with status {status}")
        used = {"wall_s": wall, "cpu_s": usage.ru_utime + usage.ru_stime, "peak_mb": peak}
        return out.read().decode(errors="replace"), used


def _wait_for_child(child: subprocess.Popen[bytes], work: Work) -> tuple[int, Any, float]:
    """Wait for a child process; stop it if the work is cancelled. Returns its status, usage and peak memory,
    MiB.

    The pauses grow with the age of the process, so that its memory is read in the last part of its life.
    """
    seen, start = 0.0, time.perf_counter()
    while True:
        seen = max(seen, own_peak_mb(child.pid))
        pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        if pid:
            child.returncode = os.waitstatus_to_exitcode(status)
            most = usage.ru_maxrss / MAXRSS
            return child.returncode, usage, seen if seen and most <= peak_rss_mb() else most
        if work.cancel.wait(min(0.02, 0.001 + (time.perf_counter() - start) / 20)):
            child.kill()
            child.wait()
            work.check()
