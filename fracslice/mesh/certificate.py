"""Certificate of a mesh: triangles unchanged since contouring are free of self-intersections."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..volume.bricks import Bricks, SignBricks
from ..volume.lattice import BRICK


@dataclass(frozen=True, eq=False)
class Certificate:
    """The triangles of a mesh that are unchanged since contouring.

    No two of them intersect (`fracslice/native/mesh/contour.h`). This also holds after quantisation if no
    vertex changes its position relative to the planes of the grid (`quantise.h`).

    Attributes
    ----------
    planes : ndarray of float64, shape (k, 3)
        Planes of the grid across each axis, ascending, in the space of the mesh; empty without a certificate.
    holds : ndarray of bool, shape (m,)
        True for each certified triangle.
    """

    planes: NDArray[np.float64]
    holds: NDArray[np.bool_]

    @classmethod
    def none(cls, triangles: int) -> Certificate:
        """Empty certificate.

        Parameters
        ----------
        triangles : int
            Triangles of the mesh.

        Returns
        -------
        Certificate
            Certifies no triangle.
        """
        return cls(np.empty((0, 3)), np.zeros(triangles, bool))

    @classmethod
    def of(cls, bricks: Bricks | SignBricks, triangles: int) -> Certificate:
        """Certificate of a mesh as `contour` makes it.

        Parameters
        ----------
        bricks : Bricks or SignBricks
            Samples that were contoured.
        triangles : int
            Triangles of the mesh.

        Returns
        -------
        Certificate
            Certifies all triangles; planes in scene units.
        """
        steps = np.arange(-BRICK, BRICK * (max(bricks.index.shape) + 1) + 1)
        return cls(np.array(bricks.origin) + bricks.voxel * steps[:, None], np.ones(triangles, bool))

    def scaled(self, factor: float) -> Certificate:
        """Certificate of the scaled mesh; see `Mesh.scaled`.

        Parameters
        ----------
        factor : float
            Scale factor.

        Returns
        -------
        Certificate
            Its planes scaled.
        """
        return replace(self, planes=self.planes * factor)

    def translated(self, offset: NDArray[np.float64]) -> Certificate:
        """Certificate of the translated mesh; see `Mesh.translated`.

        Parameters
        ----------
        offset : ndarray of float64, shape (3,)
            Translation.

        Returns
        -------
        Certificate
            Its planes translated.
        """
        return replace(self, planes=self.planes + offset)

    def selected(self, keep: NDArray[np.bool_]) -> Certificate:
        """Certificate of selected triangles; see `Mesh.selected`.

        Parameters
        ----------
        keep : ndarray of bool, shape (m,)
            True for each triangle that stays.

        Returns
        -------
        Certificate
            Restricted to these triangles.
        """
        return replace(self, holds=self.holds[keep])
