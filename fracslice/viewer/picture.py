"""Off-screen pictures of meshes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..common.files import replacing, temporary_folder
from ..common.messages import lacking
from ..common.parameters import Choice, Vector, validate_value
from ..errors import RenderError
from ..mesh.model import Mesh
from . import plotter

SOFTWARE = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow"}
SECONDS = 600
SIZE = Vector(None, "pixels across and down", sizes=(2,), least=1, most=16384, whole=True)


def picture(
    mesh: Mesh,
    path: str | Path,
    size: tuple[int, int] = (1280, 960),
    background: Literal["light", "dark"] = "light",
) -> Path:
    """Draw a mesh in its colours, or in matte clay, from a three-quarter view into a PNG file.

    Needs no screen, but OpenGL in software or hardware (Debian: libegl1 with libgl1-mesa-dri, or libosmesa6).

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    path : str or Path
        PNG file to write.
    size : tuple of int
        Picture width and height, pixels.
    background : {"light", "dark"}
        Background gradient.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    RenderError
        If the size is invalid, the mesh is empty, pyvista is missing or the machine cannot draw.
    ExportError
        If the file cannot be written.
    """
    size = validate_value("size", size, SIZE, RenderError)
    validate_value("background", background, Choice("light", "", tuple(plotter.BACKGROUNDS)), RenderError)
    if not len(mesh.triangles):
        raise RenderError("the mesh has no triangles to draw")
    need_pyvista()
    with temporary_folder() as folder, replacing(path) as file:
        source, target = os.path.join(folder, "mesh.npz"), os.path.join(folder, "picture.png")
        arrays: dict[str, Any] = {"vertices": mesh.vertices, "triangles": mesh.triangles}
        np.savez(source, **arrays if mesh.colours is None else arrays | {"colours": mesh.colours})
        _draw([source, target, *map(str, size), background])
        file.write(Path(target).read_bytes())
    return Path(path)


def need_pyvista() -> None:
    """Check that pyvista is installed.

    Raises
    ------
    RenderError
        If it is missing.
    """
    if reason := lacking("pyvista", "pictures of meshes need"):
        raise RenderError(reason)


def _draw(arguments: list[str]) -> None:
    """Draw in a child process, first with the default OpenGL window, then with OSMesa."""
    command = [sys.executable, "-P", plotter.__file__, *arguments]
    for extra in ({}, SOFTWARE):
        try:
            run = subprocess.run(
                command,
                env=os.environ | extra,
                capture_output=True,
                timeout=SECONDS,
                stdin=subprocess.DEVNULL,
            )
        except subprocess.TimeoutExpired:
            raise RenderError(f"the picture was not ready after {SECONDS} seconds") from None
        if run.returncode == 0 and os.path.exists(arguments[1]):
            return
    raise RenderError(
        "this machine cannot draw without a screen; install libegl1 and libgl1-mesa-dri (or libosmesa6)"
    )
