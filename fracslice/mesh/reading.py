"""Readers of mesh files: STL, 3MF, PLY, OBJ and GLB, welded like in a slicer, nothing repaired."""

from __future__ import annotations

import io
import json
import re
import struct
import warnings
import zipfile
import zlib
from array import array
from pathlib import Path
from typing import IO, Any, NamedTuple
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ..common.files import open_regular
from ..common.messages import format_count
from ..errors import MeshError
from .cleaning import quantise_mesh
from .model import Mesh, concatenate
from .pieces import NOTHING

MILLIMETRES = {
    "micron": 1e-3,
    "millimeter": 1.0,
    "centimeter": 10.0,
    "inch": 25.4,
    "foot": 304.8,
    "meter": 1000.0,
}
DEEPEST, MOST_PARTS = 32, 1 << 16
"""Limits for a 3MF file: nesting depth of components, and number of objects, components and items."""
LARGEST, COPIES = 1 << 21, 64
"""Vertices, triangles and objects that the build may have, and how many times those of the file. A few lines
could ask for any number.
"""
LONGEST, CHUNK = 1 << 20, 1 << 16
"""Most bytes of a tag, and bytes that are parsed at once."""
MOST_AROUND = 1 << 13
"""Most triangles around a vertex, as each is compared with each."""
MODEL_RELATION = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"


def read_3mf(path: Path) -> Mesh:
    """Read the build of a 3MF file, mm."""
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            relations, package = _Relations(), _Package()
            with archive.open("_rels/.rels") as part:
                _parse(part, relations.start)
            package.read(archive, relations.model)
            return package.laid_out()
    except (zipfile.BadZipFile, EOFError, KeyError, RuntimeError, zlib.error) as error:
        raise MeshError("not a whole 3MF file: it is cut short, or of another kind") from error
    except (expat.ExpatError, ValueError, OverflowError) as error:
        raise MeshError(f"not a valid 3MF file: {error}") from error


def _parse(part: IO[bytes], start: Any, end: Any = None) -> None:
    """Stream XML through handlers. A document type, and hence entities, is refused."""
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = _refuse
    given = 0
    while data := part.read(CHUNK):
        parser.Parse(data, False)
        given += len(data)
        if given - parser.CurrentByteIndex > LONGEST:  # which takes quadratic time
            raise MeshError(f"not a valid 3MF file: it has a tag of more than {LONGEST >> 20} MB")
    parser.Parse(b"", True)


def _refuse(*_: Any) -> None:
    """Refuse a document type."""
    raise MeshError("not a valid 3MF file: it has a document type")


class _Relations:
    """Finds the 3D model in the relationships of the package."""

    model = ""

    def start(self, name: str, attributes: dict[str, str]) -> None:
        if attributes.get("Type") == MODEL_RELATION:
            self.model = attributes.get("Target", "")


_Name = tuple[str, str]
"""File of an object in the package, and its identifier there."""

_Placed = tuple[_Name, NDArray[np.float64]]
"""Object and its transform."""


IN_PLACE = np.vstack([np.eye(3), np.zeros(3)])
"""Transform that moves nothing."""


class _Package:
    """Collects the meshes of a 3MF model from XML streams, then expands its build.

    Objects may lie in further files of the package, as its production extension has it.
    """

    def __init__(self) -> None:
        self.meshes: dict[_Name, Mesh] = {}
        self.parts: dict[_Name, list[_Placed]] = {}
        self.build: list[_Placed] = []
        self.unit, self.file, self.object = "millimeter", "", ("", "")
        self.vertices, self.triangles = array("d"), array("q")
        self.count = 0
        self.expanded: dict[_Name, Mesh] = {}

    def read(self, archive: zipfile.ZipFile, model: str) -> None:
        """Read a model, whose unit and build count, and the files that components name."""
        self.parse(archive, model.lstrip("/"))
        unit, build, known = self.unit, self.build, {self.file}
        while more := self.named(build) - known:
            known |= more
            for file in sorted(more):
                self.parse(archive, file)
        self.unit, self.build = unit, build

    def parse(self, archive: zipfile.ZipFile, file: str) -> None:
        """Collect the objects of a file; its unit and build take the place of earlier ones."""
        self.file, self.build = file, []
        with archive.open(file) as part:
            _parse(part, self.start, self.end)

    def named(self, build: list[_Placed]) -> set[str]:
        """Files of the objects that are built or components of others."""
        return {name[0] for placed in (build, *self.parts.values()) for name, _ in placed}

    def start(self, name: str, get: dict[str, str]) -> None:
        """Handle the start of an element."""
        match name.rpartition(":")[2]:
            case "triangle":
                self.triangles.extend((int(get["v1"]), int(get["v2"]), int(get["v3"])))
            case "vertex":
                self.vertices.extend((float(get["x"]), float(get["y"]), float(get["z"])))
            case "object":
                self.count_part()
                self.object = self.file, get["id"]
                self.parts[self.object] = []
            case "levelset":
                raise MeshError("the 3MF file holds a formula (a level set), and no mesh")
            case "component":
                self.parts[self.object].append(self.reference(get))
            case "item":
                self.build.append(self.reference(get))
            case "model":
                self.unit = get.get("unit", self.unit)

    def reference(self, get: dict[str, str]) -> _Placed:
        """The object that an item or a component names, in this file or in that of its path."""
        self.count_part()
        paths = [value for key, value in get.items() if key.rpartition(":")[2] == "path"]
        file = paths[0].lstrip("/") if paths else self.file
        return (file, get["objectid"]), _matrix(get.get("transform"))

    def count_part(self) -> None:
        """Count an object, a component or an item."""
        self.count += 1
        if self.count > MOST_PARTS:
            raise MeshError(f"not a valid 3MF file: it has more than {MOST_PARTS} objects and parts")

    def end(self, name: str) -> None:
        """Handle the end of an element."""
        if name.rpartition(":")[2] == "object":
            self.meshes[self.object] = _validated_mesh(self.vertices, self.triangles)
            self.vertices, self.triangles = array("d"), array("q")

    def laid_out(self) -> Mesh:
        """All build items as one mesh, mm."""
        if self.unit not in MILLIMETRES:
            raise MeshError(f"not a valid 3MF file: no such unit: {self.unit}")
        if not self.build:
            raise MeshError("the 3MF file asks to build nothing")
        known: dict[_Name, tuple[int, int]] = {}
        most = max(LARGEST, COPIES * sum(map(_count, self.meshes.values())))
        if sum(self.size(name, known)[0] for name, _ in self.build) > most:
            raise MeshError(f"not a valid 3MF file: it builds more than {most} vertices, triangles and parts")
        return concatenate([self.placed(*item) for item in self.build]).scaled(MILLIMETRES[self.unit])

    def size(self, name: _Name, known: dict[_Name, tuple[int, int]], depth: int = 0) -> tuple[int, int]:
        """Vertices, triangles and objects of an expanded object, and levels of its components.

        An unknown object, and components nested too deep, are refused.
        """
        if name in self.meshes and depth <= DEEPEST:
            if name not in known:
                inner = [self.size(part, known, depth + 1) for part, _ in self.parts[name]]
                sizes, levels = zip((_count(self.meshes[name]), -1), *inner, strict=True)
                known[name] = 1 + sum(sizes), 1 + max(levels)
            if depth + known[name][1] <= DEEPEST:
                return known[name]
        raise MeshError(f"not a valid 3MF file: no such object: {name[1]}")

    def placed(self, name: _Name, matrix: NDArray[np.float64]) -> Mesh:
        """An object with its components, in the frame of the build."""
        if name not in self.expanded:
            inner = [self.placed(*part) for part in self.parts[name]]
            self.expanded[name] = concatenate([self.meshes[name], *inner])
        whole = self.expanded[name]
        order = -1 if np.linalg.det(matrix[:3]) < 0 else 1
        turned = sum(whole.vertices[:, k, None] * matrix[k] for k in range(3))
        return Mesh(turned + matrix[3], whole.triangles[:, ::order])


def _count(mesh: Mesh) -> int:
    """Number of vertices and triangles."""
    return len(mesh.vertices) + len(mesh.triangles)


def _matrix(text: str | None) -> NDArray[np.float64]:
    """3MF transform: four rows of three numbers, applied to row vectors. Raises ValueError."""
    if text is None:
        return IN_PLACE
    matrix = np.array(text.split(), dtype=np.float64).reshape(4, 3)
    if not np.isfinite(matrix).all():
        raise ValueError(f"a transform that is not of finite numbers: {text[:60]}")
    return matrix


def _validated_mesh(vertices: array[float], triangles: array[int]) -> Mesh:
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


KINDS = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float": "f4",
    "double": "f8",
    "float32": "f4",
    "float64": "f8",
}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
HEADER = re.compile(rb"ply\s*?\n(.*?\n)end_header[ \t]*\r?\n", re.DOTALL)
CORNERS = "vertex_indices", "vertex_index"

Numbers = NDArray[Any]


class _Property(NamedTuple):
    """A number of each row or, with the kind of a length, a list of numbers."""

    name: str
    kind: np.dtype[Any]
    length: np.dtype[Any] | None


class _Element(NamedTuple):
    """A table of the file."""

    name: str
    rows: int
    properties: list[_Property]


class _Column(NamedTuple):
    """Values of a property, row after row, and their number in each row."""

    lengths: Numbers
    values: Numbers


def read_ply(path: Path) -> Mesh:
    """Read a PLY file; polygons become fans of triangles."""
    data = _contents(path)
    try:
        elements, body = _layout(data)
        tables, at = {}, 0
        for element in elements:
            tables[element.name], at = _table(element, body, at)
        x, y, z = (_numbers(tables["vertex"][axis]) for axis in "xyz")
        face = tables.get("face", {})
        lengths, corners = next((face[name] for name in CORNERS if name in face), _Column(*np.empty((2, 0))))
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        raise MeshError("not a whole PLY file: it is cut short, broken or of another kind") from error
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(x):
        raise MeshError("not a valid PLY file: a face names a vertex that does not exist")
    return Mesh(np.stack([x, y, z], axis=1).astype(np.float64), _fans(lengths, corners.astype(np.int32)))


def _numbers(column: _Column) -> Numbers:
    """Values of a property that has one in each row. Raises ValueError."""
    if (column.lengths != 1).any():
        raise ValueError("lists in place of numbers")
    return column.values


def _layout(data: bytes) -> tuple[list[_Element], bytes]:
    """Elements of the header, and the numbers after it: those of a text as float64. Raises ValueError."""
    header = HEADER.match(data)
    if header is None:
        raise ValueError("no header")
    order, elements, body = "", list[_Element](), data[header.end() :]
    for line in header[1].decode("ascii", "replace").splitlines():
        match line.split():
            case ["format", name, _]:
                order = ORDERS[name]
            case ["element", name, rows]:
                elements.append(_Element(name, int(rows), []))
            case ["property", "list", length, kind, name]:
                elements[-1].properties.append(_Property(name, _kind(kind, order), _kind(length, order)))
            case ["property", kind, name]:
                elements[-1].properties.append(_Property(name, _kind(kind, order), None))
    if order == "=":
        body = np.array(body.split(), np.bytes_).astype(np.float64).tobytes()
    return elements, body


def _kind(name: str, order: str) -> np.dtype[Any]:
    """Type of a number in the body."""
    return np.dtype(np.float64) if order == "=" else np.dtype(order + KINDS[name])


def _table(element: _Element, body: bytes, at: int) -> tuple[dict[str, _Column], int]:
    """Columns of an element, and the offset of its end."""
    names = [one.name for one in element.properties]
    if not element.rows:
        return {name: _Column(*np.empty((2, 0), np.int64)) for name in names}, at
    lengths = [len(values) for values in _row(element, body, at)[0]]
    alike = _alike(element, lengths, body, at)
    if alike is not None:
        columns = [
            _Column(np.full(element.rows, length), alike[name].reshape(-1))
            for name, length in zip(names, lengths, strict=True)
        ]
        return dict(zip(names, columns, strict=True)), at + alike.nbytes
    rows = []
    for _ in range(element.rows):
        row, at = _row(element, body, at)
        rows.append(row)
    parts = zip(*rows, strict=True)
    columns = [_Column(np.array([len(part) for part in column]), np.concatenate(column)) for column in parts]
    return dict(zip(names, columns, strict=True)), at


def _row(element: _Element, body: bytes, at: int) -> tuple[list[Numbers], int]:
    """Values of each property in the row at an offset, and the offset of the next one."""
    values = []
    for _, kind, length in element.properties:
        count = 1
        if length is not None:
            count = int(np.frombuffer(body, length, 1, at)[0])
            at += length.itemsize
        if count < 0:
            raise ValueError("a list of a negative length")
        values.append(np.frombuffer(body, kind, count, at))
        at += count * kind.itemsize
    return values, at


def _alike(element: _Element, lengths: list[int], body: bytes, at: int) -> Numbers | None:
    """All rows as one array, if their lists are as long as those of the first row."""
    fields: list[tuple[str, np.dtype[Any], tuple[int]]] = []
    for (name, kind, length), count in zip(element.properties, lengths, strict=True):
        if length is not None:
            fields.append((f"length of {name}", length, (1,)))
        fields.append((name, kind, (count,)))
    row = np.dtype(fields)
    if at + element.rows * row.itemsize > len(body):
        return None
    table = np.frombuffer(body, row, element.rows, at)
    counted = zip(element.properties, lengths, strict=True)
    same = all((table[f"length of {one.name}"] == count).all() for one, count in counted if one.length)
    return table if same else None


def _fans(lengths: Numbers, corners: NDArray[np.int32]) -> NDArray[np.int32]:
    """Triangles of polygons, each from its first corner."""
    lengths = lengths.astype(np.int64)
    triangles = np.maximum(lengths - 2, 0)
    first = np.repeat(np.cumsum(lengths) - lengths, triangles)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    result: NDArray[np.int32] = corners[np.stack([first, second, second + 1], axis=1)]
    return result


ASCII_STL = re.compile(rb"\s*solid[^\n]*\n\s*(facet|endsolid)", re.IGNORECASE)
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_mesh(path: str | Path) -> Mesh:
    """Read a mesh file, in mm.

    STL, PLY and OBJ have no unit: mm are assumed. 3MF and GLB have one. Coordinates are rounded to float32,
    equal positions welded, and every triangle is kept.

    Returns `Mesh` in mm.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MeshError(f"{path}: not a model file that can be read; known are {', '.join(sorted(READERS))}")
    try:
        if path.is_file() and not path.stat().st_size:
            raise MeshError("the file is empty")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of NumPy: coordinates that are not finite are refused
            mesh = quantise_mesh(reader(path))
    except FileNotFoundError:
        raise MeshError(f"{path}: no such file") from None
    except (OSError, MeshError) as error:
        raise MeshError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    if not len(mesh.triangles):
        raise MeshError(f"{path}: the file has no triangles")
    most = np.bincount(mesh.triangles.ravel()).max()
    if most > MOST_AROUND:
        raise MeshError(
            f"{path}: {most} corners of triangles meet at a vertex: expected at most {MOST_AROUND}"
        )
    return mesh


def _contents(path: Path) -> bytes:
    """Bytes of a file."""
    with open_regular(path) as file:
        return file.read()


def _read_stl(path: Path) -> Mesh:
    """Binary or ASCII STL."""
    data = _contents(path)
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + STL_TRIANGLE.itemsize * count:
        corners = np.frombuffer(data, STL_TRIANGLE, offset=84)["corners"].reshape(-1, 3)
    elif ASCII_STL.match(data):
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
        return f"not an STL file: {format_count(extra, 'byte')} after the {count} triangles that it announces"
    return f"not a whole STL file: {there} of {count} triangles; the file is cut short, or of another kind"


def _ascii_corners(data: bytes) -> NDArray[np.float64]:
    """Corners of an ASCII STL."""
    text = data.lower().rstrip()
    words = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", text)
    last = text.rpartition(b"\n")[2].lstrip()
    if not last.startswith(b"endsolid") or len(words) != 3 * text.count(b"endfacet"):
        raise MeshError("not a whole STL file: the text has no end; the file is cut short")
    try:
        return np.array(words, dtype=np.bytes_).astype(np.float64).reshape(-1, 3)
    except ValueError:
        raise MeshError("not an STL file: a coordinate is not a number") from None


def _read_obj(path: Path) -> Mesh:
    """OBJ: its vertices and faces; polygons become fans of triangles."""
    vertices, corners, lengths = array("d"), array("q"), array("q")
    try:
        for line in io.BytesIO(CONTINUED.sub(b" ", _contents(path))):
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
    return Mesh(points, _fans(np.array(lengths, np.int64), at.astype(np.int32)))


CONTINUED = re.compile(rb"\\\r?\n")
"""End of a line of an OBJ file that goes on."""

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3}
TRIANGLES, STRIP, FAN = 4, 5, 6
"""Modes of a primitive of GLB."""

BROKEN = ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError
"""What Python raises for JSON of other types and sizes than expected."""

LONGEST_TREE = 1 << 24
"""Most bytes of the JSON of a GLB file, which is parsed at once."""

TRANSFORMS = {"matrix", "rotation", "scale", "translation"}
GLTF_AXES = 1000 * np.array([(1, 0, 0), (0, 0, 1), (0, -1, 0)])
"""From metres with y up, rows, to mm with z up."""


def _read_glb(path: Path) -> Mesh:
    """GLB, converted from metres to mm and from y up to z up."""
    try:
        whole = _Tree(_contents(path)).laid_out()
    except (*BROKEN, struct.error) as error:
        raise MeshError("not a whole GLB file: it is cut short, broken or of another kind") from error
    return Mesh(whole.vertices @ GLTF_AXES, whole.triangles)


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
        self.meshes = dict[int, Mesh]()
        self.placed = [NOTHING]
        self.count = self.size = 0

    def laid_out(self) -> Mesh:
        """All meshes of the scene where its nodes have them."""
        for node in self.item("scenes", self.json.get("scene", 0))["nodes"]:
            self.place(node, np.eye(4), 0)
        return concatenate(self.placed)

    def counted(self, mesh: Mesh) -> Mesh:
        """A part, unless the file names parts again and again."""
        self.count, self.size = self.count + 1, self.size + _count(mesh)
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
        mesh = self.counted(self.mesh(node["mesh"]) if "mesh" in node else NOTHING)
        if len(mesh.triangles):
            vertices = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
            order = -1 if np.linalg.det(matrix[:3, :3]) < 0 else 1
            self.placed.append(Mesh(vertices, mesh.triangles[:, ::order]))
        for child in node.get("children", ()):
            self.place(child, matrix, depth + 1)

    def mesh(self, index: Any) -> Mesh:
        """The triangles of a mesh; points and lines are none."""
        if index not in self.meshes:
            primitives = self.item("meshes", index)["primitives"]
            some = [one for one in primitives if one.get("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN)]
            self.meshes[index] = concatenate([NOTHING, *(self.counted(self.primitive(one)) for one in some)])
        return self.meshes[index]

    def primitive(self, primitive: dict[str, Any]) -> Mesh:
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
        return Mesh(vertices, corners.reshape(-1, 3).astype(np.int32))

    def values(self, index: Any, kind: str) -> Numbers:
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
        values: Numbers = np.ndarray((count, width), dtype, self.body, start, (step, dtype.itemsize))
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


READERS = {
    ".stl": _read_stl,
    ".3mf": read_3mf,
    ".ply": read_ply,
    ".obj": _read_obj,
    ".glb": _read_glb,
}
