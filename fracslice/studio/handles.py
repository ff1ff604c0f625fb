"""The light that is chosen in the tree, as a point in the picture that can be dragged."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import triple
from ..mesh.drawing import Projection, Size
from ..scene.view import Camera, Light
from .document import Document, Place
from .measuring import Mark
from .views import Pixel

COLOUR = (255, 214, 90)
"""Colour of a handle, sRGB."""

NEAR = 14.0
"""Distance from a handle within which it is taken hold of, pixels."""

SUN = 0.3
"""Distance from the middle of the view at which the direction of a sun is shown, distances of the eye."""


@dataclass(frozen=True)
class LightHandle:
    """A lamp at its place, or a sun in its direction from the middle of the view."""

    place: Place  # of its element
    light: Light

    @classmethod
    def of(cls, document: Document) -> LightHandle | None:
        """The handle of the element that is chosen; None if it has none."""
        tag = document.chosen
        if tag is None or tag.name != Light.element or document.problem:
            return None
        places = [other.place for other in document.root.children if other.name == Light.element]
        light = document.scene.view.lights[places.index(tag.place)] if tag.place in places else None
        return cls(tag.place, light) if light and light.kind in ("lamp", "sun") else None

    def _point(self, camera: Camera) -> NDArray[np.float64]:
        position = np.array(self.light.position, float)
        if self.light.kind == "lamp":
            return position
        away = SUN * math.dist(camera.eye, camera.target)
        return np.asarray(np.array(camera.target) + away * position / np.linalg.norm(position))

    def mark(self, camera: Camera) -> Mark:
        """Its mark over the picture."""
        return Mark(self._point(camera)[None], COLOUR, False, self.light.kind)

    def is_at(self, pixel: Pixel, camera: Camera, size: Size) -> bool:
        """True if a pixel is on it."""
        view = Projection.of(camera, size)
        away = view.away(self._point(camera)[None])
        if away[0, 2] <= view.near:
            return False
        column, row, _ = view.seen(away)[0]
        return math.dist((column, row), pixel) < NEAR

    def dragged(self, pixel: Pixel, camera: Camera, size: Size) -> LightHandle:
        """The handle at another pixel: a lamp as far from the film as before, a sun on its sphere."""
        view, point = Projection.of(camera, size), self._point(camera)
        start, along = view.ray(*pixel)
        if self.light.kind == "lamp":
            depth = view.axes[2]
            moved = start + ((point - start) @ depth) / (along @ depth) * along
        else:
            middle = np.array(camera.target)
            to_middle = (middle - start) @ along
            nearest = start + to_middle * along - middle
            inside = max((point - middle) @ (point - middle) - nearest @ nearest, 0.0)
            side = math.copysign(1.0, (point - middle) @ along)
            direction = nearest + side * math.sqrt(inside) * along
            moved = direction * np.linalg.norm(self.light.position) / np.linalg.norm(direction)
        position = triple(np.array([float(f"{number:.4g}") for number in moved]))
        return replace(self, light=replace(self.light, position=position))
