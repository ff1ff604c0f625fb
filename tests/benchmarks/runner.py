"""What all benchmarks share: interleaved runs, one statistic, processes with their peak memory, one table."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Row = dict[str, Any]
"""A line of the table: cells by the heading of their column."""

Figures = dict[str, float]
"""What one run measured: wall_s, cpu_s, peak_mb and others."""

PAGE = Path(__file__).parents[2] / "docs/measurements.md"

_LAUNCHER = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
status = subprocess.run(sys.argv[2:]).returncode
wall, used = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
peak = used.ru_maxrss / (1 << 20 if sys.platform == "darwin" else 1 << 10)
with open(sys.argv[1], "w") as file:
    json.dump({"wall_s": wall, "cpu_s": used.ru_utime + used.ru_stime, "peak_mb": peak}, file)
sys.exit(status)
"""
"""A process inherits the peak memory of the one that starts it, so a small one does."""


@dataclass(frozen=True)
class Spread:
    """Median of interleaved runs, with the least and the greatest."""

    median: float
    min: float
    max: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        return cls(statistics.median(values), min(values), max(values))

    def __str__(self) -> str:
        if self.min == self.max:
            return _number(self.median)
        return f"{_number(self.median)} ({_number(self.min)} to {_number(self.max)})"


class Measured(dict[str, list[Figures]]):
    """Figures of every run, by the name of what ran."""

    def spread(self, name: str, key: str) -> Spread:
        return Spread.of([figures[key] for figures in self[name]])

    def ratio(self, name: str, others: str | Sequence[str], key: str, other_key: str = "") -> Spread:
        """The ratio of one to the sum of others, turn by turn."""
        names = [others] if isinstance(others, str) else others
        sums = [
            sum(self[other][turn][other_key or key] for other in names) for turn in range(len(self[name]))
        ]
        return Spread.of([figures[key] / total for figures, total in zip(self[name], sums, strict=True)])


@dataclass
class Run:
    """One run of a benchmark: how often, with how many threads, and the faults that it met."""

    runs: int = 5
    threads: tuple[int, ...] = (2,)
    faults: list[str] = field(default_factory=list)

    def interleaved(self, acts: dict[str, Callable[[], Any]], warm: bool = True) -> Measured:
        """Run every act in turn, several times.

        Parameters
        ----------
        acts : dict
            Functions. One that returns figures is believed; the clocks measure every other.
        warm : bool
            Whether each runs once before.
        """
        result = Measured({name: [] for name in acts})
        for turn in range(-int(warm), self.runs):
            for name, act in acts.items():
                figures = timed(act)
                if turn >= 0:
                    result[name].append(figures)
        return result


def timed(act: Callable[[], Any]) -> Figures:
    """Wall and CPU seconds of an act, or the figures that it returns itself."""
    wall, cpu = time.perf_counter(), time.process_time()
    given = act()
    if isinstance(given, dict) and "cpu_s" in given:
        return given
    return {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}


def process(command: Sequence[object], **environment: str) -> Figures:
    """Wall and CPU seconds and peak memory of a command's process.

    Raises
    ------
    SystemExit
        If the command fails; the message is what it printed. Status 1 is a mesh that would not print.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "figures.json"
        words = [sys.executable, "-I", "-S", "-c", _LAUNCHER, str(path), *map(str, command)]
        installed = {"PYTHONDONTWRITEBYTECODE": ""}  # an installed package has byte code
        kept = {"env": {**os.environ, **installed, **environment}, "capture_output": True, "text": True}
        done = subprocess.run(words, **kept)  # type: ignore[call-overload]
        if done.returncode > 1 or "Traceback" in done.stderr:
            raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}{done.stdout}")
        figures: Figures = json.loads(path.read_text())
    return figures


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def cell(value: object) -> str:
    """A value as the table shows it."""
    if isinstance(value, bool) or value is None:
        return "" if value is None else str(value)
    if isinstance(value, int):
        return f"{value:,}"
    return _number(value) if isinstance(value, float) else str(value)


def columns(rows: Iterable[Row]) -> list[str]:
    """All headings, in the order of their first appearance."""
    return list(dict.fromkeys(key for row in rows for key in row))


def markdown(rows: Sequence[Row]) -> str:
    """A table for the documentation."""
    head = columns(rows)
    lines = [head, ["---"] * len(head), *([cell(row.get(key)) for key in head] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def publish(name: str, text: str) -> None:
    """Replace what is between the marks of a benchmark in docs/measurements.md."""
    start, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    page = PAGE.read_text(encoding="utf-8")
    if start not in page:
        raise SystemExit(f"docs/measurements.md has no mark <!-- {name} -->")
    before, rest = page.split(start)
    PAGE.write_text(before + start + text + "\n" + end + rest.split(end)[1], encoding="utf-8")
