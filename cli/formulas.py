"""fracslice formulas: the elements of scenes."""

from __future__ import annotations

import click


@click.command()
@click.argument("name", required=False)
def formulas(name: str | None) -> None:
    """List the elements of a scene, or describe the element NAME."""
    from fracslice.scene import manual

    click.echo(manual.overview() if name is None else manual.page(name))
