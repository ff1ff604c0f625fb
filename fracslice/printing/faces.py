"""The two faces of walls and gaps, by the field itself: samples tell only about where they are."""

from __future__ import annotations

import numpy as np

from ..kernel import Field, Kernel
from ..volume.values import values_at
from ..work import Work
from .walls import OPPOSITE, Walls

STEP = 0.05
"""Voxels between points whose values tell a slope."""

AWAY = 0.5
"""Voxels that a face is moved at most."""


def slopes(kernel: Kernel, points: np.ndarray, step: float, work: Work) -> tuple[np.ndarray, np.ndarray]:
    """How steep a field is at points [3, n], by central differences, [n], and its unit normals, [3, n]."""
    shifts = step * np.eye(3)[:, :, None]
    slope = np.stack(
        [values_at(kernel, points + s, work) - values_at(kernel, points - s, work) for s in shifts]
    )
    length = np.maximum(np.linalg.norm(slope, axis=0), 1e-30)
    return length / (2 * step), slope / length


def projected(root: Field, found: Walls, voxel: float, work: Work) -> Walls:
    """Walls or gaps that samples a voxel apart told of, their ends moved along them to where the field itself
    is zero; without those whose faces do not look away from each other there: crumbs that samples made of
    what is thinner than a voxel. Of escape-time fractals samples tell more than values: all stay as they are.
    """
    if root.bounds.exterior_only or not len(found.width):
        return found
    kernel, ways = root.kernel(), ((found.end - found.start) / found.width[:, None]).T
    ends, normals = [], []
    for points in (found.start.T, found.end.T):
        steep, normal = slopes(kernel, points, STEP * voxel, work)
        along = steep * (normal * ways).sum(0)
        shift = -values_at(kernel, points, work) / np.where(np.abs(along) > -OPPOSITE * steep, along, np.inf)
        ends.append(points + np.clip(shift, -AWAY * voxel, AWAY * voxel) * ways)
        normals.append(normal)
    across = [np.abs((normal * ways).sum(0)) > -OPPOSITE for normal in normals]
    away = (normals[0] * normals[1]).sum(0) < OPPOSITE
    width = ((ends[1] - ends[0]) * ways).sum(0)
    stays = np.where(across[0] & across[1], away, across[0] | across[1]) & (width > 0)
    return Walls(ends[0].T, ends[1].T, width, found.area).chosen(stays)
