"""Wavefront OBJ, with comments. The format has no unit; a comment states mm."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from typing import BinaryIO

import numpy as np

from ..mesh.model import Mesh
from ..work import Work
from .packages import number_rows


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str], work: Work) -> None:
    """Write a mesh, with metadata as comments and colours, if any, behind the coordinates; see `Write`."""
    about = (*metadata.items(), ("units", "mm"))
    comments = "".join(f"# {key}: {' '.join(value.split())}\n" for key, value in about)
    file.write(comments.encode("ascii", "replace"))
    vertices = mesh.vertices
    if mesh.colours is not None:
        vertices = np.hstack([vertices, mesh.colours / 255])
    before = "v ", *" " * (vertices.shape[1] - 1)
    texts = chain(
        number_rows(before, "\n", vertices), number_rows(("f ", " ", " "), "\n", mesh.triangles + 1)
    )
    file.writelines(work.ordered(lambda text: text(), texts))
