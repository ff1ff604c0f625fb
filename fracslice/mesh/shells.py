"""Surface in pieces along x, one in memory at a time; its shells, and the nesting of bodies and
cavities, by vertical rays and exact predicates.

Components of consecutive pieces are joined by a tree: a node joins those of a few ranges of pieces, and keeps
the vertices at the outer seams only. The tree depends on the number of pieces alone.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import near, near_bodies, touching
from .._native import nesting as _nesting
from ..errors import MeshError
from ..fields.depth import WIDE
from ..records import JOINING, PIECES
from ..store import Arrays
from ..work import Work, ahead, chunks
from .contouring import Piece
from .model import Mesh, Shells

NOTHING = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))


class Strip(NamedTuple):
    """Some triangles of a mesh."""

    mesh: Mesh  # the triangles and their vertices
    numbers: NDArray[np.int64]  # indices of the vertices in the mesh, ascending
    rows: NDArray[np.int64]  # indices of the triangles, ascending


def strip(mesh: Mesh, vertices: NDArray[np.bool_], threads: int = 0) -> Strip:
    """Triangles that use some vertices.

    `vertices`: bool (n,).
    """
    rows = touching(mesh.triangles, vertices, threads)
    triangles, used = mesh.triangles[rows], np.zeros(len(mesh.vertices), bool)
    used[triangles] = True
    numbers, place = np.flatnonzero(used), np.cumsum(used, dtype=np.int32) - 1
    return Strip(Mesh(mesh.vertices[numbers], place[triangles]), numbers, rows)


HEAD, TAIL = "head", "tail"
"""Sides of a piece: the strips at its begin and at its end."""


def strip_at(mesh: Mesh, side: str, seam: float, halo: float, threads: int = 0) -> Strip:
    """Strip of a piece at the seam x = `seam`, of width `halo`."""
    x = mesh.vertices[:, 0]
    return strip(mesh, x < seam + halo if side == HEAD else x > seam - halo, threads)


class Pieces:
    """Pieces of a surface, in order, with labels of their vertices; scene units.

    A label is a connected component of a piece; labels count from the first piece on. `halo`: width of the
    strips at the seams.
    """

    def __init__(self, folder: Path | None = None, halo: float = 0.0) -> None:
        self.folder, self.halo = folder, halo
        self.ends, self.starts = list[float](), list[int]()
        self.fresh, self.first_labels = list[int](), list[int]()
        self._count = 0
        self._held: dict[str, Arrays] = {}

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def triangles(self) -> int:
        """Number of all triangles."""
        return self._count

    def anew(self) -> Pieces:
        """Return an empty collection in the same place, whose pieces replace those of this one."""
        return Pieces(self.folder, self.halo)

    def add(self, piece: Piece, fresh: int = 0) -> None:
        """Append a piece."""
        self.put(len(self), piece.mesh, self.start(len(self)), piece.end)
        self.count(piece.end, len(piece.mesh.triangles), fresh)

    def put(self, number: int, mesh: Mesh, start: float, end: float) -> None:
        """Store a piece, which `count` appends.

        `start`, `end`: x between which it lies.
        """
        self.keep(f"mesh{number}", vertices=mesh.vertices, triangles=mesh.triangles)

    def count(self, end: float, triangles: int, fresh: int = 0) -> None:
        """Append a piece that is stored already."""
        self.ends.append(end)
        self.starts.append(self._count)
        self.fresh.append(fresh)
        self._count += triangles

    def label(self, number: int, labels: NDArray[np.int32]) -> None:
        """Store the labels of a piece, counted from 0.

        `labels`: int32 (n,).
        """
        self.keep(f"labels{number}", labels=labels)

    def mesh(self, number: int) -> Mesh:
        """Load a piece.

        Returns `Mesh` in scene units.
        """
        arrays = self.arrays(f"mesh{number}")
        return Mesh(arrays["vertices"], arrays["triangles"])

    def labels(self, number: int) -> NDArray[np.int32]:
        """Load the labels of a piece.

        Returns int32 (n,).
        """
        labels, first = self.arrays(f"labels{number}")["labels"], self.first_labels[number]
        return labels + np.int32(first) if first else labels

    def start(self, number: int) -> float:
        """X at which a piece begins."""
        return self.ends[number - 1] if number else -np.inf

    def fresh_rows(self, number: int) -> NDArray[np.int64]:
        """Triangles of a piece that were not made by contouring: its last ones.

        Returns int64 (k,).
        """
        first, end = [*self.starts, self._count][number : number + 2]
        return np.arange(end - first - self.fresh[number], end - first)

    def strip(self, number: int, side: str, threads: int = 0) -> Strip:
        """Load the strip of a piece at a seam."""
        seam = self.start(number) if side == HEAD else self.ends[number]
        return strip_at(self.mesh(number), side, seam, self.halo, threads)

    def finish(self, number: int, mesh: Mesh) -> None:
        """Store the finished triangles of a piece, whose vertices are float32 numbers.

        `mesh` in mm.
        """
        self.keep(f"finished{number}", vertices=mesh.vertices.astype(np.float32), triangles=mesh.triangles)

    def finished(self, number: int) -> Mesh:
        """Load the finished triangles of a piece.

        Returns `Mesh` in mm.
        """
        arrays = self.arrays(f"finished{number}")
        return Mesh(arrays["vertices"].astype(np.float64), arrays["triangles"])

    def meshes(self) -> Iterator[Mesh]:
        """Iterate over the pieces."""
        return (self.mesh(number) for number in range(len(self)))

    def drop(self, end: int) -> None:
        """Release the pieces before number `end` that are held in memory."""
        for number in range(end):
            for name in ("mesh", "labels"):
                self._held.pop(f"{name}{number}", None)

    def near(self, points: NDArray[np.float64], reach: float) -> tuple[Mesh, NDArray[np.int64]]:
        """Triangles with a corner near points, as one mesh.

        `points`: float64 (n, 3), scene units. Returns int64 (k,).
        """
        parts, numbers = NOTHING, list[NDArray[np.int64]]()
        for number, mesh in enumerate(self.meshes()):
            chosen = near(mesh.vertices, mesh.triangles, points, reach)
            numbers.append(self.starts[number] + chosen)
            part = mesh.selected(np.bincount(chosen, minlength=len(mesh.triangles)) > 0)
            parts = join_at_seam(parts, part, self.ends[number - 1], reach / 2) if number else part
        return parts, np.concatenate(numbers)

    def together(self, first: int, last: int, seam: float) -> Mesh:
        """Join consecutive pieces to one mesh.

        `seam` in scene units.
        """
        mesh = self.mesh(first)
        for number in range(first + 1, last):
            mesh = join_at_seam(mesh, self.mesh(number), self.ends[number - 1], seam)
        return mesh

    def keep(self, name: str, **arrays: NDArray[np.generic]) -> None:
        """Store arrays in memory or in the folder."""
        if self.folder is None:
            self._held[name] = arrays
        else:
            for part, array in arrays.items():
                path = self.folder / f"{name}-{part}.npy"
                path.unlink(missing_ok=True)  # the array may be the mapped file itself
                np.save(path, array)

    def arrays(self, name: str) -> Arrays:
        """Load arrays from memory or from the folder."""
        if self.folder is None:
            return self._held[name]
        begin = len(name) + 1
        return {path.stem[begin:]: np.load(path, "r") for path in self.folder.glob(f"{name}-*.npy")}


def join_at_seam(one: Mesh, other: Mesh, seam: float, near: float) -> Mesh:
    """Join two meshes: bitwise equal vertices near the plane x = `seam` become one."""
    return concatenate_at_seam(one, other, seam, near)[0].compact()


def concatenate_at_seam(one: Mesh, other: Mesh, seam: float, near: float) -> tuple[Mesh, NDArray[np.int32]]:
    """Join two meshes as `join_at_seam` does, but keep all vertices.

    Returns int32 (n,).
    """
    vertices = np.concatenate([other.vertices, one.vertices])
    close = near_plane(vertices, seam, near)
    _, first, which = np.unique(rows(vertices[close]), return_index=True, return_inverse=True)
    number = np.arange(len(vertices), dtype=np.int32)
    number[close] = close[first[which]]
    corners = number[one.triangles + np.int32(len(other.vertices))]
    return Mesh(vertices, np.concatenate([corners, other.triangles])), number


def near_plane(points: NDArray[np.float64], seam: float, near: float) -> NDArray[np.int64]:
    """Points near a plane x = `seam`.

    `points`: float64 (n, 3). Returns int64 (k,).
    """
    return np.flatnonzero(np.abs(points[:, 0] - seam) < near) if np.isfinite(seam) else np.empty(0, int)


def rows(points: NDArray[np.float64]) -> NDArray[np.void]:
    """View points as scalars, for bitwise comparison.

    `points`: float64 (n, 3). Returns void (n,).
    """
    return np.ascontiguousarray(points).view("V24").ravel()


ROWS = 1 << 17
"""Rows per task."""


def gather_rows(table: np.ndarray, rows: np.ndarray, threads: int = 0) -> np.ndarray:
    """Gather rows of a table by several threads.

    `table`: [m, ...]; `rows`: int [n, ...]. Returns `table[rows]`.
    """
    result = np.empty(rows.shape + table.shape[1:], table.dtype)

    def task(part: slice) -> None:
        np.take(table, rows[part], axis=0, out=result[part], mode="clip")  # "raise" would copy the output

    Work(threads or os.cpu_count() or 1).map(task, chunks(len(rows), ROWS))
    return result


@dataclass(frozen=True, eq=False)
class WholeShells:
    """Shells of all pieces together."""

    of_label: NDArray[np.int32]  # shell of each label
    volumes: NDArray[np.float64]  # signed volumes, negative for cavities
    areas: NDArray[np.float64]  # areas
    outermost: NDArray[np.float64]  # vertices farthest out along -x, -y, -z, x, y and z
    first: NDArray[np.int32]  # index of the vertex of least x in its piece
    piece: NDArray[np.int64]  # index of that piece

    def of(self, labels: NDArray[np.int32], threads: int = 0) -> NDArray[np.int32]:
        """Shells of labels.

        `labels`: int32 (n,). Returns int32 (n,).
        """
        joined = len(self.volumes) < len(self.of_label)
        return gather_rows(self.of_label, labels, threads) if joined else labels

    def tips(self, which: NDArray[np.bool_] | slice = slice(None)) -> NDArray[np.float64]:
        """Outermost vertices of some or all shells.

        `which`: bool (s,). Returns float64 (6, 3).
        """
        of, axes = self.outermost[which], np.arange(3)
        low, high = of[:, axes, axes].argmin(axis=0), of[:, axes + 3, axes].argmax(axis=0)
        return of[[*low, *high], np.arange(6)]

    def bounds(self, which: NDArray[np.bool_] | slice = slice(None)) -> NDArray[np.float64]:
        """Bounding box of some or all shells.

        `which`: bool (s,). Returns float64 (2, 3).
        """
        return self.tips(which).reshape(2, 3, 3).diagonal(axis1=1, axis2=2)

    def searched(self, bodies: bool) -> NDArray[np.bool_]:
        """Cavities, and with `bodies` all shells: those whose surroundings are searched by `rays`.

        Returns bool (s,).
        """
        hollow = self.volumes < 0
        searched: NDArray[np.bool_] = hollow | (bodies and len(hollow) > 1)
        return searched

    def rays(
        self,
        number: int,
        mesh: Mesh,
        labels: NDArray[np.int32],
        searched: NDArray[np.bool_],
        threads: int = 0,
    ) -> Nesting:
        """Surroundings of the searched shells whose rays are in a piece.

        The ray of each shell starts at its point of least x. This point lies within a cell, so that a ray
        across x stays in one piece.

        `labels`: int32 (n,); `searched`: bool (s,).
        """
        first = np.where(searched & (self.piece == number), self.first, -1)
        return nesting(mesh, self.of(labels, threads), self.volumes, first, threads)

    def nested(self, searched: NDArray[np.bool_], nestings: Mapping[int, Nesting]) -> tuple[Shells, int]:
        """Nesting of the shells, and how many are inside out, from the `rays` of all pieces.

        `searched`: bool (s,).
        """
        count, hollow = len(self.volumes), self.volumes < 0
        parent, winding = np.full(count, -1, np.int64), np.zeros(count, np.int64)
        for number, one in nestings.items():
            own = searched & (self.piece == number)
            parent[own], winding[own] = one.parent[own], one.winding[own]
        if (parent[hollow] < 0).any() or hollow[parent[hollow]].any():
            raise MeshError("a shell of the mesh is inside out: it looks inwards and no body is around it")
        return Shells(self.volumes, parent), int((winding != hollow)[searched].sum())

    def thin_walls(self, voxel: float) -> str:
        """Note on walls thinner than a voxel; empty if there are none.

        Such walls fall between samples: they have holes or break into pieces. A body counts if its average
        thickness is below a voxel. The dust around a fractal also counts, but is less than `PIECES` of the
        material.
        """
        whole, bodies = self.volumes.sum(), self.volumes > 0
        thin = bodies & (2 * self.volumes < voxel * self.areas)
        share, many = float(self.volumes[thin].sum() / whole), int(bodies.sum())
        holes = "have holes" if many == 1 else f"fell to pieces: {thin.sum()} of {many} bodies"
        return f"walls thinner than a voxel {holes}, {share:.0%} of the material" if share >= PIECES else ""


FAN = 16
"""Ranges of pieces that a node of the tree joins."""


def survey(pieces: Pieces, voxel: float, threads: int = 0) -> WholeShells:
    """Find the shells of a surface in pieces, and label the pieces.

    Each connected component of a piece has one label.
    """
    ends = [-np.inf, *pieces.ends]

    def labelled() -> Iterator[PieceComponents]:
        first = 0
        parts = (
            components(mesh, ends[number], ends[number + 1], voxel, threads)
            for number, mesh in enumerate(pieces.meshes())
        )
        for number, (labels, sums) in enumerate(ahead(parts)):
            pieces.label(number, labels)
            pieces.first_labels.append(first)
            first += len(sums.volumes)
            yield sums

    ranges: Iterable[PieceComponents] = labelled()
    for _ in levels(len(pieces)):
        ranges = map(joined_components, groups(ranges))
    (whole,) = ranges
    return whole.shells()


def levels(count: int) -> Iterator[int]:
    """Number of nodes at each level of the tree, from the leaves' parents to the root."""
    while count > 1:
        count = -(-count // FAN)
        yield count


def groups(ranges: Iterable[Any]) -> Iterator[list[Any]]:
    """Children of each node of a level."""
    following = iter(ranges)
    return iter(lambda: list(islice(following, FAN)), [])


@dataclass(frozen=True, eq=False)
class PieceComponents:
    """Connected components of a piece, or of consecutive pieces."""

    counts: NDArray[np.int64]  # labels of each piece
    of_label: NDArray[np.int32]  # component of each label; labels count from the first piece on
    volumes: NDArray[np.float64]  # sizes; see `topology.Sizes`
    areas: NDArray[np.float64]
    vectors: NDArray[np.float64]  # area vectors
    extremes: NDArray[np.float64]  # vertices farthest out along -x, -y, -z, x, y and z
    first: NDArray[np.int32]  # vertex of least x in its piece
    piece: NDArray[np.int64]  # index of that piece, from the first one on
    points: NDArray[np.float64]  # vertices at the seams at the begin and at the end
    labels: NDArray[np.int32]  # their components
    after: NDArray[np.float64]
    labels_after: NDArray[np.int32]

    def shells(self) -> WholeShells:
        """Shells, if these are the components of all pieces."""
        return WholeShells(self.of_label, self.volumes, self.areas, self.extremes, self.first, self.piece)


def components(
    mesh: Mesh, start: float, end: float, voxel: float, threads: int = 0
) -> tuple[NDArray[np.int32], PieceComponents]:
    """Find the connected components of a piece.

    Returns int32 (n,).
    """
    from .._native import connected_components
    from .model import component_sizes

    labels, count = connected_components(mesh.triangles, len(mesh.vertices), threads)
    sizes = component_sizes(mesh.vertices, mesh.triangles, labels, count, threads)
    here, there = (near_plane(mesh.vertices, seam, voxel / 2) for seam in (start, end))
    return labels, PieceComponents(
        counts=np.array([count]),
        of_label=np.arange(count, dtype=np.int32),
        volumes=sizes.volumes,
        areas=sizes.areas,
        vectors=sizes.vectors,
        extremes=gather_rows(mesh.vertices, sizes.outermost, threads),
        first=sizes.outermost[:, 0],
        piece=np.zeros(count, np.int64),
        points=mesh.vertices[here],
        labels=labels[here],
        after=mesh.vertices[there],
        labels_after=labels[there],
    )


def joined_components(ranges: Sequence[PieceComponents]) -> PieceComponents:
    """Join the components of consecutive ranges of pieces.

    PieceComponents that share a vertex at a seam are united: no surface crosses a seam without one.
    """
    from .._native import connected_components

    if len(ranges) == 1:
        return ranges[0]

    def all_of(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(one, name) for one in ranges])

    starts = np.cumsum([0, *(len(one.volumes) for one in ranges)], dtype=np.int32)
    own = np.arange(starts[-1], dtype=np.int32)
    pairs = np.concatenate([np.stack([own, own], axis=1), *_same(ranges, starts)])
    of, count = connected_components(pairs[:, [0, 1, 1]], len(own))
    extremes, volumes, vectors = all_of("extremes"), all_of("volumes"), all_of("vectors")
    outermost = np.empty((count, 6), np.int64)
    outermost[of] = own[:, None]
    (several,) = np.nonzero((np.bincount(of) > 1)[of])  # mostly few: dust is within a piece
    for side in range(6):
        height: NDArray[np.float64] = extremes[several, side, side % 3] * (1 if side < 3 else -1)
        order = several[np.lexsort((height, of[several]))[::-1]]
        outermost[of[order], side] = order  # the last one stays: the lowest, the first of equals
    # Cones over a component's own vertex, moved to one of the united: precise even for dust.
    tips = extremes[outermost[of[several], 0], 0]
    volumes[several] += ((extremes[several, 0] - tips) * vectors[several]).sum(axis=1) / 3
    before = np.cumsum([0, *(len(one.counts) for one in ranges)])
    piece = np.concatenate([one.piece + first for one, first in zip(ranges, before[:-1], strict=True)])
    return PieceComponents(
        counts=all_of("counts"),
        of_label=np.concatenate([of[one.of_label + s] for one, s in zip(ranges, starts[:-1], strict=True)]),
        volumes=np.bincount(of, volumes).astype(np.float64),
        areas=np.bincount(of, all_of("areas")).astype(np.float64),
        vectors=np.stack([np.bincount(of, column) for column in vectors.T], axis=1),
        extremes=extremes[outermost, np.arange(6)],
        first=all_of("first")[outermost[:, 0]],
        piece=piece[outermost[:, 0]],
        points=ranges[0].points,
        labels=of[ranges[0].labels],
        after=ranges[-1].after,
        labels_after=of[starts[-2] + ranges[-1].labels_after],
    )


def _same(ranges: Sequence[PieceComponents], starts: NDArray[np.int32]) -> Iterator[NDArray[np.int32]]:
    """Pairs of components that share a vertex at a seam, each pair once."""
    for number, (one, other) in enumerate(pairwise(ranges)):
        _, theirs, mine = np.intersect1d(rows(one.after), rows(other.points), return_indices=True)
        both = one.labels_after[theirs] + starts[number], other.labels[mine] + starts[number + 1]
        yield np.unique(np.stack(both, axis=1), axis=0)


class Nesting(NamedTuple):
    """Position of each shell among the others."""

    winding: NDArray[np.int64]  # winding number of the other shells around each shell
    parent: NDArray[np.int64]  # smallest surrounding shell, or -1


def nesting(
    mesh: Mesh,
    labels: NDArray[np.int32],
    volumes: NDArray[np.float64],
    first: NDArray[np.int64] | None = None,
    threads: int = 0,
) -> Nesting:
    """Find the shells around each closed shell of a mesh.

    A ray from one vertex of each shell goes up and adds the winding of every triangle it passes; edges and
    vertices on the ray count once (half-open edges). The mesh need only be complete along these rays.

    `labels`: int32 (n,); `volumes`: float64 (s,); `first`: int64 (s,).
    """
    count = len(volumes)
    if count < 2:
        return Nesting(np.zeros(count, np.int64), np.full(count, -1, np.int64))
    if first is None:
        first = np.zeros(count, np.int64)
        first[labels[mesh.triangles[::-1, 0]]] = mesh.triangles[::-1, 0]
    return Nesting(*_nesting(mesh.vertices, mesh.triangles, labels, np.abs(volumes), first, threads))


REACH = 2
"""Edge length of the cubes in which bodies meet, voxels."""


class NearBodies:
    """Bodies of a surface in pieces that have another one within reach.

    Vertices are sorted into the cubes of two lattices; bodies with vertices in one cube are near. Bodies that
    are nearer than half the reach share one, but for a few.

    `stays`: bool (s,).
    """

    def __init__(self, shells: WholeShells, stays: NDArray[np.bool_], voxel: float) -> None:
        body = stays & (shells.volumes > 0)
        self.several = bool(body.sum() > 1)
        """False for a single body, which is near none."""
        self._body = np.where(body, np.arange(len(body)), -1).astype(np.int32)[shells.of_label]
        self._largest, self._count = int(np.argmax(np.where(body, shells.areas, 0))), len(body)
        x, y, z = shells.bounds()[0].tolist()
        self._origin, self._edge = (x, y, z), REACH * voxel

    def within(
        self, points: NDArray[np.float64], labels: NDArray[np.int32], threads: int = 0
    ) -> NDArray[np.int64]:
        """Near bodies of a piece; cavities are none.

        `points`: float64 (n, 3); `labels`: int32 (n,). Returns int64 (k,), ascending.
        """
        at = self._origin, self._edge, threads
        return near_bodies(points, labels, self._body, self._count, self._largest, *at)

    def across(
        self,
        seam: float,
        one: tuple[NDArray[np.float64], NDArray[np.int32]],
        other: tuple[NDArray[np.float64], NDArray[np.int32]],
        threads: int = 0,
    ) -> NDArray[np.int64]:
        """Near bodies at the seam x = `seam` of two pieces, given as for `within`.

        Returns int64 (k,), ascending.
        """
        last, first = one[0][:, 0] > seam - self._edge, other[0][:, 0] < seam + self._edge
        points = np.concatenate([one[0][last], other[0][first]])
        labels = np.concatenate([one[1][last], other[1][first]])
        return self.within(points, labels, threads)


def touching_note(near: int, voxel: float, settings: Sequence[str], off: Sequence[str]) -> tuple[str, ...]:
    """Describe the bodies that touch at points or edges only, and the options that help.

    `voxel` in mm; `settings`: whose bodies are several voxels wide.
    """
    if not near:
        return tuple(off)
    whole = (
        [f"--set {' --set '.join(settings)} makes them about {WIDE} voxels wide or more"] if settings else []
    )
    width = f"{JOINING * voxel:.2g}mm"
    options = [*whole, f"--thickness {width} or --bridge {width} joins them", "--keep largest leaves one"]
    line = (
        f"{near} bodies come within two voxels of another: they touch at corners or edges only, or are tips "
        f"and walls thinner than the voxel of {voxel:.2g}mm; {', '.join(options)}"
    )
    return ("; ".join([line, *off]),)
