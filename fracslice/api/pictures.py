"""A shape becomes a picture."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np

from ..formulas import Node
from ..rendering import Renderer
from ..scene.view import Camera, Film, Light, View
from .options import WorkOptions, keywords, work_of
from .sources import Source, found

FILM = Film(width=640, height=480, samples=16)
"""Of a shape that has no scene around it: soon done."""


class Picture(np.ndarray):
    """A picture, uint8 [height, width, 3], that notebooks show."""

    def _repr_png_(self) -> bytes | None:
        from PIL import Image

        if self.dtype != np.uint8 or self.ndim != 3 or self.shape[2] != 3:
            return None  # a part of it that is no picture
        file = io.BytesIO()
        Image.fromarray(np.asarray(self)).save(file, "PNG")
        return file.getvalue()


@keywords
def render(
    shape: Source,
    *,
    size: tuple[int, int] | None = None,
    samples: int | None = None,
    camera: Camera | None = None,
    lights: Sequence[Light] | None = None,
    **options: Unpack[WorkOptions],
) -> Picture:
    """Render a picture of a shape.

    Parameters
    ----------
    shape : Node, Scene, str or path
        As `make_mesh` takes it.
    size : two whole numbers, optional
        Pixels across and down; the scene's, or 640 x 480 of a shape.
    samples : int, optional
        The most samples of a pixel; the scene's, or 16 of a shape.
    camera : Camera, optional
        From where to look, in scene units; the scene's, or one that has the whole shape in view.
    lights : sequence of Light, optional
        What lights it; the scene's, or a sun and a sky.
    threads : int, optional
        How many threads to use; one for each core if not given.
    progress : callable, optional
        Called as ``progress("rendering", share)`` after every pass.
    cancel : threading.Event, optional
        Stops the work with `Cancelled` once it is set.
    device : {"cpu", "cuda", "auto"}, optional
        What traces the rays; the GPU, if there is one.

    Returns
    -------
    Picture
        An array, uint8 [height, width, 3], sRGB, that notebooks show.

    Raises
    ------
    SceneError, RenderError
        For a shape, a view or a size that cannot be.
    TypeError
        For an unknown keyword.
    Cancelled
        When somebody asked to stop.

    Examples
    --------
    >>> from fracslice import box, render, sphere
    >>> picture = render(box() - sphere(0.6), size=(64, 48), samples=1)
    >>> picture.shape, picture.dtype.name
    ((48, 64, 3), 'uint8')
    """
    what, work = found(shape), work_of(options)
    root, view = (what, View(film=FILM)) if isinstance(what, Node) else (what.root, what.view)
    given: dict[str, Any] = {"camera": camera, "lights": None if lights is None else tuple(lights)}
    view = replace(view, **{name: value for name, value in given.items() if value is not None})
    renderer = Renderer(root, view, size, work, options.get("device") or "auto")
    most = view.film.samples if samples is None else samples
    seen = renderer.seen()
    for seen in renderer.passes(most):
        work.progress("rendering", min(seen.samples / most, 1.0))
    picture = seen.shown.view(Picture)
    picture.flags.writeable = False
    return picture
