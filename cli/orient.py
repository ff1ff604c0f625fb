"""fracslice orient: directions up in which an object prints best."""

from __future__ import annotations

import click

from fracslice.common.messages import significant
from fracslice.records import SAME

from .execution import load_scene
from .options import LENGTH, SceneOptions, argument, command, flag, option, up_text


class OrientOptions(SceneOptions):
    """Options of `orient`."""

    source: str = argument("SCENE|MODEL")
    size: float | None = option(LENGTH, "The longest side, such as 80mm; by default the scene's.")
    as_json: bool = flag("Print all figures as JSON.", "--json")


@command(OrientOptions, short_help="Find the directions up in which a SCENE or MODEL prints best.")
def orient(given: OrientOptions) -> int:
    """Find the five directions up with the least supports, scars, height, peel and resin that stays inside.

    Supports are estimated on coarse layers. The first one is that of --orient auto.

    Examples
    --------
    fracslice orient mandelbulb --size 60mm
    fracslice orient part.stl
    """
    from fracslice.slicing.orientation import orientations
    from fracslice.volume.amount import sizing

    scene = load_scene(given.source, given.settings)
    with given.working() as work:
        found = orientations(scene.root, sizing(scene, given.size, SAME, work), work)
    if given.as_json:
        import json
        from dataclasses import asdict

        click.echo(json.dumps([asdict(one) for one in found], indent=2))
        return 0
    head = ("direction", "supports mm3", "scars mm2", "height mm", "largest layer mm2", "trapped mm3")
    rows = [
        (
            f"--up {up_text(one.up)}",
            *map(significant, (one.supports, one.scars, one.height, one.peel, one.trapped)),
        )
        for one in found
    ]
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        first, *rest = (
            text.ljust(w) if k == 0 else text.rjust(w)
            for k, (text, w) in enumerate(zip(row, widths, strict=True))
        )
        click.echo("  ".join([first, *rest]))
    return 0
