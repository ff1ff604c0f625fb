"""fracslice repair: a solid of a model that is none."""

from __future__ import annotations

import os

import click

from fracslice.common.parameters import alternatives
from fracslice.formats import ENDINGS

from .execution import BadInput, check_targets, figures, load_model
from .options import RunOptions, argument, command, output


class RepairOptions(RunOptions):
    """Options of `repair`."""

    source: str = argument("MODEL")
    output: str = output("FILE", f"The repaired model: a file of {alternatives(*ENDINGS)}.")


@command(RepairOptions, short_help="Make a solid of a MODEL that is none.")
def repair(given: RepairOptions) -> int:
    """Close holes of MODEL, turn what is inside out, unite what overlaps, and say what changed.

    Needs pymeshlab. Exit status: 1 if it is still no solid; the file is written.

    Examples
    --------
    fracslice repair scan.stl -o solid.stl
    """
    from fracslice.errors import MeshError
    from fracslice.formats import write
    from fracslice.mesh.checks import repair as repaired
    from fracslice.mesh.models import faults

    if os.path.splitext(given.output)[1].lower() not in ENDINGS:
        raise click.UsageError(f"{given.output}: unknown kind of file; known are {', '.join(ENDINGS)}")
    check_targets(given.source, given.output)
    mesh = load_model(given.source)
    with given.working() as work:
        try:
            made = repaired(mesh)
        except MeshError as error:
            raise BadInput(f"{given.source}: {error}") from error
        work.check()
        write(made.mesh, given.output)
    if not given.quiet:
        changed = ", ".join(made.changes) or "nothing was changed"
        click.echo(f"{given.source}: {changed}\n{given.output}: {figures(made.report, faults(made.report))}")
    return 1 if faults(made.report) else 0
