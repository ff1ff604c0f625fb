"""Live rendering: a background thread that follows camera input and changes of the scene file."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..errors import Cancelled, FracsliceError, SceneError
from ..scene.model import Scene
from ..scene.reader import read
from ..scene.view import Camera
from ..work import Work
from .draft import Follower, drafted
from .passes import Pass
from .progressive import Renderer
from .steering import CameraInput
from .watching import POLL, WatchedFile

WITHIN = 0.05
"""Aim for the time of a draft, seconds."""
COARSEST = 8
"""Largest spacing of a draft's pixels."""
READABLE = 4
"""Samples per pixel from which the final picture replaces the draft: fewer are noisier."""
FARTHEST = 100.0
"""Distance from the first target that a flight keeps within, in distances of the first eye."""
LONGEST = 0.1
"""Longest step of a flight, seconds: the camera rests while a kernel is compiled."""


@dataclass(frozen=True, eq=False)
class Shown:
    """Displayed state of a live picture.

    Attributes
    ----------
    pixels : ndarray of uint8, shape (height, width, 3)
        sRGB; a draft has fewer pixels than the window.
    samples : float
        Mean samples per pixel; 0 for a draft.
    camera : Camera
        Camera of the picture.
    distance : float
        Lower bound of the distance from the camera to the surface, scene units.
    problem : str
        Error message of the file's current version, or "".
    """

    pixels: np.ndarray = field(repr=False)
    samples: float
    camera: Camera
    distance: float
    problem: str = ""


class Live:
    """Live picture of a scene file, which is read again whenever it is saved.

    While the camera moves, the picture is a draft with hard lights; at rest, it sharpens. If a later version
    of the file is invalid, the picture stays and the message is in `shown.problem`. Call `close` at the end.

    Parameters
    ----------
    path : str or Path
        Scene file.
    settings : sequence of str
        Settings as in `Scene.with_values`.
    size : tuple of int
        Picture width and height, pixels.
    work : Work, optional
        Threads and progress; it is copied with cancellation events of its own.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.

    Attributes
    ----------
    first : Camera
        Camera of the first picture.
    shown : Shown
        Latest picture.
    scene : Scene
        Latest valid version of the scene.
    making : float or None
        Time at which the renderer under way was begun, by `time.monotonic`: it may need compilation.

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
        self._refining = replace(work or Work(), cancel=threading.Event())
        self._drafting = replace(self._refining, cancel=threading.Event())  # input must not stop a draft
        self._lock = threading.Lock()
        self._camera_input, self._spacing = CameraInput(), COARSEST // 2
        self._stepped = time.monotonic()
        self.making: float | None = None
        self._aim: Camera
        self._file = WatchedFile(self._path)
        self._load(self._read(), None)
        self.first = self.camera
        self._farthest = FARTHEST * math.dist(self.first.eye, self.first.target)
        self._open = True
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="fracslice live", daemon=True)
        self._thread.start()

    def _read(self) -> Scene:
        return read(self._path).with_values(self._settings)

    @property
    def camera(self) -> Camera:
        """Camera of the picture."""
        return self.shown.camera

    @property
    def running(self) -> bool:
        """True while the render thread is alive."""
        return self._thread.is_alive()

    def steer(self, camera_input: CameraInput) -> None:
        """Set the steering input.

        Parameters
        ----------
        camera_input : CameraInput
            Input that holds until the next call.
        """
        if camera_input != self._camera_input:
            self._flown()  # a key held for less than the time of a draft counts, too
            with self._lock:
                self._camera_input = camera_input
            self._refining.cancel.set()

    def turn(self, yaw: float, pitch: float) -> None:
        """Turn the camera.

        Parameters
        ----------
        yaw, pitch : float
            Angles to the right and up, degrees.
        """
        with self._lock:
            self._aim = self._aim.turned(yaw, pitch)
        self._refining.cancel.set()

    def look(self, camera: Camera) -> None:
        """Move the camera to a new place."""
        with self._lock:
            self._aim = camera
        self._refining.cancel.set()

    def resize(self, size: tuple[int, int]) -> None:
        """Render at another size.

        Parameters
        ----------
        size : tuple of int
            Picture width and height, pixels.
        """
        if size != self._size:
            self._size = size
            self._refining.cancel.set()

    def close(self) -> None:
        """Stop rendering. Raises the exception that ended the render thread, if any."""
        self._open = False
        for work in (self._refining, self._drafting):
            work.cancel.set()
        self._thread.join()
        if self._failure:
            raise self._failure

    def _run(self) -> None:
        """Body of the render thread; it keeps the exception that ends it."""
        try:
            while self._open:
                self._refining.cancel.clear()
                self._step()
        except BaseException as error:
            self._failure = error

    def _step(self) -> None:
        """Follow the file and the camera; otherwise refine the picture, or wait if it is complete."""
        self._follow_file()
        aim, size = self._flown(), self._size
        try:
            if aim != self.camera or size != self._drawn:
                self._draft(self._drafts, aim, size)
            elif not self._refine():
                self._refining.cancel.wait(POLL)
        except SceneError:  # the eye is inside the solid
            with self._lock:
                self._aim = self.camera
            self._refining.cancel.wait(POLL)
        except Cancelled:
            return

    def _flown(self) -> Camera:
        """The camera after the time since the last step."""
        with self._lock:
            now = time.monotonic()
            seconds, self._stepped = min(now - self._stepped, LONGEST), now
            distance = min(self.shown.distance, self._farthest)
            aim = self._camera_input.flown(self._aim, distance, seconds)
            if math.dist(aim.eye, self.first.target) < self._farthest:
                self._aim = aim
            return self._aim

    def _draft(self, drafts: Follower, camera: Camera | None, size: tuple[int, int]) -> None:
        """Show a draft, and choose the spacing of the next one by the time that it took."""
        coarse = max(size[0] // self._spacing, 1), max(size[1] // self._spacing, 1)
        renderer = self._made(drafts, camera and replace(camera, aperture=0.0), coarse)
        start = time.monotonic()
        *_, done = renderer.passes(1)
        seconds = time.monotonic() - start
        seen = camera or renderer.setup.camera
        self.shown = Shown(done.shown, 0.0, seen, drafts.distance, self._problem)
        self._drafts, self._drawn, self._passes = drafts, size, self._sharpened(self._spacing > 1)
        if seconds > 1.5 * WITHIN:
            self._spacing = min(self._spacing + 1, COARSEST)
        elif seconds < WITHIN / 2:
            self._spacing = max(self._spacing - 1, 1)

    def _refine(self) -> bool:
        """Add a pass to the picture at rest; False if it is complete."""
        try:
            return next(self._passes, None) is not None
        except Cancelled:  # ends a generator
            self._passes = self._sharpened(False)
            raise

    def _sharpened(self, coarse: bool) -> Iterator[Pass]:
        """Show a draft of every pixel after a coarse one, then the final picture once it has less noise."""
        if coarse:
            sharp = replace(self.camera, aperture=0.0)
            for done in self._made(self._stills, sharp, self._drawn).passes(1):
                yield done
            self.shown = replace(self.shown, pixels=done.shown)
        for done in self._made(self._finals, self.camera, self._drawn).passes():
            if done.samples >= min(READABLE, done.view.film.samples):
                self.shown = replace(self.shown, pixels=done.shown, samples=done.samples)
            yield done

    def _made(self, follower: Follower, camera: Camera | None, size: tuple[int, int]) -> Renderer:
        """Renderer of a follower; `making` has the time at which it was begun."""
        self.making = time.monotonic()
        try:
            return follower.follow(camera, size)
        finally:
            self.making = None

    def _load(self, scene: Scene, camera: Camera | None) -> None:
        """Show a scene from a camera, or from its own; if that fails, the former scene stays."""
        hard, device = drafted(scene.root, scene.view), self._device
        drafts = Follower(scene.root, hard, self._drafting, device)
        self._problem = ""
        self._draft(drafts, camera or scene.view.camera, self._size)
        self._stills = Follower(scene.root, hard, self._refining, device)
        self._finals = Follower(scene.root, scene.view, self._refining, device)
        self.scene = scene
        with self._lock:
            self._aim = self.camera

    def _follow_file(self) -> None:
        """Load a new version of the file.

        Its camera is used only if it differs from the previous version's.
        """
        if not self._file.changed():
            return
        try:
            scene = self._read()
            moved = scene.view.camera != self.scene.view.camera
            self._load(scene, None if moved else self._aim)
        except FracsliceError as error:
            self._problem = str(error)
            self.shown = replace(self.shown, problem=self._problem)
