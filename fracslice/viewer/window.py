"""Interactive window to inspect a mesh, whether there is a screen, and off-screen pictures of meshes."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ..common.files import replacing, temporary_folder
from ..common.messages import lacking
from ..common.parameters import Choice, Vector, validate_value
from ..errors import RenderError
from ..mesh.model import Mesh
from ..mesh.models import read_coloured
from ..slicing.feature_graph import MARKS, FeatureBox, counted
from . import plotter
from .plotter import body, set_lighting

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


def need_screen() -> None:
    """Check that a window can be opened.

    Raises
    ------
    RenderError
        If pyvista or a screen is missing.
    """
    if reason := lacking("pyvista", "windows need"):
        raise RenderError(reason)
    if not has_screen():
        raise RenderError("there is no screen to open a window on; a picture can be made without one")


def has_screen() -> bool:
    """Return whether a window can be opened.

    On Linux, an X server must answer: VTK ends the process without one. Other systems always count as having
    a screen.
    """
    if not sys.platform.startswith("linux"):
        return True
    library = ctypes.util.find_library("X11")
    if library is None:
        return False
    x11 = ctypes.CDLL(library)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    # Keep the display open: a server that loses its only client may reset and refuse connections meanwhile.
    return bool(x11.XOpenDisplay(None))


INK = "#303438"
HELP = "drag: turn   wheel: zoom   W, S: wires, surface   C: cut   X: see through   V: first view   Q: close"
CLEAR = 0.35
"""Opacity of a mesh that is see-through."""

CURVE = (0.34, 0.24)
"""Width and height of the curve of areas, shares of the window."""


class Found(NamedTuple):
    """What a check found in the layers of a mesh."""

    marks: Sequence[FeatureBox]  # boxes around features
    tops: np.ndarray  # upper faces of the layers, mm, float64 [l]
    areas: np.ndarray  # their areas, mm2, float64 [l]


def show(mesh: Mesh | str | Path, found: Found | None = None) -> None:
    """Open a window on a mesh and return when it is closed.

    Keys: W wireframe, S surface, C clipping plane on and off (drag it), X see-through on and off, V first
    view, Q close.

    Parameters
    ----------
    mesh : Mesh, str or Path
        A mesh or a model file.
    found : Found, optional
        Boxes and a curve to draw beside it; the mesh is see-through then.

    Raises
    ------
    RenderError
        If pyvista or a screen is missing.
    MeshError
        If the file cannot be read.
    """
    name = "" if isinstance(mesh, Mesh) else f"{Path(mesh).name}: "
    model = mesh if isinstance(mesh, Mesh) else read_coloured(mesh)
    need_screen()
    window = ViewerWindow(model, name)
    if found:
        window.add(found, model)
    window.plotter.show()


def caption(mesh: Mesh) -> str:
    """Return size and triangle count of a mesh as text.

    `mesh` in mm.
    """
    x, y, z = mesh.size
    return f"{x:.1f} x {y:.1f} x {z:.1f} mm, {len(mesh.triangles):,} triangles"


def _plotter(title: str) -> Any:
    import pyvista

    return pyvista.Plotter(title=title, window_size=[1280, 960], off_screen=False)


class ViewerWindow:
    """A pyvista window with its key bindings."""

    def __init__(self, mesh: Mesh, name: str) -> None:
        self.surface = body(mesh.vertices, mesh.triangles, mesh.colours)
        self.cutting = False
        title = name + caption(mesh)
        self.plotter = _plotter(f"fracslice  {title}")
        self.actor = set_lighting(self.plotter, self.surface, "light", brightness=0.72)
        self.view, self.angle = self.plotter.camera_position, self.plotter.camera.view_angle
        self.plotter.add_text(title, position="upper_left", font_size=10, color=INK)
        self.plotter.add_text(HELP, position="lower_left", font_size=8, color=INK)
        self.plotter.add_axes(color=INK)
        self.bind("c", self.toggle_cut)
        self.bind("v", self.reset)
        self.bind("x", self.see_through)

    def add(self, found: Found, mesh: Mesh) -> None:
        """Draw boxes around what was found in a mesh, and the curve of areas over height."""
        import pyvista

        (x0, y0, z0), (x1, y1, _) = mesh.bounds.tolist()
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2, z0])
        for kind, low, high in found.marks:
            sides = np.column_stack([middle + low, middle + high]).ravel()
            edges = pyvista.Box(sides).extract_feature_edges()
            self.plotter.add_mesh(edges, color=MARKS[kind], line_width=3, lighting=False)
        if found.marks:
            self.see_through()
        for line, (kind, text) in enumerate(counted(found.marks).items()):
            place = (0.84, 0.96 - 0.03 * line)
            self.plotter.add_text(text, place, font_size=10, color=MARKS[kind], viewport=True)
        chart = pyvista.Chart2D(size=CURVE, loc=(1 - CURVE[0], 0), x_label="height, mm", y_label="area, mm2")
        chart.line(found.tops, found.areas, color=INK)
        self.plotter.add_chart(chart)

    def see_through(self) -> None:
        """Switch between a mesh that hides what is in it and one that does not."""
        self.actor.prop.opacity = 1.0 if self.actor.prop.opacity < 1 else CLEAR
        self.plotter.render()

    def bind(self, key: str, action: Callable[[], None]) -> None:
        """Bind a key and remove pyvista's own bindings of it."""
        self.plotter.clear_events_for_key(key, raise_on_missing=False)
        self.plotter.add_key_event(key, action)

    def toggle_cut(self) -> None:
        """Switch the clipping plane on or off."""
        if self.cutting:
            self.close_up()
        else:
            self.cutting = True
            self.plotter.add_plane_widget(self.cut, normal="y", color=INK, outline_translation=False)
        self.plotter.render()

    def cut(self, normal: tuple[float, float, float], origin: tuple[float, float, float]) -> None:
        """Clip the mesh at a plane, on the GPU, so that large models stay interactive."""
        from vtkmodules.vtkCommonDataModel import vtkPlane

        plane = vtkPlane()
        plane.SetNormal(normal)
        plane.SetOrigin(origin)
        self.actor.mapper.RemoveAllClippingPlanes()
        self.actor.mapper.AddClippingPlane(plane)

    def close_up(self) -> None:
        """Remove the clipping plane."""
        self.cutting = False
        self.plotter.clear_plane_widgets()
        self.actor.mapper.RemoveAllClippingPlanes()

    def reset(self) -> None:
        """Restore the first view of the whole model."""
        self.close_up()
        self.actor.prop.style = "Surface"
        self.plotter.camera_position = self.view
        self.plotter.camera.view_angle = self.angle
        self.plotter.reset_camera_clipping_range()
        self.plotter.render()
