"""Where a studio looks from: moves about the point under the mouse, flights to another view, views that were
left.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import triple
from ..fields.box import Triple
from ..fields.registry import Node
from ..rendering.linking import camera_unit
from ..rendering.live import CameraInput, Live
from ..rendering.setup import optics, ray_bound
from ..scene.view import Camera

NEARER = 1.1
"""Factor of a step of the wheel on the distance from the point under the mouse."""

DEGREES = 0.35
"""Angle that a drag turns by, for each pixel."""

WALK = 0.6
"""Part of the way to a point that a walk to it takes."""

FLIGHT = 0.5
"""Length of a flight to another view, seconds."""

LEFT = 0.6
"""Time at a view after which it can be returned to, seconds."""

MOST = 200
"""Views that can be returned to."""

STEPS = 1000
"""Most steps of the ray through a pixel."""

Pixel = tuple[float, float]
"""Place in the picture, pixels from its upper left corner."""


def surface_at(root: Node, camera: Camera, size: tuple[int, int], at: Pixel) -> Triple | None:
    """Point of the surface that is seen at a place of the picture; None if there is none.

    `size` in pixels.
    """
    function, values = camera_unit(replace(camera, aperture=0.0), size)
    ray = np.array([float(np.asarray(number)) for number in function(*at, 0.0, 0.0, **values)])
    eye, towards = ray[:3], ray[3:]
    field, bound = root.kernel("cpu", "float64"), ray_bound(root)
    seen = optics(camera, size, root, 0.0)
    distance = 0.0
    for _ in range(STEPS):
        place = eye + distance * towards
        step = float(field.points(*place[:, None])[0]) / bound
        if step <= seen.least + seen.cone * distance:
            return triple(place)
        distance += step
        if distance > seen.far:
            return None
    return triple(place)


def turned_about(camera: Camera, pivot: Triple, yaw: float, pitch: float) -> Camera:
    """Turn a camera so that a point keeps its place in the picture.

    `yaw`, `pitch` in degrees.
    """
    turned = camera.turned(yaw, pitch)
    rotation = np.transpose(_axes(turned)) @ _axes(camera)
    eye = pivot + rotation @ np.subtract(camera.eye, pivot)
    target = eye + np.subtract(turned.target, turned.eye)
    return replace(camera, eye=triple(eye), target=triple(target))


def _axes(camera: Camera) -> NDArray[np.float64]:
    return np.array([camera.right, camera.above, camera.forward])


def scaled_about(camera: Camera, pivot: Triple, factor: float) -> Camera:
    """Move a camera to `factor` times its distance from a point, which keeps its place in the picture."""
    eye, target = (triple(pivot + factor * np.subtract(p, pivot)) for p in (camera.eye, camera.target))
    return replace(camera, eye=eye, target=target)


def between(first: Camera, last: Camera, share: float) -> Camera:
    """A view between two; what is no place, direction or angle is that of the first one."""

    def mixed(a: Triple, b: Triple) -> Triple:
        return triple((1 - share) * np.array(a) + share * np.array(b))

    eye, target = mixed(first.eye, last.eye), mixed(first.target, last.target)
    fov = (1 - share) * first.fov + share * last.fov
    return replace(first, eye=eye, target=target, up=mixed(first.up, last.up), fov=fov)


def rounded(camera: Camera) -> Camera:
    """A view whose places have nine digits, to be written."""
    eye, target, up = (triple(np.array([float(f"{x:.9g}") for x in place])) for place in _places(camera))
    return replace(camera, eye=eye, target=target, up=up)


def _places(camera: Camera) -> tuple[Triple, Triple, Triple]:
    return camera.eye, camera.target, camera.up


@dataclass(frozen=True)
class Flight:
    """A flight from one view to another."""

    first: Camera
    last: Camera
    begun: float  # seconds

    def at(self, now: float) -> Camera:
        """The view at a time; it begins and ends at rest."""
        share = min((now - self.begun) / FLIGHT, 1.0)
        return self.last if share == 1 else between(self.first, self.last, share * share * (3 - 2 * share))


class Views:
    """Camera of a live picture, moved by a mouse."""

    def __init__(self, live: Live) -> None:
        self._live = live
        self._pivot: Triple | None = None
        self._flight: Flight | None = None
        self._visited, self._now = list[Camera](), -1
        self._at, self._since = live.aim, time.monotonic()

    @property
    def camera(self) -> Camera:
        """Where the picture is going to be seen from."""
        return self._flight.last if self._flight else self._live.aim

    def surface_at(self, at: Pixel) -> Triple | None:
        """Point of the surface under the mouse."""
        live = self._live
        return surface_at(live.root, live.camera, live.size, at)

    def grip(self, at: Pixel) -> None:
        """Begin to turn around what is under the mouse, or the target where nothing is."""
        self._pivot = self.surface_at(at)

    def orbit(self, right: float, down: float) -> None:
        """Turn around the point that is gripped, as a drag by some pixels says."""
        camera = self._live.aim
        pivot = self._pivot or camera.target
        self.look(turned_about(camera, pivot, DEGREES * right, -DEGREES * down))

    def look_around(self, right: float, down: float) -> None:
        """Turn in place as a drag by some pixels says."""
        self.look(self._live.aim.turned(-DEGREES / 2 * right, DEGREES / 2 * down))

    def approach(self, steps: float, at: Pixel | None = None) -> None:
        """Come nearer to the point under the mouse, or to the target, or go away from it."""
        camera = self._live.aim
        pivot = (self.surface_at(at) if at else None) or camera.target
        if at and pivot != camera.target:
            self.look(scaled_about(camera, pivot, NEARER**-steps))
        else:
            arm = np.subtract(camera.eye, camera.target) * NEARER**-steps
            self.look(replace(camera, eye=triple(np.add(camera.target, arm))))

    def look(self, camera: Camera) -> None:
        """Look from another view at once."""
        self._flight = None
        self._live.look(camera)

    def steer(self, steering: CameraInput) -> None:
        """Fly."""
        if steering != CameraInput(pace=steering.pace):
            self._flight = None
        self._live.steer(steering)

    def walk_to(self, at: Pixel) -> None:
        """Fly a part of the way to the point under the mouse, which becomes the target."""
        point = self.surface_at(at)
        if point is None:
            return
        camera = self.camera
        eye = triple((1 - WALK) * np.array(camera.eye) + WALK * np.array(point))
        self.fly_to(replace(camera, eye=eye, target=point))

    def fly_to(self, camera: Camera) -> None:
        """Fly to a view."""
        self._flight = Flight(self._live.aim, camera, time.monotonic())

    def home(self) -> None:
        """Return to the first view."""
        self.fly_to(self._live.first)

    def back(self, by: int = 1) -> None:
        """Return to the view that was left before; -1 leads forward again."""
        now = self._now - by
        if 0 <= now < len(self._visited):
            self._now = now
            self.fly_to(self._visited[now])

    def forget(self) -> None:
        """Forget the views of another scene."""
        self._flight, self._pivot = None, None
        self._visited, self._now = [], -1

    def advance(self) -> None:
        """Go on with a flight, and remember a view where the camera rests; to be called again and again."""
        now = time.monotonic()
        if self._flight:
            camera = self._flight.at(now)
            if camera is self._flight.last:
                self._flight = None
            self._live.look(camera)
        aim = self._live.aim
        if aim != self._at:
            self._at, self._since = aim, now
        elif now - self._since > LEFT and aim not in self._visited[self._now :][:1]:
            self._visited = [*self._visited[: self._now + 1], aim][-MOST:]
            self._now = len(self._visited) - 1


def depth_of(camera: Camera, point: Triple) -> float:
    """Distance of a point from the plane of the eye, scene units."""
    return float(np.subtract(point, camera.eye) @ np.array(camera.forward))
