"""Wavefront OBJ by trimesh, with comments. The format has no unit; a comment states mm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np

from ..mesh.model import Mesh


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh, with metadata as comments; every float32 coordinate survives. See `Write`."""
    from trimesh.exchange.obj import export_obj

    header = "\n# ".join(
        f"{key}: {' '.join(value.split())}" for key, value in (*metadata.items(), ("units", "mm"))
    )
    text = export_obj(mesh.to_trimesh(), include_normals=False, digits=_digits(mesh.vertices), header=header)
    file.write(text.encode("ascii", "replace"))


def _digits(coordinates: np.ndarray) -> int:
    """Decimals with which every coordinate reads back as the same float32: one in the last place is less than
    the distance from the smallest coordinate to the next smaller number.
    """
    sizes = np.abs(coordinates.astype(np.float32))
    smallest = np.min(sizes, initial=1.0, where=sizes > 0)
    return max(math.ceil(-math.log10(float(np.spacing(smallest)) / 2)), 0)
