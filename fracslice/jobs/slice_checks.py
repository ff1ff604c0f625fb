"""Checks of layers in ranges, as tasks of a cluster; components are joined over the borders of ranges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..checks.layer_checks import LayerFindings, PrintReport, check_layers, findings_of
from ..checks.problems import Limits
from ..cluster import Contents, Files, Pool, Shard, pack_arrays, unpack_arrays
from ..errors import SharedError
from ..export.slice_run import RangeTask, SliceRun
from ..slicing.feature_graph import LayerComponents, Nodes, Runs
from ..work import Work

FORM = "checks"
"""Stands for the format in the key of checked layers."""


class CheckTask(RangeTask):
    """Layers `first` to `end` - 1 of a run, each examined by itself."""

    stage = "checked"

    def make(self, work: Work) -> Contents:
        """Components and widths of the layers; see `Task.make`."""
        run = self.planned(FORM)
        arrays: Files = {}
        for index, of in enumerate(findings_of(run.slicer_with(work), range(self.first, self.end))):
            arrays |= {f"{index}-{name}": array for name, array in _arrays(of)}
        return pack_arrays(**arrays)


def check_run(run: SliceRun, limits: Limits | None = None) -> PrintReport:
    """Check the layers of a run, by the pool of its work if there is one."""
    pool, printer = run.work.cluster, run.screen.printer
    if pool is None:
        return check_layers(run.stack, limits, printer, run.work)
    job = run.key(FORM)
    tasks = CheckTask.all(run, job)
    if isinstance(pool, Shard) and not pool.first:
        raise SharedError(f"{pool.share(tasks, run.work)} ranges are checked; shard 1 writes the report")
    report = check_layers(run.stack, limits, printer, run.work, _findings(pool, tasks, run))
    pool.finished(job)
    return report


def _findings(pool: Pool, tasks: list[CheckTask], run: SliceRun) -> Iterator[LayerFindings]:
    """Results of all layers, in order."""
    for task, data in zip(tasks, pool.results(tasks, run.work, "checking layers"), strict=True):
        files = unpack_arrays(data)
        for index in range(task.end - task.first):
            yield _read_layer_findings(files, f"{index}-", run.stack.shape[1])


def _arrays(of: LayerFindings) -> Iterator[tuple[str, np.ndarray]]:
    """Arrays of the results of a layer, by name."""
    for kind, components in (("solid", of.solid), ("empty", of.empty)):
        for part in (components.runs, components.nodes):
            yield from ((f"{kind}-{n}", v) for n, v in vars(part).items() if isinstance(v, np.ndarray))
        yield f"{kind}-label", components.label
    yield "area", np.array(of.area)
    for name, measured in (("walls", of.walls), ("gaps", of.gaps)):
        if measured is not None:
            yield name, measured
    yield from ((f"measured-{kind}", np.array(number)) for kind, number in of.measured.items())


def _read_layer_findings(files: Files, layer: str, width: int) -> LayerFindings:
    """Results of a layer from their arrays."""

    def components(kind: str) -> LayerComponents:
        def read(*names: str) -> dict[str, np.ndarray]:
            return {name: files[f"{layer}{kind}-{name}"] for name in names}

        runs = Runs(**read("rows", "begin", "end"), width=width)
        return LayerComponents(runs, **read("label"), nodes=Nodes(**read("area", "middle", "open")))

    walls, gaps = (files.get(f"{layer}{name}") for name in ("walls", "gaps"))
    start = f"{layer}measured-"
    measured = {name.removeprefix(start): float(n) for name, n in files.items() if name.startswith(start)}
    area = float(files[f"{layer}area"])
    return LayerFindings(components("solid"), components("empty"), area, walls, gaps, measured)
