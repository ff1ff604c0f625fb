"""fracslice plate: many parts in one file of layers, or in one file of meshes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.common.messages import format_count
from fracslice.common.parameters import Sides
from fracslice.formats import ENDINGS
from fracslice.records import MeshJob, Placed, SliceJob

from .execution import check_targets, load_scene, of_mesh, refuse_options, summary, total
from .options import AMOUNT, MATERIAL, MeshOptions, Name, argument, command, kind_option, option
from .slice import COPIES, SPACING, LayerFileOptions, recipe, write_layers

if TYPE_CHECKING:
    from fracslice.export.slice_run import SliceRun
    from fracslice.jobs.report import Result
    from fracslice.slicing.packing import Beds
    from fracslice.slicing.printers import Resin
    from fracslice.work import Work

    from .mesh import WholeOptions

OF_MESHES = {*(MeshJob.kinds().keys() - Placed.kinds().keys()), "material"}
OF_LAYERS = {*(SliceJob.kinds().keys() - Placed.kinds().keys()), *("mirror", "exposure", "resin", "preview")}
OF_LAYERS |= {"address", "html", "form", "cluster", "shard", "store"}


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
    bed: Sequence[float] | None = kind_option(
        Sides(None, "size of the bed, such as 220x220x250mm", flat=True),
        None,
        "Size of the bed, such as 220x220x250mm; that of --printer, or without limits, by default",
    )
    material: str = MATERIAL
    price: float | None = option(
        AMOUNT, "Price of a litre of resin, by default the resin's; of meshes, price of a kilogram."
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
        from fracslice.slicing.packing import Beds

        (*flat, height), name = [*(given.bed or ()), math.inf][:3], "the bed"
        if given.machine:
            (*flat, height), name = given.machine.build_volume, f"the {given.machine.title}"
        sides = (flat[0], flat[1]) if flat else None
        return write_meshes(given, given.parts, Beds(sides, given.spacing, name), height)
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


def write_meshes(
    given: PlateOptions | WholeOptions, parts: Sequence[str], beds: Beds, height: float = math.inf
) -> int:
    """Write the meshes of parts side by side, and a summary of each and of all.

    `parts`: source of each part; `height`: that is free above a bed, mm.
    """
    from fracslice.jobs.mesh import make_mesh
    from fracslice.jobs.plates import lay_out

    sources = list(dict.fromkeys(parts))
    for source in sources:
        check_targets(source, given.output)
    scenes = {source: load_scene(source, given.settings) for source in sources}
    with given.working() as work:
        made: dict[str, Result] = {}
        for source, scene in scenes.items():
            made[source] = make_mesh(scene, given.oriented(scene, work).mesh_job(scene), work)
        places = [sources.index(source) for source in parts]
        laid = lay_out(list(made.values()), places, parts, beds, height)
        names = [scene.name for scene in scenes.values()]
        laid.write(given.output, {"Title": ", ".join(names)}, work, names)
    if not given.quiet:
        closing = {s: of_mesh(result, given.material, given.price) for s, result in made.items()}
        lines = [f"{given.output}: {format_count(len(parts), 'part')}, {total(closing[s] for s in parts)}"]
        for source, result in made.items():
            lines += [summary(source, result.report), *closing[source].lines()]
        click.echo(os.linesep.join(lines))
    return 1 if any(result.report.problems for result in made.values()) else 0
