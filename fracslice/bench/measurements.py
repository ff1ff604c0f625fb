"""Benchmark runs of fracslice and of other programs, and the report: a page, plots and numbers."""

from __future__ import annotations

import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from ..cluster import Shard
from ..common.cache import key, program
from ..common.files import replacing, temporary_folder
from ..common.memory import MAXRSS, own_peak_mb, peak_rss_mb
from ..common.messages import format_count, lacking
from ..common.parameters import Count, Number, attribute, validate, validate_value
from ..errors import BenchError, FracsliceError, SharedError
from ..version import __version__
from ..work import Work
from .measure import METHODS, WORKLOADS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


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


LAG = 64.0
"""By how much the kernel's counters of a process with many threads may differ, MiB."""


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
            inherited = most <= peak_rss_mb() + LAG
            return child.returncode, usage, seen if seen and inherited else most
        if work.cancel.wait(min(0.02, 0.001 + (time.perf_counter() - start) / 20)):
            child.kill()
            child.wait()
            work.check()


ERROR, TIME = "error_voxels", "cpu_s"
PLOTS = ("error.png", "growth.png", "memory.png")
COLOURS = ("#4477aa", "#66ccee", "#aa3377", "#ccbb44", "#888888", "#ee6677", "#228833", "#000000")
"""Paul Tol's bright scheme, distinguishable for colour-blind readers."""

LABELS = {
    "volume": "volume",
    "area": "area",
    "wall_s": "seconds",
    "cpu_s": "CPU seconds",
    "triangles": "triangles",
    "peak_mb": "peak MB",
}


def require_plots() -> None:
    """Check that matplotlib is installed."""
    if reason := lacking("matplotlib", "plots need"):
        raise BenchError(reason)


def write_report(measured: list[Measurement], folder: Path) -> list[Path]:
    """Write report.md, numbers.json and the plots."""
    about = {"version": __version__, "machine": _machine()}
    numbers = about | {"measurements": [asdict(one) for one in measured]}
    texts = {"report.md": _page(measured, about), "numbers.json": json.dumps(numbers, indent=1) + "\n"}
    for name, text in texts.items():
        with replacing(folder / name) as file:
            file.write(text.encode())
    measured = [one for one in measured if not one.failed]
    _plots(measured, folder)
    return [folder / name for name in (*texts, *PLOTS)]


def _machine() -> str:
    cores, python = os.cpu_count(), platform.python_version()
    return f"{platform.system()} {platform.machine()}, {cores} cores, Python {python}"


def _page(measured: list[Measurement], about: dict[str, str]) -> str:
    parts = [
        "# Run time against error",
        f"fracslice {about['version']}; {about['machine']}. Warm, each run in a process of its own, "
        "medians. The error is the mean distance from the true surface, |f| / |grad f|, at points spread "
        "evenly over the mesh, in voxels; volume and area are relative errors where a closed form is known. "
        "Evaluations are those of the field on the grid, probing included, for each sample that is kept.",
        *(f"![{name}]({name})" for name in PLOTS),
    ]
    for workload in _unique(one.workload for one in measured):
        rows = [one for one in measured if one.workload == workload]
        parts.append(f"## {workload}\n\n{_table(rows)}")
    return "\n\n".join(parts) + "\n"


def _table(rows: list[Measurement]) -> str:
    known = [key for key in LABELS if any(key in one.numbers for one in rows)]
    spent = any("evaluations" in one.numbers for one in rows)
    head = ["voxels", "method", "error", *(LABELS[key] for key in known), *(["evaluations"] if spent else [])]
    lines = [head, ["---:", "---", *["---:"] * (len(head) - 2)]]
    for one in rows:
        cells = [_cell(one.numbers.get(key)) for key in (ERROR, *known)]
        if one.failed:
            cells = [f"failed: {one.failed}".replace("|", "/"), *[""] * len(known)]
        if spent:
            cells.append(_cell(_evaluations(one)))
        lines.append([str(one.resolution), one.method, *cells])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _evaluations(one: Measurement) -> float | None:
    """Field evaluations per kept sample."""
    spent, kept = one.numbers.get("evaluations"), one.numbers.get("kept")
    return None if spent is None or not kept else spent / kept


def _cell(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.2g}"


def _plots(measured: list[Measurement], folder: Path) -> None:
    """Draw small multiples, one per workload."""
    _plot(measured, folder / PLOTS[0], "mean error, voxels of the finest", "CPU seconds", _error)
    _plot(measured, folder / PLOTS[1], "voxels along the cube", "CPU seconds", _growth)
    _plot(measured, folder / PLOTS[2], "voxels along the cube", "peak memory, MB", _memory)


def _error(one: Measurement, finest: int) -> tuple[float, float] | None:
    error = one.numbers[ERROR] * finest / one.resolution
    return max(error, 1e-9), one.numbers[TIME]


def _growth(one: Measurement, finest: int) -> tuple[float, float] | None:
    return one.resolution, one.numbers[TIME]


def _memory(one: Measurement, finest: int) -> tuple[float, float] | None:
    return (one.resolution, one.numbers["peak_mb"]) if "peak_mb" in one.numbers else None


Point = Callable[[Measurement, int], tuple[float, float] | None]


def _plot(measured: list[Measurement], path: Path, x: str, y: str, point: Point) -> None:
    from matplotlib.figure import Figure

    workloads, methods = _unique(one.workload for one in measured), _unique(one.method for one in measured)
    columns = 2 if len(workloads) == 4 else min(3, max(1, len(workloads)))
    rows = max(1, -(-len(workloads) // columns))
    figure = Figure(figsize=(4 * columns, 3.1 * rows + 0.7), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel, workload in zip(axes, workloads, strict=False):
        _panel(panel, [one for one in measured if one.workload == workload], methods, point)
        panel.set(title=workload, xlabel=x, ylabel=y)
    for panel in axes[len(workloads) :]:
        panel.remove()
    lines = [_line(method, methods) for method in methods]
    figure.legend(handles=lines, loc="outside lower center", ncols=columns + 1, frameon=False)
    with replacing(path) as file:
        figure.savefig(file, format="png", dpi=110, metadata={"Software": None})


def _panel(panel: Axes, measured: list[Measurement], methods: list[str], point: Point) -> None:
    finest = max((one.resolution for one in measured), default=1)
    for method in methods:
        points = [point(one, finest) for one in measured if one.method == method]
        drawn = [p for p in points if p is not None]
        if drawn:
            line = _line(method, methods)
            line.set_data([p[0] for p in drawn], [p[1] for p in drawn])
            panel.add_line(line)
    panel.set(xscale="log", yscale="log")
    panel.relim()
    panel.autoscale_view()
    panel.grid(True, which="major", color="#dddddd", linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)


def _line(method: str, methods: list[str]) -> Line2D:
    from matplotlib.lines import Line2D

    i, marks = methods.index(method), "osD^vPX*<>hd"
    colour, mark = COLOURS[i % len(COLOURS)], marks[i % len(marks)]
    style = "-" if i < len(COLOURS) else "--"
    return Line2D([], [], color=colour, marker=mark, ls=style, markersize=4.5, lw=1.4, label=method)


def _unique(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))
