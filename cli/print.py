"""fracslice print: a filament printer's file, by the command line of a slicer."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from .closing import duration
from .inputs import check_targets, load_scene
from .options import NAME, job_of, job_options, output_option, print_options, run_options, source_argument
from .working import working

TOLERANCE = 0.02
"""Default tolerance of the simplified mesh, mm."""

MOST = 1_000_000
"""Triangles above which slicers take very long."""


@click.command("print")
@source_argument("SCENE")
@output_option("OUT", "A .gcode file; .3mf for orca and bambu.")
@click.option(
    "--slicer",
    type=click.Choice(["prusa", "orca", "bambu", "cura"]),
    default="prusa",
    help="PrusaSlicer, OrcaSlicer, Bambu Studio or CuraEngine; prusa by default.",
)
@click.option(
    "--profile",
    "profiles",
    type=NAME,
    multiple=True,
    metavar="FILE",
    help="A profile of the slicer: .ini of PrusaSlicer, .json of the others (machine, process, filament). "
    "Repeatable.",
)
@click.option(
    "--send", "address", metavar="ADDRESS", help="Upload the file: prusalink://HOST. Nothing is started."
)
@print_options
@job_options
@run_options
def print_(
    source: str,
    output: str,
    slicer: str,
    profiles: tuple[str, ...],
    address: str | None,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Mesh SCENE, simplify the mesh within 0.02mm and have a slicer make the printer's file.

    The slicer's warnings are passed on. Exit status: 1 if the mesh would not print; nothing is sliced.
    """
    import tempfile

    from fracslice.export.sending import printer_address, send
    from fracslice.export.slicers import SECONDS, SLICERS
    from fracslice.jobs.mesh import make_mesh

    chosen = SLICERS[slicer]
    if Path(output).suffix.lower() != chosen.output:
        raise click.UsageError(f"{output}: expected a file name that ends in {chosen.output}")
    check_targets(source, output)
    if missing := [profile for profile in profiles if not Path(profile).is_file()]:
        raise click.UsageError(f"{missing[0]}: no such file")
    if address is not None:
        printer_address(address)
    chosen.check(profiles)  # before the mesh, which may take minutes
    scene = load_scene(source, settings)
    job = job_of(scene, **{**options, "simplify": options["simplify"] or TOLERANCE})
    with tempfile.TemporaryDirectory(prefix="fracslice-") as folder, working(threads, quiet) as work:
        model = Path(folder) / f"{Path(output).stem}{chosen.model}"
        report = make_mesh(scene, job, work, path=model).report
        count = report.mesh.triangles
        if report.problems:
            click.echo(f"{source}: would not print: {', '.join(report.problems)}")
            return 1
        if not quiet:
            many = f"; expected at most {MOST:,}: a larger --voxel or --simplify" if count > MOST else ""
            click.echo(f"{count:,} triangles: {chosen.title} takes about {duration(count * SECONDS)}{many}")
        warnings = chosen.slice(model, profiles, Path(output), work)
        sent = send(output, address, work) if address is not None else None
    for warning in warnings:
        click.echo(f"{chosen.title}: {warning}", err=True)
    if not quiet:
        click.echo(os.linesep.join([f"{output}: made by {chosen.title}", *([sent] if sent else [])]))
    return 0
