"""Shells of a surface in pieces, and the nesting of bodies and cavities, by vertical rays and exact
predicates.

Components of consecutive pieces are joined by a tree: a node joins those of a few ranges of pieces, and keeps
the vertices at the outer seams only. The tree depends on the number of pieces alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import near_bodies
from .._native import nesting as _nesting
from ..errors import MeshError
from ..fields.depth import WIDE
from ..records import JOINING, PIECES
from ..work import ahead
from .model import Mesh, Shells
from .pieces import Pieces, gather_rows, near_plane, rows


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
