"""Shells of a surface in pieces, with few pieces in memory at a time.

Components of consecutive pieces are joined by a tree: a node joins those of a few ranges of pieces, and keeps
the vertices at the outer seams only. The tree depends on the number of pieces alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..background import ahead
from .gathering import gathered
from .model import Mesh
from .pieces import Pieces, near_plane, rows
from .whole_shells import WholeShells

FAN = 16
"""Ranges of pieces that a node of the tree joins."""


def survey(pieces: Pieces, voxel: float, threads: int = 0) -> WholeShells:
    """Find the shells of a surface in pieces, and label the pieces.

    Each connected component of a piece has one label.

    Parameters
    ----------
    pieces : Pieces
        Pieces of a closed surface; their labels are stored.
    voxel : float
        Voxel, in the units of the pieces.
    threads : int, optional
        Threads; 0 for all cores.
    """
    ends = [-np.inf, *pieces.ends]

    def labelled() -> Iterator[PieceComponents]:
        first = 0
        parts = (
            components(mesh, ends[number], ends[number + 1], voxel, threads)
            for number, mesh in enumerate(pieces.meshes())
        )
        for number, (labels, sums) in enumerate(ahead(parts)):
            pieces.label(number, labels + np.int32(first) if first else labels)
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
    """Children of each node of a level.

    Parameters
    ----------
    ranges : iterable
        Nodes of the level below, in order.

    Yields
    ------
    list
        `FAN` of them, fewer in the last one.
    """
    following = iter(ranges)
    return iter(lambda: list(islice(following, FAN)), [])


@dataclass(frozen=True, eq=False)
class PieceComponents:
    """Connected components of a piece, or of consecutive pieces.

    Attributes
    ----------
    counts : ndarray of int64, shape (p,)
        Labels of each piece.
    of_label : ndarray of int32, shape (l,)
        Component of each label; labels count from the first piece on.
    volumes, areas : ndarray of float64, shape (c,)
        Sizes; see `topology.Sizes`.
    vectors : ndarray of float64, shape (c, 3)
        Area vectors.
    extremes : ndarray of float64, shape (c, 6, 3)
        Vertices farthest out along -x, -y, -z, x, y and z.
    first : ndarray of int32, shape (c,)
        Vertex of least x in its piece.
    piece : ndarray of int64, shape (c,)
        Index of that piece, from the first one on.
    points, after : ndarray of float64, shape (k, 3)
        Vertices at the seams at the begin and at the end.
    labels, labels_after : ndarray of int32, shape (k,)
        Their components.
    """

    counts: NDArray[np.int64]
    of_label: NDArray[np.int32]
    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    vectors: NDArray[np.float64]
    extremes: NDArray[np.float64]
    first: NDArray[np.int32]
    piece: NDArray[np.int64]
    points: NDArray[np.float64]
    labels: NDArray[np.int32]
    after: NDArray[np.float64]
    labels_after: NDArray[np.int32]

    def shells(self) -> WholeShells:
        """Shells, if these are the components of all pieces.

        Returns
        -------
        WholeShells
            Numbered by their first labels.
        """
        return WholeShells(self.of_label, self.volumes, self.areas, self.extremes, self.first, self.piece)


def components(
    mesh: Mesh, start: float, end: float, voxel: float, threads: int = 0
) -> tuple[NDArray[np.int32], PieceComponents]:
    """Find the connected components of a piece.

    Parameters
    ----------
    mesh : Mesh
        The piece.
    start, end : float
        x of its seams; infinite at the ends of the surface.
    voxel : float
        Voxel, in the units of the piece.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    ndarray of int32, shape (n,)
        Component of each vertex, from 0.
    PieceComponents
        The components.
    """
    from .._native import connected_components
    from .topology import component_sizes

    labels, count = connected_components(mesh.triangles, len(mesh.vertices), threads)
    sizes = component_sizes(mesh.vertices, mesh.triangles, labels, count, threads)
    here, there = (near_plane(mesh.vertices, seam, voxel / 2) for seam in (start, end))
    return labels, PieceComponents(
        counts=np.array([count]),
        of_label=np.arange(count, dtype=np.int32),
        volumes=sizes.volumes,
        areas=sizes.areas,
        vectors=sizes.vectors,
        extremes=gathered(mesh.vertices, sizes.outermost, threads),
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

    Parameters
    ----------
    ranges : sequence of PieceComponents
        The ranges, in order.

    Returns
    -------
    PieceComponents
        Numbered by their first labels.
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
