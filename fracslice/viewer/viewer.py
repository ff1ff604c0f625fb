"""Interactive window to fly through a scene while its picture refines and its file is edited."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path

from ..common.files import replacing
from ..errors import ExportError
from ..rendering.live import CameraInput, Live
from ..scene.model import to_xml
from ..scene.view import Camera
from ..work import Work
from .canvas import Canvas
from .window import need_screen

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
    live = Live(path, settings, size, work, device, files_outside)
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
