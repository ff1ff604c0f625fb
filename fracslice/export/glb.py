"""Binary glTF 2.0.

Coordinates stay in mm with z up, bit for bit; the node's matrix converts them to glTF's metres with y up.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np

from fracslice.errors import ExportError
from fracslice.mesh.model import Mesh

FLOAT, UNSIGNED_INT = 5126, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
TO_METRES_Y_UP = [0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1]  # column by column
GREY = {"baseColorFactor": [0.8, 0.8, 0.78, 1], "metallicFactor": 0, "roughnessFactor": 0.7}


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh without normals, so that viewers use flat shading, as printed.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    file : file
        Binary file, open for writing.
    metadata : mapping of str to str
        Names and values, with Application among them.

    Raises
    ------
    ExportError
        For a file of 4 GiB or more.
    """
    positions = mesh.vertices.astype("<f4")
    indices = mesh.triangles.astype("<u4")
    text = json.dumps(_document(positions, indices, metadata), separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    size = positions.nbytes + indices.nbytes
    total = 12 + 8 + len(text) + 8 + size
    if total >= 2**32:
        raise ExportError("GLB cannot hold more than 4 GiB; STL and PLY can")
    file.write(b"glTF" + np.array([2, total, len(text)], "<u4").tobytes() + b"JSON" + text)
    file.write(np.uint32(size).astype("<u4").tobytes() + b"BIN\0")
    file.write(positions.tobytes())
    file.write(indices.tobytes())


def _document(positions: np.ndarray, indices: np.ndarray, metadata: Mapping[str, str]) -> dict[str, Any]:
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": positions.nbytes, "target": ARRAY_BUFFER},
        {
            "buffer": 0,
            "byteOffset": positions.nbytes,
            "byteLength": indices.nbytes,
            "target": ELEMENT_ARRAY_BUFFER,
        },
    ]
    box = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    accessors = [
        {"bufferView": 0, "componentType": FLOAT, "count": len(positions), "type": "VEC3", **box},
        {"bufferView": 1, "componentType": UNSIGNED_INT, "count": indices.size, "type": "SCALAR"},
    ]
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    return {
        "asset": {"version": "2.0", "generator": metadata["Application"], "extras": dict(metadata)},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "matrix": TO_METRES_Y_UP}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [{"pbrMetallicRoughness": GREY}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": positions.nbytes + indices.nbytes}],
    }
