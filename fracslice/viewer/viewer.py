"""Interactive window to fly through a scene while its picture refines and its file is edited."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fracslice.rendering.live import CameraInput, Live, Shown
from fracslice.scene.view import Camera
from fracslice.viewer.screen import need_screen
from fracslice.work import Work

AXES = {
    "w": ("forward", 1.0),
    "s": ("forward", -1.0),
    "d": ("right", 1.0),
    "a": ("right", -1.0),
    "r": ("up", 1.0),
    "f": ("up", -1.0),
}
FASTER = 1.25
TICK = 20
"""Timer interval, milliseconds."""
LIFTED = 0.05
"""Delay, in seconds, after which a key release counts: key repeat sends releases and presses continuously."""
TEXT: dict[str, Any] = {"font_size": 9, "color": "#f4f5f5", "shadow": True}
HELP = "drag: look around   W, S, A, D, R, F: fly   wheel: pace   V: first view   Q: close"


def fly(
    path: str | Path,
    settings: Sequence[str] = (),
    size: tuple[int, int] = (960, 540),
    work: Work | None = None,
    device: str = "auto",
) -> Camera:
    """Open a window on a scene file.

    Keys: W, S, A, D, R, F fly forward, back, left, right, up and down, more slowly near the surface; dragging
    looks around, the wheel changes the pace, V returns to the first view, Q closes. The file is read again
    whenever it is saved.

    Parameters
    ----------
    path : str or Path
        Scene file.
    settings : sequence of str
        Settings as in `Scene.with_values`.
    size : tuple of int
        Window width and height, pixels.
    work : Work, optional
        Threads, progress and cancellation.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.

    Returns
    -------
    Camera
        Camera at the time the window was closed.

    Raises
    ------
    RenderError
        If pyvista or a screen is missing.
    SceneError
        If the scene cannot be rendered.
    Cancelled
        If the work was cancelled.
    """
    need_screen()
    work = work or Work()
    live = Live(path, settings, size, work, device)
    try:
        Viewer(live, size, work.cancel.is_set).open()
    finally:
        live.close()
    work.check()
    return live.camera


def steered(held: Iterable[str], pace: float) -> CameraInput:
    """Convert pressed keys to camera input.

    Parameters
    ----------
    held : iterable of str
        Keys of `AXES` that are held down.
    pace : float
        Speed, in distances to the surface per second.

    Returns
    -------
    CameraInput
        The input.
    """
    ways = {"forward": 0.0, "right": 0.0, "up": 0.0}
    for key in held:
        axis, way = AXES[key]
        ways[axis] += way
    return CameraInput(**ways, pace=pace)


class Viewer:
    """A pyvista window with its key bindings.

    Parameters
    ----------
    live : Live
        The live picture.
    size : tuple of int
        Picture width and height, pixels.
    stopped : callable
        Returns True when the window must close.
    """

    def __init__(self, live: Live, size: tuple[int, int], stopped: Callable[[], bool]) -> None:
        import pyvista

        self.live, self.stopped = live, stopped
        self.pace, self.held = 1.0, set[str]()
        self.lifted: dict[str, float] = {}
        self.grip: tuple[int, int] | None = None
        self.image = pyvista.ImageData(dimensions=(*size, 1))
        self.plotter: Any = pyvista.Plotter(title=f"fracslice  {live.scene.name}", window_size=list(size))
        self.plotter.add_actor(_whole_window(self.image), reset_camera=False)
        self.caption = self.plotter.add_text("", position="upper_left", **TEXT)
        self.plotter.add_text(HELP, position="lower_left", **TEXT)
        self.put(live.shown)

    def open(self) -> None:
        """Show the window until it is closed."""
        interactor = self.plotter.iren.interactor
        self.plotter.iren.initialize()
        interactor.SetInteractorStyle(None)
        for event, act in {
            "TimerEvent": self.tick,
            "KeyPressEvent": lambda: self.press(interactor.GetKeySym().lower()),
            "KeyReleaseEvent": lambda: self.lift(interactor.GetKeySym().lower()),
            "LeftButtonPressEvent": lambda: self.grasp(interactor.GetEventPosition()),
            "LeftButtonReleaseEvent": lambda: self.grasp(None),
            "MouseMoveEvent": lambda: self.drag(interactor.GetEventPosition()),
            "MouseWheelForwardEvent": lambda: self.hurry(FASTER),
            "MouseWheelBackwardEvent": lambda: self.hurry(1 / FASTER),
        }.items():
            interactor.AddObserver(event, lambda *_, act=act: act())
        interactor.CreateRepeatingTimer(TICK)
        self.plotter.show()

    def tick(self) -> None:
        """Timer callback: release keys and show a new picture."""
        now = time.monotonic()
        for key in [key for key, since in self.lifted.items() if now - since > LIFTED]:
            del self.lifted[key]
            self.held.remove(key)
            self.steer()
        if self.stopped() or not self.live.running:
            self.plotter.iren.interactor.TerminateApp()
        if self.live.shown is not self.shown:
            self.put(self.live.shown)
            self.plotter.render()

    def put(self, shown: Shown) -> None:
        """Display a picture.

        Parameters
        ----------
        shown : Shown
            The picture.
        """
        self.shown = shown
        self.image.point_data["picture"] = np.ascontiguousarray(shown.pixels[::-1].reshape(-1, 3))
        self.caption.set_text("upper_left", shown.caption)

    def press(self, key: str) -> None:
        """Handle a key press, including key repeat.

        Parameters
        ----------
        key : str
            Key symbol, lower case.
        """
        if key in ("q", "escape"):
            self.plotter.iren.interactor.TerminateApp()
        elif key == "v":
            self.live.look(self.live.first)
        elif key in AXES:
            self.lifted.pop(key, None)
            if key not in self.held:
                self.held.add(key)
                self.steer()

    def lift(self, key: str) -> None:
        """Handle a key release, including those of key repeat.

        Parameters
        ----------
        key : str
            Key symbol, lower case.
        """
        if key in self.held:
            self.lifted[key] = time.monotonic()

    def hurry(self, factor: float) -> None:
        """Multiply the pace.

        Parameters
        ----------
        factor : float
            Factor on the pace.
        """
        self.pace *= factor
        self.steer()

    def steer(self) -> None:
        """Send the pressed keys to the live picture."""
        self.live.steer(steered(self.held, self.pace))

    def grasp(self, at: tuple[int, int] | None) -> None:
        """Begin or end a drag.

        Parameters
        ----------
        at : tuple of int or None
            Pointer position, pixels; None ends the drag.
        """
        self.grip = at

    def drag(self, to: tuple[int, int]) -> None:
        """Turn the camera so that the grasped point follows the pointer.

        Parameters
        ----------
        to : tuple of int
            Pointer position, pixels.
        """
        if self.grip is None:
            return
        degrees = self.live.camera.fov / self.plotter.window_size[1]
        self.live.turn((self.grip[0] - to[0]) * degrees, (self.grip[1] - to[1]) * degrees)
        self.grip = to


def _whole_window(image: Any) -> Any:
    """An actor that scales an image to the whole window."""
    from vtkmodules.vtkRenderingCore import vtkActor2D, vtkImageMapper

    mapper, actor = vtkImageMapper(), vtkActor2D()
    mapper.SetInputData(image)
    mapper.SetColorWindow(255)
    mapper.SetColorLevel(127.5)
    mapper.RenderToRectangleOn()
    actor.SetMapper(mapper)
    upper_right = actor.GetPosition2Coordinate()
    upper_right.SetCoordinateSystemToNormalizedViewport()
    upper_right.SetValue(1, 1)
    return actor
