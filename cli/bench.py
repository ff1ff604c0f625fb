"""fracslice bench: run time against error on this machine."""

from __future__ import annotations

from pathlib import Path

import click

from .execution import check_folder
from .options import POSITIVE, ClusterOptions, Name, Whole, command, option


class BenchOptions(ClusterOptions):
    """Options of `bench`."""

    output: str = option(
        Name("DIR"), "The report's folder; bench by default.", "-o", "--output", default="bench"
    )
    workloads: tuple[str, ...] = option(
        str,
        "A workload to mesh, all of them by default; repeatable.",
        "--workload",
        metavar="NAME",
        multiple=True,
    )
    resolutions: tuple[int, ...] = option(
        Whole(16, 2048),
        "Voxels along the cube; 64, 128 and 256 by default; repeatable.",
        "--resolution",
        multiple=True,
    )
    peers: tuple[str, ...] = option(
        str,
        "Another program to compare with; {workload}, {resolution} and {output} (a .ply file) are filled in.",
        "--peer",
        metavar="NAME=COMMAND",
        multiple=True,
    )
    repeat: int = option(Whole(1, 100), "Number of runs; their median counts; 3 by default.", default=3)
    limit: float = option(
        POSITIVE,
        "Skip finer resolutions of a method that takes longer; 60 by default.",
        metavar="SECONDS",
        default=60.0,
    )


@command(BenchOptions, short_help="Measure run time against error, beside other programs.")
def bench(given: BenchOptions) -> int:
    """Measure the run time and the error of each meshing method, and write a report with plots.

    Workloads: sphere, torus, menger3, menger4, mandelbulb, julia. A peer writes its mesh in scene units; its
    time is that of the whole command, unless the last line it prints is a JSON object with "wall_s" and
    "cpu_s". Needs matplotlib; without scikit-image, its method is left out.

    Examples
    --------
    fracslice bench -o bench --workload sphere --resolution 64
    """
    from fracslice.bench.measurements import BenchmarkTask, Peer, measure, require_plots, write_report

    require_plots()
    chosen = {"workloads": given.workloads, "resolutions": given.resolutions}
    chosen = {name: values for name, values in chosen.items() if values}
    peers = tuple(Peer.read(text) for text in given.peers)
    task = BenchmarkTask(**chosen, peers=peers, repeats=given.repeat, limit_s=given.limit)  # type: ignore[arg-type]
    folder = Path(given.output)
    check_folder(folder)
    with given.working() as work:
        rows = measure(task, work)
        folder.mkdir(exist_ok=True)
        paths = write_report(rows, folder)
    if not given.quiet:
        click.echo(f"{paths[0]}: {len(rows)} measurements")
        for one in rows:
            if one.failed:
                click.echo(f"{one.workload} {one.resolution}, {one.method}: {one.failed}", err=True)
    return 1 if any(one.failed for one in rows) else 0
