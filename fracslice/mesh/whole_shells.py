"""Shells of a surface, and the nesting of bodies and cavities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from ..meshjob import PIECES
from .components import Shells
from .gathering import gathered
from .model import Mesh
from .pieces import Pieces

if TYPE_CHECKING:
    from .nesting import Nesting


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

    def of(self, labels: NDArray[np.int32], threads: int = 0) -> NDArray[np.int32]:
        """Shells of labels.

        Parameters
        ----------
        labels : ndarray of int32, shape (n,)
            Labels.
        threads : int, optional
            Threads; 0 for all cores.

        Returns
        -------
        ndarray of int32, shape (n,)
            Their shells; the labels themselves if each is a shell.
        """
        joined = len(self.volumes) < len(self.of_label)
        return gathered(self.of_label, labels, threads) if joined else labels

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
        return nesting(mesh, self.of(labels, threads), self.volumes, first, threads)

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
        """
        whole, bodies = self.volumes.sum(), self.volumes > 0
        thin = bodies & (2 * self.volumes < voxel * self.areas)
        share, many = float(self.volumes[thin].sum() / whole), int(bodies.sum())
        holes = "have holes" if many == 1 else f"fell to pieces: {thin.sum()} of {many} bodies"
        return f"walls thinner than a voxel {holes}, {share:.0%} of the material" if share >= PIECES else ""
