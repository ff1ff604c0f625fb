"""A tetrahedral mesh around a surface, whose edges, faces and cells are split at given points, and marching
tetrahedra.

Where all cells at an edge, a face or a cell are split at one point strictly inside it, they still meet in
whole faces and do not overlap, wherever the point is. The surface by marching tetrahedra (Doi and Koide 1991,
"An efficient method of triangulating equi-valued surfaces by using tetrahedral cells") is then closed, an
oriented 2-manifold and free of self-intersections.
"""

from __future__ import annotations

import math
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import distinct
from ..errors import TooLargeError
from ..fields.field import Field
from ..volume.bricks import BRICK, Lattice, values_at
from ..work import Work
from .model import Mesh
from .roots import Segments

Points = NDArray[np.float64]
"""Points, [3, n], scene units."""

Parts = NDArray[np.int32]
"""Numbers of the vertices of edges, faces or cells, ascending in each, [2, n], [3, n] or [4, n]."""

CORNERS: dict[int, list[tuple[int, ...]]] = {k: list(combinations(range(4), k)) for k in (2, 3)}
"""Corners of the edges and of the faces of a tetrahedron."""

BITS = {2: 31, 3: 21}
"""Bits of a vertex in the key of an edge, and of a face."""

MOST_VERTICES = 1 << BITS[3]
"""Largest number of vertices."""

COARSEST = 64
"""Voxels along a cell of the first level."""

SMALLEST = 1e-8
"""Volume of a cell, cubic voxels, below which none is made: rounding may turn smaller ones over."""

APART = 1e-3
"""Distance in voxels of a root from the ends of its edge, at least."""


def cube_corners() -> NDArray[np.int64]:
    """Numbers of corners, 4 x + 2 y + z, of the six tetrahedra of a cube around its diagonal, [6, 4].

    Their volumes are positive. The division is the same on opposite faces (Kuhn 1960, "Some combinatorial
    lemmas in topology").
    """
    result = []
    for order in permutations(range(3)):
        corners = np.zeros((4, 3), np.int64)
        for place, axis in enumerate(order):
            corners[place + 1 :, axis] = 1
        turned = np.linalg.det(corners[1:]) < 0
        result.append(corners[[0, 2, 1, 3]] if turned else corners)
    return np.array(result) @ (4, 2, 1)


class Tetrahedra:
    """Tetrahedra of the cells of a lattice that the surface of a field may pass.

    Attributes
    ----------
    points : float64 [3, n]
        Vertices, scene units.
    values : float64 [n]
        The field there.
    cells : int32 [4, m]
        Vertices of each tetrahedron, of positive volume.
    evaluations : int
        Evaluations of the field.
    """

    def __init__(self, root: Field, lattice: Lattice, finest: float, work: Work) -> None:
        self._kernel, self.slope, self.voxel = (
            root.kernel("cpu", "float64"),
            root.bounds.lipschitz,
            lattice.voxel,
        )
        self.segments, self._work, self.evaluations = Segments(root, lattice.voxel, finest, work), work, 0
        self.points, self.cells = self._cut_up(lattice)
        self.values = self.at(self.points)

    def at(self, points: Points) -> NDArray[np.float64]:
        """The field at points; outside where it is not a number."""
        self.evaluations += points.shape[1]
        values = values_at(self._kernel, points, self._work)
        return np.asarray(np.where(np.isnan(values), self.voxel, values))

    def _cut_up(self, lattice: Lattice) -> tuple[Points, NDArray[np.int32]]:
        """Vertices, and tetrahedra of the cells that no bound proves to be on one side."""
        origin, counts = np.array(lattice.origin)[:, None], BRICK * np.array(lattice.bricks)
        corners, size = np.indices((2, 2, 2)).reshape(3, 1, 8), COARSEST
        places = size * np.indices((-(-counts // size)).tolist()).reshape(3, -1)
        while True:
            values = self.at(origin + self.voxel * (places + size / 2))
            places = places[:, np.abs(values) <= self.slope * self.voxel * size * math.sqrt(3) / 2]
            if size == 1:
                break
            size //= 2
            places = (places[:, :, None] + size * corners).reshape(3, -1)
        shape = tuple((counts + COARSEST).tolist())
        keys = np.asarray(np.ravel_multi_index(tuple((places[:, :, None] + corners).reshape(3, -1)), shape))
        known = distinct(keys)
        if len(known) > MOST_VERTICES / 4:
            raise TooLargeError("too many tetrahedra")
        rows = np.searchsorted(known, keys).reshape(-1, 8)
        points = origin + self.voxel * np.stack(np.unravel_index(known, shape))
        return points, np.ascontiguousarray(rows[:, cube_corners()].reshape(-1, 4).T.astype(np.int32))

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether the vertices of each tetrahedron are inside, [4, m]."""
        return (self.values < 0)[self.cells]

    def parts(self, size: int, since: int = 0) -> Parts:
        """Edges (`size` 2) or faces (3) with a vertex since a number, as often as they are in cells."""
        cells = self.cells
        if since:
            cells = cells[:, (cells >= since).any(axis=0)]
        parts = ordered(np.concatenate([cells[list(corners)] for corners in CORNERS[size]], axis=1))
        return parts[:, parts[-1] >= since] if since else parts

    # --- splitting
    def add(self, points: Points, values: NDArray[np.float64]) -> NDArray[np.int32]:
        """Add vertices; return their numbers."""
        first = len(self.values)
        self.points, self.values = (
            np.concatenate(both, axis=-1) for both in ((self.points, points), (self.values, values))
        )
        if len(self.values) > MOST_VERTICES:
            raise TooLargeError("too many tetrahedra")
        return np.arange(first, len(self.values), dtype=np.int32)

    def split(self, parts: Parts, points: Points, values: NDArray[np.float64]) -> None:
        """Split edges or faces, each at a point in it, in all cells that they are in.

        Edges are split one after another, in the same order in each cell, so that both cells of a face divide
        it alike. A face is divided in three on either side. What would leave a cell too small is not split.
        """
        order = np.argsort(keys_of(parts))
        parts, points, values = parts[:, order], points[:, order], values[order]
        few, numbers = self._cells_with(parts)
        least = np.full(parts.shape[1] + 1, np.inf)
        volumes = self.volumes(few)
        for row in numbers:
            np.minimum.at(least, row, volumes)
        large = (
            least[:-1] * least_share(points, [self.points[:, row] for row in parts])
            > SMALLEST * self.voxel**3
        )
        if not large.all():
            parts, points, values = parts[:, large], points[:, large], values[large]
            few, numbers = self._cells_with(parts)
        fresh = self.add(points, values)
        touched = np.minimum.reduce(numbers) < len(fresh)
        rest = np.ones(self.cells.shape[1], bool)
        rest[few[touched]] = False
        made = self.cells[:, few[touched]]
        cell = np.arange(made.shape[1])
        for numbered in np.sort([row[touched] for row in numbers], axis=0):
            made, cell = split_once(made, cell, numbered, parts, fresh)
        self.cells = np.concatenate([self.cells[:, rest], made], axis=1)

    def _cells_with(self, parts: Parts) -> tuple[NDArray[np.int64], list[NDArray[np.int64]]]:
        """Cells that may have some of the parts; for each of their edges or faces, the number of the part, or
        the last number if it is none.
        """
        marks = np.zeros(len(self.values), np.int8)
        marks[parts] = 1
        few = np.flatnonzero(marks[self.cells].sum(axis=0) >= len(parts))
        own, of, numbers = self.cells[:, few], keys_of(parts), []
        for corners in CORNERS[len(parts)]:
            keys = keys_of(ordered(own[list(corners)]))
            place = np.searchsorted(of, keys)
            found = np.append(of, -1)[place] == keys
            numbers.append(np.where(found, place, len(of)))
        return few, numbers

    def volumes(self, which: NDArray[np.int64]) -> NDArray[np.float64]:
        """Volumes of cells, cubed scene units."""
        return size_of([self.points[:, row[which]] for row in self.cells]) / 6

    def split_cells(self, which: NDArray[np.int64], points: Points, values: NDArray[np.float64]) -> None:
        """Split cells in four, each at a point in it."""
        least = self.volumes(which) * least_share(points, [self.points[:, row[which]] for row in self.cells])
        large = least > SMALLEST * self.voxel**3
        which, points, values = which[large], points[:, large], values[large]
        fresh, cells = self.add(points, values), self.cells[:, which]
        made = [self.cells[:, np.delete(np.arange(self.cells.shape[1]), which)]]
        for row in range(4):
            own = cells.copy()
            own[row] = fresh
            made.append(own)
        self.cells = np.concatenate(made, axis=1)

    # --- the surface
    def roots(self, edges: Parts) -> Points:
        """Roots on edges whose ends are on different sides."""
        start, end = (self.points[:, row] for row in edges)
        along, size = end - start, lengths(end - start)
        margin = np.minimum(APART * self.voxel / size, 0.25)
        shares = np.clip(self.segments.roots(start, along), margin, 1 - margin)
        return np.asarray(start + shares * along)

    def surface(self) -> Mesh:
        """The surface, scene units."""
        inside = self.inside
        code = (inside * np.array([[1], [2], [4], [8]], np.int8)).sum(axis=0)
        (cut,) = np.nonzero((code > 0) & (code < 15))
        cells, inside, code = self.cells[:, cut], inside[:, cut], code[cut]
        number = np.empty((4, 4, len(cut)), np.int64)  # of the root on the edge between two corners
        crossed = np.array([inside[i] != inside[j] for i, j in CORNERS[2]])
        edges = np.array([ordered(cells[list(ends)]) for ends in CORNERS[2]])  # [6, 2, m]
        keys = keys_of(np.stack([edges[:, k][crossed] for k in range(2)]))
        known = distinct(keys)
        numbered = np.zeros(crossed.shape, np.int64)
        numbered[crossed] = np.searchsorted(known, keys)
        for row, (i, j) in enumerate(CORNERS[2]):
            number[i, j] = number[j, i] = numbered[row]
        vertices = self.roots(parts_of(known, 2))
        triangles = []
        for case in range(1, 15):
            (rows,) = np.nonzero(code == case)
            triangles += case_triangles(case, number[:, :, rows], vertices)
        return Mesh(vertices.T.copy(), np.concatenate(triangles, axis=1).T.astype(np.int32))


def lengths(vectors: Points) -> NDArray[np.float64]:
    """Lengths of vectors, [n]."""
    return np.asarray(np.sqrt(vectors[0] ** 2 + vectors[1] ** 2 + vectors[2] ** 2))


def least_share(points: Points, corners: list[Points]) -> NDArray[np.float64]:
    """Least barycentric coordinate of points on segments, in triangles or in tetrahedra."""
    whole = size_of(corners)
    parts = [
        size_of([points if k == own else c for k, c in enumerate(corners)]) for own in range(len(corners))
    ]
    return np.asarray(np.minimum.reduce(parts) / np.maximum(whole, 1e-300))


def size_of(corners: list[Points]) -> NDArray[np.float64]:
    """Lengths of segments, twice the areas of triangles, or six times the volumes of tetrahedra."""
    a, *others = corners
    first, *rest = (b - a for b in others)
    if not rest:
        return lengths(first)
    across = np.cross(first, rest[0], axis=0)
    return lengths(across) if len(rest) == 1 else np.abs((across * rest[1]).sum(axis=0))


def ordered(parts: Parts) -> Parts:
    """Edges or faces with their vertices in ascending order; sorting takes longer."""
    a, b, *rest = parts
    a, b = np.minimum(a, b), np.maximum(a, b)
    if not rest:
        return np.array([a, b])
    middle, last = np.minimum(b, rest[0]), np.maximum(b, rest[0])
    return np.array([np.minimum(a, middle), np.maximum(a, middle), last])


def keys_of(parts: Parts) -> NDArray[np.int64]:
    """Number of each edge or face."""
    bits, keys = BITS[len(parts)], parts[0].astype(np.int64)
    for row in parts[1:]:
        keys = keys << bits | row
    return np.asarray(keys)


def parts_of(keys: NDArray[np.int64], size: int) -> Parts:
    """Edges or faces from their numbers."""
    bits = BITS[size]
    rows = [keys >> bits * k & (1 << bits) - 1 for k in reversed(range(size))]
    return np.array(rows, np.int32).reshape(size, -1)


def distinct_parts(parts: Parts) -> Parts:
    """Each edge or face once, in order."""
    return parts_of(distinct(keys_of(parts)), len(parts))


def split_once(
    cells: NDArray[np.int32],
    of: NDArray[np.int64],
    numbers: NDArray[np.int64],
    parts: Parts,
    fresh: NDArray[np.int32],
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Split those cells that have the part that is numbered in the cell that they come from.

    `of`: which cell each comes from; `numbers`: of a part in each of these, or of none. Returns the same as
    `cells` and `of`.
    """
    mine = numbers[of]
    (rows,) = np.nonzero(mine < len(fresh))
    if not len(rows):
        return cells, of
    own, ends = cells[:, rows], parts[:, mine[rows]]
    has = np.logical_and.reduce([(own == end).any(axis=0) for end in ends])
    own, ends, new = own[:, has], ends[:, has], fresh[mine[rows[has]]]
    rest = np.ones(len(of), bool)
    rest[rows[has]] = False
    made = [np.where(own == end, new, own) for end in ends]
    owners = [of[rest], *[of[rows[has]]] * len(ends)]
    return np.concatenate([cells[:, rest], *made], axis=1), np.concatenate(owners)


def case_triangles(case: int, number: NDArray[np.int64], vertices: Points) -> list[NDArray[np.int64]]:
    """Triangles of cells of a case, [3, n] each. A quadrangle is cut by its shorter diagonal.

    `case`: bits of the corners inside; `number`: of the root between two corners, [4, 4, n].
    """
    within, out = ([k for k in range(4) if (case >> k & 1) == side] for side in (1, 0))
    if np.linalg.det(np.eye(4)[within + out]) < 0:
        (within if len(within) > 1 else out)[:2] = (within if len(within) > 1 else out)[1::-1]
    if len(within) == 2:
        (a, b), (c, d) = within, out
        corners = number[a, c], number[a, d], number[b, d], number[b, c]
        p, q, r, s = (vertices[:, corner] for corner in corners)
        short, (p, q, r, s) = lengths(p - r) <= lengths(q - s), corners
        return [np.where(short, [p, q, r], [p, q, s]), np.where(short, [p, r, s], [q, r, s])]
    one, three = (within[0], out) if len(within) == 1 else (out[0], within)
    return [np.array([number[one, k] for k in three])]
