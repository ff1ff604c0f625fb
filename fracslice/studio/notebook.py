"""A studio in the output of a notebook's cell: the page of ``fracslice studio``, and its scene in Python."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from html import escape
from pathlib import Path

from ..api.options import as_scene
from ..common.messages import lacking
from ..errors import RenderError
from ..fields.registry import Node
from ..scene.model import Scene, to_xml
from ..work import Work
from .document import Document
from .session import Session

HEIGHT = 640
"""Height of the page in a notebook, pixels."""


class Studio:
    """Page in which a scene is looked at and changed, in Jupyter, VS Code or marimo.

    It is shown as the value of a cell. The page is served on this machine, at an address that holds a token:
    where the notebook's kernel runs on another machine, forward the port of `address`. Files are made in
    the current folder. Call `close`, or let go of it, at the end.

    Parameters
    ----------
    of : Node or Scene
        Shape or scene; its formulas may be those of the notebook.
    work : Work, optional
        Threads.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.

    Raises
    ------
    RenderError
        If the extra `studio` is not installed.

    Examples
    --------
    >>> from fracslice import Studio, menger
    >>> studio = Studio(menger(2))  # doctest: +SKIP
    >>> studio.on_change(lambda scene: print(scene.root))  # doctest: +SKIP
    """

    def __init__(self, of: Node | Scene, work: Work | None = None, device: str = "auto") -> None:
        if reason := lacking("trame", "the studio needs"):
            raise RenderError(reason)
        from .page import Page  # with trame

        made = as_scene(of)
        document = Document(to_xml(made), Path.cwd() / f"{made.name}.xml", files_outside=True)
        self._session = Session(document, Path.cwd(), work, device, files_outside=True)
        self.address = Page(self._session).serve_in_background()
        self._close = weakref.finalize(self, self._session.close)

    @property
    def scene(self) -> Scene:
        """The scene as the page has it now.

        Returns
        -------
        Scene
            The last valid one.
        """
        return self._session.document.scene

    def on_change(self, act: Callable[[Scene], object]) -> None:
        """Call a function with the scene after each change of it, in a thread of the page.

        Parameters
        ----------
        act : callable
            Function of the scene.
        """
        self._session.listeners.append(act)

    def close(self) -> None:
        """End the page."""
        self._close()

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{escape(self.address)}" title="fracslice studio" '
            f'style="width: 100%; height: {HEIGHT}px; border: 0"></iframe>'
        )


def show(of: Node | Scene) -> Studio | Node | Scene:
    """Return what shows a shape in a notebook: a studio, or its picture where the extra is not installed."""
    return of if lacking("trame", "the studio needs") else Studio(of)
