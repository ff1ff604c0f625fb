"""Binary glTF 2.0 by trimesh.

Coordinates stay in mm with z up, bit for bit; the node's matrix converts them to glTF's metres with y up.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import to_linear
from ..errors import ExportError
from ..mesh.model import Mesh
from ..work import Work

TO_METRES_Y_UP = 0.001 * np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1000]])
GREY = {"baseColorFactor": [204, 204, 199, 255], "metallicFactor": 0.0, "roughnessFactor": 0.7}
HEADERS = 1 << 16
"""Bytes of a file beside its arrays, at most, metadata aside."""


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str], _: Work) -> None:
    """Write a mesh without normals, so that viewers use flat shading, as printed; see `Write`.

    Raises
    ------
    ExportError
        For a file of 4 GiB or more.
    """
    values = 4 * (len(mesh.scalars) + (mesh.colours is not None))
    if (12 + values) * len(mesh.vertices) + 12 * len(mesh.triangles) + HEADERS + len(str(metadata)) >= 2**32:
        raise ExportError("GLB cannot hold more than 4 GiB; STL and PLY can")
    import trimesh
    from trimesh.exchange.gltf import export_glb
    from trimesh.visual.material import PBRMaterial

    def described(tree: dict[str, Any]) -> None:
        tree["asset"] |= {"generator": metadata["Application"], "extras": dict(metadata)}

    solid = mesh.to_trimesh()
    if mesh.colours is None:
        solid.visual = trimesh.visual.TextureVisuals(material=PBRMaterial(**GREY))
    else:
        solid.visual = trimesh.visual.ColorVisuals(solid, vertex_colors=_linear(mesh.colours))
    scene = trimesh.Scene()
    scene.add_geometry(solid, node_name="mesh", geom_name="mesh", transform=TO_METRES_Y_UP)
    file.write(export_glb(scene, include_normals=False, tree_postprocessor=described))


def _linear(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours in linear light, as glTF defines them."""
    encoded: NDArray[np.uint8] = np.rint(255 * to_linear(colours / 255)).astype(np.uint8)
    return encoded
