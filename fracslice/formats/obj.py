"""Wavefront OBJ. No unit; a written comment states mm."""

from __future__ import annotations

import io
import re
from array import array
from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..common.arrays import Triangles, fans
from ..common.files import number_rows, read_bytes
from ..errors import MeshError
from ..work import Work
from . import MeshFormat


def _write(mesh: Triangles, file: BinaryIO, metadata: Mapping[str, str], work: Work) -> None:
    """Write a mesh, with metadata as comments and colours behind the coordinates; see `MeshFormat`."""
    mesh = mesh.in_order()
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


CONTINUED = re.compile(rb"\\\r?\n")
"""End of a line that goes on."""


def _read(path: Path) -> Triangles:
    """Its vertices and faces; polygons become fans of triangles."""
    vertices, corners, lengths = array("d"), array("q"), array("q")
    try:
        for line in io.BytesIO(CONTINUED.sub(b" ", read_bytes(path))):
            kind, *words = line.split() or [b""]
            if kind == b"v":
                x, y, z = words[:3]
                vertices.extend((float(x), float(y), float(z)))
            elif kind == b"f":
                if b"/" in line:
                    words = [word.partition(b"/")[0] for word in words]
                named = list(map(int, words))
                if b"-" in line:  # from the last vertex on
                    named = [k + (k < 0) * (len(vertices) // 3 + 1) for k in named]
                corners.extend(named)
                lengths.append(len(named))
    except (ValueError, OverflowError) as error:
        raise MeshError("not a whole OBJ file: it is cut short, broken or of another kind") from error
    at = np.array(corners, np.int64) - 1
    points = np.array(vertices, np.float64).reshape(-1, 3)
    if len(at) and not 0 <= at.min() <= at.max() < len(points):
        raise MeshError("not a valid OBJ file: a face names a vertex that does not exist")
    return Triangles(points, fans(np.array(lengths, np.int64), at.astype(np.int32)))


FORMAT = MeshFormat(_read, _write, most=1 << 27)  # text takes more than numbers
