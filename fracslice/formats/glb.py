"""Binary glTF 2.0, written by trimesh.

Written coordinates stay in mm with z up, bit for bit; the node's matrix converts them to glTF's metres with
y up.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import (
    COPIES,
    DEEPEST,
    LARGEST,
    MOST_PARTS,
    NO_TRIANGLES,
    Triangles,
    concatenate,
    count,
    from_linear,
    moved,
    to_linear,
)
from ..common.files import read_bytes
from ..errors import ExportError, MeshError
from ..work import Work
from . import MeshFormat

TO_METRES_Y_UP = 0.001 * np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1000]])
GREY = {"baseColorFactor": [204, 204, 199, 255], "metallicFactor": 0.0, "roughnessFactor": 0.7}
HEADERS = 1 << 16
"""Bytes of a file beside its arrays, at most, metadata aside."""


def _write(mesh: Triangles, file: BinaryIO, metadata: Mapping[str, str], _: Work) -> None:
    """Write a mesh without normals, so that viewers use flat shading, as printed; see `MeshFormat`.

    Raises
    ------
    ExportError
        For a file of 4 GiB or more.
    """
    mesh = mesh.in_order()
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


COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
TRIANGLES, STRIP, FAN = 4, 5, 6
"""Modes of a primitive of GLB."""

BROKEN = ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError
"""What Python raises for JSON of other types and sizes than expected."""

LONGEST_TREE = 1 << 24
"""Most bytes of the JSON of a GLB file, which is parsed at once."""

TRANSFORMS = {"matrix", "rotation", "scale", "translation"}
GLTF_AXES = 1000 * np.array([(1, 0, 0), (0, 0, 1), (0, -1, 0)])
"""From metres with y up, rows, to mm with z up."""


def _read(path: Path) -> Triangles:
    """The scene of a file, converted from metres to mm and from y up to z up."""
    try:
        whole = _Tree(read_bytes(path)).laid_out()
    except (*BROKEN, struct.error) as error:
        raise MeshError("not a whole GLB file: it is cut short, broken or of another kind") from error
    return Triangles(whole.vertices @ GLTF_AXES, whole.triangles, whole.colours)


class _Tree:
    """The nodes of a binary glTF 2.0 file, with their meshes. Files of another kind raise built-in errors."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        if magic != b"glTF" or version != 2 or length > len(data):
            raise ValueError("not the head of a GLB file")
        chunks, at = dict[bytes, bytes](), 12
        while at < length:
            size, kind = struct.unpack_from("<I4s", data, at)
            chunks.setdefault(kind, data[at + 8 : at + 8 + size])
            at += 8 + size
        if len(chunks[b"JSON"]) > LONGEST_TREE:
            raise MeshError(f"not a valid GLB file: its JSON has more than {LONGEST_TREE >> 20} MB")
        self.json, self.body = json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b"")
        self.meshes = dict[int, Triangles]()
        self.placed = [NO_TRIANGLES]
        self.count = self.size = 0

    def laid_out(self) -> Triangles:
        """All meshes of the scene where its nodes have them."""
        for node in self.item("scenes", self.json.get("scene", 0))["nodes"]:
            self.place(node, np.eye(4), 0)
        return concatenate(self.placed)

    def counted(self, mesh: Triangles) -> Triangles:
        """A part, unless the file names parts again and again."""
        self.count, self.size = self.count + 1, self.size + count(mesh)
        most = max(LARGEST, COPIES * len(self.body) // 12)
        if self.count > MOST_PARTS or self.size > most:
            parts = f"{MOST_PARTS} nodes and parts or {most} vertices and triangles"
            raise MeshError(f"not a valid GLB file: it has more than {parts}")
        return mesh

    def item(self, kind: str, index: Any) -> Any:
        """An item of the lists at the top."""
        items = self.json[kind]
        if not isinstance(index, int) or not 0 <= index < len(items):
            raise ValueError(f"no such item of {kind}: {index}")
        return items[index]

    def place(self, index: Any, matrix: NDArray[np.float64], depth: int) -> None:
        """Place the mesh of a node and those of its children."""
        if depth > DEEPEST:
            raise MeshError(f"not a valid GLB file: it has more than {DEEPEST} levels of nodes")
        node = self.item("nodes", index)
        if not TRANSFORMS.isdisjoint(node):
            matrix = matrix @ _node_matrix(node)
        mesh = self.counted(self.mesh(node["mesh"]) if "mesh" in node else NO_TRIANGLES)
        if len(mesh.triangles):
            vertices = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
            self.placed.append(moved(mesh, vertices, matrix[:3, :3]))
        for child in node.get("children", ()):
            self.place(child, matrix, depth + 1)

    def mesh(self, index: Any) -> Triangles:
        """The triangles of a mesh; points and lines are none."""
        if index not in self.meshes:
            primitives = self.item("meshes", index)["primitives"]
            some = [one for one in primitives if one.get("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN)]
            self.meshes[index] = concatenate(
                [NO_TRIANGLES, *(self.counted(self.primitive(one)) for one in some)]
            )
        return self.meshes[index]

    def primitive(self, primitive: dict[str, Any]) -> Triangles:
        """Triangles of a list, a strip or a fan."""
        for name in primitive.get("extensions", ()):
            if name.endswith("_compression"):
                raise MeshError(f"the GLB file is compressed ({name[:60]}): expected one that is not")
        vertices = self.values(primitive["attributes"]["POSITION"], "VEC3").astype(np.float64)
        corners = np.arange(len(vertices))
        if "indices" in primitive:
            corners = self.values(primitive["indices"], "SCALAR").ravel().astype(np.int64)
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(vertices):
            raise MeshError("not a valid GLB file: a triangle names a vertex that does not exist")
        mode, count = primitive.get("mode", TRIANGLES), np.arange(max(len(corners) - 2, 0))
        if mode == STRIP:
            corners = corners[np.stack([count, count + 1 + count % 2, count + 2 - count % 2], axis=1)]
        elif mode == FAN:
            corners = corners[np.stack([count + 1, count + 2, 0 * count], axis=1)]
        colours = self.colours(primitive["attributes"].get("COLOR_0"), len(vertices))
        return Triangles(vertices, corners.reshape(-1, 3).astype(np.int32), colours)

    def colours(self, index: Any, count: int) -> NDArray[np.uint8] | None:
        """Colours of vertices, from linear light to sRGB; None without, or if there is not one for each."""
        if index is None:
            return None
        kind = self.item("accessors", index)["type"]
        light = self.values(index, kind) if kind in ("VEC3", "VEC4") else np.empty((0, 3))
        if len(light) != count or not np.isfinite(light).all():
            return None
        shown: NDArray[np.uint8] = np.rint(255 * from_linear(light[:, :3].clip(0, 1))).astype(np.uint8)
        return shown

    def values(self, index: Any, kind: str) -> NDArray[Any]:
        """Numbers of an accessor, [n, 1 or 3]."""
        accessor = self.item("accessors", index)
        if "bufferView" not in accessor or "sparse" in accessor:
            raise MeshError("the GLB file has an accessor without data, or a sparse one")
        view = self.item("bufferViews", accessor["bufferView"])
        if view.get("buffer") != 0 or "uri" in self.item("buffers", 0):
            raise MeshError("the GLB file has data in other files: expected one that has all")
        dtype, width = np.dtype(COMPONENTS[accessor["componentType"]]), WIDTHS[kind]
        if accessor["type"] != kind:
            raise ValueError(f"not {kind}")
        row, start = width * dtype.itemsize, view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        step, count = view.get("byteStride", row), accessor["count"]
        if step < row or min(start, count) < 0:
            raise ValueError("rows that overlap, or numbers below 0")
        values: NDArray[Any] = np.ndarray((count, width), dtype, self.body, start, (step, dtype.itemsize))
        return values / np.iinfo(dtype).max if accessor.get("normalized") else values


def _node_matrix(node: dict[str, Any]) -> NDArray[np.float64]:
    """Transform of a node of glTF, float64 [4, 4]. Raises ValueError."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], np.float64).reshape(4, 4).T
    else:
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        turn = np.array(
            [
                (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
                (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
                (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
            ]
        )
        matrix = np.eye(4)
        matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), np.float64).reshape(3)
        matrix[:3, 3] = node.get("translation", (0, 0, 0))
    if not np.isfinite(matrix).all():
        raise ValueError("a transform that is not of finite numbers")
    return matrix


FORMAT = MeshFormat(_read, _write, has_unit=True, has_colours=True)
