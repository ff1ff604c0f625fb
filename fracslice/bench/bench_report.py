"""Benchmark report: a page, plots and numbers."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from ..common.files import replacing
from ..common.messages import lacking
from ..errors import BenchError
from ..version import __version__
from .measurements import Measurement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

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
