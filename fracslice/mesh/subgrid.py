"""The surface of a solid with parts thinner than a voxel.

A tetrahedral mesh of cells of a voxel is split until its edges, faces and cells show what is in them:

- An edge is split where the field on it has the sign that neither end has, until each crosses the surface at
  most once: sheets, and gaps between them. "Subgrid Marching Tetrahedra" (Baktash, Gillespie and Crane 2026)
  takes the same roots, and triangulates within the tetrahedra of the grid.
- A face is split where a wire pierces it, or where a sheet between its edges ends; a cell where a wire ends.
- Edges around a part that is round are split until normals differ little from one to the next.

Where there is something is found by steps along segments that are as long as the field allows.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..errors import EmptyError
from ..fields.field import Field
from ..volume.bricks import Lattice
from ..work import Work
from .model import Mesh
from .tetrahedra import Parts, Points, Tetrahedra, distinct_parts, lengths, ordered

FINEST = 0.02
"""Length in voxels that an edge must be in a sheet, or in a gap, for it to be found."""

DEPTH = 5e-3
"""Distance from the surface, voxels, of the points that are taken; triangles around others would be too small
for the float32 of a file.
"""

STEPS = 128
"""Largest number of steps along a chord."""

ROUNDS, FACE_ROUNDS, BENDS = 8, 4, 6
"""Largest number of times that edges, faces, and edges around bends are split."""

SHARES = 0.5, 0.75, 0.9
"""Shares of the way from a corner to the opposite side at which a sheet or a wire is looked for."""

SMALL = 0.02
"""Area of a face, square voxels, below which the end of a sheet is not looked for in it."""

DESCENT = 6
"""Steps along the gradient of a face."""

WITHIN = 0.01
"""Least barycentric coordinate of a point in a face."""

STEP = 1e-4
"""Step of differences of the field, voxels."""

NEEDLE, ROUND, SHARP, BLUNTED = 0.5, 0.99, 0.5, 3
"""Cosines between two normals: below which a part is thin in two directions (60 degrees); below which an edge
there is split (8 degrees); below which it is sharp (60 degrees), and not split after so many rounds: around a
round part, normals differ by half as much after each.
"""


MOST_BENT = 1 << 15
"""Vertices from which on edges around bends are not split: each round doubles those around wires."""


def thin_surface(root: Field, lattice: Lattice, work: Work) -> tuple[Mesh, int]:
    """Surface of a field, scene units, and the number of evaluations that it took."""
    made = ThinParts(root, lattice, work)
    made.run()
    mesh = made.mesh.surface()
    if not len(mesh.triangles):
        raise EmptyError(f"there is no surface that is {FINEST:g} voxels of {lattice.voxel:.3g} thick")
    return mesh, made.mesh.evaluations


def outside_share(mesh: Mesh, points: Points) -> float:
    """Share of points that are outside a mesh."""
    from .models import MeshField

    return float((MeshField(mesh).kernel("cpu", "float64").points(*points) >= 0).mean())


class ThinParts:
    """Splits tetrahedra until they show what is thinner than they are."""

    def __init__(self, root: Field, lattice: Lattice, work: Work) -> None:
        self.mesh, self.work = Tetrahedra(root, lattice, FINEST * lattice.voxel, work), work
        self.slope, self.voxel = self.mesh.slope, self.mesh.voxel
        self.samples = len(self.mesh.values)  # vertices that are grid points
        self.needles = self.samples  # vertices before those in faces
        self.round = np.zeros(0, bool)  # vertices at parts that are thin in two directions

    def run(self) -> None:
        """Split."""
        for done, _ in enumerate(self._rounds(), 1):
            self.work.check()
            self.work.progress("meshing", done / (1 + FACE_ROUNDS + BENDS))

    def _rounds(self) -> Iterator[None]:
        self.split_edges()
        yield
        since, self.needles = 0, len(self.mesh.values)
        for _ in range(FACE_ROUNDS):
            since, before = len(self.mesh.values), since
            self.split_faces(before)
            self.split_tips(before)
            yield
            if len(self.mesh.values) == since:
                break
        since = 0
        for turn in range(BENDS):
            since, before = len(self.mesh.values), since
            if since > MOST_BENT:
                break
            self.split_bends(before, SHARP if turn >= BLUNTED else -1)
            yield
            if len(self.mesh.values) == since:
                break

    # --- edges
    def split_edges(self, since: int = 0) -> None:
        """Split edges with a vertex since a number until each crosses the surface at most once."""
        for _ in range(ROUNDS):
            edges = self.mesh.parts(2, since)
            edges = distinct_parts(edges)
            f, (a, b) = np.abs(self.mesh.values[edges]), (self.mesh.points[:, end] for end in edges)
            (near,) = np.nonzero(f[0] + f[1] < self.slope * lengths(b - a))
            edges, a, b = edges[:, near], a[:, near], b[:, near]
            which, points, values = self.hidden(a, b, *self.mesh.values[edges])
            if not len(which):
                return
            since = len(self.mesh.values)
            self.mesh.split(edges[:, which], points, values)

    def hidden(
        self, a: Points, b: Points, fa: NDArray[np.float64], fb: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], Points, NDArray[np.float64]]:
        """Segments between points on which the field has a sign change more than its ends show.

        `fa`, `fb`: the field at the ends. Returns numbers of segments, a point on each, not on the side
        of its first end, and the field there.
        """
        along, sides = b - a, np.where(np.array([fa, fb]) < 0, -1.0, 1.0)
        t = self.mesh.segments.approach(a, along, np.array([fa, fb]))
        over = t >= 0
        t = np.where(over, t, -1 - t)
        alike = sides[0] == sides[1]
        (found,) = np.nonzero(np.where(alike, over.any(axis=0), over.all(axis=0)))
        low, high = np.where(over[:, found], t[:, found], t[::-1, found])
        tries = np.where(alike[found], [low, high, (low + high) / 2], low)
        points = a[:, None, found] + tries * along[:, None, found]
        values = self.mesh.at(points.reshape(3, -1)).reshape(3, -1)
        best = (sides[0, found] * values).argmin(axis=0), np.arange(len(found))
        points, values = points[:, *best], values[best]
        deep = self.deep(values)
        return found[deep], points[:, deep], values[deep]

    # --- faces and cells
    def split_faces(self, since: int) -> None:
        """Split faces with a vertex since a number where a wire pierces them, or a sheet ends in them."""
        faces, first = self.mesh.parts(3, since), len(self.mesh.values)
        inside = (self.mesh.values < 0).astype(np.int8)
        inside[: self.samples] *= 4  # where samples are inside, no sheet is too thin for them
        one, two, three = inside[faces]
        count = one + two + three
        bare, rim = (distinct_parts(faces[:, count == k]) for k in (0, 1))
        which, points, values = self.pierced([self.mesh.points[:, corner] for corner in bare])
        rim, at, there = self.ended(rim)
        self.mesh.split(
            np.concatenate([bare[:, which], rim], axis=1),
            np.concatenate([points, at], axis=1),
            np.concatenate([values, there]),
        )
        self.split_edges(first)

    def pierced(self, corners: list[Points]) -> tuple[NDArray[np.int64], Points, NDArray[np.float64]]:
        """Triangles whose corners are outside, with a point inside.

        Newton's method along the gradient in the triangle, from its middle. Returns the numbers of triangles,
        a point in each, and the field there.
        """
        middle = np.mean(corners, axis=0)
        reach = np.max([lengths(corner - middle) for corner in corners], axis=0)
        f, finest = self.mesh.at(middle), FINEST * self.voxel
        (left,) = np.nonzero(f < self.slope * reach)
        at, f, found = middle[:, left], f[left], [(left[:0], middle[:, :0], f[:0])]
        for step in range(DESCENT):
            hit = f < 0
            found.append((left[hit], at[:, hit], f[hit]))
            left, at, f = left[~hit], at[:, ~hit], f[~hit]
            if step == DESCENT - 1 or not len(left):
                break
            axes = frame(*(corner[:, left] for corner in corners))
            e = STEP * self.voxel
            slopes = [(self.mesh.at(at + e * axis) - f) / e for axis in axes]
            move = -(f + self.slope * finest / 4) / np.maximum(slopes[0] ** 2 + slopes[1] ** 2, 1e-9)
            at = at + move * (slopes[0] * axes[0] + slopes[1] * axes[1])
            shares = barycentric(at, *(corner[:, left] for corner in corners))
            near = shares.min(axis=0) > -0.3
            left, shares = left[near], np.maximum(shares[:, near], WITHIN)
            at = sum(
                w * corner[:, left] for w, corner in zip(shares / shares.sum(axis=0), corners, strict=True)
            )
            f = self.mesh.at(at)
        which, at, f = (np.concatenate(rows, axis=-1) for rows in zip(*found, strict=True))
        at, f = self.centred(at, f, [corner[:, which] for corner in corners])
        deep = self.deep(f)
        return which[deep], at[:, deep], f[deep]

    def deep(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points are so far from the surface, by the field there, that they are worth a vertex."""
        return np.abs(values) > DEPTH * self.voxel

    def centred(
        self, at: Points, f: NDArray[np.float64], corners: list[Points]
    ) -> tuple[Points, NDArray[np.float64]]:
        """Points inside on triangles, moved to the middle of what is inside: of the chord along the gradient,
        then of that across it. Returns the points, and the field there.
        """
        axes, e = frame(*corners), STEP * self.voxel
        slopes = [(self.mesh.at(at + e * axis) - f) / e for axis in axes]
        steep = np.maximum(np.hypot(*slopes), 1e-300)
        along = (slopes[0] * axes[0] + slopes[1] * axes[1]) / steep
        across = (slopes[0] * axes[1] - slopes[1] * axes[0]) / steep
        for axis in (along, across):
            middle = at + (self.chord(at, f, axis, corners) - self.chord(at, f, -axis, corners)) / 2 * axis
            there = self.mesh.at(middle)
            at, f = np.where(there < f, middle, at), np.where(there < f, there, f)
        return at, f

    def chord(
        self, at: Points, f: NDArray[np.float64], axis: Points, corners: list[Points]
    ) -> NDArray[np.float64]:
        """Length from points inside, along an axis, to where the field is not negative or the triangle
        ends.
        """
        here, there = (barycentric(p, *corners) for p in (at, at + self.voxel * axis))
        slope = (here - there) / self.voxel
        ends = (here - WITHIN) / np.where(slope > 0, slope, np.inf)
        most = np.min(np.where(slope > 0, np.maximum(ends, 0), np.inf), axis=0)
        reached, left = np.zeros(len(f)), np.flatnonzero(most > 0)
        f = f.copy()
        for _ in range(STEPS):
            step = np.maximum(-f[left] / self.slope, FINEST * self.voxel / 8)
            reached[left] = np.minimum(reached[left] + step, most[left])
            left = left[reached[left] < most[left]]
            if not len(left):
                break
            f[left] = self.mesh.at(at[:, left] + reached[left] * axis[:, left])
            left = left[f[left] < 0]
        return reached

    def ended(self, faces: Parts) -> tuple[Parts, Points, NDArray[np.float64]]:
        """Faces with one corner inside, in which the sheet that it is in goes on between the others.

        Returns such faces, a point inside on each, and the field there.
        """
        one, two, three = (self.mesh.points[:, row] for row in self._inside_first(faces))
        wide = lengths(np.cross(two - one, three - one, axis=0)) > 2 * SMALL * self.voxel**2
        faces, one, two, three = faces[:, wide], one[:, wide], two[:, wide], three[:, wide]
        left, last = np.arange(faces.shape[1]), np.zeros(faces.shape[1], bool)
        points, values = np.zeros((3, len(left))), np.zeros(len(left))
        for share in SHARES:
            a, b = (one[:, left] + share * (p - one)[:, left] for p in (two, three))
            fa, fb = self.mesh.at(a), self.mesh.at(b)
            wide = (fa >= 0) & (fb >= 0) & (fa + fb < self.slope * lengths(b - a))
            which, at, there = self.hidden(a[:, wide], b[:, wide], fa[wide], fb[wide])
            left = left[wide][which]
            points[:, left], values[left], last[left] = at, there, True
        return faces[:, last], points[:, last], values[last]

    def split_tips(self, since: int) -> None:
        """Split cells with a vertex since a number in which a wire ends that comes from one corner."""
        cells, first = self.mesh.cells, len(self.mesh.values)
        inside = self.mesh.inside
        (own,) = np.nonzero(
            (inside.sum(axis=0) == 1) & (inside & (cells >= max(since, self.needles))).any(axis=0)
        )
        one, *others = (self.mesh.points[:, row] for row in self._inside_first(cells[:, own]))
        left, last = np.arange(len(own)), np.zeros(len(own), bool)
        points, values = np.zeros((3, len(own))), np.zeros(len(own))
        for share in SHARES:
            corners = [one[:, left] + share * (p - one)[:, left] for p in others]
            bare = np.min([self.mesh.at(corner) for corner in corners], axis=0) >= 0
            which, at, there = self.pierced([corner[:, bare] for corner in corners])
            left = left[bare][which]
            points[:, left], values[left], last[left] = at, there, True
        self.mesh.split_cells(own[last], points[:, last], values[last])
        self.split_edges(first)

    def _inside_first(self, parts: Parts) -> Parts:
        """Parts with one vertex inside, from that vertex on."""
        inside = self.mesh.values[parts] < 0
        turns = (inside.argmax(axis=0) + np.arange(len(parts))[:, None]) % len(parts)
        return np.take_along_axis(parts, turns, axis=0)

    # --- bends
    def split_bends(self, since: int, sharp: float) -> None:
        """Split edges with a vertex since a number, along which the surface beside them turns.

        `sharp`: cosine between two normals below which there is a sharp edge, which is left as it is.
        """
        faces, first = self.mesh.parts(3, since), len(self.mesh.values)
        inside = self.mesh.values < 0
        one, two, three = inside[faces]
        mixed = (one != two) | (two != three)
        faces, one, two, three = faces[:, mixed], one[mixed], two[mixed], three[mixed]
        lone = np.where(two == three, 0, np.where(one == three, 1, 2))
        faces = np.take_along_axis(faces, (lone + np.arange(3)[:, None]) % 3, axis=0)
        normals, used = np.zeros(self.mesh.points.shape), np.zeros(len(inside), bool)
        used[faces[1:]] = True
        normals[:, used] = self.normals(self.mesh.points[:, used])
        cosine = sum(row[faces[1]] * row[faces[2]] for row in normals)
        self.round = np.append(self.round, np.zeros(len(inside) - len(self.round), bool))
        self.round[faces[:, cosine < NEEDLE]] = True
        faces = faces[:, (cosine < ROUND) & self.round[faces].any(axis=0)]
        one, other = (self.normals(self.mesh.roots(faces[[0, k]])) for k in (1, 2))
        cosine = (one * other).sum(axis=0)
        bent = (sharp < cosine) & (cosine < ROUND)
        edges = distinct_parts(ordered(faces[1:, bent]))
        a, b = (self.mesh.points[:, end] for end in edges)
        edges = edges[:, lengths(b - a) > 2 * FINEST * self.voxel]
        (fa, fb), (a, b) = np.abs(self.mesh.values[edges]), (self.mesh.points[:, end] for end in edges)
        share = np.where(
            self.mesh.values[edges[0]] < 0, 0.5, np.clip(fa / np.maximum(fa + fb, 1e-300), 0.1, 0.9)
        )
        points = a + share * (b - a)
        values = self.mesh.at(points)
        deep = self.deep(8 * values)
        self.mesh.split(edges[:, deep], points[:, deep], values[deep])
        self.split_edges(first)

    def normals(self, points: Points) -> Points:
        """Unit vectors along the gradient of the field."""
        e, f = STEP * self.voxel, self.mesh.at(points)
        slopes = np.array([self.mesh.at(points + e * axis[:, None]) - f for axis in np.eye(3)])
        return slopes / np.maximum(lengths(slopes), 1e-300)


def frame(a: Points, b: Points, c: Points) -> tuple[Points, Points]:
    """Unit vectors along triangles, at right angles."""
    along, other = (b - a) / np.maximum(lengths(b - a), 1e-300), c - a
    across = other - (other * along).sum(axis=0) * along
    return along, across / np.maximum(lengths(across), 1e-300)


def barycentric(points: Points, a: Points, b: Points, c: Points) -> NDArray[np.float64]:
    """Barycentric coordinates of points in the planes of triangles, [3, n]."""
    u, v, w = b - a, c - a, points - a
    uu, uv, vv, wu, wv = ((p * q).sum(axis=0) for p, q in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    area = np.maximum(uu * vv - uv * uv, 1e-300)
    second, third = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    return np.array([1 - second - third, second, third])
