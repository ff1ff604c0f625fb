"""Interactive window to fly through a scene while its picture refines and its file is edited.

The window is VTK's own: pyvista's installs an interactor style with keys and gestures of its own.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from ..common.files import replacing
from ..errors import ExportError
from ..rendering import Pass
from ..rendering.live import CameraInput, Live, SceneFile
from ..scene.model import to_xml
from ..scene.view import Camera
from ..work import Work
from .window import need_screen

COLOUR = (0.96, 0.96, 0.96)
FONT = 15
"""Height of the text, pixels."""


class Canvas:
    """Window without an interactor style: it does what its handlers do, and nothing else.

    `size` in pixels.
    """

    def __init__(self, title: str, size: tuple[int, int], help_text: str) -> None:
        for module in (
            "UI",
            "OpenGL2",
            "FreeType",
        ):  # register the platform's interactor and window, and text
            import_module(f"vtkmodules.vtkRendering{module}")
        from vtkmodules.vtkCommonDataModel import vtkImageData
        from vtkmodules.vtkRenderingCore import (
            vtkImageActor,
            vtkRenderer,
            vtkRenderWindow,
            vtkRenderWindowInteractor,
        )

        self.image, self._renderer, self.window = vtkImageData(), vtkRenderer(), vtkRenderWindow()
        actor = vtkImageActor()
        actor.SetInputData(self.image)
        self._renderer.AddActor(actor)
        self._upper, lower = _text(over=True), _text(over=False)
        for text in (self._upper, lower):
            self._renderer.AddViewProp(text)
        lower.SetInput(help_text)
        self.window.SetWindowName(title)
        self.window.SetSize(*size)
        self.window.AddRenderer(self._renderer)
        interactor: Any = vtkRenderWindowInteractor
        self.interactor = interactor()
        self.interactor.SetRenderWindow(self.window)
        self.interactor.SetInteractorStyle(None)
        self.hidden = False

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the window, pixels."""
        width, height = self.window.GetSize()
        return max(width, 1), max(height, 1)

    def on(self, event: str, act: Callable[[], None]) -> None:
        """Call a function at every event of a name."""
        self.interactor.AddObserver(event, lambda *_: act())

    def open(self, tick: int) -> None:
        """Show the window until `close`, with a timer event every `tick` milliseconds.

        `tick`: milliseconds.
        """
        self.interactor.Initialize()
        self.interactor.CreateRepeatingTimer(tick)
        self.interactor.Start()
        self.window.Finalize()

    def show(self) -> None:
        """Show the window and return; `handle_events` must be called from time to time, `hide` at the end."""
        self.on("ExitEvent", self.hide)
        self.interactor.Initialize()

    def handle_events(self) -> None:
        """Handle the events of the window, without waiting for any."""
        if not self.hidden:
            self.interactor.ProcessEvents()

    def hide(self) -> None:
        """Close the window of `show`; nothing is drawn from then on."""
        if not self.hidden:
            self.hidden = True
            self.window.Finalize()

    def close(self) -> None:
        """End `open`."""
        self.interactor.TerminateApp()

    def draw(self, pixels: np.ndarray, text: str) -> None:
        """Draw a picture as large as the window allows without stretching it.

        `pixels`: uint8 (height, width, 3).
        """
        if self.hidden:
            return
        from vtkmodules.util import numpy_support

        to_vtk: Any = numpy_support.numpy_to_vtk
        rows, columns, _ = pixels.shape
        flipped = np.ascontiguousarray(pixels[::-1]).reshape(-1, 3)
        self.image.SetDimensions(columns, rows, 1)
        self.image.GetPointData().SetScalars(to_vtk(flipped, deep=True))
        self._upper.SetInput(text)
        width, height = self.size
        x, y = (columns - 1) / 2, (rows - 1) / 2
        camera = self._renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(x, y, 0)
        camera.SetPosition(x, y, 1)
        camera.SetParallelScale(max(rows, columns * height / width) / 2)
        camera.SetClippingRange(0.5, 1.5)
        self.window.Render()


def _text(over: bool) -> Any:
    """Text actor at the upper or lower left of the window."""
    from vtkmodules.vtkRenderingCore import vtkTextActor

    actor = vtkTextActor()
    style = actor.GetTextProperty()
    style.SetFontSize(FONT)
    style.SetColor(*COLOUR)
    style.ShadowOn()
    if over:
        style.SetVerticalJustificationToTop()
    place = actor.GetPositionCoordinate()
    place.SetCoordinateSystemToNormalizedViewport()
    place.SetValue(0.01, 0.985 if over else 0.015)
    return actor


LARGEST = (1280, 800)
"""Largest width and height of the window, pixels."""
LOOK = 0.02
"""Interval between two looks at the events of the window, seconds."""


def previewed(passes: Iterator[Pass], title: str, size: tuple[int, int]) -> Iterator[Pass]:
    """Show every pass in a window until the last one, or until the window is closed.

    Passes are made in another thread, so that the window can be moved and resized meanwhile.

    Parameters
    ----------
    passes : iterator of Pass
        The passes.
    title : str
        Title of the window.
    size : tuple of int
        Width and height of the picture, pixels.

    Yields
    ------
    Pass
        The same passes.

    Raises
    ------
    RenderError
        If pyvista or a screen is missing.
    """
    need_screen()
    scale = min(1.0, *(most / n for most, n in zip(LARGEST, size, strict=True)))
    canvas = Canvas(title, (max(int(scale * size[0]), 1), max(int(scale * size[1]), 1)), "")
    canvas.show()
    try:
        with ThreadPoolExecutor(1) as pool:
            while done := _await_pass(pool.submit(next, passes, None), canvas):
                text = f"{done.samples:.1f} samples a pixel, error {done.error:.2g}"
                canvas.draw(done.shown, text)
                yield done
    finally:
        canvas.hide()


def _await_pass(made: Future[Pass | None], canvas: Canvas) -> Pass | None:
    """Result of a pass under way; events of the window are handled meanwhile."""
    while not wait([made], LOOK).done:
        canvas.handle_events()
    return made.result()


MOVES = {
    "w": ("forward", 1.0),
    "s": ("forward", -1.0),
    "d": ("right", 1.0),
    "a": ("right", -1.0),
    "r": ("up", 1.0),
    "f": ("up", -1.0),
    "right": ("yaw", 1.0),
    "left": ("yaw", -1.0),
    "up": ("pitch", 1.0),
    "down": ("pitch", -1.0),
    "e": ("roll", 1.0),
    "q": ("roll", -1.0),
}
"""Axis and direction of each key that moves or turns the camera while it is held."""
PACES = {str(digit): 2.0 ** (digit - 5) for digit in range(1, 10)}
"""Pace of each speed key: 5 is 1, and the next one is twice as fast."""
SLOWEST = 2.0**-10
"""Slowest pace; the fastest one is its inverse."""
RELEASE = 0.05
"""Delay, in seconds, after which a key release counts: key repeat sends releases and presses continuously."""


@dataclass
class Controls:
    """Keys that are held, pace, and pointer."""

    pace: float = 1.0  # speed, in distances to the surface per second
    locked: bool = False  # true if the camera must not move
    looking: bool = False  # true if the camera follows the pointer without a button
    # pointer position up to which a drag or a look has been followed, pixels
    grip: tuple[int, int] | None = None
    _held: dict[str, float | None] = field(default_factory=dict)

    def press(self, key: str) -> None:
        """Hold a key of `MOVES`, or choose the pace of a key of `PACES`."""
        self.pace = PACES.get(key, self.pace)
        if key in MOVES:
            self._held[key] = None

    def hurry(self, factor: float) -> None:
        """Multiply the pace, within `SLOWEST` and its inverse."""
        self.pace = min(max(self.pace * factor, SLOWEST), 1 / SLOWEST)

    def let_go(self) -> None:
        """Release all keys at once."""
        self._held.clear()

    def release(self, key: str) -> None:
        """Release a key once `RELEASE` seconds pass without a press."""
        if key in self._held:
            self._held[key] = time.monotonic()

    @property
    def input(self) -> CameraInput:
        """Camera input of the keys that are held."""
        late = time.monotonic() - RELEASE
        self._held = {key: since for key, since in self._held.items() if since is None or since > late}
        axes: dict[str, float] = {}
        for key in () if self.locked else self._held:
            axis, direction = MOVES[key]
            axes[axis] = axes.get(axis, 0.0) + direction
        return CameraInput(**axes, pace=self.pace)

    def turn(self, to: tuple[int, int], degrees: float) -> tuple[float, float]:
        """Follow the pointer.

        While a button drags, the picture follows the pointer; while looking, the camera does.

        `to`: pixels from the lower left; `degrees`: angle of a pixel, degrees. Returns yaw, pitch in
        degrees.
        """
        if self.locked or self.grip is None:
            self.grip = to if self.looking else None
            return 0.0, 0.0
        x, y = (b - a for a, b in zip(self.grip, to, strict=True))
        self.grip = to
        factor = degrees if self.looking else -degrees
        return factor * x, factor * y


FASTER = 1.25
"""Factor of the wheel on the pace."""
TICK = 20
"""Timer interval, milliseconds."""
PATIENCE = 0.2
"""Time, in seconds, after which the making of a renderer is displayed."""
NOTICE = 3.0
"""Time, in seconds, for which a message is displayed."""
EDGE = 0.1
"""Margin of the window, as a fraction of its size, from which the pointer is put back to the middle."""
HELP = """\
W S A D R F: fly   Q E: roll   1 to 9, wheel: pace
drag, arrows: look   M: mouse look   L: lock
.: save the view   V: first view   Esc: close"""


def fly(
    path: str | Path,
    settings: Sequence[str] = (),
    size: tuple[int, int] = (960, 540),
    work: Work | None = None,
    device: str = "auto",
    files_outside: bool = False,
) -> Camera:
    """Open a window on a scene file.

    Keys: W, S, A, D, R, F fly forward, back, left, right, up and down, more slowly near the surface; the
    arrows and dragging turn the camera, Q and E roll it. 1 to 9 and the wheel choose the pace. M toggles
    mouse look, L locks the camera, "." saves the view as a scene file in the current folder, V returns to the
    first view, Escape closes. The file is read again whenever it is saved.

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
    files_outside : bool
        Whether models may lie outside of the scene's folder.

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
    live = Live(SceneFile(Path(path), settings, files_outside), size, work, device)
    try:
        Viewer(live, size, work.cancel.is_set).open()
    finally:
        live.close()
    work.check()
    return live.camera


class Viewer:
    """Window of a live picture, with its controls.

    `size` in pixels.
    """

    def __init__(self, live: Live, size: tuple[int, int], stopped: Callable[[], bool]) -> None:
        self.live, self.stopped = live, stopped
        self.controls = Controls()
        self.canvas = Canvas(f"fracslice  {live.scene.name}", size, HELP)
        self.message, self.since = "", 0.0
        self.drawn: tuple[object, ...] = ()
        self.actions: dict[str, Callable[[], None]] = {
            "escape": self.canvas.close,
            "v": self.reset,
            "m": self.toggle_look,
            "l": self.toggle_lock,
            "period": self.save,
        }

    def open(self) -> None:
        """Show the window until it is closed."""
        interactor = self.canvas.interactor
        for event, act in {
            "TimerEvent": self.tick,
            "KeyPressEvent": lambda: self.press(interactor.GetKeySym().lower()),
            "KeyReleaseEvent": lambda: self.controls.release(interactor.GetKeySym().lower()),
            "LeftButtonPressEvent": lambda: self.grasp(interactor.GetEventPosition()),
            "LeftButtonReleaseEvent": lambda: self.grasp(None),
            "MouseMoveEvent": lambda: self.move(interactor.GetEventPosition()),
            "MouseWheelForwardEvent": lambda: self.hurry(FASTER),
            "MouseWheelBackwardEvent": lambda: self.hurry(1 / FASTER),
        }.items():
            self.canvas.on(event, act)
        self.tick()
        self.canvas.open(TICK)

    def tick(self) -> None:
        """Steer by the keys that are held, and draw what has changed."""
        if self.stopped() or not self.live.running:
            self.canvas.close()
        self.live.steer(self.controls.input)
        self.live.resize(self.canvas.size)
        now = self.live.shown, self.canvas.size, self.caption
        if now != self.drawn:
            self.drawn = now
            self.canvas.draw(now[0].pixels, now[2])

    @property
    def caption(self) -> str:
        """State of the picture and the controls, the last message and the file's error message."""
        shown, making, now = self.live.shown, self.live.making, time.monotonic()
        state = f"{shown.samples:.0f} samples per pixel" if shown.samples else "draft"
        lines = [
            f"{state}   surface at {shown.distance:.2g}   pace {self.controls.pace:.2g}",
            *(["compiling ..."] if making and now - making > PATIENCE else []),
            *(["camera locked"] if self.controls.locked else []),
            *(["mouse look"] if self.controls.looking else []),
            *([self.message] if now - self.since < NOTICE else []),
            shown.problem,
        ]
        return "\n".join(filter(None, lines))

    def press(self, key: str) -> None:
        """Handle a key press, including key repeat."""
        self.controls.press(key)
        if act := self.actions.get(key):
            act()

    def hurry(self, factor: float) -> None:
        """Multiply the pace."""
        self.controls.hurry(factor)

    def grasp(self, at: tuple[int, int] | None) -> None:
        """Begin or end a drag; mouse look ends by its key only.

        `at` in pixels.
        """
        if not self.controls.looking:
            self.controls.grip = at

    def move(self, to: tuple[int, int]) -> None:
        """Follow the pointer; in mouse look, put it back to the middle before it leaves the window.

        `to` in pixels.
        """
        size = self.canvas.size
        yaw, pitch = self.controls.turn(to, self.live.camera.fov / size[1])
        if yaw or pitch:
            self.live.turn(yaw, pitch)
        if self.controls.looking and any(not EDGE < p / s < 1 - EDGE for p, s in zip(to, size, strict=True)):
            self.canvas.window.SetCursorPosition(size[0] // 2, size[1] // 2)
            self.controls.grip = None

    def toggle_look(self) -> None:
        """Begin or end mouse look."""
        self.controls.looking, self.controls.grip = not self.controls.looking, None

    def toggle_lock(self) -> None:
        """Lock or release the camera."""
        self.controls.locked = not self.controls.locked

    def reset(self) -> None:
        """Return to the first view, unless the camera is locked."""
        if not self.controls.locked:
            self.controls.let_go()  # a key that was just released would move on from there
            self.live.steer(self.controls.input)
            self.live.look(self.live.first)

    def save(self) -> None:
        """Save the view as a scene file in the current folder."""
        scene, camera = self.live.scene, self.live.camera
        view = replace(scene, view=replace(scene.view, camera=camera))
        path = next(p for k in count(1) if not (p := Path(f"{scene.name}-view{k}.xml")).exists())
        try:
            with replacing(path) as file:
                file.write(to_xml(view).encode())
            self.message = f"saved {path}"
        except ExportError as error:
            self.message = str(error)
        self.since = time.monotonic()
