"""Wavefront OBJ: text, vertices numbered from one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import BinaryIO

import numpy as np

from fracslice.export.text import rows
from fracslice.mesh.model import Mesh


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh in mm; nine digits keep every float32."""
    for key, value in (*metadata.items(), ("units", "mm")):
        file.write(f"# {key}: {' '.join(value.split())}\n".encode("ascii", "replace"))
    file.writelines(rows("v %.9g %.9g %.9g\n", mesh.vertices.astype(np.float32)))
    file.writelines(rows("f %d %d %d\n", mesh.triangles.astype(np.int64) + 1))
