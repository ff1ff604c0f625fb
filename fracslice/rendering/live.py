"""Live rendering: a background thread that follows camera input and changes of the scene file, with drafts
while moving.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from ..errors import Cancelled, FracsliceError, SceneError
from ..fields.depth import with_depths_of
from ..fields.registry import Node
from ..scene.model import Scene
from ..scene.reader import read
from ..scene.view import Camera, View
from ..work import Work
from .progressive import Pass, Renderer
from .setup import clearance

NEARER = 2.0
"""Ratio of surface distances, in either direction, at which depth and precision are chosen again."""


class Follower:
    """Renderer of a scene that follows a camera."""

    def __init__(self, root: Node, view: View, work: Work, device: str) -> None:
        self._root, self._view, self._work, self._device = root, view, work, device
        self._renderer: Renderer | None = None
        self._distance_then = 0.0

    def follow(self, camera: Camera | None, size: tuple[int, int]) -> Renderer:
        """Return a renderer of an empty picture; it is made again only if depth or size must change.

        `size` in pixels.
        """
        made = self._renderer
        if made and camera and (made.width, made.height) == size and self._near(camera):
            made.look(camera)
            return made
        view = replace(self._view, camera=camera) if camera else self._view
        self._renderer = made = Renderer(self._root, view, size, self._work, self._device)
        self._distance_then = self.distance
        return made

    def _near(self, camera: Camera) -> bool:
        """True if depth and precision suit the camera's distance to the surface."""
        assert self._renderer
        try:
            distance = clearance(self.root, camera)
        except SceneError:  # inside the solid at this depth
            return False
        return self._distance_then / NEARER < distance < self._distance_then * NEARER

    @property
    def root(self) -> Node:
        """The scene with the depths that suit the camera's distance to the surface."""
        assert self._renderer
        return self._renderer.setup.root

    @property
    def distance(self) -> float:
        """Lower bound of the distance from the camera to the surface, scene units."""
        assert self._renderer
        return clearance(self.root, self._renderer.setup.camera)


POLL = 0.2
"""Interval between checks of the file, seconds."""


class SceneSource(Protocol):
    """Where a live picture has its scene from."""

    def read(self) -> Scene:
        """The scene as it is now; raises `SceneError` if it is invalid."""

    def changed(self) -> bool:
        """Whether it is another than at the last call."""


class SceneFile:
    """Scene of a file that another program may save again."""

    def __init__(self, path: Path, settings: Sequence[str] = (), files_outside: bool = False) -> None:
        self._path, self._settings, self._files_outside = path, settings, files_outside
        self._checked, self._saved = time.monotonic(), self._stamp()

    def read(self) -> Scene:
        """See `SceneSource.read`."""
        return read(self._path, files_outside=self._files_outside).with_values(self._settings)

    def changed(self) -> bool:
        """Return whether the file was saved since the last call; the disk is asked at most every `POLL`."""
        now, saved = time.monotonic(), self._saved
        if now - self._checked < POLL:
            return False
        self._checked, self._saved = now, self._stamp() or saved
        return self._saved != saved

    def _stamp(self) -> tuple[int, int] | None:
        """Modification time and size of the file; None while it is being replaced."""
        try:
            status = self._path.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size


BOLD = 0.5
"""Maximum fraction of the distance to the surface per step."""
TURN = 60.0
"""Rate of turning and rolling by keys, degrees per second."""


@dataclass(frozen=True)
class CameraInput:
    """Steering input of the camera."""

    forward: float = 0.0  # direction of flight, -1 to 1 each
    right: float = 0.0
    up: float = 0.0
    yaw: float = 0.0  # rotation to the right, up and clockwise, -1 to 1 each
    pitch: float = 0.0
    roll: float = 0.0
    pace: float = 1.0  # speed, in distances to the surface per second

    def flown(self, camera: Camera, distance: float, seconds: float) -> Camera:
        """Move and turn a camera for some time.

        Speed is proportional to the distance of the surface, so the camera never reaches it.

        `distance` in scene units.
        """
        direction = self.forward, self.right, self.up
        if any(direction):
            length = distance * min(self.pace * seconds, BOLD) / max(1.0, math.hypot(*direction))
            camera = camera.moved(*(length * axis for axis in direction))
        if self.yaw or self.pitch:
            camera = camera.turned(TURN * seconds * self.yaw, TURN * seconds * self.pitch)
        return camera.rolled(TURN * seconds * self.roll) if self.roll else camera


WITHIN = 0.035
"""Aim for the time of a draft, seconds."""
REST = 0.1
"""Time without a move after which the picture sharpens, seconds."""
NOISY = 4
"""Samples of each pixel below which a picture is smoothed."""
SOON = 0.3
"""Time of a sample of every pixel, seconds, above which a picture at rest gets finer in steps before."""
SLOWER, STEADY = 1.5, 0.3
"""Ratio of the time of drafts to that, above which they are coarser, and the weight of the last one in it."""
COARSEST = 8
"""Largest spacing of a draft's pixels."""
FARTHEST = 100.0
"""Distance from the first target that a flight keeps within, in distances of the first eye."""
LONGEST = 0.1
"""Longest step of a flight, seconds: the camera rests while a kernel is compiled."""


@dataclass(frozen=True, eq=False)
class Shown:
    """Displayed state of a live picture."""

    pixels: np.ndarray = field(repr=False)  # sRGB; a draft has fewer pixels than the window
    samples: float  # mean samples per pixel; 0 for a draft
    camera: Camera  # camera of the picture
    distance: float  # lower bound of the distance from the camera to the surface, scene units
    problem: str = ""  # error message of the file's current version, or ""


Drawing = Callable[[Camera, tuple[int, int]], np.ndarray]
"""Draws a scene in another way than by rays, from a camera, in a size, pixels: uint8 [rows, columns, 3]."""


class Live:
    """Live picture of a scene, which is read again whenever its source says that it has changed.

    While the camera moves, the picture is a draft, with fewer pixels and one sample of each; at rest, it
    sharpens. If a later version is invalid, the picture stays and the message is in `shown.problem`. Call
    `close` at the end.

    `size` in pixels.
    """

    def __init__(
        self,
        source: SceneSource,
        size: tuple[int, int] = (960, 540),
        work: Work | None = None,
        device: str = "auto",
    ) -> None:
        self._source, self._size, self._device = source, size, device
        self._refining = replace(work or Work(), cancel=threading.Event())
        self._drafting = replace(self._refining, cancel=threading.Event())  # input must not stop a draft
        self._lock = threading.Lock()
        self._camera_input, self._spacing = CameraInput(), COARSEST // 2
        self._cost = WITHIN * self._spacing**2  # time of a draft with all pixels, seconds
        self._stepped = time.monotonic()
        self.making: float | None = None
        self._drawing: Drawing | None = None
        self._moving: Drawing | None = None
        self._drawn_by: Drawing | None = None
        self._aim: Camera
        self._drawn: tuple[int, int]
        self._resolved: Node | None = None  # the scene of the last draft, with its depths
        self._load(source.read(), None)
        self._open = True
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="fracslice live", daemon=True)
        self._thread.start()

    @property
    def camera(self) -> Camera:
        """Camera of the picture."""
        return self.shown.camera

    @property
    def aim(self) -> Camera:
        """Camera that the picture follows."""
        with self._lock:
            return self._aim

    @property
    def root(self) -> Node:
        """Scene of the picture, with the depths of its last draft."""
        assert self._resolved
        return self._resolved

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._size

    @property
    def running(self) -> bool:
        """True while the render thread is alive."""
        return self._thread.is_alive()

    def steer(self, camera_input: CameraInput) -> None:
        """Set the steering input."""
        if camera_input != self._camera_input:
            self._flown()  # a key held for less than the time of a draft counts, too
            with self._lock:
                self._camera_input = camera_input
            self._refining.cancel.set()

    def turn(self, yaw: float, pitch: float) -> None:
        """Turn the camera.

        `yaw`, `pitch` in degrees.
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

        `size` in pixels.
        """
        if size != self._size:
            self._size = size
            self._refining.cancel.set()

    def draw(self, drawing: Drawing | None, moving: Drawing | None = None) -> None:
        """Show the scene as a drawing has it from now on; None: by rays. It must not raise.

        `moving`: quicker, while the camera moves; by default the same.
        """
        self._drawing, self._moving = drawing, moving
        self._refining.cancel.set()

    def wake(self) -> None:
        """Look at the source at once."""
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
        """Follow the source and the camera; otherwise refine the picture, or wait if it is complete."""
        drawing = self._drawing
        if drawing is None:
            self._follow_source()
        aim, size = self._flown(), self._size
        try:
            if drawing is not None:
                self._draw(drawing, aim, size)
            elif self._drawn_by is not None or aim != self.camera or size != self._drawn:
                self._draft(self._drafts, aim, size)
            elif self.shown.samples or not self._refining.cancel.wait(REST):
                self._sharpen()
        except SceneError:  # the eye is inside the solid, perhaps since a drawing was seen from there
            with self._lock:
                self._aim = self.first if self._drawn_by is not None else self.camera
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

    def _draw(self, drawing: Drawing, camera: Camera, size: tuple[int, int]) -> None:
        """Show a drawing, unless it is shown; it may be seen from inside the solid, too."""
        still = camera == self.camera and size == self._drawn
        if still and drawing is self._drawn_by:
            self._refining.cancel.wait(POLL)
            return
        moving, samples = self._moving, 1.0
        if moving is not None and not still:
            drawing, samples = moving, 0.0
        elif moving is not None and self._drawn_by == moving and self._refining.cancel.wait(REST):
            return
        value = float(self.root.kernel("cpu", "float64").points(*(np.array([c]) for c in camera.eye))[0])
        distance = abs(value) / self.root.bounds.lipschitz
        self.shown = Shown(drawing(camera, size), samples, camera, distance, self._problem)
        self._drawn, self._drawn_by = size, drawing

    def _draft(self, drafts: Follower, camera: Camera | None, size: tuple[int, int]) -> None:
        """Show a draft, and choose the spacing of the next one by the time that it took."""
        spacing = self._spacing
        renderer = self._made(drafts, camera, _coarse(size, spacing))
        start = time.monotonic()
        pixels = _developed(renderer, renderer.draft())
        seconds = time.monotonic() - start
        seen = camera or renderer.setup.camera
        self.shown, self._drawn_by = Shown(pixels, 0.0, seen, drafts.distance, self._problem), None
        self._resolved, self._drawn, self._passes = drafts.root, size, self._sharpened(spacing)
        self._cost += STEADY * (seconds * spacing**2 - self._cost)
        if self._cost > SLOWER * WITHIN * self._spacing**2:
            self._spacing = min(self._spacing + 1, COARSEST)
        elif self._cost < WITHIN * (self._spacing - 1) ** 2:
            self._spacing -= 1

    def _sharpen(self) -> None:
        """Add a pass to the picture at rest, or wait if it is complete."""
        try:
            if next(self._passes, None) is None:
                self._refining.cancel.wait(POLL)
        except Cancelled:  # ends a generator
            self._passes = self._sharpened(self._spacing)
            raise

    def _sharpened(self, spacing: int) -> Iterator[Pass]:
        """Show the picture of every pixel, pass by pass, and until then finer drafts, if that takes long."""
        while self._cost > SOON and (spacing := spacing // 2) > 1:
            renderer = self._made(self._finals, self.camera, _coarse(self._drawn, spacing))
            done = renderer.draft()
            self.shown = replace(self.shown, pixels=_developed(renderer, done))
            yield done
        renderer = self._made(self._finals, self.camera, self._drawn)
        for done in renderer.passes():
            if done.samples < 1:  # in blocks: the smoothed draft is the better picture
                continue
            self.shown = replace(self.shown, pixels=_developed(renderer, done), samples=done.samples)
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
        # the depths of the scene before do for the first draft; to choose them takes longer than to draw it
        near = with_depths_of(scene.root, self._resolved) if self._resolved else scene.root
        drafts = Follower(near, scene.view, self._drafting, self._device)
        self._problem = ""
        self._draft(drafts, camera or scene.view.camera, self._size)
        if near is not scene.root:
            drafts = Follower(scene.root, scene.view, self._drafting, self._device)
        self._drafts = drafts
        self._finals = Follower(scene.root, scene.view, self._refining, self._device)
        self.scene = scene
        if camera is None:
            self.first = self.camera
            self._farthest = FARTHEST * math.dist(self.first.eye, self.first.target)
        with self._lock:
            self._aim = self.camera

    def _follow_source(self) -> None:
        """Load a new version of the scene.

        Its camera is used only if it differs from the previous version's.
        """
        if not self._source.changed():
            return
        try:
            scene = self._source.read()
            moved = scene.view.camera != self.scene.view.camera
            self._load(scene, None if moved else self._aim)
        except FracsliceError as error:
            self._problem = str(error)
            self.shown = replace(self.shown, problem=self._problem)


def _coarse(size: tuple[int, int], spacing: int) -> tuple[int, int]:
    """Size of a picture with every so many pixels, in both directions."""
    return max(size[0] // spacing, 1), max(size[1] // spacing, 1)


def _developed(renderer: Renderer, done: Pass) -> np.ndarray:
    """Picture of a pass, uint8 [height, width, 3]; with less noise where all pixels have few samples.

    A GPU has the next one sooner than the noise of this one is gone.
    """
    noisy = 1 <= done.samples < NOISY and renderer.device == "cpu"
    return done.smooth if noisy else done.shown
