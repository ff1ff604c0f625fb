"""fracslice bench: run time against error on this machine."""

from __future__ import annotations

from pathlib import Path

import click

from .cluster import cluster_options, pooled
from .inputs import check_folder
from .options import NAME, Positive, Whole, quiet_option, threads_option
from .working import working


@click.command(short_help="Measure run time against error, beside other programs.")
@click.option(
    "-o",
    "--output",
    type=NAME,
    default="bench",
    metavar="DIR",
    help="The report's folder; bench by default.",
)
@click.option(
    "--workload",
    "workloads",
    multiple=True,
    metavar="NAME",
    help="A workload to mesh, all of them by default; repeatable.",
)
@click.option(
    "--resolution",
    "resolutions",
    type=Whole(16, 2048),
    multiple=True,
    metavar="N",
    help="Voxels along the cube; 64, 128 and 256 by default; repeatable.",
)
@click.option(
    "--peer",
    "peers",
    multiple=True,
    metavar="NAME=COMMAND",
    help="Another program to run beside; {workload}, {resolution} and {output} (a .ply file) are filled in.",
)
@click.option(
    "--repeat",
    type=Whole(1, 100),
    default=3,
    metavar="N",
    help="Number of runs, of which the median counts; 3 by default.",
)
@click.option(
    "--limit",
    type=Positive(),
    default=60.0,
    metavar="SECONDS",
    help="Skip finer resolutions of what takes longer; 60 by default.",
)
@cluster_options
@threads_option
@quiet_option
def bench(
    output: str,
    workloads: tuple[str, ...],
    resolutions: tuple[int, ...],
    peers: tuple[str, ...],
    repeat: int,
    limit: float,
    cluster: str | None,
    shard: str | None,
    store: str | None,
    threads: int,
    quiet: bool,
) -> int:
    """Measure run time against error of each way to a mesh, and write a report with plots.

    Workloads: sphere, torus, menger3, menger4, mandelbulb, julia. A peer writes its mesh in scene units; its
    time is that of the whole command, unless the last line it prints is a JSON object with "wall_s" and
    "cpu_s". Needs matplotlib; what scikit-image makes is left out without it.
    """
    from fracslice.bench.peers import Peer
    from fracslice.bench.report import require_plots, write_report
    from fracslice.bench.runs import BenchmarkTask, measure
    from fracslice.work import Work

    require_plots()
    chosen = {"workloads": workloads, "resolutions": resolutions}
    given = {name: values for name, values in chosen.items() if values}
    others = tuple(Peer.read(text) for text in peers)
    task = BenchmarkTask(**given, peers=others, repeats=repeat, limit_s=limit)  # type: ignore[arg-type]
    folder = Path(output)
    check_folder(folder)
    with (
        pooled(output, threads, cluster, shard, store) as pool,
        working(Work(threads, cluster=pool), quiet) as work,
    ):
        rows = measure(task, work)
        folder.mkdir(exist_ok=True)
        paths = write_report(rows, folder)
    if not quiet:
        click.echo(f"{paths[0]}: {len(rows)} measurements")
        for one in rows:
            if one.failed:
                click.echo(f"{one.workload} {one.resolution}, {one.method}: {one.failed}", err=True)
    return 1 if any(one.failed for one in rows) else 0
