"""fracslice fly: a window for flying through a scene."""

from __future__ import annotations

import click

from .execution import scene_path
from .options import DEVICE, PIXELS, SceneOptions, argument, command, option


class FlyOptions(SceneOptions):
    """Options of `fly`."""

    source: str = argument("SCENE")
    size: tuple[int, int] = option(PIXELS, "Pixels across and down; 960x540 by default.", default="960x540")
    device: str = DEVICE


@command(FlyOptions)
def fly(given: FlyOptions) -> None:
    """Open a window to fly through SCENE while its picture sharpens.

    The file is read again whenever it is saved: edit it and look. When the window is closed, the last view is
    printed as a <camera> element, to put into the file.

    Examples
    --------
    fracslice fly my.xml
    """
    from fracslice import viewer
    from fracslice.scene.model import part_to_xml

    with given.working() as work:
        path, outside = scene_path(given.source), given.allow_files_outside
        camera = viewer.fly(path, given.settings, given.size, work, given.device, outside)
    if not given.quiet:
        click.echo(part_to_xml(camera))
