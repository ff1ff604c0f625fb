"""Measuring in the picture of a studio: the surface near a point that is seen, lengths, angles, circles,
spheres and thickness; a view of a place; marks over the picture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import triple
from ..common.messages import significant
from ..fields.box import Box
from ..fields.field import Field
from ..mesh.drawing import Projection
from ..mesh.fit import AROUND
from ..scene.view import Camera

Point = NDArray[np.float64]
"""Three coordinates."""

NEAR, STEP = 2.0, 0.01
"""Distance within which a point is moved to the surface, and steps of differences, pixels."""

FLAT = 1e-3
"""Least curvature that is told from none, of the longest side."""

SAMPLES = 8192
"""Samples along a line through a solid, whose bound may not hold inside."""

HALVINGS = 50
"""Halvings of an interval with a root: all bits of it."""

STEEP = 0.98
"""Greatest cosine between the directions of a view and of what is up in it."""

HELD = 0.03
"""Share of the way to a place at its end that may lie in the solid."""


class Tracer:
    """The surface of a field, and what lies below it and before it; all in scene units.

    `pixel`: size of a pixel there.
    """

    def __init__(self, root: Field, box: Box, pixel: float) -> None:
        self._kernel = root.kernel("cpu", "float64")
        self._longest, self._pixel = math.dist(box.lo, box.hi), pixel

    def values(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """The field at points [n, 3]."""
        return np.asarray(self._kernel.points(*np.ascontiguousarray(points.T)))

    def snapped(self, point: Point) -> Point:
        """Root of the field along the normal at a point that is seen; the point itself, if none is near."""
        normal, reach = self.normal(point), NEAR * self._pixel
        low, high = self.values(point + np.array([[-reach], [reach]]) * normal)
        if not low <= 0 < high:
            return point
        return point + reach * normal - self._root(point + reach * normal, -normal, 0.0, 2 * reach) * normal

    def _root(self, start: Point, along: Point, low: float, high: float) -> float:
        """Way to the surface between two others; the second, where the field has no other sign there."""
        if self.values((start + high * along)[None])[0] > 0:
            return high
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            inside = self.values((start + middle * along)[None])[0] <= 0
            low, high = (low, middle) if inside else (middle, high)
        return high

    def normal(self, point: Point) -> Point:
        """Unit normal of the surface at a point."""
        steps = STEP * self._pixel * np.eye(3)
        slope = self.values(point + steps) - self.values(point - steps)
        return np.asarray(slope / max(float(np.linalg.norm(slope)), 1e-300))

    def radius(self, point: Point) -> float:
        """Radius of mean curvature at a point of the surface, negative in a hollow, infinite where flat."""
        step, shifts = self._pixel, self._pixel * np.eye(3)
        turns = [self.normal(point + shift) - self.normal(point - shift) for shift in shifts]
        mean = sum(float(turn[k]) for k, turn in enumerate(turns)) / (4 * step)
        return 1 / mean if abs(mean) * self._longest > FLAT else math.inf

    def thickness(self, point: Point) -> float:
        """Thickness of the solid below a point of its surface, along the normal; infinite without end."""
        inwards = -self.normal(point)
        ways = self._longest * np.arange(1, SAMPLES + 1) / SAMPLES
        outside = self.values(point + ways[:, None] * inwards) > 0
        first = int(outside.argmax())
        if not outside.any():
            return math.inf
        if first == 0:
            return 0.0
        far = point + ways[first] * inwards
        return float(ways[first] - self._root(far, -inwards, 0.0, float(ways[first] - ways[first - 1])))

    def view(self, place: Point, camera: Camera, distance: float) -> Camera:
        """A camera before a place, in the direction in which the least of the solid is between; of equal
        ones, that which is nearest to the direction of another camera.
        """
        back = -np.array(camera.forward)
        up = np.array(camera.up) / np.linalg.norm(camera.up)
        choices = [d for d in (back, *AROUND) if abs(d @ up) < STEEP]
        ways = distance * np.linspace(HELD, 1, 256)[:, None]
        hidden = [float((self.values(place + ways * d) <= 0).mean()) for d in choices]
        best = min(range(len(choices)), key=lambda k: (round(hidden[k], 2), -choices[k] @ back))
        return replace(camera, eye=triple(place + distance * choices[best]), target=triple(place))


def readout(points: Sequence[Point]) -> list[tuple[str, str]]:
    """Names and values of what some points say, mm: a distance, an angle and a circle, or a sphere."""
    if len(points) < 2:
        return []
    rows = [("distance", f"{math.dist(points[-2], points[-1]):.4g} mm")]
    shift = points[-1] - points[-2]
    rows.append(("along x, y, z", " ".join(f"{length:.4g}" for length in shift) + " mm"))
    if len(points) == 3:
        rows.append(("angle", f"{angle(*points):.4g} degrees"))
        rows.append(("circle", f"radius {circle(*points):.4g} mm"))
    if len(points) >= 4:
        radius, off = sphere(np.array(points))
        rows.append(("sphere", f"radius {radius:.4g} mm, {significant(off)} mm off"))
    return rows


def angle(a: Point, b: Point, c: Point) -> float:
    """Angle at the second of three points, degrees."""
    first, second = a - b, c - b
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(first, second))), float(first @ second)))


def circle(a: Point, b: Point, c: Point) -> float:
    """Radius of the circle through three points; infinite on a line."""
    sides = math.dist(a, b) * math.dist(b, c) * math.dist(c, a)
    area = float(np.linalg.norm(np.cross(b - a, c - a)))
    return sides / (2 * area) if area else math.inf


def sphere(points: NDArray[np.float64]) -> tuple[float, float]:
    """Radius of the sphere that fits points [n, 3] best, and the greatest distance of one from it."""
    middle = points.mean(0)
    moved = points - middle
    rows = np.column_stack([2 * moved, np.ones(len(moved))])
    found, *_ = np.linalg.lstsq(rows, (moved**2).sum(1), rcond=None)
    radius = math.sqrt(max(float(found[3] + found[:3] @ found[:3]), 0.0))
    return radius, float(np.abs(np.linalg.norm(moved - found[:3], axis=1) - radius).max())


class Mark(NamedTuple):
    """A line through points, or points, over the picture."""

    points: NDArray[np.float64]  # [n, 3], scene units
    colour: tuple[int, int, int]
    line: bool = True
    label: str = ""  # at the first point


LETTERS = 15
"""Height of letters, pixels."""

DOT, SHADE = 5, (0, 0, 0)
"""Radius of a point, pixels, and the colour around marks."""


@dataclass(frozen=True, eq=False)
class Overlay:
    """Marks over a picture."""

    marks: tuple[Mark, ...]

    def over(self, pixels: NDArray[np.uint8], camera: Camera, size: tuple[int, int]) -> NDArray[np.uint8]:
        """A picture, uint8 [rows, columns, 3], with the marks; enlarged to a size, if it has fewer pixels."""
        from PIL import Image, ImageDraw, ImageFont

        image = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
        image = image if image.size == size else image.resize(size)
        draw, projection = ImageDraw.Draw(image), Projection.of(camera, size)
        font = ImageFont.load_default(LETTERS)
        for mark in self.marks:
            away = projection.away(mark.points)
            if mark.line:
                for a, b in pairwise(away):
                    if (ends := _before(a, b, projection)) is not None:
                        line = [tuple(end) for end in ends.tolist()]
                        draw.line(line, fill=SHADE, width=4)
                        draw.line(line, fill=mark.colour, width=2)
                continue
            for place in projection.seen(away[away[:, 2] > projection.near])[:, :2].tolist():
                x, y = place
                for radius, colour in ((DOT + 1, SHADE), (DOT, mark.colour)):
                    draw.ellipse([x - radius, y - radius, x + radius, y + radius], outline=colour, width=2)
                draw.text((x + 9, y - 9), mark.label, mark.colour, font, stroke_width=2, stroke_fill=SHADE)
        return np.asarray(image)


def _before(a: Point, b: Point, projection: Projection) -> NDArray[np.float64] | None:
    """Columns and rows of the ends of what of a line lies before the eye, [2, 2]."""
    near = projection.near
    if max(a[2], b[2]) <= near:
        return None
    ends = [p if p[2] >= near else p + (near - p[2]) / (q[2] - p[2]) * (q - p) for p, q in ((a, b), (b, a))]
    return projection.seen(np.array(ends))[:, :2]


EDGES = [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)]
"""Ends of the edges of a box, whose corners are in the order of `Box.corners`."""


def outline(box: Box, colour: tuple[int, int, int]) -> tuple[Mark, ...]:
    """Edges of a box."""
    corners = np.array(box.corners)
    return tuple(Mark(corners[list(ends)], colour) for ends in EDGES)
