"""fracslice formulas: the elements of scenes."""

from __future__ import annotations

import click


@click.command()
@click.argument("name", required=False)
@click.option("--check", "file", metavar="FILE", help="Examine the formulas of a Python file; it is run.")
def formulas(name: str | None, file: str | None) -> None:
    """List the elements of a scene with their sources, or describe the element NAME.

    --check compares the back ends with the reference and looks for points that break the formula's bound or
    lie outside its box; exit status 1 if there are any.
    """
    from fracslice.errors import KernelError
    from fracslice.scene import manual

    if file is None:
        click.echo(manual.overview() if name is None else manual.page(name))
        return
    from fracslice.formulas.plugins import run_file
    from fracslice.kernel.trial import trial

    trials = [(formula.name, trial(formula)) for formula in run_file(file)]
    for formula, result in trials:
        click.echo("\n".join([f"{formula}:", *(f"  {line}" for line in result.lines)]))
    if not trials:
        raise KernelError(f"{file}: registers no formulas")
    if any(result.faults for _, result in trials):
        raise KernelError("faults were found")
