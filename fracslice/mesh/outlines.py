"""Outlines and texts as solids of scenes: curves to segments, glyphs that HarfBuzz chooses and places, fills
to one area, and signed distances.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import _native
from ..common.cache import key
from ..common.files import open_regular
from ..common.messages import lacking
from ..errors import MeshError
from ..expr.functions import InMemory
from .models import require_unchanged
from .svg import MOST_CURVES, Curve, Fill, quadratic, read_svg

if TYPE_CHECKING:
    from shapely import Geometry


LARGEST, MOST_CHARACTERS = 64 << 20, 1000
"""Most bytes of a font, and characters of a text."""

_VARIATION = re.compile(r"\s*([\x21-\x7e]{4})\s*=\s*([-+]?\d+\.?\d*)\s*")


def lettered(file: str, text: str, variations: str) -> list[Fill]:
    """Fills of a text in one line, in ems, from the origin along the base line.

    Raises
    ------
    MeshError
        If it is no font, or has no glyph for a character.
    """
    if reason := lacking("uharfbuzz", "texts need") or lacking("shapely", "texts need"):
        raise MeshError(reason)
    import uharfbuzz as hb

    if not 0 < len(text) <= MOST_CHARACTERS:
        raise MeshError(f"expected a text of 1 to {MOST_CHARACTERS} characters, found {len(text)}")
    font, shaped = _font(file, variations), hb.Buffer()
    shaped.add_str(text)
    shaped.guess_segment_properties()
    hb.shape(font, shaped)
    pen, x, y = _Pen(font.face.upem), 0, 0
    for glyph, place in zip(shaped.glyph_infos, shaped.glyph_positions, strict=True):
        if glyph.codepoint == 0:
            raise MeshError(f"has no glyph for {text[glyph.cluster]!r}")
        pen.begin(complex(x + place.x_offset, y + place.y_offset))
        font.draw_glyph(glyph.codepoint, pen.functions, pen)
        x, y = x + place.x_advance, y + place.y_advance
    if not pen.fills:
        raise MeshError(f"has nothing to draw for {text!r:.40}")
    return pen.fills


def _font(file: str, variations: str) -> Any:
    """Font of a file, at a place on its axes."""
    import uharfbuzz as hb

    with open_regular(file) as opened:
        data = opened.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise MeshError(f"expected a font of at most {LARGEST >> 20} MB")
    face = hb.Face(hb.Blob(data))
    if not face.glyph_count:
        raise MeshError("not a font that can be read")
    font, axes = hb.Font(face), {axis.tag: axis for axis in face.axis_infos}
    chosen = {}
    for part in filter(None, variations.split(",")):
        match = _VARIATION.fullmatch(part)
        axis = axes.get(match[1]) if match else None
        if not match or axis is None or not axis.min_value <= float(match[2]) <= axis.max_value:
            ranges = (f"{a.tag}={a.min_value:g}..{a.max_value:g}" for a in axes.values())
            raise MeshError(
                f'variations="{variations:.40}": expected {", ".join(ranges) or "none, it has no axes"}'
            )
        chosen[match[1]] = float(match[2])
    font.set_variations(chosen)
    return font


class _Pen:
    """Takes the outlines of glyphs."""

    def __init__(self, em: int) -> None:
        import uharfbuzz as hb

        self.em, self.origin, self.at = em, 0j, 0j
        self.fills: list[Fill] = []
        self.curves: list[Curve] = []
        self.rings: list[tuple[complex, list[Curve]]] = []
        self.functions = hb.DrawFuncs()
        self.functions.set_move_to_func(lambda x, y, pen: pen.move(x, y))
        self.functions.set_line_to_func(lambda x, y, pen: pen.add(x, y))
        self.functions.set_quadratic_to_func(lambda a, b, x, y, pen: pen.quadratic(a, b, x, y))
        self.functions.set_cubic_to_func(lambda *numbers: numbers[-1].add(*numbers[:-1]))
        self.functions.set_close_path_func(lambda pen: None)

    def begin(self, origin: complex) -> None:
        """Begin a glyph."""
        self.origin, self.rings = origin, []

    def points(self, *numbers: float) -> list[complex]:
        """Points of a glyph, in ems."""
        return [
            (self.origin + complex(x, y)) / self.em for x, y in zip(numbers[::2], numbers[1::2], strict=True)
        ]

    def move(self, x: float, y: float) -> None:
        """Begin a ring."""
        if not self.rings:
            self.fills.append(Fill(self.rings, True))
        (self.at,), self.curves = self.points(x, y), []
        self.rings.append((self.at, self.curves))

    def add(self, *numbers: float) -> None:
        """Add a line or a cubic."""
        self.curves.append(tuple(points := self.points(*numbers)))
        self.at = points[-1]

    def quadratic(self, *numbers: float) -> None:
        """Add a quadratic, as a cubic."""
        middle, end = self.points(*numbers)
        self.curves.append(quadratic(self.at, middle, end))
        self.at = end


TOLERANCE = 5e-5
"""Largest distance of a curve from its segments, in longest sides of all curves; of texts, in ems."""
GRID = 2.0**-40
"""Distance between the places that crossings of segments can have, in longest sides: no sliver is thinner."""
MOST_CROSSINGS = 1 << 15
"""Most pairs of segments that meet, besides neighbours: each may be a corner of the outline."""
RAYS, ASKED = 1 << 10, 32
"""Points whose winding numbers, and segments whose crossings are found at once."""


@dataclass(frozen=True, eq=False)
class Outline(InMemory):
    """Closed rings whose signed distances machine code asks for; see `native/mesh/outline.h`."""

    low: tuple[float, float]  # corners of its box
    high: tuple[float, float]

    @classmethod
    def of(cls, rings: Sequence[NDArray[np.float64]]) -> Outline:
        """Outline of rings [n, 2] that do not cross, with the inside on their left."""
        corners = np.concatenate(rings)
        ends = np.cumsum([len(ring) for ring in rings])
        native, digest = _native.Outline(corners, ends), int(key("outline", corners, ends)[:16], 16)
        low, high = corners.min(0).tolist(), corners.max(0).tolist()
        return cls(digest, native, tuple(low), tuple(high))


@lru_cache(maxsize=8)
def extruded(file: str, sha256: str, size: float | None, centred: bool) -> Outline:
    """Outline of a file, scaled, its box centred at the origin or where the file has it."""
    area = _sized(file, sha256, size)
    low, high = np.reshape(area.bounds, (2, 2))
    return Outline.of(_rings(area, (low + high) / 2 if centred else np.zeros(2)))


@lru_cache(maxsize=8)
def written(file: str, sha256: str, text: str, variations: str, size: float, centred: bool) -> Outline:
    """Outline of a text in a font, of a size of the em, its box centred or its base line from the origin."""
    fills = lettered(file, text, variations)
    require_unchanged(file, sha256)
    area = area_of(fills, 1.0)
    low, high = np.reshape(area.bounds, (2, 2))
    return Outline.of([ring * size for ring in _rings(area, (low + high) / 2 if centred else np.zeros(2))])


@lru_cache(maxsize=8)
def revolved(file: str, sha256: str, size: float | None, offset: float, centred: bool) -> Outline:
    """Outline of a file, scaled, its left edge at an offset from the y axis, its box centred or above y = 0.

    At the axis it goes on as its mirror image: no edge there is one of the solid.
    """
    area = _sized(file, sha256, size)
    import shapely

    low, high = np.reshape(area.bounds, (2, 2))
    origin = np.array([low[0] - offset, (low[1] + high[1]) / 2 if centred else low[1]])
    if offset > 0:
        return Outline.of(_rings(area, origin))
    right = shapely.transform(area, lambda points: points - origin)
    left = shapely.transform(right, lambda points: points * (-1, 1))
    return Outline.of(_rings(shapely.union(right, left, grid_size=GRID * (high - low).max()), np.zeros(2)))


def _sized(file: str, sha256: str, size: float | None) -> Geometry:
    """What a file fills, scaled about the file's origin."""
    area = _area(file, sha256)
    if size is None:
        return area
    import shapely

    low, high = np.reshape(area.bounds, (2, 2))
    scale = size / (high - low).max()
    return shapely.transform(area, lambda points: points * scale)


@lru_cache(maxsize=4)
def _area(file: str, sha256: str) -> Geometry:
    """What a file fills, mm."""
    if reason := lacking("shapely", "outlines need"):
        raise MeshError(reason)
    fills = read_svg(file)
    require_unchanged(file, sha256)
    return area_of(fills)


def area_of(fills: Iterable[Fill], detail: float | None = None) -> Geometry:
    """The area of all fills, of which each may overlap itself and others.

    Curves are within `TOLERANCE` of the longest side, or of the size of a `detail`.
    """
    import shapely

    given = list(fills)
    points = np.array([p for fill in given for start, curves in fill.rings for p in _samples(start, curves)])
    if not np.isfinite(points).all() or not np.isfinite(
        extent := np.ptp(points.view(float).reshape(-1, 2), axis=0).max()
    ):
        raise MeshError("has a coordinate that is not a finite number")
    if extent == 0:
        raise MeshError("has no path with an area")
    grid = extent * GRID
    rings = [
        ([_ring(*ring, (detail or extent) * TOLERANCE) for ring in fill.rings], fill.nonzero)
        for fill in given
    ]
    if (count := sum(len(ring) for fill, _ in rings for ring in fill)) > MOST_CURVES:
        raise MeshError(f"expected an outline of at most {MOST_CURVES} segments, found {count}")
    _require_few_crossings([ring for fill, _ in rings for ring in fill])
    areas = [shapely.coverage_union_all(_faces(*fill, grid)) for fill in rings]
    area = shapely.set_precision(shapely.union_all(areas), grid)
    if area.area == 0:
        raise MeshError("has no path with an area")
    return area


def _samples(start: complex, curves: list[Curve]) -> Iterable[complex]:
    """Points of a ring that have nearly its box."""
    yield start
    for curve in curves:
        if len(curve) > 1:
            yield from _points(start, curve, 8)
        yield (end := _end(curve))
        start = end


def _end(curve: Curve) -> complex:
    return curve[-1] if len(curve) != 4 else complex(_points(0, curve, 1)[0])


def _points(start: complex, curve: Curve, count: int) -> NDArray[np.complex128]:
    """Points of a cubic or arc after its start, the last at its end."""
    t = np.arange(1, count + 1) / count
    if len(curve) == 4:
        centre, one, other, ends = curve
        angle = ends.real + (ends.imag - ends.real) * t
        return np.asarray(centre + one * np.cos(angle) + other * np.sin(angle))
    a, b, c = curve
    s = 1 - t
    return np.asarray(s * s * s * start + 3 * s * s * t * a + 3 * s * t * t * b + t * t * t * c)


def _pieces(start: complex, curve: Curve, tolerance: float) -> int:
    """Segments that a cubic or arc is split into, which stay within a tolerance of it."""
    if len(curve) == 4:
        _, one, other, ends = curve
        radius = math.sqrt(abs(one) ** 2 + abs(other) ** 2)  # at least the larger half axis
        turn = 2 * math.acos(max(1 - tolerance / radius, 0.0)) if radius else math.pi
        return max(1, math.ceil(abs(ends.imag - ends.real) / turn))
    a, b, c = curve
    bend = 6 * max(abs(start - 2 * a + b), abs(a - 2 * b + c))  # of the second derivative
    return max(1, math.ceil(math.sqrt(bend / (8 * tolerance))))


def _ring(start: complex, curves: list[Curve], tolerance: float) -> NDArray[np.complex128]:
    """Corners of a ring."""
    points, at = [start], start
    for curve in curves:
        if len(curve) == 1:
            points.append(at := curve[0])
        else:
            points.extend(_points(at, curve, _pieces(at, curve, tolerance)).tolist())
            at = points[-1]
    return np.array(points)


def _faces(rings: list[NDArray[np.complex128]], nonzero: bool, grid: float) -> NDArray[Any]:
    """Polygons of all that rings fill, which do not overlap."""
    import shapely

    closed = [np.append(ring, ring[0]) for ring in rings if len(ring) > 2]
    if not closed:
        return np.array([])
    if len(closed) == 1 and (alone := shapely.Polygon(closed[0].view(float).reshape(-1, 2))).is_valid:
        return np.array([alone])
    lines = [shapely.LineString(ring.view(float).reshape(-1, 2)) for ring in closed]
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(lines, grid_size=grid)]))
    inside = shapely.point_on_surface(faces)
    winding = _winding(closed, shapely.get_x(inside), shapely.get_y(inside))
    filled: NDArray[Any] = faces[winding != 0 if nonzero else winding % 2 != 0]
    return filled


def _require_few_crossings(rings: list[NDArray[np.complex128]]) -> None:
    """Raise the error about segments that cross others too often, of which a few make millions of faces."""
    import shapely

    pairs = [np.stack([ring, np.roll(ring, -1)], 1) for ring in rings]
    segments = shapely.linestrings(np.concatenate(pairs).view(float).reshape(-1, 2, 2))
    tree, met, most = shapely.STRtree(segments), 0, 3 * len(segments) + 2 * MOST_CROSSINGS
    for first in range(0, len(segments), ASKED):
        met += tree.query(segments[first : first + ASKED], predicate="intersects").shape[1]
        if met > most:
            raise MeshError(f"expected an outline whose segments cross at most {MOST_CROSSINGS} times")


def _winding(
    closed: list[NDArray[np.complex128]], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Winding numbers of rings around points, by the segments that rays to the right cross."""
    import shapely

    a, b = (np.concatenate([ring[part] for ring in closed]) for part in (slice(None, -1), slice(1, None)))
    tree = shapely.STRtree(shapely.linestrings(np.stack([a, b], 1).view(float).reshape(-1, 2, 2)))
    winding, far = np.zeros(len(x), np.int64), max(a.real.max(), x.max(initial=0.0))
    for first in range(0, len(x), RAYS):
        part = slice(first, first + RAYS)
        ray, segment = tree.query(shapely.box(x[part], y[part], far, y[part]))
        s, e, px, py = a[segment], b[segment], x[part][ray], y[part][ray]
        left = (e.real - s.real) * (py - s.imag) - (px - s.real) * (e.imag - s.imag) > 0
        up, down = (s.imag <= py) & (py < e.imag) & left, (e.imag <= py) & (py < s.imag) & ~left
        np.add.at(winding[part], ray, up.astype(int) - down)
    return winding


def _rings(area: Geometry, origin: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Rings of polygons, from an origin, with the inside on their left."""
    import shapely

    rings = []
    for polygon in shapely.get_parts(shapely.normalize(area)):
        for k, ring in enumerate((polygon.exterior, *polygon.interiors)):
            corners = shapely.get_coordinates(ring)[:-1]
            if shapely.is_ccw(ring) != (k == 0):
                corners = corners[::-1]
            rings.append(np.ascontiguousarray(corners - origin))
    return rings
