"""Interactive window to inspect a mesh, and whether there is a screen."""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..common.messages import lacking
from ..errors import RenderError
from ..mesh.model import Mesh
from ..mesh.models import read_mesh
from .plotter import body, set_lighting


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
HELP = "drag: turn   wheel: zoom   W, S: wires, surface   C: cut open   V: first view   Q: close"


def show(mesh: Mesh | str | Path) -> None:
    """Open a window on a mesh and return when it is closed.

    Keys: W wireframe, S surface, C clipping plane on and off (drag it), V first view, Q close.

    Parameters
    ----------
    mesh : Mesh, str or Path
        A mesh or a model file.

    Raises
    ------
    RenderError
        If pyvista or a screen is missing.
    MeshError
        If the file cannot be read.
    """
    name = "" if isinstance(mesh, Mesh) else f"{Path(mesh).name}: "
    model = mesh if isinstance(mesh, Mesh) else read_mesh(mesh)
    need_screen()
    ViewerWindow(model, name).plotter.show()


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
