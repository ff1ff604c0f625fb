"""fracslice fly: a window for flying through a scene."""

from __future__ import annotations

import click

from .inputs import scene_path
from .options import device_option, run_options, source_argument
from .sizes import pixels
from .working import working


@click.command()
@source_argument("SCENE")
@click.option(
    "--size",
    callback=pixels,
    default="960x540",
    metavar="WxH",
    help="Pixels across and down; 960x540 by default.",
)
@device_option
@run_options
def fly(
    source: str, size: tuple[int, int], device: str, settings: tuple[str, ...], threads: int, quiet: bool
) -> None:
    """Open a window to fly through SCENE while its picture sharpens.

    The file is read again whenever it is saved: edit it and look. When the window is closed, the last view is
    printed as a <camera> element, to put into the file.
    """
    from fracslice import viewer
    from fracslice.scene.writer import part_to_xml

    with working(threads, quiet) as work:
        camera = viewer.fly(scene_path(source), settings, size, work, device)
    if not quiet:
        click.echo(part_to_xml(camera))
