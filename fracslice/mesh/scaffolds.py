"""Beams between points as solids: graphs of files, and edges of Voronoi cells or of Delaunay tetrahedra of
points in or on other solids.

Points are drawn at random and spread evenly (Lloyd 1982, "Least squares quantization in PCM"). On a surface,
cells and edges between points are those of the solid's surface (Edelsbrunner and Shah 1997, "Triangulating
topological spaces").
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _native
from ..common.cache import key
from ..common.files import read_bytes
from ..errors import MeshError
from ..expr.language import InMemory
from ..fields.box import Box
from ..fields.devices import reference
from ..fields.registry import Node
from ..formats._3mf import read_beams
from ..formats.ply import numbers_of, read_tables
from .models import require_unchanged

MOST = 1 << 20
"""Most beams."""
DRAWN, ROUNDS = 12, 12
"""Points that are drawn for each that is left, and how often these move to the middles of their cells."""
STEPS, PARTS = 60, 6
"""Halvings of an interval with a root, and parts of a beam along a surface."""


class BeamGraph(NamedTuple):
    """Points, pairs of them, and radii of both ends of each pair, NaN where none is stated."""

    points: NDArray[np.float64]  # [n, 3]
    pairs: NDArray[np.int64]  # [m, 2]
    radii: NDArray[np.float64]  # [m, 2]

    @classmethod
    def of(cls, points: NDArray[np.float64], pairs: NDArray[np.int64]) -> BeamGraph:
        """BeamGraph without radii."""
        return cls(points, pairs, np.full((len(pairs), 2), np.nan))

    @property
    def balls(self) -> NDArray[np.float64]:
        """Ends of beams and their radii, [m, 2, 4]."""
        return np.concatenate([self.points[self.pairs], self.radii[..., None]], -1)

    def checked(self) -> BeamGraph:
        """This graph, if it is one."""
        if not 0 < len(self.pairs) <= MOST:
            raise MeshError(f"expected 1 to {MOST:,} beams, found {len(self.pairs):,}")
        if not np.isfinite(self.points).all() or np.isinf(self.radii).any():
            raise MeshError("has a coordinate or a radius that is not a finite number")
        if not 0 <= self.pairs.min() <= self.pairs.max() < len(self.points):
            raise MeshError("a beam names a point that does not exist")
        if (self.radii <= 0).any():
            raise MeshError("expected radii above 0")
        return self


@dataclass(frozen=True, eq=False)
class Beams(InMemory):
    """Beams whose signed distances machine code asks for; see `native/mesh/beams.h`."""

    box: Box

    @classmethod
    def of(cls, balls: NDArray[np.float64], seam: float, parts: int = 1) -> Beams:
        """Beams between balls, [m, 2, 4], with a seam of a width, which fills less than that.

        `parts`: parts of each that follow each other without a seam, those of the same number together.
        """
        chains = np.arange(len(balls), dtype=np.int32) % (len(balls) // parts)
        filled = seam * (1 - 1 / np.sqrt(len(balls) / parts))
        ends, radii = balls[..., :3], balls[..., 3:]
        low, high = (ends - radii).min((0, 1)) - filled, (ends + radii).max((0, 1)) + filled
        digest = int(key("beams", balls, seam, parts)[:16], 16)
        native = _native.Beams(np.ascontiguousarray(balls), chains, seam)
        return cls(digest, native, Box(tuple(low.tolist()), tuple(high.tolist())))


@lru_cache(maxsize=8)
def graph(file: str, sha256: str) -> BeamGraph:
    """BeamGraph of a file with a hash."""
    try:
        read = READERS[Path(file).suffix.lower()](file)
    except MeshError:
        raise
    except OSError as error:
        raise MeshError(error.strerror or str(error)) from None
    except (ValueError, TypeError, KeyError, IndexError, OverflowError, RecursionError, csv.Error):
        raise MeshError("not a whole file of beams: it is cut short, broken or of another kind") from None
    require_unchanged(file, sha256)
    return read.checked()


def _read_csv(file: str) -> BeamGraph:
    """Rows of two points and one radius, two, or none; a first row may name the columns."""
    lines = read_bytes(file).decode("utf-8-sig").splitlines()
    rows = [row for row in csv.reader(lines) if row]
    if rows and not _is_number(rows[0][0]):
        del rows[0]
    numbers = [list(map(float, row)) for row in rows]
    for k, row in enumerate(numbers):
        if not 6 <= len(row) <= 8:
            expected = "expected x y z of both ends and at most two radii"
            raise MeshError(f"row {k + 1}: {expected}, found {len(row)} numbers")
    points = np.array([row[:6] for row in numbers], np.float64).reshape(-1, 3)
    pairs = np.arange(len(points)).reshape(-1, 2)
    return BeamGraph(points, pairs, np.array([_both(row[6:]) for row in numbers], np.float64).reshape(-1, 2))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _both(radii: list[float]) -> list[float]:
    """Radii of both ends, of those that are stated."""
    return (radii * 2)[:2] or [np.nan, np.nan]


def _read_json(file: str) -> BeamGraph:
    """Points, each with or without a radius, and pairs of their numbers, each with none, one or two radii."""
    given = json.loads(read_bytes(file))
    points = np.array([[float(x) for x in point[:3]] for point in given["points"]], np.float64).reshape(-1, 3)
    own = np.array([float(point[3]) if len(point) > 3 else np.nan for point in given["points"]])
    pairs = np.array([[int(k) for k in beam[:2]] for beam in given["beams"]], np.int64).reshape(-1, 2)
    stated = np.array([_both([float(r) for r in beam[2:4]]) for beam in given["beams"]]).reshape(-1, 2)
    known = pairs.size and 0 <= pairs.min() <= pairs.max() < len(points)
    return BeamGraph(points, pairs, np.where(np.isnan(stated), own[pairs], stated) if known else stated)


def _read_obj(file: str) -> BeamGraph:
    """Vertices, and lines through them."""
    points, pairs = list[list[float]](), list[tuple[int, int]]()
    for line in read_bytes(file).splitlines():
        kind, *words = line.split() or [b""]
        if kind == b"v":
            points.append([float(word) for word in words[:3]])
        elif kind == b"l":
            named = [int(word.partition(b"/")[0]) for word in words]
            numbers = [k - 1 if k > 0 else len(points) + k for k in named]
            pairs += pairwise(numbers)
    return BeamGraph.of(np.array(points, np.float64).reshape(-1, 3), np.array(pairs, np.int64).reshape(-1, 2))


def _read_ply(file: str) -> BeamGraph:
    """Vertices, with or without a radius, and edges."""
    tables = read_tables(file)
    vertex, edge = ({k: numbers_of(v) for k, v in tables[name].items()} for name in ("vertex", "edge"))
    points = np.stack([vertex[axis].astype(np.float64) for axis in "xyz"], 1)
    pairs = np.stack([edge[name].astype(np.int64) for name in ("vertex1", "vertex2")], 1)
    made = BeamGraph.of(points, pairs)
    if "radius" not in vertex or not len(pairs) or pairs.max() >= len(points):
        return made
    return made._replace(radii=vertex["radius"].astype(np.float64)[pairs])


def _read_3mf(file: str) -> BeamGraph:
    """Beam lattices of the build."""
    balls = read_beams(file)
    pairs = np.arange(2 * len(balls)).reshape(-1, 2)
    return BeamGraph(balls[..., :3].reshape(-1, 3), pairs, balls[..., 3])


READERS: dict[str, Callable[[str], BeamGraph]] = {
    ".3mf": _read_3mf,
    ".csv": _read_csv,
    ".json": _read_json,
    ".obj": _read_obj,
    ".ply": _read_ply,
}
"""Readers of graphs by the endings of files."""


@lru_cache(maxsize=8)
def from_file(
    file: str, sha256: str, size: float | None, place: str, unit: float, radius: float, seam: float
) -> Beams:
    """Beams of a file, scaled and placed; `unit`: scene units of one of its own, without a size."""
    given = graph(file, sha256)
    scale = unit
    if size is not None:
        if not (longest := np.ptp(given.points[given.pairs], axis=(0, 1)).max()) > 0:
            raise MeshError("has no beam with a length")
        scale = size / longest
    balls = given.balls * scale
    balls[..., 3] = np.where(np.isnan(balls[..., 3]), radius, balls[..., 3])
    ends = balls[..., :3]
    low, high = ends.min((0, 1)), ends.max((0, 1))
    if place != "as is":
        ends -= (low + high) / 2
    if place == "bed":
        ends[..., 2] -= (ends[..., 2] - balls[..., 3]).min()
    return Beams.of(balls, seam)


@lru_cache(maxsize=8)
def scaffold(child: Node, of: str, where: str, count: int, seed: int, radius: float, seam: float) -> Beams:
    """Beams between points in or on a solid."""
    field = _Field(child)
    spread = _spread(field, where == "surface", count, seed)
    makes: dict[tuple[str, str], Callable[..., NDArray[np.float64]]] = {
        ("voronoi", "inside"): _cells_inside,
        ("delaunay", "inside"): _tetrahedra_inside,
        ("voronoi", "surface"): partial(_on_surface, dual=False),
        ("delaunay", "surface"): partial(_on_surface, dual=True),
    }
    ends = makes[of, where](field, spread, radius)
    if not 0 < len(ends) <= MOST:
        raise MeshError(f"expected 1 to {MOST:,} beams, found {len(ends):,}: more or fewer points")
    balls = np.concatenate([ends, np.full((len(ends), 2, 1), radius)], -1)
    return Beams.of(balls, seam, PARTS if where == "surface" else 1)


class _Field:
    """Field of a solid, and what of it is asked for."""

    def __init__(self, child: Node) -> None:
        self.bounds = child.bounds
        self._evaluate = reference(child)

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at points [..., 3]."""
        return self._evaluate(*np.moveaxis(points, -1, 0))

    def on_surface(self, points: NDArray[np.float64], steps: int = 6) -> NDArray[np.float64]:
        """Points moved along the gradient to the surface, [n, 3]."""
        step = 1e-3 * max(self.bounds.box.size)  # differences are hardly rounded
        for _ in range(steps):
            values = self(points)
            before, after = (np.stack([points + h * side for side in np.eye(3)]) for h in (-step, step))
            slope = ((self(after) - self(before)) / (2 * step)).T
            points = points - (values / np.maximum((slope * slope).sum(1), 0.25))[:, None] * slope
        return points


def _spread(field: _Field, on_surface: bool, count: int, seed: int) -> NDArray[np.float64]:
    """Points in a solid or on its surface, evenly."""
    from scipy.spatial import cKDTree

    drawn = _drawn(field, on_surface, DRAWN * count, seed)
    chosen = drawn[:count]
    for _ in range(ROUNDS):
        nearest = cKDTree(chosen).query(drawn)[1]
        sizes = np.bincount(nearest, minlength=len(chosen))
        sums = np.stack([np.bincount(nearest, x, len(chosen)) for x in drawn.T], 1)
        middles = np.where(sizes[:, None] > 0, sums / np.maximum(sizes, 1)[:, None], chosen)
        # Where a middle is not in the solid, the point is one that was drawn.
        chosen = drawn[cKDTree(drawn).query(middles)[1]] if on_surface else middles
    if not on_surface:
        outside = field(chosen) > 0
        chosen[outside] = drawn[cKDTree(drawn).query(chosen[outside])[1]]
    return np.unique(chosen, axis=0)


def _drawn(field: _Field, on_surface: bool, count: int, seed: int) -> NDArray[np.float64]:
    """Points at random, evenly by volume, or nearly by area."""
    rng, box = np.random.default_rng(seed), field.bounds.box
    low, size = np.array(box.lo), np.array(box.size)
    band = 0.01 * size.max() if on_surface else 0.0
    found, left = [np.empty((0, 3))], count
    for number in range(50):
        points = low - band + (size + 2 * band) * rng.random((max(4 * left, 1 << 12), 3))
        values = field(points)
        points = points[abs(values) < band if on_surface else values < 0][:left]
        found.append(field.on_surface(points) if on_surface else points)
        left -= len(points)
        if left <= 0:
            return np.concatenate(found)
        if number > 3 and left > 0.9 * count:
            break
    raise MeshError("finds too few points in the element: expected one that fills more of its box")


def _cells_inside(field: _Field, points: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Edges of Voronoi cells, [m, 2, 3], as far as they may be in the solid."""
    voronoi = _voronoi(field, points)
    pairs = {
        (min(a, b), max(a, b))
        for ridge in voronoi.ridge_vertices
        for a, b in zip(ridge, [*ridge[1:], ridge[0]], strict=True)
        if min(a, b) >= 0
    }
    return _reaching(field, voronoi.vertices[np.array(sorted(pairs))], radius, len(points))


def _tetrahedra_inside(field: _Field, points: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Edges of Delaunay tetrahedra, [m, 2, 3], as far as they may be in the solid."""
    from scipy.spatial import Delaunay

    corners = np.sort(Delaunay(points).simplices, 1)
    pairs = np.unique(np.concatenate([corners[:, [a, b]] for a in range(4) for b in range(a + 1, 4)]), axis=0)
    return _reaching(field, points[pairs], radius, len(points))


def _voronoi(field: _Field, points: NDArray[np.float64]) -> Any:
    """Voronoi cells of points, and of some far off, so that those of the points are bounded."""
    from scipy.spatial import Voronoi

    box = field.bounds.box
    far = np.array(box.centre) + 20 * max(box.size) * np.concatenate([np.eye(3), -np.eye(3)])
    return Voronoi(np.concatenate([points, far]))


def _reaching(field: _Field, ends: NDArray[np.float64], radius: float, count: int) -> NDArray[np.float64]:
    """Parts of beams that may reach into the solid: not longer than points are apart."""
    box = field.bounds.box
    longest = (np.prod(box.size) / count) ** (1 / 3)
    # Where a beam leaves the box, it ends.
    ends = _clipped(ends, np.array(box.lo) - radius, np.array(box.hi) + radius)
    parts = np.maximum(np.ceil(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / longest), 1).astype(int)
    which = np.repeat(np.arange(len(parts)), parts)
    first = np.concatenate([np.arange(n) for n in parts])[:, None] if len(parts) else np.empty((0, 1))
    a, b = ends[which, 0], ends[which, 1]
    share = 1 / parts[which][:, None]
    begin, end = a + (b - a) * first * share, a + (b - a) * (first + 1) * share
    half = np.linalg.norm(end - begin, axis=1) / 2
    near: NDArray[np.bool_] = field((begin + end) / 2) <= field.bounds.lipschitz * (half + radius)
    return np.stack([begin[near], end[near]], 1)


def _clipped(
    ends: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Parts of segments [m, 2, 3] in a box."""
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (low - start) / along, (high - start) / along
    first = np.nan_to_num(np.fmin(one, other), nan=-np.inf).max(1).clip(0)
    last = np.nan_to_num(np.fmax(one, other), nan=np.inf).min(1).clip(None, 1)
    kept = (first < last)[:, None] & np.array([True, True])
    inside = kept[:, 0] & ~((along == 0) & ((start < low) | (start > high))).any(1)
    first, last, start, along = first[inside, None], last[inside, None], start[inside], along[inside]
    cut: NDArray[np.float64] = np.stack([start + first * along, start + last * along], 1)
    return cut


def _on_surface(field: _Field, points: NDArray[np.float64], radius: float, dual: bool) -> NDArray[np.float64]:
    """Borders between cells on the surface, or lines between the points of neighbours, [m, 2, 3]."""
    voronoi = _voronoi(field, points)
    edges, ridges, sites = [], [], []
    for number, (ridge, pair) in enumerate(zip(voronoi.ridge_vertices, voronoi.ridge_points, strict=True)):
        if max(pair) >= len(points) or min(ridge) < 0:
            continue
        around = zip(ridge, [*ridge[1:], ridge[0]], strict=True)
        edges += [(min(a, b), max(a, b)) for a, b in around]
        ridges += [number] * len(ridge)
        sites.append(tuple(pair))
    if not edges:
        return np.empty((0, 2, 3))
    known, of = np.unique(np.array(edges), axis=0, return_inverse=True)
    crossing, place = _crossings(field, voronoi.vertices[known])
    met = [(ridge, edge) for ridge, edge in zip(ridges, of.ravel(), strict=True) if crossing[edge]]
    by_ridge: dict[int, list[int]] = {}
    for ridge, edge in met:
        by_ridge.setdefault(ridge, []).append(int(edge))
    if dual:
        ends = [points[list(voronoi.ridge_points[ridge])] for ridge in sorted(by_ridge)]
    else:
        met_edges = (edges for _, edges in sorted(by_ridge.items()))
        ends = [place[edges[k : k + 2]] for edges in met_edges for k in range(0, len(edges) - 1, 2)]
    return _along_surface(field, np.array(ends).reshape(-1, 2, 3))


def _crossings(field: _Field, ends: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Whether segments [m, 2, 3] end on both sides of the surface, and where they meet it, [m, 3]."""
    inside = field(ends) < 0
    crossing = inside[:, 0] != inside[:, 1]
    low, high = ends[:, 0].copy(), ends[:, 1].copy()
    for _ in range(STEPS):
        middle = (low + high) / 2
        same = ((field(middle) < 0) == inside[:, 0])[:, None]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return crossing, (low + high) / 2


def _along_surface(field: _Field, ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Segments [m, 2, 3] in parts between points of the surface."""
    share = np.linspace(0, 1, PARTS + 1)[:, None, None]
    points = (1 - share) * ends[:, 0] + share * ends[:, 1]
    shape = points.shape
    points = field.on_surface(points.reshape(-1, 3)).reshape(shape)
    points[0], points[-1] = ends[:, 0], ends[:, 1]
    return np.stack([points[:-1], points[1:]], 2).reshape(-1, 2, 3)
