"""fracslice mesh: a scene becomes a file to print."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .inputs import load_scene
from .options import job_of, job_options, quiet_option, set_option, threads_option
from .summary import summary
from .working import working

if TYPE_CHECKING:
    from fracslice.job import Result

GRID = ".vdb"


@click.command()
@click.argument("source", metavar="SCENE")
@click.option(
    "-o", "--output", required=True, metavar="FILE", help="An .stl, .3mf, .ply, .obj, .glb or .vdb file."
)
@job_options
@set_option
@click.option("--report", metavar="FILE.json", help="Write the numbers that prove what was made.")
@click.option("--picture", metavar="FILE.png", help="Write a shaded picture of the mesh.")
@threads_option
@quiet_option
def mesh(
    source: str,
    output: str,
    settings: tuple[str, ...],
    report: str | None,
    picture: str | None,
    threads: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Make a printable mesh of SCENE, and say what it is.

    Exits with 1 if the mesh has defects that a slicer would stumble over; it is written all the same.
    """
    from fracslice.job import make_mesh

    check_outputs(output, report, picture)
    scene = load_scene(source, settings)
    with working(threads, quiet) as work:
        result = make_mesh(scene, job_of(**options), work)
        work.check()
        for path in written(result, output, report, picture):
            work.progress(f"wrote {path.name}", 1.0)
    if not quiet:
        click.echo(summary(output, result.report))
    return 1 if result.report.problems else 0


def check_outputs(output: str, report: str | None, picture: str | None) -> None:
    """Refuses files that could not be written before any work is done."""
    from fracslice.export import check_format, check_target

    for path, ending in ((report, ".json"), (picture, ".png")):
        if path is not None and Path(path).suffix.lower() != ending:
            raise click.UsageError(f"{path}: expected a file name that ends in {ending}")
    if Path(output).suffix.lower() != GRID:
        check_format(output)
    for target in (output, report, picture):
        if target is not None:
            check_target(target)


def write_grid(result: Result, path: str) -> Path:
    """Writes the samples, in mm, as an OpenVDB file."""
    from fracslice.export import replacing
    from fracslice.volume.grid import write_vdb

    with tempfile.TemporaryDirectory(prefix="fracslice-") as folder, replacing(path) as file:
        whole = Path(folder) / f"grid{GRID}"
        write_vdb(result.bricks_mm, whole, metadata(result))
        with whole.open("rb") as grid:
            shutil.copyfileobj(grid, file)
    return Path(path)


def metadata(result: Result) -> dict[str, str]:
    """What files are told about themselves."""
    return {"Title": result.report.scene, "scene_hash": result.report.scene_hash}


def written(result: Result, output: str, report: str | None, picture: str | None) -> Iterator[Path]:
    """Writes the files that are wanted, one after the other."""
    if Path(output).suffix.lower() == GRID:
        yield write_grid(result, output)
    else:
        from fracslice.export import write

        yield write(result.mesh, output, metadata(result))
    if report is not None:
        from fracslice.export import replacing

        with replacing(report) as file:
            file.write((json.dumps(result.report.as_dict(), indent=2) + "\n").encode())
        yield Path(report)
    if picture is not None:
        from fracslice.viewer import picture as draw

        yield draw(result.mesh, picture)
