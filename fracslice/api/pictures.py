"""Rendering of shapes and scenes."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from ..errors import TooLargeError
from ..formulas import Node
from ..jobs.pictures import make_picture
from ..records import RenderJob
from ..scene import Scene
from ..scene.view import Camera, Film, Light, View
from .options import RenderKeywords, Source, job_with, keywords, resolve, work_of

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


@keywords(RenderJob)
def render(
    shape: Source,
    job: RenderJob | None = None,
    *,
    path: str | Path | None = None,
    camera: Camera | None = None,
    lights: Sequence[Light] | None = None,
    **options: Unpack[RenderKeywords],
) -> Picture:
    """Render a picture of a shape.

    Keywords set the fields of `RenderJob` and `Work`, and override those of the record. A shape without a
    scene has 640 x 480 pixels of 16 samples by default.

    Parameters
    ----------
    shape : Node, Scene, str or path
        As for `make_mesh`.
    job : RenderJob, optional
        Settings of the picture, as a record.
    path : str or path, optional
        The file to write, in the format of its extension: .png, .jpg, .webp, or linear floats as .exr or
        .tif. A .png, .exr or .tif file may be larger than memory: the picture is then only in that file,
        and `TooLargeError` says so.
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
        For an invalid shape, view or value.
    ExportError
        For a file that cannot be written.
    TooLargeError
        For a picture that does not fit in memory; one with a path is in the file.
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
    what, work = resolve(shape), work_of({**options, "device": None})
    scene = Scene(what, 1.0, view=View(film=FILM)) if isinstance(what, Node) else what
    given: dict[str, Any] = {"camera": camera, "lights": None if lights is None else tuple(lights)}
    view = replace(scene.view, **{name: value for name, value in given.items() if value is not None})
    picture = job_with(job or RenderJob(), options)
    device = options.get("device") or "auto"
    done = make_picture(replace(scene, view=view), picture, work, path, device=device).done
    if done is None:
        raise TooLargeError(f"{path}: holds the picture, which does not fit in memory")
    array = done.shown.view(Picture)
    array.flags.writeable = False
    return array
