"""fracslice mesh: a printable mesh of a scene."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from fracslice.common.messages import decimal, format_count
from fracslice.common.parameters import alternatives
from fracslice.formats import ENDINGS
from fracslice.records import PartsJob

from .execution import (
    BadInput,
    check_folder,
    check_targets,
    figures,
    load_scene,
    of_mesh,
    refuse_moved,
    refuse_options,
    summary,
    total,
)
from .options import (
    AMOUNT,
    FOR_SLICERS,
    HINTS,
    INTERVAL,
    MATERIAL,
    SECONDS,
    ClusterOptions,
    MeshOptions,
    Name,
    argument,
    command,
    flag,
    option,
    output,
)
from .plate import write_meshes
from .slice import COPIES, SPACING
from .sweeps import MOST, TABLE, families, going_on, is_table, with_suffix

if TYPE_CHECKING:
    from fracslice.fields.box import Triple
    from fracslice.jobs.divided import Parted
    from fracslice.jobs.report import Report, Result
    from fracslice.scene import Scene
    from fracslice.store import Store
    from fracslice.work import Work

GRID = ".vdb"

Parts: TypeAlias = "Iterable[tuple[str, Scene]]"


class MeshFileOptions(ClusterOptions, MeshOptions):
    """Options of `mesh`."""

    without = frozenset()

    source: str = argument("SCENE|MODEL")
    output: str = output("FILE", f"A file of {alternatives(*ENDINGS)}; or .vdb, for distances on a grid.")
    seconds: float | None = option(
        SECONDS, "Mesh the scene at this time of its <animation>, such as 2.5s.", "--time"
    )
    every: float | None = option(
        INTERVAL,
        "Mesh the scene at this interval, such as 0.5s, from the start to the end of its <animation>.",
    )
    report: str | None = option(
        Name("FILE.json", ".json", TABLE),
        "Write the figures and the accuracy of the mesh; to a .csv file, as a row for each mesh.",
    )
    picture: str | None = option(Name("FILE.png", ".png"), "Write a shaded picture of the mesh.")
    implicit: bool = flag(
        "Write the formula instead of triangles: an .3mf file for programs with the implicit extension."
    )
    cache: str | None = option(
        Name("FOLDER"),
        "Keep samples and surface in this folder, for further jobs of the same scene and voxel.",
    )
    device: str = option(
        click.Choice(["cpu", "cuda", "auto"]),
        "The device that evaluates the field; cpu by default. auto: the GPU, if there is one.",
        default="cpu",
    )
    material: str = MATERIAL
    price: float | None = option(AMOUNT, "Price of a kilogram.")


class WholeOptions(MeshFileOptions):
    """Options of `mesh`."""

    records = (PartsJob,)
    bed: Triple | None
    parts: tuple[int, int, int] | str | None
    plugs: bool
    support_body: bool
    copies: int = COPIES
    spacing: float = SPACING


@command(WholeOptions)
@families("output", "report", "picture")
def mesh(given: WholeOptions) -> int:
    """Make a printable mesh of SCENE, and print a summary. With --bed or --parts, make it in parts; with
    --copies, put several side by side.

    Exit status: 1 if the mesh would not print; the file is written. A mesh
    that does not fit in memory is made piece after piece if it goes to an .stl file.

    Examples
    --------
    fracslice mesh mandelbulb -o bulb.stl --size 8cm --voxel 0.25mm
    fracslice mesh geode -o geode.3mf --thickness 0.8mm --bridge 1.5mm
    fracslice mesh menger-sponge -o sponge.stl --set menger.level=1..3
    """
    if given.copies > 1:
        from fracslice.slicing.packing import Beds

        refuse_options(NO_COPIES, "not with --copies")
        return write_meshes(given, [given.source] * given.copies, Beds(spacing=given.spacing))
    refuse_options({"spacing"}, "only for several parts: --copies, or fracslice plate")
    if given.plugs:
        return make_plugged(given)
    if given.support_body:
        return make_apart(given)
    return make_files(given) if given.bed is None and given.parts is None else make_parted(given)


NO_PARTS = HINTS | {"implicit", "report", "seconds", "every", "cluster", "shard", "store"}
"""Options that parts do not have."""

NO_PLUGS = NO_PARTS | FOR_SLICERS | {"picture", "cache", "device"}
"""Options that plugs and bodies of supports do not have."""

NO_COPIES = NO_PLUGS | PartsJob.kinds().keys()
"""Options that copies do not have."""


def make_plugged(given: WholeOptions) -> int:
    """Make the mesh of an object and plugs for its drain holes: in one .3mf file, or each in its own."""
    from fracslice.jobs.mesh import make_mesh, make_plugs, metadata
    from fracslice.jobs.plates import lay_out, write_each
    from fracslice.slicing.packing import Beds

    how, output = PartsJob(**given.values(PartsJob)), Path(given.output)
    refuse_options(NO_PLUGS, "not with --plugs")
    check_targets(given.source, given.output)
    scene = load_scene(given.source, given.settings)
    about = metadata(scene)
    with given.working() as work:
        made = make_mesh(scene, given.oriented(scene, work).mesh_job(scene), work)
        plugs = make_plugs(scene, made, how.clearance, work)
        meshes, names = [made.mesh, *plugs], ["", *(f"plug-{n}" for n in range(1, len(plugs) + 1))]
        if output.suffix.lower() == ".3mf":
            lay_out(meshes, range(len(names)), names, Beds()).write(output, about, work, names)
        else:
            write_each(meshes, names, output, about, work)
    if not given.quiet:
        count = format_count(len(plugs), "plug")
        sizes = ", ".join(f"{mesh.size[0]:.2f} x {mesh.size[2]:.2f} mm" for mesh in plugs)
        lines = [summary(given.output, made.report), *of_mesh(made, given.material, given.price).lines()]
        click.echo(os.linesep.join([*lines, f"{count}, wide and high: {sizes}"]))
    return 1 if made.report.problems else 0


NAMES = "object", "supports"
"""Bodies of a supported object."""


def make_apart(given: WholeOptions) -> int:
    """Make the mesh of an object and that of its supports: bodies of one .3mf file, or each in its own."""
    from fracslice.jobs import mesh as jobs
    from fracslice.jobs.plates import write_bodies

    PartsJob(**given.values(PartsJob))
    refuse_options(NO_PLUGS, "not with --support-body")
    check_targets(given.source, given.output)
    scene = load_scene(given.source, given.settings)
    with given.working() as work:
        made = jobs.make_apart(scene, given.oriented(scene, work).mesh_job(scene), work)
        files = write_bodies(made, NAMES, Path(given.output), jobs.metadata(scene), work)
    if not given.quiet:
        titles = [str(file) for file in files] if len(files) > 1 else [f"{files[0]}, {n}" for n in NAMES]
        for title, one in zip(titles, made, strict=True):
            click.echo(summary(title, one.report))
    return 1 if made[0].report.problems else 0


def make_parted(given: WholeOptions) -> int:
    """Make the meshes of an object in parts, and one file or several."""
    from fracslice.fields.devices import choose_device
    from fracslice.jobs.divided import make_parts, write_parts
    from fracslice.jobs.mesh import metadata

    refuse_options(NO_PARTS, "not for an object in parts")
    how = PartsJob(**given.values(PartsJob))
    check_targets(given.source, given.output, given.picture)
    if given.picture is not None:
        from fracslice.viewer import need_pyvista

        need_pyvista()
    scene = load_scene(given.source, given.settings)
    with given.working(store=store_in(given.cache), device=choose_device(given.device)) as work:
        made = make_parts(scene, given.mesh_job(scene), how, work, given.output)
        files = write_parts(made, given.output, metadata(scene), work)
        if given.picture is not None:
            from fracslice.viewer import picture as draw

            draw(made.exploded(), given.picture)
    if not given.quiet:
        closing = [
            of_mesh(m, given.material, given.price) for _, m, count in made.named for _ in range(count)
        ]
        click.echo(os.linesep.join([*parted_lines(made, [str(file) for file in files]), total(closing)]))
    return 1 if any(mesh.report.problems for mesh in made.meshes) else 0


def parted_lines(made: Parted, files: list[str]) -> Iterator[str]:
    """Lines on the parts of an object."""
    divided, named = made.divided, made.named
    for index, (name, mesh, count) in enumerate(named):
        title = files[index] if len(files) == len(named) else f"{files[0]}, part {name}"
        copies = f", {count} times" if count > 1 else ""
        yield f"{title}: {figures(mesh.report.mesh, mesh.report.problems)}{copies}"
        yield from mesh.report.notes
    if divided.pegs:
        size = f"{divided.diameter:g} mm thick, {divided.length:g} mm long"
        yield f"{format_count(len(divided.pegs), 'peg')}, {size}"
    if divided.bare:
        yield f"{format_count(divided.bare, 'joint')} without a place for a peg: glue, or other --parts"
    if silent := [str(n) for n, part in enumerate(divided.parts, 1) if part.number is None]:
        yield f"no place for the number of part {', '.join(silent)}"
    if made.bed is not None and len(files) == 1:
        yield format_count(made.laid_out.beds, "bed")


def whole(scene: Scene, _: Work) -> Parts:
    """The scene as it is, of which one mesh is made."""
    return [("", scene)]


def make_files(given: MeshFileOptions, parts: Callable[[Scene, Work], Parts] = whole) -> int:
    """Make meshes of a scene; `parts`: what they are made of, and what the names of their files end in."""
    from fracslice.fields.devices import choose_device

    check_outputs(given)
    if Path(given.output).suffix.lower() == GRID:
        names = {"chord", "simplify", "faces", *FOR_SLICERS, "cluster", "shard", "store"}
        refuse_options(names, "only for meshes, and a .vdb file holds distances on a grid")
    if given.implicit:
        refuse_what_needs_triangles(given.output)
    scene = load_scene(given.source, given.settings)
    if given.seconds is not None or given.every is not None:
        refuse_moved(scene, given.settings)
    scenes = moments(scene, given.seconds, given.every)
    problems = False
    with given.working(store=store_in(given.cache), device=choose_device(given.device)) as work:
        given = given.oriented(scene, work)
        for suffix, scene in [(s + end, part) for s, whole in scenes for end, part in parts(whole, work)]:
            files = {name: vars(given)[name] for name in ("output", "report", "picture")}
            own = given.but(**{name: file and with_suffix(file, suffix) for name, file in files.items()})
            with going_on(own.output):
                problems |= (write_formula if given.implicit else write_mesh)(scene, own, work)
    return 1 if problems else 0


def write_mesh(scene: Scene, given: MeshFileOptions, work: Work) -> bool:
    """Make the mesh, the report and the picture; True if the mesh would not print."""
    result = make_and_write(scene, given, work)
    if given.report is not None:
        if is_table(given.report):
            write_row(given.report, given.output, given.settings, result.report)
        else:
            write_report(result.report, given.report)
    if not given.quiet:
        click.echo(summary(given.output, result.report))
        click.echo(os.linesep.join(of_mesh(result, given.material, given.price).lines()))
    return bool(result.report.problems)


def moments(scene: Scene, seconds: float | None, every: float | None) -> list[tuple[str, Scene]]:
    """Scenes of --time and --every, and what their file names end in."""
    if seconds is None and every is None:
        return [("", scene)]
    from fracslice.animation import Timeline

    timeline = Timeline(scene)
    if every is None:
        return [("", timeline.at(seconds or 0.0))]
    if seconds is not None:
        raise click.UsageError("--time and --every: expected one of them")
    count = int(timeline.animation.duration / every + 1e-9) + 1
    if count > MOST:
        raise click.UsageError(f"--every: expected at most {MOST} outputs, and this makes {count}")
    times = [float(f"{k * every:.6g}") for k in range(count)]
    return [(f"-{time:g}s", timeline.at(time)) for time in times]


def refuse_what_needs_triangles(output: str) -> None:
    """Raise a usage error for a file other than .3mf, or an option without effect on a formula."""
    if Path(output).suffix.lower() != ".3mf":
        raise click.UsageError(f"{output}: expected a file name that ends in .3mf, for --implicit")
    names = {
        "chord",
        "simplify",
        "faces",
        *FOR_SLICERS,
        "dust",
        "report",
        "picture",
        "cache",
        "device",
        "material",
    }
    names |= {"price", "proved", "cluster", "shard", "store"}
    refuse_options(names, "only for meshes, and --implicit makes none")


def write_formula(scene: Scene, given: MeshFileOptions, work: Work) -> bool:
    """Write the formula of a scene, and print its size. A formula has no problems."""
    from fracslice.jobs.mesh import make_implicit

    made = make_implicit(scene, given.mesh_job(scene), given.output, work)
    for note in made.notes:
        click.echo(note, err=True)
    if not given.quiet:
        size = " x ".join(map(decimal, made.box.size))
        kilobytes = made.path.stat().st_size / 1e3
        click.echo(
            f"{given.output}: a formula of {made.operations} operations, {kilobytes:.1f} kB, {size} mm"
        )
    return False


def store_in(folder: str | None) -> Store | None:
    """Store of finished work in a folder; None without a folder."""
    from fracslice.store import Store

    if folder is None:
        return None
    if Path(folder).exists():
        check_folder(Path(folder))
    return Store(Path(folder))


def make_and_write(scene: Scene, given: MeshFileOptions, work: Work) -> Result:
    """Make the mesh and write it, or its samples, and the picture."""
    from fracslice.formats import write
    from fracslice.jobs.mesh import make_mesh, metadata

    job, output, picture = given.mesh_job(scene), given.output, given.picture
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

        shown = result.shown
        if shown.filaments is not None:
            from fracslice.mesh.filaments import painted_mesh

            shown = painted_mesh(shown)
        draw(shown, picture)
    return result


def check_outputs(given: MeshFileOptions) -> None:
    """Check before any work is done that the output files can be written."""
    if Path(given.output).suffix.lower() not in (*ENDINGS, GRID):
        known = ", ".join([*ENDINGS, GRID])
        raise click.UsageError(f"{given.output}: unknown kind of file; known are {known}")
    check_targets(given.source, given.output, given.report, given.picture)
    if given.report is not None and is_table(given.report):
        table_rows(given.report)
    if given.picture is not None:
        from fracslice.viewer import need_pyvista

        need_pyvista()


def write_grid(result: Result, path: str, about: dict[str, str]) -> None:
    """Write distances in a narrow band, in mm, as an OpenVDB file."""
    from fracslice.volume.level_sets import grid_of, save

    save(grid_of(result.bricks_mm), path, about)


def write_report(report: Report, path: str) -> None:
    """Write the report as JSON."""
    import json

    from fracslice.common.files import replacing

    with replacing(path) as file:
        file.write((json.dumps(report.as_dict(), indent=2) + "\n").encode())


KEY = "file"
"""First column: the output of the row."""


def table_rows(path: str) -> dict[str, dict[str, Any]]:
    """Rows of a table by their output; none if there is no file.

    Raises `BadInput` for a file that is no table of meshes.
    """
    import csv

    try:
        table = csv.DictReader(Path(path).read_text("utf-8").splitlines())
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError):
        raise BadInput(f"{path}: cannot be read as a table") from None
    if KEY not in (table.fieldnames or ()):
        raise BadInput(f"{path}: expected a table of meshes, with a column {KEY!r}, or a new file")
    return {row[KEY]: {name: value for name, value in row.items() if name} for row in table}


def write_row(path: str, output: str, settings: Sequence[str], report: Report) -> None:
    """Write the settings and numbers of a mesh to its row of a table; the rows of other outputs stay."""
    import csv

    from fracslice.common.files import replacing

    numbers = {name: value for name, value in report.as_dict().items() if isinstance(value, int | float)}
    values = dict(setting.split("=", 1) for setting in settings)
    own = {KEY: output, **values, **numbers, "problems": "; ".join(report.problems)}
    rows = {**table_rows(path), output: own}
    text = io.StringIO()
    table = csv.DictWriter(text, list(dict.fromkeys(name for row in rows.values() for name in row)))
    table.writeheader()
    table.writerows(rows.values())
    with replacing(path) as file:
        file.write(text.getvalue().encode())
