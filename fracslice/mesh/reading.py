"""Readers of mesh files: STL, 3MF, PLY, OBJ and GLB, welded like in a slicer, nothing repaired."""

from __future__ import annotations

import re
import struct
import zipfile
import zlib
from array import array
from pathlib import Path
from typing import IO, Any
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .model import Mesh
from .quantisation import quantised

STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
MILLIMETRES = {
    "micron": 1e-3,
    "millimeter": 1.0,
    "centimeter": 10.0,
    "inch": 25.4,
    "foot": 304.8,
    "meter": 1000.0,
}
DEEPEST, LARGEST = 32, 1 << 28
"""Limits for a 3MF file: nesting depth of components, and number of triangles and components that the build
may expand to. A few lines could ask for any number.
"""
MODEL_RELATION = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"


def read_mesh(path: str | Path) -> Mesh:
    """Read a mesh file, in mm.

    STL, PLY and OBJ have no unit: mm are assumed. 3MF and GLB have one. Coordinates are rounded to float32,
    equal positions welded, and every triangle is kept.

    Parameters
    ----------
    path : str or Path
        File; the extension selects the format.

    Returns
    -------
    Mesh
        Quantised mesh, mm.

    Raises
    ------
    MeshError
        For a missing, unknown, truncated or otherwise invalid file.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MeshError(f"{path}: not a model file that can be read; known are {', '.join(sorted(READERS))}")
    try:
        if path.is_file() and not path.stat().st_size:
            raise MeshError("the file is empty")
        mesh = quantised(reader(path))
    except FileNotFoundError:
        raise MeshError(f"{path}: no such file") from None
    except (OSError, MeshError) as error:
        raise MeshError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    if not len(mesh.triangles):
        raise MeshError(f"{path}: the file has no triangles")
    return mesh


def _read_stl(path: Path) -> Mesh:
    """Binary or ASCII STL."""
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + STL_TRIANGLE.itemsize * count:
        corners = np.frombuffer(data, STL_TRIANGLE, offset=84)["corners"].reshape(-1, 3)
    elif data[:5] == b"solid" and b"facet" in data[:4096]:
        corners = _ascii_corners(data)
    elif len(data) < 84:
        raise MeshError("not an STL file: shorter than its header")
    else:
        raise MeshError(_wrong_length(count, len(data) - 84))
    return Mesh(corners.astype(np.float64), np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


def _wrong_length(count: int, size: int) -> str:
    """Message for a binary STL whose size does not match its count of triangles."""
    there = size // STL_TRIANGLE.itemsize
    if there >= count:
        extra = size - count * STL_TRIANGLE.itemsize
        return f"not an STL file: {extra} bytes after the {count} triangles that it announces"
    return f"not a whole STL file: {there} of {count} triangles; the file is cut short, or of another kind"


def _ascii_corners(data: bytes) -> NDArray[np.float32]:
    """Corners of an ASCII STL."""
    words = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", data)
    if b"endsolid" not in data[-1024:] or len(words) != 3 * data.count(b"endfacet"):
        raise MeshError("not a whole STL file: the text has no end; the file is cut short")
    try:
        return np.array(words, dtype=np.bytes_).astype(np.float32).reshape(-1, 3)
    except ValueError:
        raise MeshError("not an STL file: a coordinate is not a number") from None


def _read_3mf(path: Path) -> Mesh:
    """3MF: the model of a ZIP package."""
    try:
        with zipfile.ZipFile(path) as archive:
            relations, package = _Relations(), _Package()
            with archive.open("_rels/.rels") as part:
                _parse(part, relations.start)
            with archive.open(relations.model.lstrip("/")) as part:
                _parse(part, package.start, package.end)
            return package.laid_out()
    except (zipfile.BadZipFile, EOFError, KeyError, zlib.error) as error:
        raise MeshError("not a whole 3MF file: it is cut short, or of another kind") from error
    except (expat.ExpatError, ValueError, OverflowError) as error:
        raise MeshError(f"not a valid 3MF file: {error}") from error


def _parse(part: IO[bytes], start: Any, end: Any = None) -> None:
    """Stream XML through handlers. A document type, and hence entities, is refused."""
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = _refuse
    parser.ParseFile(part)


def _refuse(*_: Any) -> None:
    """Refuse a document type."""
    raise MeshError("not a valid 3MF file: it has a document type")


class _Relations:
    """Finds the 3D model in the relationships of the package."""

    model = ""

    def start(self, name: str, attributes: dict[str, str]) -> None:
        if attributes.get("Type") == MODEL_RELATION:
            self.model = attributes.get("Target", "")


class _Package:
    """Collects the meshes of a 3MF model from its XML stream, then expands its build."""

    def __init__(self) -> None:
        self.meshes: dict[str, Mesh] = {}
        self.parts: dict[str, list[tuple[str, NDArray[np.float64]]]] = {}
        self.build: list[tuple[str, NDArray[np.float64]]] = []
        self.unit, self.object = "millimeter", ""
        self.vertices, self.triangles = array("d"), array("q")

    def start(self, name: str, get: dict[str, str]) -> None:
        """Handle the start of an element."""
        match name.rpartition(":")[2]:
            case "triangle":
                self.triangles.extend((int(get["v1"]), int(get["v2"]), int(get["v3"])))
            case "vertex":
                self.vertices.extend((float(get["x"]), float(get["y"]), float(get["z"])))
            case "object":
                self.object = get["id"]
                self.parts[self.object] = []
            case "levelset":
                raise MeshError("the 3MF file holds a formula (a level set), and no mesh")
            case "component":
                self.parts[self.object].append((get["objectid"], _matrix(get.get("transform"))))
            case "item":
                self.build.append((get["objectid"], _matrix(get.get("transform"))))
            case "model":
                self.unit = get.get("unit", self.unit)

    def end(self, name: str) -> None:
        """Handle the end of an element."""
        if name.rpartition(":")[2] == "object":
            self.meshes[self.object] = _indexed(self.vertices, self.triangles)
            self.vertices, self.triangles = array("d"), array("q")

    def laid_out(self) -> Mesh:
        """All build items as one mesh, mm."""
        if self.unit not in MILLIMETRES:
            raise MeshError(f"not a valid 3MF file: no such unit: {self.unit}")
        if not self.build:
            raise MeshError("the 3MF file asks to build nothing")
        known: dict[str, int] = {}
        if sum(self.size(name, known) for name, _ in self.build) > LARGEST:
            raise MeshError(f"not a valid 3MF file: it builds more than {LARGEST} triangles and parts")
        return joined([self.placed(*item) for item in self.build]).scaled(MILLIMETRES[self.unit])

    def size(self, name: str, known: dict[str, int], depth: int = 0) -> int:
        """Triangles and objects of an expanded object, its components included."""
        self.check(name, depth)
        if name not in known:
            inner = sum(self.size(part, known, depth + 1) for part, _ in self.parts[name])
            known[name] = 1 + len(self.meshes[name].triangles) + inner
        return known[name]

    def check(self, name: str, depth: int) -> None:
        """Refuse an unknown object, or components nested too deep."""
        if name not in self.meshes or depth > DEEPEST:
            raise MeshError(f"not a valid 3MF file: no such object: {name}")

    def placed(self, name: str, matrix: NDArray[np.float64], depth: int = 0) -> Mesh:
        """An object with its components, in the frame of the build."""
        self.check(name, depth)
        inner = [self.placed(part, at, depth + 1) for part, at in self.parts[name]]
        whole = joined([self.meshes[name], *inner])
        order = -1 if np.linalg.det(matrix[:3]) < 0 else 1
        turned = sum(whole.vertices[:, k, None] * matrix[k] for k in range(3))
        return Mesh(turned + matrix[3], whole.triangles[:, ::order])


def _matrix(text: str | None) -> NDArray[np.float64]:
    """3MF transform: four rows of three numbers, applied to row vectors. Raises ValueError."""
    if text is None:
        return np.vstack([np.eye(3), np.zeros(3)])
    matrix = np.array(text.split(), dtype=np.float64).reshape(4, 3)
    if not np.isfinite(matrix).all():
        raise ValueError(f"a transform that is not of finite numbers: {text[:60]}")
    return matrix


def _indexed(vertices: array[float], triangles: array[int]) -> Mesh:
    """Validated mesh of an object."""
    corners = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    indices = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    if not np.isfinite(corners).all():
        raise MeshError("not a valid 3MF file: a coordinate is not a finite number")
    if len(indices) and not 0 <= indices.min() <= indices.max() < len(corners):
        raise MeshError("not a valid 3MF file: a triangle names a vertex that does not exist")
    if (indices == np.roll(indices, 1, axis=1)).any():
        raise MeshError("not a valid 3MF file: a triangle names a vertex twice")
    return Mesh(corners, indices.astype(np.int32))


def joined(meshes: list[Mesh]) -> Mesh:
    """Concatenate meshes without welding.

    Returns
    -------
    Mesh
        All their triangles, in order.
    """
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    triangles = [mesh.triangles + np.int32(offset) for mesh, offset in zip(meshes, offsets, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


def _read_by_trimesh(path: Path) -> Mesh:
    """PLY, OBJ and GLB, by trimesh. Any exception of its parsers means an invalid file."""
    import trimesh

    with path.open("rb") as file:
        try:
            scene = trimesh.load_scene(
                file, file_type=path.suffix.lower()[1:], process=False, skip_materials=True
            )
            mesh = scene.to_mesh()
            triangles = np.asarray(mesh.faces, dtype=np.int32).reshape(-1, 3)
            model = Mesh(np.asarray(mesh.vertices, dtype=np.float64).reshape(-1, 3), triangles)
        except Exception as error:
            kind = path.suffix[1:].upper()
            raise MeshError(f"not a whole {kind} file: it is cut short, broken or of another kind") from error
    return model


def _read_glb(path: Path) -> Mesh:
    """GLB, converted from metres to mm and from y up to z up."""
    model = _read_by_trimesh(path)
    x, y, z = model.vertices.T * 1000
    return Mesh(np.stack([x, -z, y], axis=1), model.triangles)


READERS = {
    ".stl": _read_stl,
    ".3mf": _read_3mf,
    ".ply": _read_by_trimesh,
    ".obj": _read_by_trimesh,
    ".glb": _read_glb,
}
