"""The face of a cut through a field, in colours by the distance to the surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import product
from ..fields.box import Box
from ..fields.field import Field
from ..mesh.drawing import Plane, Projection, Size
from ..scene.view import Camera
from .solid import graded, legend_of

FLAT = ("perspective", "orthographic")
"""Kinds of cameras whose rays are those of a plane film."""

GRID = 129
"""Places in each direction that the greatest distance on a face is taken from."""

BANDS = 8
"""Bands of equal distance, from the surface to the greatest one."""

LINE = 0.75
"""Brightness of the line between two bands."""


class CutFace:
    """Paints the face of a cut into pictures of it.

    The part of the solid that stays is behind the plane, so nothing hides a face that turns to the viewer.

    Parameters
    ----------
    field : Field
        The solid before it is cut.
    plane : Plane
        What lies before it is cut away.
    box : Box
        Encloses the solid.
    scale : float
        mm per scene unit.
    """

    def __init__(self, field: Field, plane: Plane, box: Box, scale: float) -> None:
        self._kernel, self._plane, self._scale = field.kernel("cpu", "float64"), plane, scale
        self._greatest = max(-float(self._values(_grid(plane, box)).min()), 1e-12)
        self._seen: tuple[object, NDArray[np.bool_], NDArray[np.uint8]] | None = None

    @property
    def legend(self) -> dict[str, Any]:
        """Legend of the colours for a page."""
        return legend_of("distance in the solid", (0.0, self._greatest * self._scale), "mm")

    def over(self, pixels: NDArray[np.uint8], camera: Camera, size: Size) -> NDArray[np.uint8]:
        """Paint the face into a picture, uint8 [rows, columns, 3], that may have fewer pixels than `size`."""
        if camera.kind not in FLAT:
            return pixels
        key = camera, size, pixels.shape[:2]
        if self._seen is None or self._seen[0] != key:
            self._seen = key, *self._look(*key)
        _, face, colours = self._seen
        painted = pixels[..., :3].copy()
        painted[face] = colours
        return painted

    def _look(
        self, camera: Camera, size: Size, shape: tuple[int, ...]
    ) -> tuple[NDArray[np.bool_], NDArray[np.uint8]]:
        """Pixels of a picture of [rows, columns] that show the face, and their colours, [n, 3]."""
        row, column = ((np.indices(shape) + 0.5).T * (size[1] / shape[0], size[0] / shape[1])).T
        points, seen = self._hits(Projection.of(camera, size), column.ravel(), row.ravel())
        depths = np.full(shape, -1.0)
        depths.ravel()[seen] = -self._values(points[seen])
        face = depths >= 0
        band = np.floor(BANDS * depths / self._greatest)
        line = np.zeros(shape, bool)
        line[:, 1:] |= band[:, 1:] != band[:, :-1]
        line[1:] |= band[1:] != band[:-1]
        colours = graded(depths[face], (0.0, self._greatest))
        return face, np.where(line[face][:, None], LINE * colours, colours).astype(np.uint8)

    def _values(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(self._kernel.points(*np.ascontiguousarray(points.T)))

    def _hits(
        self, view: Projection, column: NDArray[np.float64], row: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Where rays meet the plane, from the side that is cut away, [n, 3], and whether they do."""
        start, along = view.rays(column, row)
        height = self._plane.heights(start)
        falls = -product(along, np.array(self._plane.normal)[:, None])[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            away = height / falls
        seen = (height > 0) & (falls > 0) & np.isfinite(away)
        return start + np.where(seen, away, 0.0)[:, None] * along, seen


def _grid(plane: Plane, box: Box) -> NDArray[np.float64]:
    """Places of a plane across an axis, in a box, [n, 3]."""
    axis = int(np.argmax(np.abs(plane.normal)))
    sides = [np.linspace(low, high, GRID) for low, high in zip(box.lo, box.hi, strict=True)]
    sides[axis] = np.array([plane.offset / plane.normal[axis]])
    return np.stack([side.ravel() for side in np.meshgrid(*sides, indexing="ij")], 1)
