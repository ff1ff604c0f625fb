"""Projection of the faces of walls and gaps to the surface, where samples place them only roughly."""

from __future__ import annotations

import numpy as np

from ..kernel import Field
from ..volume.evaluation import values_at
from ..work import Work
from .edge_crossings import slopes
from .walls import OPPOSITE, Walls

STEP = 0.05
"""Step of central differences, voxels."""

AWAY = 0.5
"""Maximum displacement of a face, voxels."""


def projected(root: Field, walls: Walls, voxel: float, work: Work) -> Walls:
    """Project the faces of walls or gaps to the surface, along the wall.

    Walls whose faces do not look away from each other there are dropped: they are artefacts of features
    thinner than a voxel. Walls of escape-time fractals are returned unchanged: samples are more accurate than
    values.

    Parameters
    ----------
    root : Field
        The object.
    walls : Walls
        Walls or gaps measured on samples.
    voxel : float
        Spacing of those samples, scene units.
    work : Work
        Threads and cancellation.

    Raises
    ------
    Cancelled
        When the work is cancelled.
    """
    if root.bounds.exterior_only or not len(walls.width):
        return walls
    kernel, directions = root.kernel(), ((walls.end - walls.start) / walls.width[:, None]).T
    ends, normals = [], []
    for points in (walls.start.T, walls.end.T):
        steep, normal = slopes(kernel, points, STEP * voxel, work)
        along = steep * (normal * directions).sum(0)
        shift = -values_at(kernel, points, work) / np.where(np.abs(along) > -OPPOSITE * steep, along, np.inf)
        ends.append(points + np.clip(shift, -AWAY * voxel, AWAY * voxel) * directions)
        normals.append(normal)
    across = [np.abs((normal * directions).sum(0)) > -OPPOSITE for normal in normals]
    facing = (normals[0] * normals[1]).sum(0)
    width = ((ends[1] - ends[0]) * directions).sum(0)
    stays = np.where(across[0] & across[1], facing < OPPOSITE, across[0] | across[1]) & (width > 0)
    return Walls(ends[0].T, ends[1].T, width, walls.area, facing).chosen(stays)
