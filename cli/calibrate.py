"""fracslice calibrate: objects that show what a printer and a resin do."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.common.parameters import parse_length

from .execution import check_targets, refuse_options
from .options import Name, Parsed, argument, command, option
from .slice import LayerFileOptions, recipe, write_layers

if TYPE_CHECKING:
    from fracslice.export.slice_run import SliceRun
    from fracslice.slicing.printers import Resin
    from fracslice.work import Work

SCENE = ".xml"


def parse_sizes(text: str) -> tuple[float, ...]:
    """Sizes, mm."""
    return tuple(parse_length(word) for word in text.split(","))


def known_object(_: click.Context, __: click.Parameter, name: str) -> str:
    """Check the name of an object."""
    from fracslice.scene.calibration import OBJECTS

    if name not in OBJECTS:
        raise click.BadParameter(f"{name!r}: expected {', '.join(OBJECTS)}")
    return name


class CalibrateOptions(LayerFileOptions):
    """Options of `calibrate`."""

    without = LayerFileOptions.without | {"orient"}

    kind: str = argument("OBJECT", callback=known_object)
    output: str = option(
        Name("OUT"),
        "A scene (.xml), or a file of layers, as slice writes it.",
        "-o",
        "--output",
        required=True,
    )
    sizes: tuple[float, ...] | None = option(
        Parsed(parse_sizes, "LENGTH,..."), "Sizes of its details, such as 0.1,0.2,0.4mm."
    )
    label: str = option(str, "A number to engrave, such as the exposure.", metavar="NUMBER", default="")


@command(CalibrateOptions, short_help="Make an object that shows what a printer and a resin do.")
def calibrate(given: CalibrateOptions) -> int:
    """Make an OBJECT to calibrate a printer and a resin by: walls, tolerance, elephant-foot, exposure or
    depth.

    walls has walls, pins, slots and holes of several sizes; tolerance a bar of holes and a peg;
    elephant-foot blocks with slits at the plate, and a cube; exposure pins, holes and squares that meet at
    corners; depth bridges, which grow as deep as light cures. All sizes are engraved. OUT is a scene, for
    all other commands, or a file of layers.

    Examples
    --------
    fracslice calibrate walls -o walls.goo --printer mars-5 --exposure 2.5 30
    fracslice calibrate exposure -o exposure.goo --printer mars-5 --exposure 2.5 30 --label 2.5
    fracslice calibrate tolerance -o tolerance.xml --sizes 0.05,0.1,0.2mm
    """
    from fracslice.scene.calibration import calibration

    scene = calibration(given.kind, given.sizes or (), given.label)
    if Path(given.output).suffix.lower() == SCENE:
        names = {str(option.name) for option in LayerFileOptions.parameters()} - {"output", "quiet"}
        refuse_options(names, "only for layers, and a scene is written")
        check_targets("", given.output)
        from fracslice.common.files import replacing
        from fracslice.scene import to_xml

        with replacing(given.output) as file:
            file.write(to_xml(scene).encode())
        return 0

    def planned(kind: str, resin: Resin | None) -> Callable[[Work], SliceRun]:
        return partial(recipe(given, scene, kind, resin).run, scene=scene)

    return write_layers(given, [], planned)
