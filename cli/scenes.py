"""fracslice scenes: a list of the shipped scenes."""

from __future__ import annotations

import click

from .options import CommandOptions, command


@command(CommandOptions, short_help="List the scenes that ship with fracslice.")
def scenes(_: CommandOptions) -> None:
    """List the scenes that ship with fracslice, then those of the gallery; each name can stand for a SCENE.

    Examples
    --------
    fracslice scenes
    """
    from fracslice.scene import library

    names, gallery = library.names(), library.gallery()
    width = max(map(len, names + gallery))
    lines = {name: f"{name:{width}}  {library.about(name)}" for name in names + gallery}
    click.echo("\n".join([*(lines[name] for name in names), "", *(lines[name] for name in gallery)]))
