"""Wavefront OBJ: text, with vertices numbered from one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import BinaryIO

import numpy as np

from fracslice.export.text import rows
from fracslice.mesh.model import Mesh


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh; nine digits represent every float32 exactly.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    file : file
        Binary file, open for writing.
    metadata : mapping of str to str
        Names and values, written as comments.
    """
    for key, value in (*metadata.items(), ("units", "mm")):
        file.write(f"# {key}: {' '.join(value.split())}\n".encode("ascii", "replace"))
    file.writelines(rows("v %.9g %.9g %.9g\n", mesh.vertices.astype(np.float32)))
    file.writelines(rows("f %d %d %d\n", mesh.triangles.astype(np.int64) + 1))
