"""A small picture of a mesh, for notebooks: orthographic, from three quarters, with a depth buffer."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from .._native import foremost
from ..common.arrays import from_linear, to_linear

if TYPE_CHECKING:
    from .model import Mesh

WIDTH, HEIGHT, FINER = 480, 360, 2
"""Pixels of the picture, and samples along each side of a pixel."""

FILLED = 0.92
"""Largest fraction of the picture's sides that the mesh fills."""

CLAY = (239, 227, 208)
"""Colour of a mesh without colours, sRGB."""

AMBIENT = 0.2
"""Share of the light that comes from everywhere."""

AXES = np.array([[0.876, 0.482, 0.0], [-0.2385, 0.4336, 0.8689], [0.4188, -0.7614, 0.4949]])
"""Directions in space that point to the right, up, and to the viewer."""

LIGHT = np.array([-0.48, 0.62, 0.62])
"""Direction to the light: right, up, to the viewer."""


def thumbnail(mesh: Mesh) -> bytes:
    """Draw a mesh in its colours, or in clay, on a transparent background."""
    from PIL import Image

    file = io.BytesIO()
    drawn = Image.fromarray(_render_small(mesh, WIDTH * FINER, HEIGHT * FINER))
    drawn.resize((WIDTH, HEIGHT), Image.Resampling.BOX).save(file, "PNG")
    return file.getvalue()


def _render_small(mesh: Mesh, width: int, height: int) -> np.ndarray:
    """The picture with one sample per pixel, uint8 [height, width, 4]."""
    seen = mesh.vertices @ AXES.T
    low, high = seen.min(0), seen.max(0)
    across = np.maximum((high - low)[:2] / (width, height), 1e-30).max() / FILLED
    seen = (seen - (low + high) / 2) / across + (width / 2, height / 2, 0)
    front = foremost(seen, mesh.triangles, (height, width))
    rows, columns = np.nonzero(front >= 0)
    shown = np.zeros((height, width, 4), np.uint8)
    shown[rows, columns] = _shades(mesh, seen, front[rows, columns])
    return shown[::-1]


def _shades(mesh: Mesh, seen: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Colours of some triangles in the light, uint8 [n, 4]."""
    corners = mesh.triangles[which]
    a, b, c = (seen[corners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    lit = np.maximum(normals @ LIGHT * np.sign(normals[:, 2]), 0)
    own = np.array([CLAY] if mesh.colours is None else mesh.colours[corners].mean(1)) / 255
    light = to_linear(own) * (AMBIENT + (1 - AMBIENT) * lit)[:, None]
    opaque = np.full((len(which), 1), 255, np.uint8)
    return np.hstack([np.uint8(255 * from_linear(np.minimum(light, 1)) + 0.5), opaque])
