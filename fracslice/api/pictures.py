"""Rendering of shapes and scenes."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np

from ..common.parameters import validate_value
from ..errors import RenderError
from ..formulas import Node
from ..kernel.devices import for_picture
from ..rendering import Renderer
from ..rendering.progressive import SIZE
from ..scene.view import Camera, Film, Light, View
from .options import Source, WorkKeywords, keywords, resolve, work_of

FILM = Film(width=640, height=480, samples=16)
"""Film of a shape without a scene, for a quick picture."""


class Picture(np.ndarray):
    """A picture, uint8 [height, width, 3], sRGB, that notebooks display."""

    def _repr_png_(self) -> bytes | None:
        from PIL import Image

        if self.dtype != np.uint8 or self.ndim != 3 or self.shape[2] != 3:
            return None  # a slice of a picture need not be a picture
        file = io.BytesIO()
        Image.fromarray(np.asarray(self)).save(file, "PNG")
        return file.getvalue()


@keywords()
def render(
    shape: Source,
    *,
    size: tuple[int, int] | None = None,
    samples: int | None = None,
    camera: Camera | None = None,
    lights: Sequence[Light] | None = None,
    **options: Unpack[WorkKeywords],
) -> Picture:
    """Render a picture of a shape.

    Parameters
    ----------
    shape : Node, Scene, str or path
        As for `make_mesh`.
    size : two whole numbers, optional
        Pixels across and down; by default the scene's, or 640 x 480 for a shape.
    samples : int, optional
        Maximum number of samples per pixel; by default the scene's, or 16 for a shape.
    camera : Camera, optional
        The camera, in scene units; by default the scene's, or one that shows the whole shape.
    lights : sequence of Light, optional
        The lights; by default the scene's, or a sun and a sky.
    {options}
    Returns
    -------
    Picture
        An array, uint8 [height, width, 3], sRGB, that notebooks display.

    Raises
    ------
    SceneError, RenderError
        For an invalid shape, view or size.
    TypeError
        For an unknown keyword.
    Cancelled
        When `cancel` is set.

    Examples
    --------
    >>> from fracslice import box, render, sphere
    >>> picture = render(box() - sphere(0.6), size=(64, 48), samples=1)
    >>> picture.shape, picture.dtype.name
    ((48, 64, 3), 'uint8')
    """
    if not isinstance(camera, Camera | None):
        raise TypeError(f"camera={camera!r}: expected a Camera")
    if lights is not None and not (
        isinstance(lights, Sequence) and all(isinstance(lamp, Light) for lamp in lights)
    ):
        raise TypeError(f"lights={lights!r}: expected a sequence of Light")
    what, work = resolve(shape), work_of(options)
    root, view = (what, View(film=FILM)) if isinstance(what, Node) else (what.root, what.view)
    given: dict[str, Any] = {"camera": camera, "lights": None if lights is None else tuple(lights)}
    view = replace(view, **{name: value for name, value in given.items() if value is not None})
    most = view.film.samples if samples is None else samples
    most = validate_value("samples", most, Film.kinds()["samples"], RenderError)
    pixels = (view.film.width, view.film.height) if size is None else size
    film = validate_value("size", pixels, SIZE, RenderError)
    device = for_picture(options.get("device") or "auto", film, most)
    renderer = Renderer(root, view, film, work, device)
    seen = renderer.seen()
    for seen in renderer.passes(most):
        work.progress("rendering", min(seen.samples / most, 1.0))
    picture = seen.shown.view(Picture)
    picture.flags.writeable = False
    return picture
