"""fracslice scenes: a list of the shipped scenes."""

from __future__ import annotations

import click

from .options import CommandOptions, command


@command(CommandOptions, short_help="List the scenes that ship with fracslice.")
def scenes(_: CommandOptions) -> None:
    """List the scenes that ship with fracslice; each name can stand for a SCENE.

    Examples
    --------
    fracslice scenes
    """
    from fracslice.scene import library

    names = library.names()
    width = max(map(len, names))
    for name in names:
        click.echo(f"{name:{width}}  {library.about(name)}")
