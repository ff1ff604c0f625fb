"""fracslice plate: many parts in one file of layers, or in one file of meshes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.common.messages import format_count
from fracslice.common.parameters import parse_length
from fracslice.errors import SceneError
from fracslice.formats import ENDINGS
from fracslice.records import MeshJob, Placed, SliceJob

from .execution import check_targets, load_scene, refuse_options, summary
from .options import MeshOptions, Name, Parsed, argument, command, option
from .slice import COPIES, SPACING, LayerFileOptions, recipe, write_layers

if TYPE_CHECKING:
    from fracslice.export.slice_run import SliceRun
    from fracslice.jobs.report import Result
    from fracslice.slicing.printers import Resin
    from fracslice.work import Work

    Bed = tuple[float, ...]

OF_MESHES = MeshJob.kinds().keys() - Placed.kinds().keys()
OF_LAYERS = {*(SliceJob.kinds().keys() - Placed.kinds().keys()), *("mirror", "exposure", "resin", "preview")}
OF_LAYERS |= {"address", "price", "html", "form", "cluster", "shard", "store"}
SOLO = {"thickness", "bridge", "hollow"}


def parse_bed(text: str) -> Bed:
    """Width, depth and, if it is given, height of a bed, mm."""
    words, unit = text.strip().lower().split("x"), ""
    last = words[-1].strip()
    while last and not last[-1].isdigit() and last[-1] != ".":
        last, unit = last[:-1], last[-1] + unit
    try:
        if len(words) in (2, 3):
            return tuple(parse_length(f"{word}{unit}") for word in (*words[:-1], last))
    except SceneError:
        pass
    raise ValueError("width, depth and height, such as 220x220x250mm; or width and depth, 143x89mm")


class PlateOptions(LayerFileOptions, MeshOptions):
    """Options of `plate`."""

    without = MeshOptions.without

    sources: tuple[str, ...] = argument("SCENE|MODEL...", nargs=-1, required=True)
    output: str = option(
        Name("OUT"),
        f"A file of layers, as slice writes it, or of meshes: {', '.join(ENDINGS)}.",
        "-o",
        "--output",
        required=True,
    )
    copies: int = COPIES
    spacing: float = SPACING
    bed: Bed | None = option(
        Parsed(parse_bed, "WxD[xH]"),
        "Size of the bed, such as 220x220x250mm; that of --printer, or without limits, by default.",
    )

    @property
    def parts(self) -> list[str]:
        """Source of each part; a copy of each part follows the first ones."""
        return list(self.sources) * self.copies


@command(PlateOptions, short_help="Put many parts on one plate: one file of layers, or of meshes.")
def plate(given: PlateOptions) -> int:
    """Put parts side by side, as close as their outlines go, and write all of them to one file.

    Each part stands as mesh and slice place it, turned about z where that helps, and has all changes for
    printing by itself. Equal parts are made once. A part that is named twice stands there twice. Exit
    status: 2 if they do not fit; the line says how many do.

    Examples
    --------
    fracslice plate a.xml b.stl -o plate.goo --printer mars-5 --copies 3
    fracslice plate menger-tower mandelbulb -o plate.3mf --bed 220x220x250mm --size 50mm
    """
    if given.machine and given.bed:
        raise click.UsageError("--bed and --printer: expected one of them")
    if Path(given.output).suffix.lower() in ENDINGS and given.form is None:
        refuse_options(OF_LAYERS, "only for layers, and meshes are written")
        return write_meshes(given)
    refuse_options(OF_MESHES, "only for meshes, and layers are written")

    def planned(kind: str, resin: Resin | None) -> Callable[[Work], SliceRun]:
        from fracslice.jobs.plates import PlateRecipe

        scenes = {source: load_scene(source, given.settings) for source in dict.fromkeys(given.sources)}
        bed = (given.bed[0], given.bed[1]) if given.bed else None

        def run(work: Work) -> SliceRun:
            made = {s: recipe(given.oriented(scene, work), scene, kind, resin) for s, scene in scenes.items()}
            return PlateRecipe(tuple(made[source] for source in given.parts), given.spacing, bed).run(work)

        return run

    return write_layers(given, given.sources, planned)


def write_meshes(given: PlateOptions) -> int:
    """Write the meshes of all parts, and a summary of each."""
    from fracslice.jobs.mesh import make_mesh
    from fracslice.jobs.plates import write_meshes

    for source in given.sources:
        check_targets(source, given.output)
    scenes = {source: load_scene(source, given.settings) for source in dict.fromkeys(given.sources)}
    bed, where = given.bed, "the bed"
    if given.machine:
        bed, where = given.machine.build_volume, f"the {given.machine.title}"
    with given.working() as work:
        results: dict[str, Result] = {}
        for source, scene in scenes.items():
            results[source] = make_mesh(scene, given.oriented(scene, work).mesh_job(scene), work)
        write_meshes(
            list(results.values()),
            [list(results).index(source) for source in given.parts],
            given.parts,
            given.output,
            {"Title": ", ".join(scene.name for scene in scenes.values())},
            work,
            spacing=given.spacing,
            bed=bed if bed is None or len(bed) == 3 else (bed[0], bed[1], float("inf")),
            where=where,
        )
    if not given.quiet:
        parts = format_count(len(given.parts), "part")
        lines = [summary(source, result.report) for source, result in results.items()]
        click.echo(os.linesep.join([f"{given.output}: {parts} on one plate", *lines]))
    return 1 if any(result.report.problems for result in results.values()) else 0
