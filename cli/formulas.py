"""fracslice formulas: the elements of scenes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .execution import BadInput, check_targets
from .options import CommandOptions, Name, argument, command, option

if TYPE_CHECKING:
    from fracslice.formulas import Node

SIDE = 320
"""Pixels along a side of a formula's picture."""


class FormulaOptions(CommandOptions):
    """Options of `formulas`."""

    name: str | None = argument("[NAME]", required=False)
    file: str | None = option(
        str, "Examine the formulas of a Python file; it is run.", "--check", metavar="FILE"
    )
    picture: str | None = option(
        Name("FILE.png", ".png"), "Write a picture of the examined formulas, side by side."
    )


@command(FormulaOptions)
def formulas(given: FormulaOptions) -> None:
    """List the elements of a scene with their sources, or describe the element NAME.

    --check compares the back ends with the reference and the derivative of a step with differences, and looks
    for points that break the formula's bound or lie outside its box; exit status 1 if there are any.

    Examples
    --------
    fracslice formulas mandelbulb
    fracslice formulas --check own.py --picture own.png
    """
    from fracslice.errors import KernelError
    from fracslice.scene import manual

    if given.file is None:
        if given.picture is not None:
            raise click.UsageError("--picture: expected --check FILE")
        click.echo(manual.overview() if given.name is None else manual.page(given.name))
        return
    from fracslice.fields.definitions import trial
    from fracslice.fields.registry import run_file

    check_targets(given.file, given.picture)
    trials = [(formula.name, trial(formula)) for formula in run_file(given.file)]
    for formula, result in trials:
        click.echo("\n".join([f"{formula}:", *(f"  {line}" for line in result.lines)]))
    if not trials:
        raise BadInput(f"{given.file}: registers no formulas")
    if given.picture is not None:
        draw([result.root for _, result in trials], given.picture)
    if any(result.faults for _, result in trials):
        raise KernelError("faults were found")


def draw(roots: list[Node], path: str) -> None:
    """Write a picture of some solids, side by side; those without an end are cut by a box."""
    import numpy as np
    from PIL import Image

    from fracslice import render
    from fracslice.common.files import replacing
    from fracslice.formulas import bounds

    cut = [r if r.bounds.box.finite else bounds(r, min=(-2, -2, -2), max=(2, 2, 2)) for r in roots]
    pictures = [np.asarray(render(root, size=(SIDE, SIDE), samples=4))[..., :3] for root in cut]
    with replacing(path) as file:
        Image.fromarray(np.hstack(pictures)).save(file, "PNG")
