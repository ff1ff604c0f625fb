"""PLY: written as binary by trimesh, with comments. No unit; a written comment states mm."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Triangles, fans
from ..common.files import read_bytes
from ..errors import MeshError
from ..work import Work
from . import MeshFormat


def _write(mesh: Triangles, file: BinaryIO, metadata: Mapping[str, str], _: Work) -> None:
    """Write a mesh, with metadata as comments; see `MeshFormat`."""
    from trimesh.exchange.ply import export_ply

    data = export_ply(mesh.in_order().to_trimesh(), vertex_normal=False)
    begin = data.index(b"\ncomment") + 1
    comments = [f"comment {key}: {' '.join(value.split())}\n" for key, value in metadata.items()]
    file.write(data[:begin])
    file.write("".join([*comments, "comment units: mm\n"]).encode("ascii", "replace"))
    file.write(memoryview(data)[begin:])


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


def read_tables(path: str | Path) -> dict[str, dict[str, _Column]]:
    """Columns of each element of a file. Raises ValueError and others of its kind."""
    elements, body = _layout(read_bytes(path))
    tables, at = {}, 0
    for element in elements:
        tables[element.name], at = _table(element, body, at)
    return tables


def _read(path: Path) -> Triangles:
    """Its vertices and faces; polygons become fans of triangles."""
    try:
        tables = read_tables(path)
        x, y, z = (numbers_of(tables["vertex"][axis]) for axis in "xyz")
        face = tables.get("face", {})
        lengths, corners = next((face[name] for name in CORNERS if name in face), _Column(*np.empty((2, 0))))
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        raise MeshError("not a whole PLY file: it is cut short, broken or of another kind") from error
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(x):
        raise MeshError("not a valid PLY file: a face names a vertex that does not exist")
    points = np.stack([x, y, z], axis=1).astype(np.float64)
    return Triangles(points, fans(lengths, corners.astype(np.int32)), _colours(tables["vertex"], len(points)))


def _colours(vertex: dict[str, _Column], count: int) -> NDArray[np.uint8] | None:
    """Colours of the vertices, if the file has them as bytes."""
    columns = [vertex[name].values for name in ("red", "green", "blue") if name in vertex]
    if [len(column) for column in columns] != [count] * 3:
        return None
    colours = np.stack(columns, axis=1)
    return colours.astype(np.uint8) if ((colours >= 0) & (colours <= 255)).all() else None


def numbers_of(column: _Column) -> Numbers:
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


FORMAT = MeshFormat(_read, _write, has_colours=True)
