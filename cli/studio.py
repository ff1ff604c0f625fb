"""fracslice studio: a page in a browser where a scene is looked at, changed and made."""

from __future__ import annotations

from pathlib import Path

import click

from .options import DEVICE, SceneOptions, argument, command, option


class StudioOptions(SceneOptions):
    """Options of `studio`."""

    source: str = argument("[SCENE|MODEL]", required=False, default="mandelbulb")
    host: str = option(
        str, "Address to listen at; others than this machine's can be reached by others.", default="127.0.0.1"
    )
    port: int = option(click.IntRange(0, 65535), "Port; a free one by default.", default=0)
    browser: bool = option(
        bool,
        "Open the page in a browser, or print its address alone.",
        "--browser/--no-browser",
        default=True,
    )
    device: str = DEVICE


@command(StudioOptions)
def studio(given: StudioOptions) -> None:
    """Open a page in a browser where SCENE is looked at, changed and made.

    The page needs the address that is printed, with its token. Files are written into the current folder and
    below. Ctrl-C ends it. Over SSH: ssh -L 8080:127.0.0.1:8080 HOST fracslice studio --port 8080.

    Examples
    --------
    fracslice studio mandelbulb
    fracslice studio my.xml --no-browser --port 8080
    """
    from fracslice.common.messages import lacking
    from fracslice.errors import RenderError

    if reason := lacking("trame", "the studio needs"):
        raise RenderError(reason)
    from fracslice.studio.page import Page
    from fracslice.studio.session import Session

    if given.host not in ("127.0.0.1", "localhost", "::1"):
        click.echo(f"anyone who reaches {given.host} and knows the token can use this studio", err=True)
    with given.working() as work:
        made = Session(given.source, Path.cwd(), work, given.device, given.allow_files_outside)
        try:
            Page(made).serve(given.host, given.port, given.browser, click.echo)
        finally:
            made.close()
