"""fracslice import: a scene of another program as a scene of ours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .execution import check_targets
from .options import CommandOptions, argument, command, flag, output

if TYPE_CHECKING:
    from fracslice.scene.mandelbulber import Imported

SHOWN = 12
"""Values that were not understood that the summary names."""


class ImportOptions(CommandOptions):
    """Options of `import`."""

    source: str = argument("FILE.fract")
    output: str = output("FILE.xml", "The scene.", ".xml")
    leave_out: bool = flag("Leave out formulas that are not known here; without it, they are an error.")
    as_json: bool = flag("Print what was imported, and what was not, as JSON.", "--json")
    quiet: bool = flag("No summary.", "-q", "--quiet")


@command(ImportOptions, "import", short_help="Make a scene of a settings file of Mandelbulber 2.")
def import_(given: ImportOptions) -> int:
    """Make a scene of a settings file of Mandelbulber 2, and list what was not understood.

    The scene holds the formulas by their text, hybrids with their order, the camera, the lights and a
    material. Exit status: 1 if a formula was left out; the scene is written.

    Examples
    --------
    fracslice import menger.fract -o menger.xml
    fracslice import hybrid.fract -o hybrid.xml --leave-out --json
    """
    from fracslice.common.files import replacing
    from fracslice.scene import to_xml
    from fracslice.scene.mandelbulber import import_scene

    check_targets(given.source, given.output)
    made = import_scene(given.source, leave_out=given.leave_out)
    with replacing(given.output) as file:
        file.write(to_xml(made.scene).encode())
    if given.as_json:
        import json

        click.echo(json.dumps(figures(made), indent=2))
    elif not given.quiet:
        click.echo("\n".join(summary(given.output, made)))
    return 1 if made.missing else 0


def figures(made: Imported) -> dict[str, object]:
    """What was imported, and what was not."""
    lists = {name: list(getattr(made, name)) for name in ("formulas", "missing", "notes", "ignored")}
    return {"scene": made.scene.hash, **lists}


def summary(output: str, made: Imported) -> list[str]:
    """Lines about what was imported, and what was not."""
    lines = [f"{output}: {', '.join(made.formulas)}"]
    lines += [f"left out: {line}" for line in made.missing]
    lines += [f"changed: {line}" for line in made.notes]
    lines += [f"not understood: {line}" for line in made.ignored[:SHOWN]]
    if len(made.ignored) > SHOWN:
        lines.append(f"not understood: {len(made.ignored) - SHOWN} more; --json lists all")
    return lines
