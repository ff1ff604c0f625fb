"""Contouring of signs, piece by piece: roots on grid edges, on a GPU too, normals, feature vertices,
triangles.

A vertex moves only along its own grid edge, strictly between the edge's ends. Refinement therefore cannot
fold a mesh or make it self-intersect if its triangles stay in their cells.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from .. import _native
from .._native import Cells, RootLoops
from ..errors import MeshError
from ..expr.cuda_driver import device_array, pinned_array, require, to_device
from ..expr.graph import NOTHING
from ..fields.cuda import CudaFunction, CudaLoop, load_functions
from ..fields.field import Field
from ..store import Arrays, stored
from ..volume.bricks import BRICK, Bricks, SignBricks
from ..work import Work, ahead, chunks
from .model import Mesh
from .roots import SURE, Roots, collect, lay, start

Point = tuple[float, float, float]
Memory = tuple[np.ndarray, np.ndarray]
"""Positions along the edges, float64 [n], and normals, float32 [3, n]."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """Intersections of the surface with consecutive grid edges."""

    first: int  # number of the first intersection
    t: np.ndarray  # position along each grid edge, float64 [n]
    normals: np.ndarray  # outward unit normals, float32 [3, n]


class Search(Protocol):
    """Search for intersections on numbered grid edges."""

    def memory(self, size: int) -> Memory:
        """Return memory for at least `size` intersections, which may be that of an earlier call."""

    def find(self, begin: int, end: int, t: np.ndarray, normals: np.ndarray) -> None:
        """Find intersections `begin` to `end` - 1."""


class LaneSearch:
    """Search by native code.

    `fast`, `exact`: its loops in float32 and float64; `origin`, `voxel` in scene units.
    """

    def __init__(
        self, root: Field, fast: Roots, exact: Roots, cells: Cells, origin: Point, voxel: float
    ) -> None:
        loops = fast.native("find"), exact.native("find"), exact.native("polish")
        entry = root.kernel("cpu", "float64").entry
        self._loops = RootLoops(fast.width, fast.batch, *loops, entry, SURE)
        self._cells, self._placement = cells, (origin, voxel)
        self._memory: Memory = np.empty(0), np.empty((3, 0), np.float32)

    def memory(self, size: int) -> Memory:
        """See `Search.memory`."""
        if size > len(self._memory[0]):
            self._memory = np.empty(size), np.empty((3, size), np.float32)
        return self._memory

    def find(self, begin: int, end: int, t: np.ndarray, normals: np.ndarray) -> None:
        """See `Search.find`."""
        self._cells.find_crossings(begin, end, *self._placement, self._loops, t, normals)


class Refiner:
    """Root finder on grid edges whose ends have opposite signs, for the float64 field.

    The float32 kernel brackets each root and the float64 kernel refines it; the float64 kernel starts from
    its own signs where the float32 kernel was wrong. If the float64 field has no sign change (at one end it
    is smaller than float32 resolves) t is that end.

    `origin`, `voxel` in scene units.
    """

    def __init__(
        self,
        root: Field,
        cells: Cells,
        origin: Point,
        voxel: float,
        work: Work | None = None,
    ) -> None:
        self._cells, self._work = cells, work or Work()
        fast, exact = (Roots(root, p, voxel, self._work.device) for p in ("float32", "float64"))
        if fast.on_gpu:
            self._search: Search = CudaSearch(fast, exact, cells, origin, voxel)
            self._in_order: Callable[[Iterator[Crossings]], Iterator[Crossings]] = ahead
        else:
            self._search, self._in_order = LaneSearch(root, fast, exact, cells, origin, voxel), iter
        self._memory = self._search.memory(0)
        self._first, self._end = 0, 0  # computed intersections: first in memory, one past the last

    def each(self, ranges: Iterable[tuple[int, int]]) -> Iterator[Crossings]:
        """Yield the intersections of ranges, as `between` returns them.

        A GPU finds those of the next range while the caller uses the ones before.
        """
        return self._in_order(self.between(begin, end) for begin, end in ranges)

    def between(self, begin: int, end: int) -> Crossings:
        """Return the intersections from number `begin` to at least `end` - 1.

        Both numbers lie between bricks. Intersections beyond `end` are included if already computed.
        """
        self._work.check()
        known, end = max(self._end - begin, 0), max(self._end, end)
        t, normals = self._space(begin, end - begin, known)
        if end > self._end:
            self._search.find(begin + known, end, t[known:], normals[:, known:])
            self._end = end
        return Crossings(begin, t, normals)

    def _space(self, begin: int, size: int, known: int) -> Memory:
        """Memory for `size` intersections, the first `known` of which are computed. They are moved only if no
        space is left behind them.
        """
        memory, here = self._memory, begin - self._first
        if here + size > len(memory[0]):
            self._memory = self._search.memory(2 * size)
            for old, new in zip(memory, self._memory, strict=True):
                new[..., :known] = old[..., here : here + known]
            self._first, here = begin, 0
        t, normals = self._memory
        return t[here : here + size], normals[:, here : here + size]


TrustRegions = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Function of point numbers, [n], and of a mask of the interior ones, [n]; float64 [4, 3, n], scene units.

The rows are the lower and upper corners of boxes that the points must not leave, which may be flat; points in
the boxes or on their boundaries where the field has the opposite sign, or NaN; and points in the boxes in the
middle of the known part of the surface there, or NaN.
"""

AT_ONCE = 1 << 16
"""Points per thread between two checks for cancellation."""


def project(
    root: Field,
    points: np.ndarray,
    trust_regions: TrustRegions,
    voxel: float,
    work: Work | None = None,
) -> None:
    """Project points, in place, to the zero set within their trust regions.

    A point moves along the gradient if the field changes its sign there within four Newton steps and the box,
    else straight towards the point of opposite sign of its trust region. Where the field is smooth nearby, it
    moves straight towards the middle if the surface lies between. A point that would come no nearer stays, as
    does a point already on the surface, such as an exact corner.

    `points`: float64 [n, 3], scene units; `voxel` in scene units.
    """
    work = work or Work()  # on the CPU: copies to a GPU and back take longer
    guess, exact = (Roots(root, precision, voxel) for precision in ("float32", "float64"))
    lead, find, entry = guess.native("lead"), guess.native("find"), root.kernel("cpu", "float64").entry
    exactly = exact.native("find"), exact.native("aim")
    loops = _native.ProjectionLoops(guess.width, lead, find, *exactly, entry)
    for part in chunks(len(points), AT_ONCE * work.threads):
        work.check()
        _native.project(points, part.start, part.stop, loops, trust_regions, voxel, work.threads)


def anywhere(which: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Return unbounded trust regions.

    `which`, `inside`: [n]. Returns [4, 3, n].
    """
    sides = np.array([-np.inf, np.inf, np.nan, np.nan])
    return np.tile(sides[:, None, None], (1, 3, len(which)))


BLUNT = 1 << 14
"""Blunt cells above which a surface is rough: it has any number of sharp edges."""


@dataclass(frozen=True, eq=False)
class Piece:
    """Part of a surface in some layers of bricks."""

    # triangles, scene units; open at the seams. Adjacent pieces have bitwise equal points at their seam
    mesh: Mesh
    end: float  # x at which the piece ends; infinite for the last one
    # middles of its blunt cells: a sharp edge or corner of the surface should pass, but does not. Some of
    # them if there are more than `BLUNT`
    blunt: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))


class SurfaceContours:
    """Pieces of the exact surface of a scene, in any order.

    `signs` in scene units.
    """

    def __init__(self, root: Field, signs: SignBricks, threads: int) -> None:
        from .._native import Cells

        self.root, self.signs = root, signs
        self._cells = call_native(Cells, signs.ijk, signs.signs, signs.index, threads)
        self._placement = placement(signs)

    def refiner(self, work: Work) -> Refiner:
        """Return a root finder for pieces by ascending x."""
        origin, voxel, _ = self._placement
        return Refiner(self.root, self._cells, origin, voxel, work)

    def pieces(self, cuts: Iterable[tuple[int, int]], work: Work) -> Iterator[Piece]:
        """Contour layers of bricks by ascending x, with one search for roots."""
        refiner = self.refiner(work)
        return (self.piece(first, last, refiner, work) for first, last in cuts)

    def piece(self, first: int, last: int, refiner: Refiner, work: Work) -> Piece:
        """Contour some layers of bricks."""
        from .._native import Contouring, trust_regions

        cells, signs = self._cells, self.signs
        surface = Contouring(cells, first, last, *self._placement)
        batches = list(_batches(cells, first - 1, last + 1, work.threads << 16))
        before = cells.crossings_before
        needed = [(before(min(begin, last - 1)), before(end + 1)) for begin, end in batches]
        for (_, end), known in zip(batches, refiner.each(needed), strict=True):
            call_native(surface.advance, end, known.first, known.t, known.normals)
        vertices, triangles, count, cases, to_means, blunt = surface.finish()
        features = vertices[count:]

        def regions(which: np.ndarray, inside: np.ndarray) -> np.ndarray:
            return trust_regions(features, cases, to_means, which, inside, *self._placement)

        project(self.root, features, regions, signs.voxel, work)
        mesh, border = Mesh(vertices, triangles), np.inf
        if last < len(signs.index):  # Unused vertices belong to the next piece.
            mesh = mesh.compact()
            border = signs.origin[0] + signs.voxel * BRICK * last
        return Piece(mesh, border, blunt[: BLUNT + 1])


def _batches(cells: Cells, first: int, last: int, least: int) -> Iterator[tuple[int, int]]:
    """Split layers first to last - 1 into ranges (begin, end), end excluded, of at least `least` crossings,
    so that the crossings of a range are still in the cache when used.
    """
    begin = first
    for end in range(first + 1, last + 1):
        if end == last or cells.crossings_before(end) - cells.crossings_before(begin) >= least:
            yield begin, end
            begin = end


def layers(bricks: SignBricks, most: int) -> list[tuple[int, int]]:
    """Split layers of bricks into pieces."""
    counts = np.bincount(bricks.ijk[:, 0] // BRICK, minlength=bricks.index.shape[0])
    cuts, size = [-1], 0
    for layer, count in enumerate(counts):
        if size and size + count > most:
            cuts.append(layer)
            size = 0
        size += count
    return list(zip(cuts, [*cuts[1:], len(counts)], strict=True))


def placement(bricks: Bricks | SignBricks) -> tuple[tuple[float, float, float], float, float]:
    """Placement of samples, for native code.

    Returns voxel and minimum edge parameter.
    """
    x, y, z = bricks.origin
    return (float(x), float(y), float(z)), float(bricks.voxel), minimum_edge_parameter(bricks)


def minimum_edge_parameter(bricks: Bricks | SignBricks) -> float:
    """Minimum distance of a vertex from a grid point, in voxels, that keeps vertices distinct in float32.

    Vertices of one cell differ by at least this distance along some axis; four float32 steps survive any
    rounding.
    """
    low = np.asarray(bricks.origin, dtype=np.float64)
    high = low + bricks.voxel * 8 * np.asarray(bricks.index.shape)
    extent = np.float32(max(np.abs(low).max(), np.abs(high).max()))
    share = max(1e-4, 4 * float(np.spacing(extent)) / bricks.voxel)
    if share >= 0.5:
        raise MeshError(
            f"a voxel of {bricks.voxel:g} at a distance of {extent:g} is too fine for float32 coordinates"
        )
    return share


def call_native(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a native function."""
    try:
        return function(*arguments)
    except ValueError as error:
        raise MeshError(f"cannot mesh the samples: {error}") from None


def extract(bricks: Bricks, threads: int = 0) -> Mesh:
    """Marching cubes of the samples, in scene units, without the field.

    The mesh is a closed, oriented 2-manifold without self-intersections for any samples, also after its
    coordinates are rounded to float32. Marching cubes (Lorensen and Cline, 1987) with a table without holes
    or self-intersections; `contour.h` has the proof.

    `bricks` in scene units. Returns `Mesh` in scene units.
    """
    from .._native import marching_cubes

    vertices, triangles = call_native(
        marching_cubes, bricks.ijk, bricks.values, bricks.index, *placement(bricks), threads
    )
    return Mesh(vertices, triangles)


def contour(root: Field, bricks: Bricks | SignBricks, work: Work | None = None) -> Mesh:
    """Exact surface of a scene, with sharp edges and corners.

    Each vertex on a grid edge is moved along it to the zero set of the float64 field. Where the normals in a
    cell differ, a vertex is placed at the intersection of the tangent planes and projected to the surface.
    The mesh is a closed, oriented 2-manifold without self-intersections, like that of `extract`; `contour.h`
    has the proof. After Ho, Wu, Chen, Chuang and Ouhyoung 2005, "Cubical Marching Squares".

    `bricks` in scene units. Returns `Mesh` in scene units.
    """
    return contour_whole(root, bricks, work).mesh


def contour_whole(root: Field, bricks: Bricks | SignBricks, work: Work | None = None) -> Piece:
    """Exact surface of a scene as one piece; see `contour`."""
    work, signs = work or Work(), bricks.signs if isinstance(bricks, Bricks) else bricks

    def made() -> Arrays:
        (piece,) = contour_pieces(root, signs, work, len(bricks))
        return {"vertices": piece.mesh.vertices, "triangles": piece.mesh.triangles, "blunt": piece.blunt}

    parts = ("contours", work.device, bricks.origin, bricks.voxel, bricks.index, bricks.ijk, signs.signs)
    arrays = stored(work.store, parts, root, made)
    return Piece(Mesh(arrays["vertices"], arrays["triangles"]), np.inf, arrays["blunt"])


def contour_pieces(
    root: Field, bricks: Bricks | SignBricks, work: Work | None = None, most: int = 1 << 14
) -> Iterator[Piece]:
    """Exact surface of a scene in pieces along x, with memory for one piece at a time.

    `bricks` in scene units.
    """
    work = work or Work()
    made = SurfaceContours(root, bricks.signs if isinstance(bricks, Bricks) else bricks, work.threads)
    return made.pieces(layers(made.signs, most), work)


MOST_EDGES = 1 << 21
"""Grid edges of one round, which take 300 MB of GPU memory; a batch of a mesh on 16 cores has fewer."""


class Table:
    """Rows in GPU memory for the edges of one round. Slicing takes longer than launching: it happens once.

    `whole`: [count, MOST_EDGES].
    """

    def __init__(self, count: int, dtype: np.typing.DTypeLike) -> None:
        self.whole = device_array((count, MOST_EDGES), dtype)
        self.rows = [self.whole[k] for k in range(count)]


@dataclass(frozen=True, eq=False)
class Find:
    """Loop `find` of one precision."""

    launch: Any  # function that launches it, and its FRAME
    frame: Any
    segments: Table  # what it reads and writes
    roots: Any
    start: CudaFunction  # loops that start `polish` from its roots, and collect the results of that
    collect: CudaFunction


class CudaSearch:
    """Search of `crossings.Refiner` on a GPU, with a thread per edge.

    `fast`, `exact`: in float32 and float64; `origin`, `voxel` in scene units.
    """

    def __init__(
        self, fast: Roots, exact: Roots, cells: Cells, origin: tuple[float, float, float], voxel: float
    ) -> None:
        require()
        self._cells, self._placement = cells, (*origin, voxel)
        self._lay = load_functions(NOTHING, "float64", (lay,))["lay"]
        self._edges = device_array((MOST_EDGES, 4), np.int16)
        self._fast, self._exact = (
            Find(
                *self._loop(roots, "find"), Table(6, roots.dtype), self._row(roots.dtype),
                **load_functions(NOTHING, roots.precision, (start, collect)),
            )
            for roots in (fast, exact)
        )  # fmt: skip
        self._polish = self._loop(exact, "polish")
        self._roots, self._polished = self._row(np.float64), Table(4, np.float64)
        self._normals, self._unsure = Table(3, np.float32), self._row(np.uint8)
        self._memories = [(np.empty(0), np.empty((3, 0), np.float32))] * 2

    def _loop(self, roots: Roots, name: str) -> tuple[Any, Any]:
        """Function that launches a loop, and its FRAME."""
        return cast(CudaLoop, roots.runs[name]).launch, to_device(roots.frame)

    def _row(self, dtype: np.typing.DTypeLike) -> Any:
        return device_array(MOST_EDGES, dtype)

    def memory(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        """See `Search.memory`. It alternates between two: the caller still reads the other."""
        self._memories.reverse()
        if size > len(self._memories[0][0]):
            of = pinned_array(size, np.float64), pinned_array((3, size), np.float32)
            self._memories[0] = of  # the GPU copies faster into page-locked memory
        return self._memories[0]

    def find(self, begin: int, end: int, t: np.ndarray, normals: np.ndarray) -> None:
        """See `Search.find`."""
        for first in range(begin, end, MOST_EDGES):
            last = min(first + MOST_EDGES, end)
            part = slice(first - begin, last - begin)
            self._round(self._cells.edges(first, last), t[part], normals[:, part])

    def _round(self, edges: np.ndarray, t: np.ndarray, normals: np.ndarray) -> None:
        """Find roots in float32 and polish them in float64; find them in float64 where that is not exact."""
        unsure = np.flatnonzero(self._searched(self._fast, edges, t, normals))
        if len(unsure):
            few = np.empty(len(unsure)), np.empty((3, len(unsure)), np.float32)
            self._searched(self._exact, edges[unsure], *few)
            for row, new in zip((t, *normals), (few[0], *few[1]), strict=True):
                row[unsure] = new

    def _searched(self, find: Find, edges: np.ndarray, t: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Find and polish roots; return a mask of those that are not exact."""
        n, (polish, frame) = len(edges), self._polish
        segments, polished = self._exact.segments, self._polished
        self._edges[:n].copy_to_device(edges)
        rows = segments.whole, self._fast.segments.whole, MOST_EDGES
        self._lay.launch(n, self._edges, *self._placement, *rows, n)
        find.launch(n, find.frame, *find.segments.rows, find.roots)
        find.start.launch(n, find.roots, self._roots, n)
        polish(n, frame, *segments.rows, self._roots, *polished.rows)
        results = self._roots, polished.whole, self._normals.whole, self._unsure
        find.collect.launch(n, find.roots, *results, SURE, MOST_EDGES, n)
        for row, to in zip((self._roots, *self._normals.rows), (t, *normals), strict=True):
            row[:n].copy_to_host(to)
        flags: np.ndarray = self._unsure[:n].copy_to_host()
        return flags.view(np.bool_)  # NumPy finds flags twenty times faster than other numbers
