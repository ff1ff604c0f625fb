"""fracslice check: printability of a model, or of the mesh or layers of a scene."""

from __future__ import annotations

import json
import os
from typing import Any

import click

from .inputs import is_model, load_model, load_scene, refuse_options, refuse_scene_options
from .options import (
    NAME,
    job_of,
    job_options,
    length,
    print_options,
    quiet_option,
    set_option,
    source_argument,
    threads_option,
)
from .slice import check_print, heights, limits_of, printer_option, verdict
from .summary import figures, summary
from .working import working

OF_LAYERS = {"pixel", "machine", "picture"}
OF_MESHES = {"voxel", "resolution", "dust", "chord", "simplify"}


@click.command(short_help="Say whether a model, or a scene's mesh or layers, would print.")
@source_argument("MODEL|SCENE")
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
@click.option("--layer", callback=heights, metavar="LENGTH[..LENGTH]", help="Check layers of this height.")
@click.option(
    "--pixel",
    callback=length,
    metavar="LENGTH",
    help="With --layer: pixel size; the printer's by default, or 0.05mm.",
)
@printer_option('With --layer: the printer it has to fit; "list" shows all.')
@click.option("--picture", type=NAME, metavar="FILE.png", help="With --layer: draw the worst layers.")
@click.option(
    "--wall",
    callback=length,
    default="0.1mm",
    metavar="LENGTH",
    help="Minimum thickness of walls; 0.1mm by default.",
)
@click.option(
    "--floor",
    callback=length,
    default="0.1mm",
    metavar="LENGTH",
    help="Minimum thickness of floors and roofs; 0.1mm by default.",
)
@print_options
@job_options
@set_option
@threads_option
@quiet_option
@click.pass_context
def check(
    context: click.Context,
    /,
    source: str,
    as_json: bool,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Say whether a model file, or the mesh or the layers of a scene, would print as it is.

    The options between --json and --threads are for scenes. Exit status: 1 if it would not print.
    """
    from fracslice.job import make_mesh
    from fracslice.mesh.check import check_mesh as examined

    if options["layer"] is not None and not is_model(source):
        refuse_options(context, OF_MESHES, "only for meshes, and --layer checks layers")
        return check_print(source, settings, as_json, threads, quiet, **options)
    if is_model(source):
        refuse_scene_options(context)
        checked = examined(load_model(source), threads=threads)
        numbers, line, problems = checked.as_dict(), f"{source}: {figures(checked)}", checked.problems
        line += "" if problems else ", would print"
    else:
        refuse_options(context, OF_LAYERS, "only with --layer")
        from fracslice.printing.checks import check_solid  # imported here: models need no Numba

        scene = load_scene(source, settings)
        with working(threads, quiet) as work:
            result = make_mesh(scene, job_of(scene, **options), work)
            solid = check_solid(result.root, result.bricks, result.place.scale, limits_of(options), work)
        numbers = result.report.as_dict() | {"solid": solid.as_dict()}
        problems = (*result.report.problems, *solid.thin)
        said = verdict(problems) + ("" if problems else "; --layer looks at islands, cups and traps, too")
        line = os.linesep.join(filter(None, [summary(source, result.report), solid.unseen, said]))
    click.echo(json.dumps(numbers, indent=2) if as_json else line)
    return 1 if problems else 0
