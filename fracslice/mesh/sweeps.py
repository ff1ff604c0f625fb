"""Outlines that are swept along paths, as solids: a prism for each segment of the path, cut where it bends at
the plane that halves the angle.

Outlines turn as little as they can: from segment to segment by the reflection that takes one to the other
(Wang, Juettler, Zheng and Liu 2008, "Computation of Rotation Minimizing Frames"), so that edges go on from
prism to prism and all faces are flat. Along a closed path in space the turn that is left is spread over it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _native
from ..common.cache import key
from ..common.parameters import Triple
from ..errors import MeshError
from ..expr.language import InMemory
from ..fields.box import Box
from .model import Mesh, self_intersecting_triangles
from .models import MOST, Solid, require_unchanged
from .outlines import (
    GRID,
    SHAPES,
    TOLERANCE,
    Affine,
    Curve,
    Drawing,
    PathReader,
    Rings,
    SvgElement,
    corners_of,
    rings_of,
    samples_of,
    sized,
    tree_of,
)

if TYPE_CHECKING:
    from shapely import Geometry

SHARPEST = math.cos(math.radians(165))
"""Cosine of the sharpest turn that is mitred: a corner beyond it is a spike."""
MOST_PARTS = 1000
"""Most parts of a path whose corners are too narrow for mitres."""
SHORTEST = 1e-9
"""Shortest segments and edges, in longest sides of the path, and of the outline."""


class Path(NamedTuple):
    """Corners of a path."""

    corners: tuple[Triple, ...]
    closed: bool


@dataclass(frozen=True, eq=False)
class Profile:
    """An outline, seen along the path: x to the right, y up."""

    area: Geometry
    corners: NDArray[np.float64]  # [n, 2]
    edges: NDArray[np.int64]  # corners where edges start and end, [n, 2], with the inside on their left
    triangles: NDArray[np.int64]  # that fill it, counter-clockwise

    @classmethod
    def of(cls, area: Geometry) -> Profile:
        """Outline of an area, which is not empty."""
        import shapely

        rings = rings_of(area, np.zeros(2))
        corners = np.concatenate(rings)
        if len(np.unique(corners, axis=0)) < len(corners):
            raise MeshError("expected an outline that touches itself nowhere")
        ends = np.cumsum([len(ring) for ring in rings])
        numbers = np.split(np.arange(len(corners)), ends[:-1])
        edges = np.concatenate([np.stack([ring, np.roll(ring, -1)], 1) for ring in numbers])
        number = {tuple(corner): i for i, corner in enumerate(corners.tolist())}
        parts = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
        turned = (shapely.get_coordinates(part)[:3].tolist() for part in shapely.orient_polygons(parts))
        triangles = [[number[tuple(corner)] for corner in part] for part in turned]
        return cls(area, corners, edges, np.array(triangles, np.int64))

    @property
    def reach(self) -> float:
        """Longest side."""
        return float(np.ptp(self.corners, axis=0).max())

    @property
    def most_turn(self) -> float:
        """Angle from section to section, radians, for which triangles are within the tolerance of a screw."""
        tolerance = TOLERANCE * self.reach
        a, b = self.corners[self.edges.T]
        flat = 4 * tolerance / np.linalg.norm(b - a, axis=1).max()
        return float(min(flat, math.sqrt(8 * tolerance / np.linalg.norm(self.corners, axis=1).max())))

    def beyond(self, right: float, up: float) -> Profile | None:
        """The part where x times `right` plus y times `up` is positive; None if there is none."""
        import shapely

        size = 4 * np.linalg.norm(self.corners, axis=1).max()
        turn = size * np.array([[right, up], [-up, right]]) / math.hypot(right, up)
        half = shapely.Polygon(np.array([(0, -1), (1, -1), (1, 1), (0, 1)]) @ turn)
        part = shapely.intersection(self.area, half, grid_size=size * GRID)
        areas = [one for one in shapely.get_parts(part) if one.area > size * size * GRID]
        return Profile.of(shapely.MultiPolygon(areas)) if areas else None


@dataclass(frozen=True, eq=False)
class Swept(InMemory):
    """Solids of a path whose signed distances machine code asks for; see `native/mesh/solid.h`.

    Where a path meets itself there are several, which go on from one to the next; all are united.
    """

    box: Box

    @classmethod
    def of(cls, meshes: Sequence[Mesh]) -> Swept:
        """Union of the solids of meshes."""
        solids = [Solid.of(mesh) for mesh in meshes]
        low = np.min([solid.box.lo for solid in solids], 0).tolist()
        high = np.max([solid.box.hi for solid in solids], 0).tolist()
        digest = int(key("swept", *(solid.digest for solid in solids))[:16], 16)
        native = _native.Solids([solid.native for solid in solids])
        return cls(digest, native, Box(tuple(low), tuple(high)))


@lru_cache(maxsize=8)
def drawn(file: str, sha256: str, size: float | None, centred: bool) -> tuple[Path, ...]:
    """Paths that an SVG file draws, scaled, at z = 0, their box centred or where the file has it."""
    lines = list(_Lines(tree_of(file)).drawings())
    require_unchanged(file, sha256)
    points = np.array([p for start, curves, _ in lines for p in samples_of(start, curves)])
    extent = np.ptp(points.view(float).reshape(-1, 2), axis=0).max() if len(points) else 0.0
    if not 0 < extent < math.inf:
        raise MeshError("has no path with a length")
    flat = [
        (corners_of(start, curves, extent * TOLERANCE).view(float).reshape(-1, 2), closed)
        for start, curves, closed in lines
    ]
    whole = np.concatenate([corners for corners, _ in flat])
    low, high = whole.min(0), whole.max(0)
    origin = (low + high) / 2 if centred else np.zeros(2)
    scale = 1.0 if size is None else size / (high - low).max()
    placed = ((scale * (corners - origin), closed) for corners, closed in flat)
    return tuple(Path(tuple((x, y, 0.0) for x, y in corners.tolist()), closed) for corners, closed in placed)


class _Lines(Drawing):
    """Draws a tree of elements: their lines, whatever they fill."""

    names = Drawing.names | {"line"}

    def shape(
        self, element: SvgElement, to: Affine, style: dict[str, str]
    ) -> Iterator[tuple[complex, list[Curve], bool]]:
        """Starts and curves of lines, and whether each is closed."""
        reader = PathReader(element) if element.name == "path" else None
        rings: Rings = iter(reader.rings) if reader else _line(element)
        for number, (start, curves) in enumerate(rings):
            self.curves += len(curves)
            element.limit(self.curves)
            closed = number in reader.closed if reader else element.name not in ("line", "polyline")
            if curves:
                yield to(start), list(map(to.curve, curves)), closed


def _line(element: SvgElement) -> Rings:
    """The line of any element but a path."""
    if element.name != "line":
        yield from SHAPES[element.name](element)
        return
    start, end = (complex(element.length(f"x{k}"), element.length(f"y{k}")) for k in (1, 2))
    yield start, [(end,)]


@lru_cache(maxsize=8)
def profile(file: str, sha256: str, size: float | None, centred: bool) -> Profile:
    """Outline of a file, scaled, with the centre of its box, or the origin of its file, on the path."""
    import shapely

    area = sized(file, sha256, size)
    if not centred:
        return Profile.of(area)
    middle = np.reshape(area.bounds, (2, 2)).mean(0)
    return Profile.of(shapely.transform(area, lambda points: points - middle))


@lru_cache(maxsize=8)
def swept(outline: Profile, paths: tuple[Path, ...]) -> Swept:
    """Solids of an outline that is swept along paths."""
    if (count := sum(2 * len(outline.corners) * len(path.corners) for path in paths)) > MOST:
        raise MeshError(f"{count:,} triangles along the path: expected at most {MOST:,}")
    return Swept.of([mesh for path in paths for mesh in _meshes(outline, path)])


class _Segments(NamedTuple):
    """Segments of a path, and the planes that cut their prisms at both ends.

    A plane is given by its tilt: a point across the segment times this is how far behind the point the plane
    is, along the segment.
    """

    starts: NDArray[np.float64]  # [n, 3], as all of these
    ends: NDArray[np.float64]
    along: NDArray[np.float64]  # directions
    across: NDArray[np.float64]  # to the right
    across_end: NDArray[np.float64]
    tilt: NDArray[np.float64]
    tilt_end: NDArray[np.float64]

    def outlines(self, outline: Profile) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Outlines at both ends, [n, corners, 3]."""
        x, y = outline.corners.T[:, None, :, None]
        given = (self.starts, self.across, self.tilt), (self.ends, self.across_end, self.tilt_end)
        found = []
        for place, across, tilt in given:
            flat = x * across[:, None] + y * np.cross(across, self.along)[:, None]
            behind = np.einsum("spk,sk->sp", flat, tilt)[..., None]
            found.append(place[:, None] + flat - behind * self.along[:, None])
        return found[0], found[1]

    def sections(self, outline: Profile, closed: bool = False) -> NDArray[np.float64]:
        """Outlines along the path, [n, corners, 3], the first once more at the end of a closed one."""
        near, far = self.divided(outline.most_turn).outlines(outline)
        return np.append(near, near[:1] if closed else far[-1:], 0)

    def lengths(self, outline: Profile) -> NDArray[np.float64]:
        """Of the shortest edge of each prism; negative where its planes cross within the outline."""
        near, far = self.outlines(outline)
        shortest: NDArray[np.float64] = np.einsum("spk,sk->sp", far - near, self.along).min(1)
        return shortest

    def where(self, which: NDArray[np.int64]) -> _Segments:
        """Some of them, or all in another order."""
        return _Segments(*(part[which] for part in self))

    def cut(self, before: NDArray[np.bool_], after: NDArray[np.bool_]) -> _Segments:
        """With planes across the path before some and after some."""
        tilt, tilt_end = (
            np.where(these[:, None], 0, t) for these, t in ((before, self.tilt), (after, self.tilt_end))
        )
        return self._replace(tilt=tilt, tilt_end=tilt_end)

    def divided(self, most: float) -> _Segments:
        """In parts, around which the outline turns by an angle at most, radians."""
        up = np.cross(self.along, self.across)
        sine, cosine = (np.einsum("ij,ij->i", side, self.across_end) for side in (up, self.across))
        angle = np.arctan2(sine, cosine)
        angle[abs(angle) < SHORTEST] = 0
        parts = np.maximum(np.ceil(abs(angle) / most), 1).astype(int)
        which = np.repeat(np.arange(len(parts)), parts)
        share = np.concatenate([np.arange(n) / n for n in parts])[:, None]
        old = self.where(which)

        def at(share: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
            turned = angle[which][:, None] * share
            across = np.cos(turned) * old.across + np.sin(turned) * up[which]
            tilt = (1 - share) * old.tilt + share * old.tilt_end
            return (1 - share) * old.starts + share * old.ends, across, tilt

        starts, across, tilt = at(share)
        ends, across_end, tilt_end = at(share + 1 / parts[which][:, None])
        return _Segments(starts, ends, old.along, across, across_end, tilt, tilt_end)


def _meshes(outline: Profile, path: Path) -> list[Mesh]:
    """Meshes along a path that do not intersect themselves: one, where it may be.

    At corners where mitres would cut more than the segments beside them, those before and after end, and what
    is missing on the outer side has a mesh of its own.
    """
    segments = _mitred(path)
    split = _splits(outline, segments, path.closed)
    if not split.any():
        return _apart(outline, segments.sections(outline, True), True)
    order = np.roll(np.arange(len(split)), -int(split.argmax()))
    segments, split = segments.where(order), split[order]
    begins = np.flatnonzero(split)
    if len(begins) > MOST_PARTS:
        place = " ".join(f"{x:.4g}" for x in segments.starts[begins[1]])
        raise MeshError(
            f"the path bends more tightly than the outline is wide in too many places, as near {place}"
        )
    found = []
    for begin, end in zip(begins, [*begins[1:], len(split)], strict=True):
        which = np.arange(begin, end)
        found += _apart(
            outline, segments.where(which).cut(which == begin, which == end - 1).sections(outline)
        )
    for corner in begins if path.closed else begins[1:]:
        found += _corner(outline, segments, split, corner)
    return found


def _mitred(path: Path) -> _Segments:
    """Segments of a path with planes that halve the angles at its corners."""
    corners = _distinct(path)
    along = np.diff(corners, axis=0)
    lengths = np.linalg.norm(along, axis=1)
    along /= lengths[:, None]
    before, after = np.roll(along, 1, 0), np.roll(along, -1, 0)
    if not path.closed:
        before[0], after[-1] = along[0], along[-1]
    cosines, cosines_after = (
        np.maximum(np.einsum("ij,ij->i", along, other), SHARPEST)[:, None] for other in (before, after)
    )
    across, turn = _carried(along, path.closed)
    far, up = np.append(0, np.cumsum(lengths)), np.cross(along, across)
    angles = (turn / far[-1] * part[:, None] for part in (far[:-1], far[1:]))
    right, right_end = (np.cos(angle) * across + np.sin(angle) * up for angle in angles)
    tilt, tilt_end = (along + before) / (1 + cosines), (along + after) / (1 + cosines_after)
    return _Segments(corners[:-1], corners[1:], along, right, right_end, tilt, tilt_end)


def _splits(outline: Profile, segments: _Segments, closed: bool) -> NDArray[np.bool_]:
    """Starts of segments where mitres would cut more than the segments, and that of an open path."""
    sharp = 1 - np.einsum("ij,ij->i", segments.along, np.roll(segments.along, 1, 0))
    split: NDArray[np.bool_] = sharp > 1 - SHARPEST
    split[0] |= not closed
    least = SHORTEST * outline.reach
    while True:
        after = np.roll(split, -1)
        short = segments.cut(split, after).lengths(outline) <= least
        if not (short & ~(split & after)).any():
            return split
        before, behind = np.where(split, -1, sharp), np.where(after, -1, np.roll(sharp, -1))
        split = split | (short & (before >= behind)) | np.roll(short & (before < behind), 1)


def _corner(outline: Profile, segments: _Segments, split: NDArray[np.bool_], corner: int) -> list[Mesh]:
    """Mesh of what a mitre adds on the outer side of a corner, and goes on as far as the outline is wide."""
    if segments.along[corner] @ segments.along[corner - 1] < SHARPEST:
        return []
    across, up = segments.across[corner], np.cross(segments.across[corner], segments.along[corner])
    right, high = (float(segments.tilt[corner] @ side) for side in (across, up))
    if math.hypot(right, high) < SHORTEST or (outer := outline.beyond(right, high)) is None:
        return []
    count, far = len(split), np.linalg.norm(segments.ends - segments.starts, axis=1)
    first, last, before, after = corner - 1, corner, far[corner - 1], far[corner]
    while before < outline.reach and not split[first] and last - first < count - 1:
        first -= 1
        before += far[first]
    while after < outline.reach and not split[(last + 1) % count] and last - first < count - 1:
        last += 1
        after += far[last % count]
    for begin, end in ((first, last), (corner - 1, corner)):
        which = np.arange(begin, end + 1)
        starts, ends = (
            split[which % count] & (which != corner),
            split[(which + 1) % count] & (which != corner - 1),
        )
        sections = segments.where(which % count).cut(starts, ends).sections(outer)
        if _is_simple(outer, sections):
            break
    return [_mesh(outer, sections)]


def _distinct(path: Path) -> NDArray[np.float64]:
    """Corners of a path that are apart, the first once more at the end of a closed one."""
    corners = np.array(path.corners + path.corners[: path.closed])
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    apart = steps > SHORTEST * np.ptp(corners, axis=0).max()
    kept: NDArray[np.float64] = corners[np.append(True, apart)]
    if path.closed and not apart[-1]:
        kept[-1] = kept[0]
    if len(kept) < 2 + 2 * path.closed:
        raise MeshError(f"expected a path of at least {3 if path.closed else 2} points that are apart")
    return kept


def _carried(along: NDArray[np.float64], closed: bool) -> tuple[NDArray[np.float64], float]:
    """Directions to the right of segments, [n, 3], and the angle from the last one to the first, radians.

    The first is to the right of one who looks along the path, up being z, or y where the path starts along z.
    """
    first = along[0]
    up = np.array([0.0, 0.0, 1.0] if abs(first[2]) < 0.999 else [0.0, 1.0, 0.0])
    right = np.cross(first, up)
    across = [right / np.linalg.norm(right)]
    for one, other in zip(along, [*along[1:], *along[:closed]], strict=False):
        halving, before = one + other, across[-1]
        if (square := halving @ halving) > SHORTEST:
            now = before - halving * (2 * (before @ halving) / square)
        else:
            now = -before  # after a half turn around what is up
        now = now - other * (now @ other)
        across.append(now / np.linalg.norm(now))
    if not closed:
        return np.array(across), 0.0
    end = across.pop()
    turn = math.atan2(np.cross(end, across[0]) @ first, end @ across[0])
    return np.array(across), turn if abs(turn) > SHORTEST else 0.0


def _apart(outline: Profile, sections: NDArray[np.float64], closed: bool = False) -> list[Mesh]:
    """Meshes of sections, which do not intersect themselves: one, or several where the path meets itself."""
    whole = _mesh(outline, sections[:-1] if closed else sections, closed)
    if not self_intersecting_triangles(whole).any():
        return [whole]
    count = len(sections) - 1  # of prisms
    far = np.append(0, np.cumsum(np.linalg.norm(np.diff(sections.mean(1), axis=0), axis=1)))
    goal = count
    if closed:
        sections, far = np.append(sections, sections[1:], 0), np.append(far, far[-1] + far[1:])
        goal = min(max(int(np.searchsorted(far, far[count] + outline.reach)), count + 1), 2 * count)
    begin, found = 0, list[Mesh]()
    while True:
        end = _longest(outline, sections, begin, min(begin + count - closed, len(sections) - 1))
        found.append(_mesh(outline, sections[begin : end + 1]))
        if end >= goal:
            return found
        if sum(len(mesh.triangles) for mesh in found) > MOST:
            raise MeshError(f"the path meets itself too often: expected at most {MOST:,} triangles")
        # The next one begins within this one, so that each place inside is deep in one of them.
        near = int(np.searchsorted(far, far[end] - outline.reach, "right")) - 1
        begin = min(max(near, begin + 1), end - 1)


def _longest(outline: Profile, sections: NDArray[np.float64], begin: int, last: int) -> int:
    """Last section up to which a mesh from another one does not intersect itself."""
    good, step = min(begin + 2, last), 2  # two prisms lie on both sides of a plane
    while good < last and _is_simple(outline, sections[begin : min(good + step, last) + 1]):
        good, step = min(good + step, last), 2 * step
    bad = min(good + step, last + 1)
    while bad - good > 1:
        middle = (good + bad) // 2
        if _is_simple(outline, sections[begin : middle + 1]):
            good = middle
        else:
            bad = middle
    return good


def _is_simple(outline: Profile, sections: NDArray[np.float64]) -> bool:
    return not self_intersecting_triangles(_mesh(outline, sections)).any()


def _mesh(outline: Profile, sections: NDArray[np.float64], closed: bool = False) -> Mesh:
    """Closed mesh of sections, which are joined to a ring or have lids."""
    count, width = sections.shape[:2]
    a, b = outline.edges.T
    here = width * np.arange(count if closed else count - 1)[:, None]
    there = (here + width) % (width * count)
    sides = [[here + a, there + a, there + b], [here + a, there + b, here + b]]
    triangles = [np.stack(side, -1).reshape(-1, 3) for side in sides]
    if not closed:
        triangles += [outline.triangles, outline.triangles[:, ::-1] + width * (count - 1)]
    return Mesh(sections.reshape(-1, 3), np.concatenate(triangles).astype(np.int32))
