"""Live rendering: a background thread that follows camera input and changes of the scene file."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..errors import Cancelled, FracsliceError, SceneError
from ..scene.model import Scene
from ..scene.reader import read
from ..scene.view import Camera
from ..work import Work
from .progressive import Pass, Renderer
from .setup import clearance

WITHIN = 0.03
"""Time budget of the first pass after a camera move, seconds."""
AGAIN = 0.2
"""Interval between checks of the file, seconds."""
NEARER = 2.0
"""Ratio of surface distances, in either direction, at which depth and precision are chosen again."""
BOLD = 0.5
"""Maximum fraction of the distance to the surface per step."""


@dataclass(frozen=True)
class CameraInput:
    """Steering input of the camera.

    Attributes
    ----------
    forward, right, up : float
        Direction of flight, -1 to 1 each.
    pace : float
        Speed, in distances to the surface per second.
    """

    forward: float = 0.0
    right: float = 0.0
    up: float = 0.0
    pace: float = 1.0

    def flown(self, camera: Camera, room: float, seconds: float) -> Camera:
        """Move a camera for some time.

        Speed is proportional to the distance of the surface, so the camera never reaches it.

        Parameters
        ----------
        camera : Camera
            Camera to move.
        room : float
            Distance to the surface, scene units.
        seconds : float
            Duration of the flight.

        Returns
        -------
        Camera
            The moved camera.
        """
        way = room * min(self.pace * seconds, BOLD) / max(1.0, math.hypot(self.forward, self.right, self.up))
        return camera.moved(way * self.forward, way * self.right, way * self.up)

    @property
    def idle(self) -> bool:
        """True if the camera does not move."""
        return self.forward == self.right == self.up == 0


@dataclass(frozen=True, eq=False)
class Shown:
    """Displayed state of a live picture.

    Attributes
    ----------
    pixels : ndarray of uint8, shape (height, width, 3)
        sRGB.
    done : Pass
        Last pass of the picture.
    camera : Camera
        Camera of the picture.
    room : float
        Lower bound of the distance from the camera to the surface, scene units.
    trouble : str
        Error message of the file's current version, or "".
    """

    pixels: np.ndarray = field(repr=False)
    done: Pass
    camera: Camera
    room: float
    trouble: str = ""

    @property
    def caption(self) -> str:
        """Samples per pixel, surface distance and the file's error message, as text."""
        text = f"{self.done.samples:.1f} samples a pixel, surface at {self.room:.2g}"
        return f"{text}\n{self.trouble}" if self.trouble else text


class Live:
    """Live picture of a scene file, which is read again whenever it is saved.

    If a later version of the file is invalid, the picture stays and the message is in `shown.trouble`. Call
    `close` at the end.

    Parameters
    ----------
    path : str or Path
        Scene file.
    settings : sequence of str
        Settings as in `Scene.with_values`.
    size : tuple of int
        Picture width and height, pixels.
    work : Work, optional
        Threads and progress; it is copied with a cancellation event of its own.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.

    Attributes
    ----------
    first : Camera
        Camera of the first picture.
    shown : Shown
        Latest picture.

    Raises
    ------
    SceneError
        If the scene cannot be rendered.
    """

    def __init__(
        self,
        path: str | Path,
        settings: Sequence[str] = (),
        size: tuple[int, int] = (960, 540),
        work: Work | None = None,
        device: str = "auto",
    ) -> None:
        self._path, self._settings, self._size, self._device = Path(path), settings, size, device
        self._work = replace(work or Work(), cancel=threading.Event())  # ends a pass, not the caller's work
        self._saved = self._stamp()
        self._scene = self._read()
        self._renderer = self._made(self._scene.view.camera)
        self.first = self.camera
        self._lock = threading.Lock()
        self._camera_input, self._aim, self._trouble = CameraInput(), self.camera, ""
        self._looked = self._stepped = time.monotonic()
        self._pass()
        self._open = True
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="fracslice live", daemon=True)
        self._thread.start()

    @property
    def camera(self) -> Camera:
        """Camera of the picture."""
        return self._renderer.setup.camera

    @property
    def scene(self) -> Scene:
        """Latest valid version of the scene."""
        return self._scene

    def steer(self, camera_input: CameraInput) -> None:
        """Set the steering input.

        Parameters
        ----------
        camera_input : CameraInput
            Input that holds until the next call.
        """
        with self._lock:
            self._camera_input = camera_input
        self._work.cancel.set()

    def turn(self, yaw: float, pitch: float) -> None:
        """Turn the camera.

        Parameters
        ----------
        yaw, pitch : float
            Angles to the right and up, degrees.
        """
        with self._lock:
            self._aim = self._aim.turned(yaw, pitch)
        self._work.cancel.set()

    def look(self, camera: Camera) -> None:
        """Move the camera to a new place.

        Parameters
        ----------
        camera : Camera
            The new camera.
        """
        with self._lock:
            self._aim = camera
        self._work.cancel.set()

    @property
    def running(self) -> bool:
        """True while the render thread is alive."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Stop rendering. Raises the exception that ended the render thread, if any."""
        self._open = False
        self._work.cancel.set()
        self._thread.join()
        if self._failure:
            raise self._failure

    def _run(self) -> None:
        """Body of the render thread; it keeps the exception that ends it."""
        try:
            while self._open:
                self._work.cancel.clear()
                self._step()
        except BaseException as error:
            self._failure = error

    def _step(self) -> None:
        """Follow the file and the camera; otherwise add a pass, or wait if the picture is complete."""
        self._follow_file()
        try:
            if not self._moved() and not self._pass():
                self._work.cancel.wait(AGAIN)
        except Cancelled:
            return

    def _pass(self) -> bool:
        """Add a pass; False if the picture is complete."""
        done = next(self._renderer.passes(), None)
        if done is None:
            return False
        self.shown = Shown(done.shown, done, self.camera, self._room(), self._trouble)
        return True

    def _moved(self) -> bool:
        """Apply the camera input. If the camera has moved, show the picture from its new place."""
        now = time.monotonic()
        with self._lock:
            if not self._camera_input.idle:
                self._aim = self._camera_input.flown(self._aim, self._room(), now - self._stepped)
            aim = self._aim
        self._stepped = now
        if aim == self.camera:
            return False
        try:
            self._look(aim)
        except SceneError:  # the eye is inside the solid
            with self._lock:
                self._aim = self.camera
            return False
        return self._pass()

    def _look(self, camera: Camera) -> None:
        """Restart the picture from a camera.

        A new renderer is made if the distance to the surface has changed much.
        """
        what = self._renderer.setup
        room = clearance(what.roots[-1], camera)
        if self._settled / NEARER < room < self._settled * NEARER:
            self._renderer.look(camera, WITHIN)
        else:
            self._renderer = self._made(camera)

    def _made(self, camera: Camera | None) -> Renderer:
        """A new renderer of the current scene."""
        view = replace(self._scene.view, camera=camera)
        made = Renderer(self._scene.root, view, self._size, self._work, self._device)
        self._settled = clearance(made.setup.roots[-1], made.setup.camera)
        return made

    def _room(self) -> float:
        """Lower bound of the distance from the camera to the surface."""
        return clearance(self._renderer.setup.roots[-1], self.camera)

    def _read(self) -> Scene:
        return read(self._path).with_values(self._settings)

    def _stamp(self) -> tuple[int, int] | None:
        """Modification time and size of the file; None while it is being replaced."""
        try:
            found = self._path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size

    def _follow_file(self) -> None:
        """Load a new version of the file.

        Its camera is used only if it differs from the previous version's.
        """
        now, saved = time.monotonic(), self._saved
        if now - self._looked < AGAIN:
            return
        self._looked, self._saved = now, self._stamp() or saved
        if self._saved == saved:
            return
        before = self._scene
        try:
            self._scene = self._read()
            moved = self._scene.view.camera != before.view.camera
            self._renderer = self._made(self._scene.view.camera if moved else self.camera)
            self._trouble = ""
        except FracsliceError as error:
            self._scene, self._trouble = before, str(error)
        with self._lock:
            self._aim = self.camera
        self.shown = replace(self.shown, trouble=self._trouble)
