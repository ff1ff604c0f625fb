"""fracslice mesh: a printable mesh of a scene."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .closing import DENSITIES, of_mesh
from .cluster import cluster_options, pooled
from .families import MOST, families, going_on, suffixed
from .inputs import check_folder, check_targets, load_scene, refuse_options
from .options import (
    NAME,
    job_of,
    job_options,
    moment,
    output_option,
    price_option,
    print_options,
    quiet_option,
    set_option,
    source_argument,
    threads_option,
)
from .summary import summary
from .working import working

if TYPE_CHECKING:
    from fracslice.jobs.mesh_result import MeshResult
    from fracslice.jobs.report import Report
    from fracslice.meshjob import MeshJob
    from fracslice.scene import Scene
    from fracslice.store import Store
    from fracslice.work import Work

GRID = ".vdb"
COLOURS = ("material", "point", "axes", "planes", "sphere", "steps", "direction")


@click.command()
@source_argument("SCENE")
@output_option(
    "FILE",
    "An .stl, .3mf, .ply, .obj or .glb file; or .vdb, for the samples of the field.",
)
@print_options
@job_options
@set_option
@click.option(
    "--time",
    "seconds",
    callback=moment,
    metavar="TIME",
    help="Mesh the scene of this time of its <animation>, such as 2.5s.",
)
@click.option(
    "--every",
    callback=moment,
    metavar="TIME",
    help="Mesh the scene every so often, such as 0.5s, from the begin to the end of its <animation>.",
)
@click.option("--report", type=NAME, metavar="FILE.json", help="Write the figures that prove the mesh.")
@click.option("--picture", type=NAME, metavar="FILE.png", help="Write a shaded picture of the mesh.")
@click.option(
    "--implicit",
    is_flag=True,
    help="Write the formula instead of triangles: an .3mf file for programs with the implicit extension.",
)
@click.option(
    "--cache",
    type=NAME,
    metavar="FOLDER",
    help="Keep samples and surface in this folder, for further jobs of the same scene and voxel.",
)
@click.option(
    "--device",
    type=click.Choice(["cpu", "cuda", "auto"]),
    default="cpu",
    help="The device that evaluates the field; cpu by default. auto: the GPU, if there is one.",
)
@click.option(
    "--colour",
    type=click.Choice(COLOURS),
    help="Colour the vertices of a .ply, .glb or .3mf file: as the scene's materials, or by a property of "
    "the orbit. PLY and GLB hold the property itself, too.",
)
@cluster_options
@click.option(
    "--material",
    type=click.Choice(list(DENSITIES)),
    default="resin",
    help="Material of the weight in the summary; resin by default.",
)
@price_option("kilogram")
@threads_option
@quiet_option
@click.pass_context
@families("output", "report", "picture")
def mesh(
    context: click.Context,
    /,
    source: str,
    output: str,
    settings: tuple[str, ...],
    seconds: float | None,
    every: float | None,
    report: str | None,
    picture: str | None,
    implicit: bool,
    cache: str | None,
    device: str,
    colour: str | None,
    cluster: str | None,
    shard: str | None,
    store: str | None,
    material: str,
    price: float | None,
    threads: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Make a printable mesh of SCENE, and print a summary.

    Exit status: 1 if the mesh would not print; the file is written. A mesh
    that does not fit in memory is made piece after piece if it goes to an .stl file.
    """
    from fracslice.kernel.devices import chosen
    from fracslice.work import Work

    check_outputs(source, output, report, picture)
    if Path(output).suffix.lower() == GRID:
        names = {"chord", "simplify", "colour", "cluster", "shard", "store"}
        refuse_options(context, names, "only for meshes, and a .vdb file holds samples")
    if implicit:
        refuse_what_needs_triangles(context, output)
    scenes = moments(load_scene(source, settings), seconds, every)
    how = Work(threads, store=store_in(cache), device=chosen(device))
    problems = False
    with (
        pooled(output, threads, cluster, shard, store) as pool,
        working(replace(how, cluster=pool), quiet) as work,
    ):
        for suffix, scene in scenes:
            file, *others = (path and suffixed(path, suffix) for path in (output, picture, report))
            with going_on(str(file)):
                if implicit:
                    write_formula(scene, job_of(scene, **options), str(file), work, quiet)
                    continue
                job = replace(job_of(scene, **options), colour=colour)
                result = made(scene, job, str(file), others[0], work)
                if others[1] is not None:
                    write_report(result.report, others[1])
                if not quiet:
                    click.echo(summary(str(file), result.report))
                    click.echo(os.linesep.join(of_mesh(result, material, price).lines()))
                problems |= bool(result.report.problems)
    return 1 if problems else 0


def moments(scene: Scene, seconds: float | None, every: float | None) -> list[tuple[str, Scene]]:
    """Scenes of --time and --every, and what their file names end in."""
    if seconds is None and every is None:
        return [("", scene)]
    from fracslice.animation import Timeline

    timeline = Timeline(scene)
    if every is None:
        return [("", timeline.at(seconds or 0.0))]
    if seconds is not None or not every:
        raise click.UsageError("--every: expected a time above zero, and no --time")
    count = int(timeline.animation.duration / every + 1e-9) + 1
    if count > MOST:
        raise click.UsageError(f"--every: expected at most {MOST} outputs, and this makes {count}")
    times = [float(f"{k * every:.6g}") for k in range(count)]
    return [(f"-{time:g}s", timeline.at(time)) for time in times]


def refuse_what_needs_triangles(context: click.Context, output: str) -> None:
    """Raise a usage error for a file other than .3mf, or an option without effect on a formula."""
    if Path(output).suffix.lower() != ".3mf":
        raise click.UsageError(f"{output}: expected a file name that ends in .3mf, for --implicit")
    names = {"chord", "simplify", "colour", "dust", "report", "picture", "cache", "device", "material"}
    refuse_options(
        context, names | {"price", "cluster", "shard", "store"}, "only for meshes, and --implicit makes none"
    )


def write_formula(scene: Scene, job: MeshJob, output: str, work: Work, quiet: bool) -> None:
    """Write the formula of a scene, and print its size."""
    from fracslice.jobs.implicit import make_implicit

    made = make_implicit(scene, job, output, work)
    for note in made.notes:
        click.echo(note, err=True)
    if not quiet:
        size = " x ".join(f"{side:.2f}" for side in made.box.size)
        kilobytes = made.path.stat().st_size / 1e3
        click.echo(f"{output}: a formula of {made.operations} operations, {kilobytes:.1f} kB, {size} mm")


def store_in(folder: str | None) -> Store | None:
    """Store of finished work in a folder; None without a folder."""
    from fracslice.store import Store

    if folder is None:
        return None
    if Path(folder).exists():
        check_folder(Path(folder))
    return Store(Path(folder))


def made(scene: Scene, job: MeshJob, output: str, picture: str | None, work: Work) -> MeshResult:
    """Make the mesh and write it, or its samples, and the picture."""
    from fracslice.export import write
    from fracslice.jobs.mesh import make_mesh
    from fracslice.jobs.mesh_writing import metadata

    if picture is None and Path(output).suffix.lower() != GRID:
        return make_mesh(scene, job, work, path=output)
    result = make_mesh(scene, job, work)
    work.check()
    if Path(output).suffix.lower() == GRID:
        write_grid(result, output, metadata(scene))
    else:
        write(result.mesh, output, metadata(scene))
    if picture is not None:
        from fracslice.viewer import picture as draw

        draw(result.mesh, picture)
    return result


def check_outputs(source: str, output: str, report: str | None, picture: str | None) -> None:
    """Check before any work is done that the output files can be written."""
    from fracslice.export import FORMATS

    for path, ending in ((report, ".json"), (picture, ".png")):
        if path is not None and Path(path).suffix.lower() != ending:
            raise click.UsageError(f"{path}: expected a file name that ends in {ending}")
    if Path(output).suffix.lower() not in (*FORMATS, GRID):
        raise click.UsageError(f"{output}: unknown kind of file; known are {', '.join([*FORMATS, GRID])}")
    check_targets(source, output, report, picture)
    if picture is not None:
        from fracslice.viewer import need_pyvista

        need_pyvista()


def write_grid(result: MeshResult, path: str, about: dict[str, str]) -> None:
    """Write the samples, in mm, as an OpenVDB file."""
    import shutil
    import tempfile

    from fracslice.export import replacing
    from fracslice.volume.grid import write_vdb

    with tempfile.TemporaryDirectory(prefix="fracslice-") as folder, replacing(path) as file:
        whole = Path(folder) / f"grid{GRID}"
        write_vdb(result.bricks_mm, whole, about)
        with whole.open("rb") as grid:
            shutil.copyfileobj(grid, file)


def write_report(report: Report, path: str) -> None:
    """Write the report as JSON."""
    import json

    from fracslice.export import replacing

    with replacing(path) as file:
        file.write((json.dumps(report.as_dict(), indent=2) + "\n").encode())
