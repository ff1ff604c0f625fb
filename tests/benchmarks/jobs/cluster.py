"""What a cluster costs: jobs by workers against threads, and the simulated growth to 1000 workers.

Each job is made by two local workers and by as many threads, in turn; the ratio is of CPU time, of workers
and this process together. What the workers compute outside of their tasks is counted, too, and the first
job of new workers, which import, compile and plan. Empty tasks give the cost of one in all processes, and
its wall time, which is serial; idle workers that of their heartbeats. A run of each job in one process, and
of a smaller one, gives the CPU time of its tasks and the growth of the rest, which is serial. The
simulation makes a larger job of more tasks of these times: every task passes the serial part, then a free
worker, and its result the serial part again; all tasks of a stage end before the next one begins.
"""

from __future__ import annotations

import heapq
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from fracslice.animation import FilmJob, Timeline, write_frames
from fracslice.cluster import Contents, Pool, ResultFolder, Task, Workers, connect
from fracslice.cluster.pool import run_task as make_piece
from fracslice.export.layers import write_slices
from fracslice.formulas import mandelbulb
from fracslice.jobs import shared
from fracslice.jobs.mesh import make_mesh
from fracslice.jobs.slices import SliceRecipe
from fracslice.records import MeshJob
from fracslice.rendering import Renderer
from fracslice.scene import scene
from fracslice.scene.model import to_xml
from fracslice.scene.view import Animation, Camera, View
from fracslice.slicing import SliceJob
from fracslice.volume import sampler
from fracslice.work import Work

from ..runner import Figures, Row, Run, Spread

RUNS, THREADS = 3, [2]
SMALLEST = {
    "pixels": 64,
    "layers": 8,
    "voxels": 16,
    "width": 16,
    "frames": 1,
    "bricks": 1 << 12,
    "empty": 4,
    "idle": 0.1,
    "tasks": 8,
    "workers": (1,),
}
SAMPLES = 16
SCENE = scene(mandelbulb(), size="80mm")
VIEW = View(camera=Camera(eye=(2.0, -2.0, 1.0)))
Job = Callable[[Work, Path], object]


@dataclass(frozen=True)
class Nothing:
    """Empty task."""

    job: str
    number: int

    @property
    def name(self) -> str:
        return f"nothing-{self.number:05}"

    def make(self, work: Work) -> bytes:
        return b"done"


def by_pool(pool: Pool, tasks: Sequence[Task]) -> None:
    """All results, in order; then removed."""
    assert sum(1 for _ in pool.results(tasks, Work(1))) == len(tasks)
    pool.finished(tasks[0].job)


SECONDS: list[float] = []
"""CPU seconds of the tasks that this process has made, of measured workers."""


@dataclass(frozen=True)
class Measured:
    """Task that measures itself."""

    of: Task

    @property
    def job(self) -> str:
        return self.of.job

    @property
    def name(self) -> str:
        return self.of.name

    def make(self, work: Work) -> Contents:
        begun = time.thread_time()
        data = self.of.make(work)
        SECONDS.append(time.thread_time() - begun)
        return data


class MeasuredWorkers(Workers):
    """Workers whose tasks measure themselves."""

    def made(self, tasks: Sequence[Task], work: Work) -> Iterator[int]:
        return super().made([Measured(task) for task in tasks], work)


@dataclass
class Timed(Pool):
    """Makes all tasks in this process, and measures them; stages by the begin of their names."""

    pieces: ResultFolder
    seconds: dict[str, list[float]] = field(default_factory=dict)

    def made(self, tasks: Sequence[Task], work: Work) -> Iterator[int]:
        for index, task in enumerate(tasks):
            begun = time.process_time()
            make_piece(task, self.pieces, work)
            self.seconds.setdefault(task.name.partition("-")[0], []).append(time.process_time() - begun)
            yield index


def jobs(
    pixels: int, layers: int, voxels: int, width: int, frames: int, samples: int = SAMPLES
) -> dict[str, Job]:
    """A job of each kind."""
    size = 80 / pixels
    recipe = SliceRecipe(
        to_xml(SCENE), "bulb", SliceJob(size=80.0, layer=80 / layers, pixel=(size, size)), "cli"
    )
    shape = width, width * 9 // 16

    def rendered(work: Work, _: Path) -> None:
        for _ in Renderer(SCENE.root, VIEW, shape, work, "cpu").passes(samples):
            pass

    def filmed(work: Work, folder: Path) -> None:
        timeline = Timeline(replace(SCENE, view=VIEW, animation=Animation(duration=frames / 24)))
        write_frames(
            FilmJob(timeline, shape, samples, 24.0, device="cpu"), range(frames), folder / "film", False, work
        )

    return {
        "slice": lambda work, folder: write_slices(recipe.run(work), folder / "a.cli"),
        "frames": filmed,
        "picture": rendered,
        "mesh": lambda work, folder: make_mesh(SCENE, MeshJob(resolution=voxels), work, folder / "a.stl"),
    }


def used() -> tuple[float, float, int]:
    """CPU seconds of this process and of its tasks so far, and their number."""
    return time.process_time(), sum(SECONDS), len(SECONDS)


def cpu_of(act: Callable[[], object], pool: Workers | None) -> Figures:
    """CPU seconds of this process and of all workers, of the workers outside of their tasks, and tasks."""

    def totals() -> tuple[float, ...]:
        others = pool.client.run(used).values() if pool else [(0.0, 0.0, 0)]
        return time.process_time(), *map(sum, zip(*others, strict=True))

    begun, wall = totals(), time.perf_counter()
    act()
    wall = time.perf_counter() - wall
    own, workers, made, count = (now - then for now, then in zip(totals(), begun, strict=True))
    return {"cpu_s": own + workers, "wall_s": wall, "outside_s": workers - made, "tasks": count}


@dataclass(frozen=True)
class Stages:
    """Measured tasks of a job: number and mean seconds of each stage, and serial seconds of a task."""

    stages: tuple[tuple[int, float], ...]
    serial: float

    @classmethod
    def of(cls, job: Job, smaller: Job, folder: Path) -> Stages:
        (times, rest), (fewer, less) = cls.timed(job, folder), cls.timed(smaller, folder)
        stages = tuple((len(of), sum(of) / len(of)) for of in times.values())
        more = sum(map(len, times.values())) - sum(map(len, fewer.values()))
        return cls(stages, max(rest - less, 0.0) / max(more, 1))

    @staticmethod
    def timed(job: Job, folder: Path) -> tuple[dict[str, list[float]], float]:
        """CPU seconds of the tasks of each stage, and of the rest."""
        pool = Timed(ResultFolder(str(folder / "timed")))
        begun = time.process_time()
        job(Work(1, cluster=pool), folder)
        total = time.process_time() - begun
        return pool.seconds, total - sum(map(sum, pool.seconds.values()))

    @property
    def mean(self) -> float:
        """Mean seconds of a task."""
        return sum(count * mean for count, mean in self.stages) / sum(count for count, _ in self.stages)

    def faster(self, workers: int, tasks: int, cost: float) -> float:
        """Times faster than one process, with so many times the tasks that there are `tasks` in all."""
        scale = tasks / sum(count for count, _ in self.stages)
        larger = [(max(round(count * scale), 1), mean) for count, mean in self.stages]
        alone = sum(count * (mean + self.serial) for count, mean in larger)
        return alone / sum(simulated(workers, *stage, cost + self.serial) for stage in larger)


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
    pixels: int = 16384,
    layers: int = 48,
    voxels: int = 512,
    width: int = 640,
    frames: int = 4,
    bricks: int = 1 << 14,
    empty: int = 200,
    idle: float = 10.0,
    tasks: int = 10_000,
    workers: tuple[int, ...] = (1, 10, 100, 300, 1000),
    plot: str = "",
) -> Iterator[Row]:
    shared.LEAST, sampler.MANY = bricks, bricks  # samples are tasks, as in the larger job
    threads, sizes = run.threads[0], (pixels, layers, voxels, width, frames)
    kinds, smaller = jobs(*sizes), jobs(pixels, 8, voxels // 2, width // 2, 1)
    nothing = [Nothing("nothing", number) for number in range(empty)]
    acts, first = dict[str, Callable[[], Any]](), dict[str, float]()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with connect(f"local:{threads}", f"{name}/pieces", threads) as plain:
            pool = MeasuredWorkers(plain.client, plain.pieces)
            for kind, job in kinds.items():
                pooled, alone = Work(threads, cluster=pool), Work(threads)
                acts[f"{kind} by workers"] = partial(cpu_of, partial(job, pooled, folder), pool)
                acts[f"{kind} by threads"] = partial(cpu_of, partial(job, alone, folder), None)
                first[kind] = acts[f"{kind} by workers"]()["cpu_s"]
            acts["empty"] = partial(cpu_of, partial(by_pool, pool, nothing), pool)
            acts["idle"] = partial(cpu_of, partial(time.sleep, idle), pool)
            measured = run.interleaved(acts)
        measures = {kind: Stages.of(job, smaller[kind], folder) for kind, job in kinds.items()}
    wall, cpu = (
        Spread.of([figures[key] / empty for figures in measured["empty"]]) for key in ("wall_s", "cpu_s")
    )
    yield {"": "an empty task, CPU ms in all processes", "slice": 1e3 * cpu.median}
    yield {"": "its wall time in the scheduler and the client, ms", "slice": 1e3 * wall.median}
    ticks = measured.ratio("idle", "idle", "cpu_s", "wall_s").median / threads
    yield {"": "a worker without a task, CPU ms a second", "slice": 1e3 * ticks}
    yield {"": "CPU time beside tasks of 2 s, %", "slice": 100 * (ticks + cpu.median / 2)}
    by = {kind: measured[f"{kind} by workers"] for kind in kinds}
    ratios = {kind: measured.ratio(f"{kind} by workers", f"{kind} by threads", "cpu_s") for kind in kinds}
    yield {"": f"CPU time, {threads} workers / {threads} threads", **ratios}
    outside = {kind: Spread.of([1e3 * f["outside_s"] / f["tasks"] for f in of]) for kind, of in by.items()}
    yield {"": "a worker outside of its tasks, CPU ms a task", **outside}
    start = {kind: first[kind] - measured.spread(f"{kind} by workers", "cpu_s").median for kind in kinds}
    yield {"": "first job of new workers, CPU s more", **start}
    yield {"": "tasks", **{kind: sum(n for n, _ in of.stages) for kind, of in measures.items()}}
    yield {"": "a task, CPU s", **{kind: of.mean for kind, of in measures.items()}}
    yield {"": "serial for a task, CPU s", **{kind: of.serial for kind, of in measures.items()}}
    for count in workers:
        faster = {kind: of.faster(count, tasks, wall.median) for kind, of in measures.items()}
        yield {"": f"simulated: {count} workers, {tasks:,} tasks", **faster}
    if plot:
        draw(Path(plot), measures, tasks, wall.median)


def draw(path: Path, measures: dict[str, Stages], tasks: int, cost: float) -> None:
    """Speed against workers, for each kind of job."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 3.6), layout="constrained")
    axes, counts = figure.subplots(), [1, 2, 5, 10, 20, 50, 100, 200, 300, 500, 700, 1000]
    for kind, of in measures.items():
        faster = [of.faster(count, tasks, cost) for count in counts]
        label = f"{kind}: {tasks:,} tasks of {of.mean:.2g} s"
        axes.loglog(counts, faster, marker="o", markersize=3, label=label)
    axes.loglog(counts, counts, color="0.7", linewidth=0.8, label="ideal")
    axes.set(xlabel="workers (simulated)", ylabel="times faster than one")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.25)
    figure.savefig(path, dpi=100)
