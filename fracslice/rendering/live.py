"""A picture that follows its pilot and its file: rendered in a thread of its own, for a window to show."""

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
"""Seconds to the first picture from a new place."""
AGAIN = 0.2
"""Seconds between looks at the file."""
NEARER = 2.0
"""Depth and precision are chosen anew when the surface is so much nearer or farther than when they were."""
BOLD = 0.5
"""The most of the way to the surface that one step goes."""


@dataclass(frozen=True)
class CameraInput:
    """Where the pilot steers: -1 to 1 each. pace: how often the way to the surface is flown in a second."""

    forward: float = 0.0
    right: float = 0.0
    up: float = 0.0
    pace: float = 1.0

    def flown(self, camera: Camera, room: float, seconds: float) -> Camera:
        """The camera after some time: the nearer the surface, the slower it goes, so that it never gets
        there. room: how far the surface is, in scene units."""
        way = room * min(self.pace * seconds, BOLD) / max(1.0, math.hypot(self.forward, self.right, self.up))
        return camera.moved(way * self.forward, way * self.right, way * self.up)

    @property
    def idle(self) -> bool:
        return self.forward == self.right == self.up == 0


@dataclass(frozen=True, eq=False)
class Shown:
    """What there is to see. pixels: uint8 [height, width, 3], sRGB. camera: where from. room: how far the
    surface is from there, at least, in scene units. trouble: what is wrong with the file."""

    pixels: np.ndarray = field(repr=False)
    done: Pass
    camera: Camera
    room: float
    trouble: str = ""

    @property
    def caption(self) -> str:
        """How far the picture is, in words."""
        text = f"{self.done.samples:.1f} samples a pixel, surface at {self.room:.2g}"
        return f"{text}\n{self.trouble}" if self.trouble else text


class Live:
    """Renders a scene file from where the pilot is, and reads it again whenever it is saved.

    settings: as `Scene.with_values` takes them. size: pixels across and down. Raises `SceneError` for a scene
    that cannot be rendered; what is wrong with a later version of the file stands in `shown.trouble`, and the
    picture stays. Call `close` at the end.
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
        self._work = replace(work or Work(), cancel=threading.Event())  # it ends a pass, not the whole
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
        """Where the picture is seen from."""
        return self._renderer.setup.camera

    @property
    def scene(self) -> Scene:
        """The last one that could be read."""
        return self._scene

    def steer(self, camera_input: CameraInput) -> None:
        """Fly on like this."""
        with self._lock:
            self._camera_input = camera_input
        self._work.cancel.set()

    def turn(self, yaw: float, pitch: float) -> None:
        """Look so many degrees further to the right, and up."""
        with self._lock:
            self._aim = self._aim.turned(yaw, pitch)
        self._work.cancel.set()

    def look(self, camera: Camera) -> None:
        """Be there."""
        with self._lock:
            self._aim = camera
        self._work.cancel.set()

    @property
    def running(self) -> bool:
        """Whether the picture still follows."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Stop rendering. Raises what has stopped it before, if anything did."""
        self._open = False
        self._work.cancel.set()
        self._thread.join()
        if self._failure:
            raise self._failure

    def _run(self) -> None:
        try:
            while self._open:
                self._work.cancel.clear()
                self._step()
        except BaseException as error:
            self._failure = error

    def _step(self) -> None:
        self._follow_file()
        try:
            if not self._moved() and not self._pass():
                self._work.cancel.wait(AGAIN)
        except Cancelled:
            return

    def _pass(self) -> bool:
        """One more pass, unless the picture is complete."""
        done = next(self._renderer.passes(), None)
        if done is None:
            return False
        self.shown = Shown(done.shown, done, self.camera, self._room(), self._trouble)
        return True

    def _moved(self) -> bool:
        """Goes where the pilot steers and shows the picture from there, if that is elsewhere."""
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
        except SceneError:  # there is no looking from inside the solid
            with self._lock:
                self._aim = self.camera
            return False
        return self._pass()

    def _look(self, camera: Camera) -> None:
        what = self._renderer.setup
        room = clearance(what.roots[-1], camera)
        if self._settled / NEARER < room < self._settled * NEARER:
            self._renderer.look(camera, WITHIN)
        else:
            self._renderer = self._made(camera)

    def _made(self, camera: Camera | None) -> Renderer:
        view = replace(self._scene.view, camera=camera)
        made = Renderer(self._scene.root, view, self._size, self._work, self._device)
        self._settled = clearance(made.setup.roots[-1], made.setup.camera)
        return made

    def _room(self) -> float:
        return clearance(self._renderer.setup.roots[-1], self.camera)

    def _read(self) -> Scene:
        return read(self._path).with_values(self._settings)

    def _stamp(self) -> tuple[int, int] | None:
        """What changes when the file is saved; None while it is being replaced."""
        try:
            found = self._path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size

    def _follow_file(self) -> None:
        """Takes up a new version of the file. Its camera counts only if it is another than before."""
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
