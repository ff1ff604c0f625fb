"""What a cluster costs: tasks by workers against threads, and the simulated growth to 1000 workers.

Tasks of some seconds wait, so that the machine's load does not count; empty tasks give the cost of one in the
scheduler and the client, which are serial. The simulation takes that cost and the measured time of a range of
layers: every task passes the serial part, then a free worker, and its result the serial part again.
"""

from __future__ import annotations

import heapq
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fracslice.cluster import Pieces, Pool, connected
from fracslice.cluster.pieces import run as make_piece
from fracslice.export.ranges import RangeTask, _planned
from fracslice.formulas import mandelbulb
from fracslice.scene import scene
from fracslice.scene.writer import to_xml
from fracslice.slicerecipe import SliceRecipe
from fracslice.slicing import SliceJob
from fracslice.work import Work

from ..runner import Row, Run, Spread, timed

RUNS, THREADS = 3, [2]
SMALLEST = {"tasks": 2, "seconds": 0.05, "empty": 4, "pixels": 64, "workers": (1, 4)}


@dataclass(frozen=True)
class Pause:
    """Task that waits."""

    job: str
    number: int
    seconds: float

    @property
    def name(self) -> str:
        return f"pause-{self.number:05}"

    def make(self, work: Work) -> bytes:
        time.sleep(self.seconds)
        return b"done"


def by_pool(pool: Pool, tasks: list[Pause]) -> None:
    """All results, in order; then removed."""
    assert sum(1 for _ in pool.results(tasks, Work(1))) == len(tasks)
    pool.finished(tasks[0].job)


def by_threads(pieces: Pieces, tasks: list[Pause], work: Work) -> None:
    """The same files by threads."""
    work.map(lambda task: make_piece(task, pieces, work), tasks)
    pieces.remove(tasks[0].job)


def layers_task(pixels: int) -> RangeTask:
    """Range of 64 layers in the middle of a Mandelbulb."""
    xml = to_xml(scene(mandelbulb(), size="80mm"))
    recipe = SliceRecipe(xml, "bulb", SliceJob(80.0, 80 / 640, (80 / pixels, 80 / pixels)))
    return RangeTask(recipe, _planned(recipe).job, 288, 352)


def simulated(workers: int, tasks: int, seconds: float, cost: float) -> float:
    """Wall time of equal tasks: a serial cost before and after each, workers in between."""
    serial, free, ended = 0.0, [0.0] * min(workers, tasks), []
    for _ in range(tasks):
        while ended and ended[0] <= max(serial, free[0]):
            serial = max(serial, heapq.heappop(ended)) + cost / 2
        serial = max(serial, 0.0) + cost / 2
        end = max(serial, heapq.heappop(free)) + seconds
        heapq.heappush(free, end)
        heapq.heappush(ended, end)
    while ended:
        serial = max(serial, heapq.heappop(ended)) + cost / 2
    return serial


def rows(
    run: Run,
    tasks: int = 8,
    seconds: float = 2.0,
    empty: int = 200,
    pixels: int = 16384,
    workers: tuple[int, ...] = (1, 10, 100, 300, 1000),
    plot: str = "",
) -> Iterator[Row]:
    threads = run.threads[0]
    waiting = [Pause("waiting", number, seconds) for number in range(tasks)]
    nothing = [Pause("nothing", number, 0.0) for number in range(empty)]
    with tempfile.TemporaryDirectory() as folder, connected(f"local:{threads}", folder, threads) as pool:
        acts = {
            "workers": partial(by_pool, pool, waiting),
            "threads": partial(by_threads, Pieces(folder + "/threads"), waiting, Work(threads)),
            "empty": partial(by_pool, pool, nothing),
        }
        measured = run.interleaved(acts)
    cost = Spread.of([figures["wall_s"] / empty for figures in measured["empty"]])
    task = layers_task(pixels)
    layers = min(timed(lambda: task.make(Work(1)))["cpu_s"] for _ in range(run.runs))
    over = measured.ratio("workers", "threads", "wall_s")
    yield {"": f"{tasks} tasks of {seconds:g} s, {threads} workers / {threads} threads", "figure": over}
    yield {
        "": "a task in the scheduler and the client, ms",
        "figure": Spread(*(1e3 * v for v in vars(cost).values())),
    }
    yield {"": f"64 layers of {pixels} pixels, CPU s", "figure": layers}
    for count in workers:
        speed = {n: n * layers / simulated(count, n, layers, cost.median) for n in (157, 10_000)}
        row = {"": f"simulated: {count} workers", "figure": speed[10_000]}
        yield {**row, "157 tasks": speed[157], "efficiency": f"{speed[10_000] / count:.0%}"}
    if plot:
        draw(Path(plot), layers, cost.median)


def draw(path: Path, seconds: float, cost: float) -> None:
    """Speed against workers, for some numbers of tasks."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 3.6), layout="constrained")
    axes, counts = figure.subplots(), [1, 2, 5, 10, 20, 50, 100, 200, 300, 500, 700, 1000]
    for tasks in (157, 1000, 10_000):
        faster = [tasks * seconds / simulated(count, tasks, seconds, cost) for count in counts]
        axes.loglog(counts, faster, marker="o", markersize=3, label=f"{tasks:,} tasks of {seconds:.2g} s")
    axes.loglog(counts, counts, color="0.7", linewidth=0.8, label="ideal")
    axes.set(xlabel="workers (simulated)", ylabel="times faster than one")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.25)
    figure.savefig(path, dpi=100)
