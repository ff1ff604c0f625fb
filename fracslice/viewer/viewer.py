"""A window to fly through a scene in, while its picture sharpens and its file is edited."""

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
"""Milliseconds between looks at what is new."""
LIFTED = 0.05
"""Seconds after which a key that was lifted is: a key held down is lifted and pressed again all the time."""
TEXT: dict[str, Any] = {"font_size": 9, "color": "#f4f5f5", "shadow": True}
HELP = "drag: look around   W, S, A, D, R, F: fly   wheel: pace   V: first view   Q: close"


def fly(
    path: str | Path,
    settings: Sequence[str] = (),
    size: tuple[int, int] = (960, 540),
    work: Work | None = None,
    device: str = "auto",
) -> Camera:
    """Open a window on a scene file and return the last camera when it is closed.

    Keys: W, S, A, D, R, F fly forward, back, left, right, up and down, the slower the nearer the surface is;
    dragging looks around, the wheel changes the pace, V goes back to the first view, Q closes. The file is
    read again whenever it is saved. settings: as `Scene.with_values` takes them. size: pixels.
    Raises `RenderError` when there is no pyvista or no screen, `SceneError` for a scene that cannot be
    rendered, `Cancelled`.
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
    """What the keys that are held down ask for."""
    ways = {"forward": 0.0, "right": 0.0, "up": 0.0}
    for key in held:
        axis, way = AXES[key]
        ways[axis] += way
    return CameraInput(**ways, pace=pace)


class Viewer:
    """A pyvista window with its keys. stopped: whether somebody outside wants it closed."""

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
        """Show it until it is closed."""
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
        """Show what is new."""
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
        """This is the picture."""
        self.shown = shown
        self.image.point_data["picture"] = np.ascontiguousarray(shown.pixels[::-1].reshape(-1, 3))
        self.caption.set_text("upper_left", shown.caption)

    def press(self, key: str) -> None:
        """A key goes down, or is held."""
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
        """A key goes up, or is held."""
        if key in self.held:
            self.lifted[key] = time.monotonic()

    def hurry(self, factor: float) -> None:
        """Fly faster, or slower."""
        self.pace *= factor
        self.steer()

    def steer(self) -> None:
        self.live.steer(steered(self.held, self.pace))

    def grasp(self, at: tuple[int, int] | None) -> None:
        """The picture is held there, or let go."""
        self.grip = at

    def drag(self, to: tuple[int, int]) -> None:
        """What is held follows the pointer."""
        if self.grip is None:
            return
        degrees = self.live.camera.fov / self.plotter.window_size[1]
        self.live.turn((self.grip[0] - to[0]) * degrees, (self.grip[1] - to[1]) * degrees)
        self.grip = to


def _whole_window(image: Any) -> Any:
    """An image as what fills the window, however large that is."""
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
