"""fracslice scenes: a list of the shipped scenes."""

from __future__ import annotations

import click


@click.command(short_help="List the scenes that ship with fracslice.")
def scenes() -> None:
    """List the scenes that ship with fracslice; each name can stand for a SCENE."""
    from fracslice.scene import library

    names = library.names()
    width = max(map(len, names))
    for name in names:
        click.echo(f"{name:{width}}  {library.about(name)}")
