"""fracslice formulas: the elements of scenes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fracslice.formulas import Node

SIDE = 320
"""Pixels along a side of a formula's picture."""


@click.command()
@click.argument("name", required=False)
@click.option("--check", "file", metavar="FILE", help="Examine the formulas of a Python file; it is run.")
@click.option("--picture", metavar="FILE.png", help="Write a picture of the examined formulas, side by side.")
def formulas(name: str | None, file: str | None, picture: str | None) -> None:
    """List the elements of a scene with their sources, or describe the element NAME.

    --check compares the back ends with the reference and the derivative of a step with differences, and looks
    for points that break the formula's bound or lie outside its box; exit status 1 if there are any.
    """
    from fracslice.errors import KernelError
    from fracslice.scene import manual

    if file is None:
        if picture is not None:
            raise click.UsageError("--picture: expected --check FILE")
        click.echo(manual.overview() if name is None else manual.page(name))
        return
    from fracslice.formulas.plugins import run_file
    from fracslice.kernel.trial import trial

    trials = [(formula.name, trial(formula)) for formula in run_file(file)]
    for formula, result in trials:
        click.echo("\n".join([f"{formula}:", *(f"  {line}" for line in result.lines)]))
    if not trials:
        raise KernelError(f"{file}: registers no formulas")
    if picture is not None:
        draw([result.root for _, result in trials], picture)
    if any(result.faults for _, result in trials):
        raise KernelError("faults were found")


def draw(roots: list[Node], path: str) -> None:
    """Write a picture of some solids, side by side; those without an end are cut by a box."""
    import numpy as np
    from PIL import Image

    from fracslice import render
    from fracslice.export import replacing
    from fracslice.formulas import bounds

    cut = [r if r.bounds.box.finite else bounds(r, min=(-2, -2, -2), max=(2, 2, 2)) for r in roots]
    pictures = [np.asarray(render(root, size=(SIDE, SIDE), samples=4))[..., :3] for root in cut]
    with replacing(path) as file:
        Image.fromarray(np.hstack(pictures)).save(file, "PNG")
