"""What is known of a mesh before it is looked at: triangles as contouring laid them do not intersect."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..volume.bricks import Bricks, SignBricks
from ..volume.lattice import BRICK


@dataclass(frozen=True, eq=False)
class Certificate:
    """Which triangles of a mesh lie in grid cells as contouring laid them there.

    No two of them intersect (`fracslice/native/mesh/contour.h`), also once their vertices are quantised, as
    long as each stays in its place between the planes (`quantise.h`).

    planes: the grid's, across each axis, in the space of the mesh, float64 [k, 3], ascending; none if nothing
    is known. holds: bool [m].
    """

    planes: NDArray[np.float64]
    holds: NDArray[np.bool_]

    @classmethod
    def none(cls, triangles: int) -> Certificate:
        """Of a mesh of which nothing is known."""
        return cls(np.empty((0, 3)), np.zeros(triangles, bool))

    @classmethod
    def of(cls, bricks: Bricks | SignBricks, triangles: int) -> Certificate:
        """Of the mesh that `contour` makes of these samples, scene units."""
        steps = np.arange(-BRICK, BRICK * (max(bricks.index.shape) + 1) + 1)
        return cls(np.array(bricks.origin) + bricks.voxel * steps[:, None], np.ones(triangles, bool))

    def scaled(self, factor: float) -> Certificate:
        """As `Mesh.scaled`."""
        return replace(self, planes=self.planes * factor)

    def translated(self, offset: NDArray[np.float64]) -> Certificate:
        """As `Mesh.translated`."""
        return replace(self, planes=self.planes + offset)

    def selected(self, keep: NDArray[np.bool_]) -> Certificate:
        """As `Mesh.selected`."""
        return replace(self, holds=self.holds[keep])
