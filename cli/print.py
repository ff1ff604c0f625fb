"""fracslice print: a filament printer's file, by the command line of a slicer."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.common.messages import duration, significant
from fracslice.errors import keeping

from .execution import check_targets, load_scene
from .options import MeshOptions, Name, argument, command, option, output

if TYPE_CHECKING:
    from fracslice.export.sending import Figures

TOLERANCE = 0.02
"""Default tolerance of the simplified mesh, mm."""

MOST = 1_000_000
"""Triangles above which slicers take very long."""


def slicer_printer(context: click.Context, _: click.Parameter, name: str | None) -> str | None:
    """Pass a printer's name on; "list" prints the names that the slicer has, and ends the command."""
    from fracslice.export.sending import SLICERS

    if name != "list":
        return name
    click.echo(os.linesep.join(SLICERS[context.params.get("slicer", "prusa")].shipped().printers))
    context.exit()


class SlicerOptions(MeshOptions):
    """Options of `print`."""

    without = frozenset({"bodies"})
    source: str = argument("SCENE|MODEL")
    output: str = output("OUT", "A .gcode file; .3mf for orca and bambu.")
    slicer: str = option(
        click.Choice(["prusa", "orca", "bambu", "cura"]),
        "PrusaSlicer, OrcaSlicer, Bambu Studio or CuraEngine; prusa by default.",
        default="prusa",
        is_eager=True,
    )
    profiles: tuple[str, ...] = option(
        Name("FILE"),
        "A profile of the slicer: .ini of PrusaSlicer, .json of the others (machine, process, filament). "
        "Repeatable.",
        "--profile",
        multiple=True,
    )
    machine: str | None = option(
        str,
        'A printer by the slicer\'s name, such as "Original Prusa MINI & MINI+", with the process and '
        'filament that the slicer has for it; "list" shows all.',
        "--printer",
        metavar="NAME",
        callback=slicer_printer,
        is_eager=True,
    )
    address: str | None = option(
        str, "Upload the file: prusalink://HOST. Nothing is started.", "--send", metavar="ADDRESS"
    )


@command(SlicerOptions, "print")
def print_(given: SlicerOptions) -> int:
    """Mesh SCENE, simplify the mesh within 0.02mm and have a slicer make the printer's file.

    The slicer's warnings are passed on, and the time, the weight and the cost that it says.
    Exit status: 1 if the mesh would not print; nothing is sliced.

    Examples
    --------
    fracslice print my.xml -o my.gcode --profile my.ini --size 8cm --voxel 0.25mm
    fracslice print my.xml -o my.gcode --printer "Original Prusa MINI & MINI+" --size 8cm
    """
    from fracslice.common.files import temporary_folder
    from fracslice.export.sending import SECONDS, SLICERS, printer_address, send
    from fracslice.jobs.mesh import make_mesh

    chosen, output, address = SLICERS[given.slicer], given.output, given.address
    if Path(output).suffix.lower() != chosen.output:
        raise click.UsageError(f"{output}: expected a file name that ends in {chosen.output}")
    check_targets(given.source, output)
    if missing := [profile for profile in given.profiles if not Path(profile).is_file()]:
        raise click.UsageError(f"{missing[0]}: no such file")
    if address is not None:
        printer_address(address)
    chosen.check(given.profiles)  # before the mesh, which may take minutes
    if given.machine is not None:
        with temporary_folder() as folder:
            chosen.shipped().write(given.machine, folder)
    scene = load_scene(given.source, given.settings)
    with given.working() as work:
        job = given.oriented(scene, work).mesh_job(scene)
    if job.simplify is None and job.faces is None:
        job = replace(job, simplify=TOLERANCE)
    with temporary_folder() as folder, given.working() as work:
        model = folder / f"{Path(output).stem}{chosen.model}"
        report = make_mesh(scene, job, work, path=model).report
        count = report.mesh.triangles
        if report.problems:
            click.echo(f"{given.source}: would not print: {', '.join(report.problems)}")
            return 1
        if not given.quiet:
            many = (
                f"; expected at most {MOST:,}: a larger --voxel or --simplify, or --faces"
                if count > MOST
                else ""
            )
            click.echo(f"{count:,} triangles: {chosen.title} takes about {duration(count * SECONDS)}{many}")
        own = chosen.shipped().write(given.machine, folder) if given.machine is not None else []
        profiles = [*map(str, own), *given.profiles]
        warnings, figures = chosen.slice(model, profiles, Path(output), work)
        with keeping(f"{output} is written"):
            sent = send(output, address, work) if address is not None else None
    for warning in warnings:
        click.echo(f"{chosen.title}: {warning}", err=True)
    if not given.quiet:
        made = ", ".join([f"{output}: made by {chosen.title}", *figure_texts(figures)])
        click.echo(os.linesep.join([made, *([sent] if sent else [])]))
    return 0


def figure_texts(figures: Figures) -> Iterator[str]:
    """Time, weight or length, and cost of a print."""
    if figures.seconds is not None:
        yield duration(figures.seconds)
    if figures.grams is not None:
        yield f"{significant(figures.grams)} g"
    elif figures.metres is not None:
        yield f"{significant(figures.metres)} m of filament"
    if figures.cost is not None:
        yield f"cost {figures.cost:.2f}"
