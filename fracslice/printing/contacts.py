"""Points at which bodies touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..kernel import Kernel
from ..volume.evaluation import values_at
from ..work import Work
from .bridges import bridging_struts
from .solid_components import SolidComponents, components_of

TOUCHING = 0.9
"""Value of the field, in samples, up to which two bodies touch: less than half of the thinnest gap."""

SIDE = 33
"""Points along each side of the cube around a contact."""


def contacts(
    components: SolidComponents, bodies: np.ndarray, kernel: Kernel, work: Work
) -> tuple[np.ndarray, np.ndarray]:
    """Struts between bodies that touch, a tree for each cluster of them.

    Samples cannot tell bodies that touch from bodies with a gap of a sample between them. Around the middle
    of each strut the field is sampled 12 times finer.

    Parameters
    ----------
    components : SolidComponents
        Components of a sampled solid whose values are distances.
    bodies : int64 [n]
        Numbers of the components to join.
    kernel : Kernel
        Kernel of the solid.
    work : Work
        Threads and cancellation.

    Returns
    -------
    start, end : float64 [m, 3]
        Ends of the struts, scene units.
    """
    voxel = components.solid.voxel
    start, end = bridging_struts(components, bodies, clusters(components)[bodies])
    touching = np.zeros(len(start), bool)
    for n in range(len(start)):
        touching[n] = _touching(kernel, start[n], end[n], voxel, work)
    return start[touching], end[touching]


def _touching(kernel: Kernel, start: np.ndarray, end: np.ndarray, voxel: float, work: Work) -> bool:
    """True if two points inside are connected in a cube around them, by samples of its own."""
    from scipy.ndimage import label

    middle, half = (start + end) / 2, float(np.abs(end - start).max()) / 2 + voxel
    step = 2 * half / (SIDE - 1)
    place = np.indices((SIDE,) * 3).reshape(3, -1)
    values = values_at(kernel, middle[:, None] + step * (place - SIDE // 2), work)
    labels, _ = label(values.reshape((SIDE,) * 3) < TOUCHING * step)
    a, b = (labels[tuple(np.round((p - middle) / step).astype(int) + SIDE // 2)] for p in (start, end))
    return bool(a == b != 0)


def clusters(components: SolidComponents) -> np.ndarray:
    """Clusters of bodies that touch, or nearly so.

    Parameters
    ----------
    components : SolidComponents
        Components of a sampled solid whose values are distances.

    Returns
    -------
    int64 [m]
        Number of the cluster of each body; 0 for empty components.
    """
    solid = components.solid
    grown = components_of(replace(solid, values=solid.values - np.float32(TOUCHING * solid.voxel)))
    result = np.zeros(len(components.inside), np.int64)
    result[components.labels] = grown.labels
    return np.where(components.inside, result, 0)
