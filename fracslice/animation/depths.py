"""Automatic depths of a film: they change without a jump."""

from __future__ import annotations

from ..formulas.registry import Node
from ..kernel.depth import resolve_depths
from ..rendering.optics import footprint
from ..rendering.setup import DETAIL, surroundings
from ..scene.view import Camera

SPAN = 4.0
"""Ratio of the coarsest detail of a frame to its finest one."""


def gradual_depths(root: Node, camera: Camera, size: tuple[int, int], count: int) -> list[Node]:
    """Resolve the depths of a frame for a range of details.

    A depth is a whole number, so a picture of one depth jumps to the next one. The mean of pictures over a
    range of details changes from one depth to the next as gradually as the camera moves.

    Parameters
    ----------
    root : Node
        Root of the formula tree; depths may be "auto".
    camera : Camera
        The camera.
    size : tuple of int
        Width and height, pixels.
    count : int
        Number of details.

    Returns
    -------
    list of Node
        Trees from the coarsest to the finest detail, the coarsest of half a pixel. Without automatic depths,
        the tree itself.
    """
    growth, base = footprint(camera, size)
    detail = DETAIL * (growth * (surroundings(root, camera, growth) if growth else 0.0) + base)
    coarsest = resolve_depths(root, detail)
    if coarsest is root:
        return [root] * count
    return [resolve_depths(root, detail * SPAN ** (-(k + 0.5) / count)) for k in range(count)]
