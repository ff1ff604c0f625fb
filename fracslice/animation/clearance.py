"""Camera that keeps a distance to the surface, by the field itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..formulas.registry import Node
from ..kernel.depth import resolve_depths
from ..scene.view import Camera

STEPS = 256
"""Most steps away from the surface."""
MARGIN = 1.01
"""Factor on a step, so that the distance is reached."""


def kept_clear(root: Node, camera: Camera, least: float) -> Camera:
    """Move a camera away from the surface until it is far enough.

    Newton steps lead the eye along the gradient. It is measured over the clearance, so that it leads out of
    narrower holes. The field over its Lipschitz bound is a lower bound of the distance, so the clearance is
    guaranteed.

    Parameters
    ----------
    root : Node
        Root of the formula tree; depths may be "auto".
    camera : Camera
        The camera.
    least : float
        Clearance, scene units.

    Returns
    -------
    Camera
        The camera, or one with another eye and the same target.

    Raises
    ------
    SceneError
        If the distance cannot be reached.
    """
    known = resolve_depths(root, least / 2)
    kernel, bound = known.kernel("cpu", "float64"), known.bounds.lipschitz
    eye, offsets = np.array(camera.eye), least * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
    for _ in range(STEPS):
        f = kernel.points(*(eye + offsets).T)
        missing = least - f[0] / bound
        if missing <= 0:
            return camera if np.array_equal(eye, camera.eye) else replace(camera, eye=tuple(eye.tolist()))
        gradient = (f[1:4] - f[4:]) / (2 * least)
        steepness = float(np.linalg.norm(gradient))
        if not steepness > 0:
            break
        eye = eye + MARGIN * min(missing * bound / steepness, least) * gradient / steepness
    raise camera.fail(f"eye: expected a place {least:g} away from the surface, and none was reached")
