"""Reader of 3MF files: the objects that the build asks for, with the parts of other files in the package."""

from __future__ import annotations

import zipfile
import zlib
from array import array
from pathlib import Path
from typing import IO, Any
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .model import Mesh, joined

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


def read_3mf(path: Path) -> Mesh:
    """Read the build of a 3MF file, mm.

    Raises
    ------
    MeshError
        For an invalid file.
    """
    try:
        with zipfile.ZipFile(path) as archive:
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


_Name = tuple[str, str]
"""File of an object in the package, and its identifier there."""

_Placed = tuple[_Name, NDArray[np.float64]]
"""Object and its transform."""


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
        paths = [value for key, value in get.items() if key.rpartition(":")[2] == "path"]
        file = paths[0].lstrip("/") if paths else self.file
        return (file, get["objectid"]), _matrix(get.get("transform"))

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
        known: dict[_Name, int] = {}
        if sum(self.size(name, known) for name, _ in self.build) > LARGEST:
            raise MeshError(f"not a valid 3MF file: it builds more than {LARGEST} triangles and parts")
        return joined([self.placed(*item) for item in self.build]).scaled(MILLIMETRES[self.unit])

    def size(self, name: _Name, known: dict[_Name, int], depth: int = 0) -> int:
        """Triangles and objects of an expanded object, its components included."""
        self.check(name, depth)
        if name not in known:
            inner = sum(self.size(part, known, depth + 1) for part, _ in self.parts[name])
            known[name] = 1 + len(self.meshes[name].triangles) + inner
        return known[name]

    def check(self, name: _Name, depth: int) -> None:
        """Refuse an unknown object, or components nested too deep."""
        if name not in self.meshes or depth > DEEPEST:
            raise MeshError(f"not a valid 3MF file: no such object: {name[1]}")

    def placed(self, name: _Name, matrix: NDArray[np.float64], depth: int = 0) -> Mesh:
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
