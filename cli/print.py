"""fracslice print: a filament printer's file, by the command line of a slicer."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from fracslice.common.messages import duration, significant
from fracslice.errors import keeping
from fracslice.records import MeshJob, PartsJob

from .execution import check_targets, load_scene, refuse_options
from .options import FOR_SLICERS, HINTS, MeshOptions, Name, argument, command, option, output
from .slice import COPIES, SPACING
from .sweeps import with_suffix

if TYPE_CHECKING:
    from fracslice.export.sending import Figures, FilamentSlicer
    from fracslice.fields.box import Triple
    from fracslice.scene import Scene
    from fracslice.work import Work

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

    records = (PartsJob,)
    without = frozenset({"bodies", "plugs", "support_body"})
    bed: Triple | None
    parts: tuple[int, int, int] | str | None
    copies: int = COPIES
    spacing: float = SPACING
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
    """Mesh SCENE, simplify the mesh within 0.02mm and have a slicer make the printer's file. With --bed or
    --parts, make it in parts, and a file for each bed.

    The slicer's warnings are passed on, and the time, the weight and the cost that it says.
    Exit status: 1 if the mesh would not print; nothing is sliced.

    Examples
    --------
    fracslice print my.xml -o my.gcode --profile my.ini --size 8cm --voxel 0.25mm
    fracslice print my.xml -o my.gcode --printer "Original Prusa MINI & MINI+" --size 8cm
    """
    from fracslice.common.files import temporary_folder
    from fracslice.export.sending import SLICERS, printer_address, send

    chosen, output, address = SLICERS[given.slicer], given.output, given.address
    if Path(output).suffix.lower() != chosen.output:
        raise click.UsageError(f"{output}: expected a file name that ends in {chosen.output}")
    check_targets(given.source, output)
    refuse_what_one_has(given)
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
        made = models(given, scene, job, folder / f"{Path(output).stem}{chosen.model}", work)
        if made.problems:
            click.echo(f"{given.source}: would not print: {', '.join(made.problems)}")
            return 1
        if not given.quiet:
            click.echo(expected_time(made.triangles, chosen.title))
        own = chosen.shipped().write(given.machine, folder) if given.machine is not None else []
        profiles = [*map(str, own), *given.profiles]
        sliced = slice_all(chosen, made.files, profiles, outputs(output, len(made.files)), work)
        with keeping(f"{output} is written"):
            sent = send(output, address, work) if address is not None else None
    for warning in dict.fromkeys(warning for _, warnings, _ in sliced for warning in warnings):
        click.echo(f"{chosen.title}: {warning}", err=True)
    if not given.quiet:
        made_by = f"made by {chosen.title}"
        lines = [", ".join([f"{file}: {made_by}", *figure_texts(figures)]) for file, _, figures in sliced]
        click.echo(os.linesep.join([*lines, *([sent] if sent else [])]))
    return 0


def refuse_what_one_has(given: SlicerOptions) -> None:
    """Raise a usage error for options that copies or parts do not have."""
    several = given.bed is not None or given.parts is not None
    if given.copies > 1 and several:
        raise click.UsageError("--copies: not with parts, --bed or --parts")
    if given.copies == 1:
        refuse_options({"spacing"}, "only for --copies")
    if given.copies > 1:
        refuse_options(FOR_SLICERS, "not for copies")
    if several:
        refuse_options(HINTS, "not for parts")
    if several and given.address is not None:
        raise click.UsageError("--send: expected one file, and parts may have several")


class Models(NamedTuple):
    """What the slicer reads: a file for each bed."""

    files: list[Path]
    triangles: int
    problems: list[str]


def models(given: SlicerOptions, scene: Scene, job: MeshJob, path: Path, work: Work) -> Models:
    """Write the model, several of them, or its parts; several beds have a file each."""
    from fracslice.jobs.divided import make_parts
    from fracslice.jobs.mesh import make_mesh, metadata
    from fracslice.jobs.plates import lay_out
    from fracslice.slicing.packing import Beds

    if given.bed is not None or given.parts is not None:
        parts = make_parts(scene, job, PartsJob(**given.values(PartsJob)), work, path)
        laid, made, names = parts.laid_out, parts.meshes, [name for name, _, _ in parts.named]
    elif given.copies > 1:
        one = make_mesh(scene, job, work)
        made, names = [one], [scene.name]
        laid = lay_out([one.mesh], [0] * given.copies, names * given.copies, Beds(spacing=given.spacing))
    else:
        report = make_mesh(scene, job, work, path=path).report
        return Models([path], report.mesh.triangles, list(report.problems))
    files = outputs(str(path), laid.beds)
    for bed, file in enumerate(files):
        laid.on_bed(bed).write(file, metadata(scene), work, names)
    problems = dict.fromkeys(problem for mesh in made for problem in mesh.report.problems)
    count = sum(len(laid.meshes[item.mesh].triangles) for item in laid.items)
    return Models(files, count, list(problems))


def outputs(path: str, count: int) -> list[Path]:
    """Files of several beds: part-1.gcode, part-2.gcode, ...; of one, the file itself."""
    if count == 1:
        return [Path(path)]
    return [Path(with_suffix(path, f"-{bed}")) for bed in range(1, count + 1)]


def slice_all(
    chosen: FilamentSlicer, models: Sequence[Path], profiles: Sequence[str], files: Sequence[Path], work: Work
) -> list[tuple[Path, list[str], Figures]]:
    """Slice models, and write all files once all are made: each with its warnings, and what it says."""
    from fracslice.common.files import check_target, temporary_folder

    with temporary_folder(check_target(files[0]).parent) as folder:
        made = [
            (file, *chosen.slice(model, profiles, folder / file.name, work))
            for model, file in zip(models, files, strict=True)
        ]
        for file in files:
            os.replace(folder / file.name, check_target(file))
    return made


def expected_time(triangles: int, title: str) -> str:
    """Line on the time that the slicer takes."""
    from fracslice.export.sending import SECONDS

    line = f"{triangles:,} triangles: {title} takes about {duration(triangles * SECONDS)}"
    if triangles > MOST:
        line += f"; expected at most {MOST:,}: a larger --voxel or --simplify, or --faces"
    return line


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
