"""A window to inspect a mesh in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fracslice.mesh.model import Mesh
from fracslice.mesh.reading import read_mesh
from fracslice.viewer.lighting import body, set_lighting
from fracslice.viewer.screen import need_screen

INK = "#303438"
HELP = "drag: turn   wheel: zoom   W, S: wires, surface   C: cut open   V: first view   Q: close"


def show(mesh: Mesh | str | Path) -> None:
    """Open a window on a mesh or a model file and return when it is closed.

    Keys: W wires, S surface, C a plane that cuts the model open (drag it) on and off, V first view, Q close.
    Raises RenderError when there is no pyvista or no screen, MeshError when the file cannot be read.
    """
    name = "" if isinstance(mesh, Mesh) else f"{Path(mesh).name}: "
    model = mesh if isinstance(mesh, Mesh) else read_mesh(mesh)
    need_screen()
    ViewerWindow(model, name).plotter.show()


def caption(mesh: Mesh) -> str:
    """Size and weight of a mesh in words."""
    x, y, z = mesh.size
    return f"{x:.1f} x {y:.1f} x {z:.1f} mm, {len(mesh.triangles):,} triangles"


def _plotter(title: str) -> Any:
    import pyvista

    return pyvista.Plotter(title=title, window_size=[1280, 960], off_screen=False)


class ViewerWindow:
    """A pyvista window with its keys."""

    def __init__(self, mesh: Mesh, name: str) -> None:
        self.surface = body(mesh.vertices, mesh.triangles)
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
        """Let a key mean this alone, whatever pyvista had it do."""
        self.plotter.clear_events_for_key(key, raise_on_missing=False)
        self.plotter.add_key_event(key, action)

    def toggle_cut(self) -> None:
        """A plane to drag that cuts the model open, or the whole again."""
        if self.cutting:
            self.close_up()
        else:
            self.cutting = True
            self.plotter.add_plane_widget(self.cut, normal="y", color=INK, outline_translation=False)
        self.plotter.render()

    def cut(self, normal: tuple[float, float, float], origin: tuple[float, float, float]) -> None:
        """Hide what lies before the plane, on the graphics card, so that large models follow the pointer."""
        from vtkmodules.vtkCommonDataModel import vtkPlane

        plane = vtkPlane()
        plane.SetNormal(normal)
        plane.SetOrigin(origin)
        self.actor.mapper.RemoveAllClippingPlanes()
        self.actor.mapper.AddClippingPlane(plane)

    def close_up(self) -> None:
        """Take the plane away."""
        self.cutting = False
        self.plotter.clear_plane_widgets()
        self.actor.mapper.RemoveAllClippingPlanes()

    def reset(self) -> None:
        """The whole model as at first."""
        self.close_up()
        self.actor.prop.style = "Surface"
        self.plotter.camera_position = self.view
        self.plotter.camera.view_angle = self.angle
        self.plotter.reset_camera_clipping_range()
        self.plotter.render()
