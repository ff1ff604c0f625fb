"""A mesh as a camera sees it: in the colours of its vertices, with its edges, cut open by a plane; and what
of it is at a pixel.

Where a plane has cut a closed mesh open, a ray that meets the back of a triangle first has come into the
solid through the plane: such pixels are the section, and need no triangles of their own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import foremost
from ..common.arrays import from_linear, product, to_linear, triple
from ..fields.box import Triple
from ..scene.view import Camera
from .model import AMBIENT, COLOUR, LIGHT, Mesh

Size = tuple[int, int]
"""Width and height, pixels."""

NEAREST = 1e-3
"""Nothing is drawn that is nearer to the eye than this share of the distance of the target."""

SECTION = (206, 104, 70)
"""Colour of a section, sRGB."""

BEHIND = (24, 26, 29)
"""Colour behind the mesh, sRGB."""

LINE, INK = 0.7, 0.45
"""Half the width of an edge, pixels, and its share of the light."""

FAINTEST, CLEAREST = 15.0, 90.0
"""Twice the areas of triangles whose edges are not drawn, as they would cover all, or fully, pixels."""

WIDEST = 120.0
"""Angle of view of cameras that see more than a plane can show, degrees."""


class Projection(NamedTuple):
    """From space to the pixels of a picture."""

    eye: Triple
    axes: NDArray[np.float64]  # directions to the right, up and away from the viewer, [3, 3]
    size: Size
    pixels: float  # pixels of a length of 1 at distance 1, or at any distance by parallel rays
    parallel: bool
    near: float  # least distance that is drawn, scene units

    @classmethod
    def of(cls, camera: Camera, size: Size) -> Projection:
        """The projection of a camera; those that see all around are shown as perspective."""
        axes = np.array([camera.right, camera.above, camera.forward])
        distance = math.dist(camera.eye, camera.target)
        parallel = camera.kind == "orthographic"
        tangent = math.tan(math.radians(min(camera.fov, WIDEST)) / 2)
        pixels = size[1] / 2 / tangent / (distance if parallel else 1.0)
        near = -math.inf if parallel else NEAREST * distance
        return cls(camera.eye, axes, size, pixels, parallel, near)

    def away(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions to the right, up and away from the eye, float64 [n, 3], scene units."""
        return product(points - np.array(self.eye), self.axes.T)

    def seen(self, away: NDArray[np.float64]) -> NDArray[np.float64]:
        """Columns and rows of positions, and how near they are, which is straight along lines; [n, 3]."""
        x, y, z = away.T
        nearness = -z if self.parallel else 1 / z
        scale = self.pixels if self.parallel else self.pixels * nearness
        return np.stack([self.size[0] / 2 + scale * x, self.size[1] / 2 - scale * y, nearness], 1)

    def rays(
        self, columns: NDArray[np.float64], rows: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Starts and unit directions of the rays through points of the picture, [n, 3]."""
        right, up = (columns - self.size[0] / 2) / self.pixels, (self.size[1] / 2 - rows) / self.pixels
        forward = np.full(len(right), 0.0 if self.parallel else 1.0)
        film = product(np.stack([right, up, forward], 1), self.axes)
        eye = np.array(self.eye)
        if self.parallel:
            return eye + film, np.broadcast_to(self.axes[2], film.shape)
        return np.broadcast_to(eye, film.shape), film / np.linalg.norm(film, axis=1)[:, None]

    def ray(self, column: float, row: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Start and unit direction of the ray through a point of the picture."""
        (start,), (along,) = self.rays(np.array([column]), np.array([row]))
        return start, along


@dataclass(frozen=True)
class Plane:
    """A plane; what lies before it, along its normal, is cut away."""

    normal: Triple
    offset: float  # of its points along the normal

    def heights(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far points lie before it, in lengths of the normal, [n]."""
        return product(points, np.array(self.normal)[:, None])[:, 0] - self.offset


class Clipped(NamedTuple):
    """Triangles behind a plane. Vertices are those of the mesh, then those on cut edges."""

    triangles: NDArray[np.int32]
    of: NDArray[np.int64]  # triangle of the mesh that each is part of
    edges: NDArray[np.int32]  # ends of cut edges, [k, 2]
    share: NDArray[np.float64]  # where each is cut, from its first end

    def values(self, given: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of all vertices, given those of the mesh, [n, ...]."""
        if not len(self.edges):
            return given
        share = self.share.reshape(-1, *(1,) * (given.ndim - 1))
        first, second = given[self.edges[:, 0]], given[self.edges[:, 1]]
        return np.concatenate([given, (1 - share) * first + share * second])


def clip(triangles: NDArray[np.int32], heights: NDArray[np.float64]) -> Clipped:
    """Cut off the part of triangles whose heights are above 0.

    `heights`: of the vertices, [n].
    """
    above = heights > 0
    if not above.any():
        return Clipped(triangles, np.arange(len(triangles)), np.empty((0, 2), np.int32), np.empty(0))
    count = above[triangles].sum(1)
    kept = np.flatnonzero(count == 0)
    # each crossing triangle begins at the corner that is alone on its side
    crossing = np.flatnonzero((count == 1) | (count == 2))
    alone = (above[triangles[crossing]] == (count[crossing] == 1)[:, None]).argmax(1)
    corners = np.take_along_axis(triangles[crossing], (alone[:, None] + np.arange(3)) % 3, 1)
    edges = np.stack([corners[:, [0, 1]], corners[:, [0, 2]]], 1).reshape(-1, 2)
    first, second = heights[edges].T
    share = first / (first - second)
    fresh = (len(heights) + np.arange(len(edges), dtype=np.int32)).reshape(-1, 2)
    tip, rest = count[crossing] == 2, count[crossing] == 1
    tips = np.column_stack([corners[tip, 0], fresh[tip]])
    one = np.column_stack([fresh[rest, 0], corners[rest, 1:]])
    two = np.column_stack([fresh[rest, 0], corners[rest, 2], fresh[rest, 1]])
    made = np.concatenate([triangles[kept], tips, one, two]).astype(np.int32)
    of = np.concatenate([kept, crossing[tip], crossing[rest], crossing[rest]])
    return Clipped(np.ascontiguousarray(made), of, edges, share)


class SeenPoint(NamedTuple):
    """What of a mesh is at a point of a picture."""

    point: Triple  # scene units
    normal: Triple  # of the triangle, or of the section
    corners: tuple[int, int, int] | None  # vertices of the triangle; None on a section
    weights: tuple[float, float, float]  # of the corners at the point


@dataclass(frozen=True, eq=False)
class MeshDrawing:
    """A picture of a mesh."""

    pixels: NDArray[np.uint8]  # sRGB [rows, columns, 3]
    view: MeshView
    projection: Projection
    front: NDArray[np.int32]  # number of the triangle at each pixel, of those that are drawn; -1: none
    drawn: Clipped  # triangles that are drawn
    seen: NDArray[np.float64]  # columns, rows and nearness of their vertices

    def at(self, column: float, row: float) -> SeenPoint | None:
        """What is at a point of the picture, pixels; None where nothing is."""
        width, height = self.projection.size
        if not (0 <= column < width and 0 <= row < height):
            return None
        number = int(self.front[int(row), int(column)])
        if number < 0:
            return None
        start, along = self.projection.ray(int(column) + 0.5, int(row) + 0.5)
        owner = self.view.part.of[self.drawn.of[number]]
        corners = self.view.mesh.triangles[owner]
        normal, cut = self.view.normals[owner], self.view.cut
        if cut and along @ normal > 0:
            facing = np.array(cut.normal)
            point = start + (cut.offset - facing @ start) / (facing @ along) * along
            return SeenPoint(triple(point), triple(facing / np.linalg.norm(facing)), None, (0.0, 0.0, 0.0))
        place = self.view.mesh.vertices[corners]
        point = start + ((place[0] - start) @ normal) / (along @ normal) * along
        weights = np.linalg.lstsq(np.vstack([place.T, np.ones(3)]), np.append(point, 1.0), rcond=None)[0]
        a, b, c = corners.tolist()
        return SeenPoint(triple(point), triple(normal), (a, b, c), triple(weights))


@dataclass(frozen=True, eq=False)
class MeshView:
    """A mesh and how it is drawn."""

    mesh: Mesh  # scene units
    edges: bool = False  # whether edges of triangles are drawn
    cut: Plane | None = None

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        """Unit normals of the triangles, [m, 3]."""
        normals = self.mesh.normals
        unit: NDArray[np.float64] = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        return unit

    @cached_property
    def part(self) -> Clipped:
        """Triangles behind the plane."""
        height = self.cut.heights(self.mesh.vertices) if self.cut else np.zeros(len(self.mesh.vertices))
        return clip(self.mesh.triangles, height)

    @cached_property
    def _vertices(self) -> NDArray[np.float64]:
        return self.part.values(self.mesh.vertices)

    @cached_property
    def _colours(self) -> NDArray[np.float64] | None:
        """Colours of the vertices, linear."""
        colours = self.mesh.colours
        return None if colours is None else self.part.values(to_linear(colours / 255.0))

    def draw(self, camera: Camera, size: Size) -> MeshDrawing:
        """Draw it; `size` in pixels."""
        projection = Projection.of(camera, size)
        away = projection.away(self._vertices)
        drawn = clip(self.part.triangles, projection.near - away[:, 2])
        seen = projection.seen(drawn.values(away))
        front = foremost(seen, drawn.triangles, size[::-1])
        rows, columns = np.nonzero(front >= 0)
        pixels = np.full((*front.shape, 3), BEHIND, np.uint8)
        shown = front[rows, columns]
        centres = np.stack([columns, rows], 1) + 0.5
        pixels[rows, columns] = self._shades(projection, drawn, seen, shown, centres)
        return MeshDrawing(pixels, self, projection, front, drawn, seen)

    def _shades(
        self,
        projection: Projection,
        drawn: Clipped,
        seen: NDArray[np.float64],
        shown: NDArray[np.int32],
        centres: NDArray[np.floating],
    ) -> NDArray[np.uint8]:
        """Colours of some triangles at the centres of pixels, [n, 3]."""
        corners = drawn.triangles[shown]
        weights, line, area = _weights(seen[corners, :2], centres)
        normals = product(self.normals[self.part.of[drawn.of[shown]]], projection.axes.T)
        towards = normals * (1, 1, -1) * np.where(area > 0, -1, 1)[:, None]
        lit = AMBIENT + (1 - AMBIENT) * np.maximum(towards @ LIGHT, 0)
        own = to_linear(np.array([COLOUR]) / 255.0)
        if self._colours is not None:
            if not projection.parallel:
                weights *= seen[corners, 2]
                weights /= weights.sum(1, keepdims=True)
            own = (weights[:, :, None] * drawn.values(self._colours)[corners]).sum(1)
        light = own * lit[:, None]
        if self.edges:
            shade = (1 - INK) * np.clip((np.abs(area) - FAINTEST) / (CLEAREST - FAINTEST), 0, 1)
            light *= np.where(line < LINE, 1 - shade, 1)[:, None]
        if self.cut:
            light[area > 0] = to_linear(np.array(SECTION) / 255.0)
        return (255 * from_linear(np.minimum(light, 1)) + 0.5).astype(np.uint8)


def _weights(
    corners: NDArray[np.float64], centres: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Weights of the corners of triangles at points of a picture; distance of the points from the nearest
    edge, pixels; and twice the areas of the triangles, which are negative where they face the viewer.

    `corners`: columns and rows, [n, 3, 2]; `centres`: [n, 2].
    """
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]  # each opposite to a corner
    arms = centres[:, None] - corners[:, [1, 2, 0]]
    parts = sides[..., 0] * arms[..., 1] - sides[..., 1] * arms[..., 0]
    area = parts.sum(1)
    line = (np.abs(parts) / np.maximum(np.hypot(sides[..., 0], sides[..., 1]), 1e-30)).min(1)
    return parts / np.where(area == 0, 1, area)[:, None], line, area
