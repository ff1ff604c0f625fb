"""Shells of a surface in pieces, with one piece in memory at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .components import PIECES, Shells
from .model import Mesh
from .pieces import Pieces, near_plane, rows

if TYPE_CHECKING:
    from .nesting import Nesting


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

    Returns
    -------
    WholeShells
        The shells.
    """
    joined, start = Survey(), -np.inf
    for number, mesh in enumerate(pieces.meshes()):
        labels, sums = components(mesh, start, start := pieces.ends[number], voxel, threads)
        pieces.label(number, labels + np.int32(joined.add(sums)))
    return joined.shells()


@dataclass(frozen=True, eq=False)
class PieceComponents:
    """Connected components of a piece.

    Attributes
    ----------
    volumes, areas : ndarray of float64, shape (c,)
        Sizes; see `topology.Sizes`.
    vectors : ndarray of float64, shape (c, 3)
        Area vectors.
    extremes : ndarray of float64, shape (c, 6, 3)
        Vertices farthest out along -x, -y, -z, x, y and z.
    first : ndarray of int32, shape (c,)
        Vertex of least x.
    points, after : ndarray of float64, shape (k, 3)
        Vertices at the seams at the begin and at the end.
    labels, labels_after : ndarray of int32, shape (k,)
        Their components.
    """

    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    vectors: NDArray[np.float64]
    extremes: NDArray[np.float64]
    first: NDArray[np.int32]
    points: NDArray[np.float64]
    labels: NDArray[np.int32]
    after: NDArray[np.float64]
    labels_after: NDArray[np.int32]


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
    Components
        The components.
    """
    from .topology import component_sizes, connected_components

    labels, count = connected_components(mesh.triangles, len(mesh.vertices), threads)
    sizes = component_sizes(mesh.vertices, mesh.triangles, labels, count, threads)
    here, there = (near_plane(mesh.vertices, seam, voxel / 2) for seam in (start, end))
    return labels, PieceComponents(
        sizes.volumes,
        sizes.areas,
        sizes.vectors,
        mesh.vertices[sizes.outermost],
        sizes.outermost[:, 0],
        mesh.vertices[here],
        labels[here],
        mesh.vertices[there],
        labels[there],
    )


NO_BORDER: dict[str, NDArray[Any]] = {
    "points": np.empty((0, 3)),
    "labels": np.empty(0, np.int32),
    "after": np.empty((0, 3)),
    "labels_after": np.empty(0, np.int32),
}
"""Fields of `PieceComponents` that only the next piece needs."""


class Survey:
    """Sums over the components of pieces, in order. Labels count from the first piece on."""

    def __init__(self) -> None:
        self.starts = [0]
        self.pieces: list[PieceComponents] = []
        self.same: list[NDArray[np.int32]] = []

    def add(self, piece: PieceComponents) -> int:
        """Add the next piece.

        Components that share a vertex with the piece before are united: no surface crosses a seam without
        one.

        Parameters
        ----------
        piece : PieceComponents
            Its components.

        Returns
        -------
        int
            Label of its first component.
        """
        start = self.starts[-1]
        if self.pieces:
            before = self.pieces.pop()
            _, theirs, mine = np.intersect1d(rows(before.after), rows(piece.points), return_indices=True)
            pairs = before.labels_after[theirs] + np.int32(self.starts[-2]), piece.labels[mine]
            if len(mine):
                both = np.stack([pairs[0], pairs[1] + np.int32(start)], axis=1)
                self.same.append(np.unique(both, axis=0))
            self.pieces.append(replace(before, **NO_BORDER))
        self.pieces.append(piece)
        self.starts.append(start + len(piece.volumes))
        return start

    def _all(self, name: str) -> NDArray[Any]:
        return np.concatenate([getattr(piece, name) for piece in self.pieces])

    def shells(self) -> WholeShells:
        """Shells of all pieces together."""
        from .topology import connected_components

        own = np.arange(self.starts[-1], dtype=np.int32)
        pairs = np.concatenate([np.stack([own, own], axis=1), *self.same])
        of_label, count = connected_components(pairs[:, [0, 1, 1]], len(own))
        extremes = self._all("extremes")
        outermost = np.empty((count, 6), np.int64)
        outermost[:] = np.arange(count)[:, None]
        for side in range(6 if self.same else 0):  # else each component is a shell
            height: NDArray[np.float64] = extremes[:, side, side % 3] * (1 if side < 3 else -1)
            order = np.lexsort((height, of_label))
            outermost[:, side] = order[np.searchsorted(of_label[order], np.arange(count))]
        # Cones over a component's own vertex, moved to one of its shell: precise even for dust.
        tips = extremes[outermost[:, 0], 0]
        moved = ((extremes[:, 0] - tips[of_label]) * self._all("vectors")).sum(axis=1) / 3
        volumes = np.bincount(of_label, self._all("volumes") + moved).astype(np.float64)
        areas = np.bincount(of_label, self._all("areas")).astype(np.float64)
        return WholeShells(
            of_label,
            volumes,
            areas,
            extremes[outermost, np.arange(6)],
            self._all("first")[outermost[:, 0]],
            np.searchsorted(self.starts, outermost[:, 0], side="right") - 1,
        )


@dataclass(frozen=True, eq=False)
class WholeShells:
    """Shells of all pieces together.

    Attributes
    ----------
    of_label : ndarray of int32, shape (l,)
        Shell of each label.
    volumes : ndarray of float64, shape (s,)
        Signed volumes, negative for cavities.
    areas : ndarray of float64, shape (s,)
        Areas.
    outermost : ndarray of float64, shape (s, 6, 3)
        Vertices farthest out along -x, -y, -z, x, y and z.
    first : ndarray of int32, shape (s,)
        Index of the vertex of least x in its piece.
    piece : ndarray of int64, shape (s,)
        Index of that piece.
    """

    of_label: NDArray[np.int32]
    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    outermost: NDArray[np.float64]
    first: NDArray[np.int32]
    piece: NDArray[np.int64]

    def tips(self, which: NDArray[np.bool_] | slice = slice(None)) -> NDArray[np.float64]:
        """Outermost vertices of some or all shells.

        Parameters
        ----------
        which : ndarray of bool, shape (s,), or slice, optional
            Shells; all by default.

        Returns
        -------
        ndarray of float64, shape (6, 3)
            Vertices farthest out along -x, -y, -z, x, y and z.
        """
        of, axes = self.outermost[which], np.arange(3)
        low, high = of[:, axes, axes].argmin(axis=0), of[:, axes + 3, axes].argmax(axis=0)
        return of[[*low, *high], np.arange(6)]

    def bounds(self, which: NDArray[np.bool_] | slice = slice(None)) -> NDArray[np.float64]:
        """Bounding box of some or all shells.

        Parameters
        ----------
        which : ndarray of bool, shape (s,), or slice, optional
            Shells; all by default.

        Returns
        -------
        ndarray of float64, shape (2, 3)
            Low and high corner.
        """
        return self.tips(which).reshape(2, 3, 3).diagonal(axis1=1, axis2=2)

    def nested(self, pieces: Pieces, bodies: bool = True, threads: int = 0) -> tuple[Shells, int]:
        """Nesting of the shells, by rays.

        The ray of each shell starts at its point of least x. This point lies within a cell, so that a ray
        across x stays in one piece.

        Parameters
        ----------
        pieces : Pieces
            Labelled pieces.
        bodies : bool, optional
            False for the nesting of cavities only. By the signs of the samples no body is in the material of
            another one.
        threads : int, optional
            Threads; 0 for all cores.

        Returns
        -------
        Shells
            Volumes and parents of the shells.
        int
            Number of misplaced shells.

        Raises
        ------
        MeshError
            For a cavity without a body around it.
        """
        searched = self.searched(bodies)
        numbers = sorted(set(self.piece[searched].tolist()))
        rays = (self.rays(n, pieces.mesh(n), pieces.labels(n), searched, threads) for n in numbers)
        return self.nested_by(searched, dict(zip(numbers, rays, strict=True)))

    def searched(self, bodies: bool) -> NDArray[np.bool_]:
        """Shells whose surroundings are searched by rays; see `nested`.

        Parameters
        ----------
        bodies : bool
            False for cavities only.

        Returns
        -------
        ndarray of bool, shape (s,)
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

        Parameters
        ----------
        number : int
            Index of the piece.
        mesh : Mesh
            The piece.
        labels : ndarray of int32, shape (n,)
            Label of each vertex.
        searched : ndarray of bool, shape (s,)
            Searched shells.
        threads : int, optional
            Threads; 0 for all cores.

        Returns
        -------
        Nesting
            Of all shells; only those of this piece are searched.
        """
        from .nesting import nesting

        first = np.where(searched & (self.piece == number), self.first, -1)
        return nesting(mesh, self.of_label[labels], self.volumes, first, threads)

    def nested_by(self, searched: NDArray[np.bool_], nestings: Mapping[int, Nesting]) -> tuple[Shells, int]:
        """Join the results of `rays` of all pieces; see `nested`.

        Parameters
        ----------
        searched : ndarray of bool, shape (s,)
            Searched shells.
        nestings : mapping
            Results by index of the piece.

        Returns
        -------
        Shells, int
            As `nested`.

        Raises
        ------
        MeshError
            As `nested`.
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

        Parameters
        ----------
        voxel : float
            Voxel, in the units of the shells.

        Returns
        -------
        str
            The note.
        """
        whole, bodies = self.volumes.sum(), self.volumes > 0
        thin = bodies & (2 * self.volumes < voxel * self.areas)
        share, many = float(self.volumes[thin].sum() / whole), int(bodies.sum())
        holes = "have holes" if many == 1 else f"fell to pieces: {thin.sum()} of {many} bodies"
        return f"walls thinner than a voxel {holes}, {share:.0%} of the material" if share >= PIECES else ""
