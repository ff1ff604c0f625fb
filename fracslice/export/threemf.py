"""3MF: one object in millimetres, by the core specification 1.3 and, for colours, materials 1.2.

Equal meshes give equal bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from html import escape
from itertools import chain
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..mesh.model import Mesh
from .packages import HEAD, Fragment, append, deflated, join
from .text import rows

MODEL = (
    HEAD + '<model unit="millimeter" xml:lang="en-US" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:fracslice="urn:fracslice:metadata">\n'
)
PLAIN, VERTICES, TRIANGLES, END_OF_MESH, END = (
    b'<object id="1" type="model">',
    b"<mesh>\n<vertices>\n",
    b"</vertices>\n<triangles>\n",
    b"</triangles>\n</mesh>",
    b'</object></resources>\n<build><item objectid="1"/></build>\n</model>\n',
)
CORE_NAMES = {"Title", "Designer", "Description", "Copyright", "LicenseTerms", "Rating", "Application"}
CORE_NAMES |= {"CreationDate", "ModificationDate"}
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
GROUP = 2
"""Number of the group of colours, of the materials extension."""


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh, streamed. Blocks of the text are deflated by themselves, so that they can be joined.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    file : file
        Binary file, open for writing and able to seek.
    metadata : mapping of str to str
        Names and values; names that 3MF does not define get fracslice's namespace.
    """
    coloured = mesh.colours is not None
    is_large = _is_large(len(mesh.vertices), len(mesh.triangles), coloured)
    join(file, (partial(append, deflated(text)) for text in _model(mesh, metadata)), is_large)


def write_fragments(
    vertices: tuple[int, Iterable[Fragment]],
    triangles: tuple[int, Iterable[Fragment]],
    file: BinaryIO,
    metadata: Mapping[str, str],
) -> None:
    """Write a mesh whose rows are deflated.

    Parameters
    ----------
    vertices, triangles : tuple
        Number of rows, and fragments of `vertex_rows` and of `triangle_rows`.
    file, metadata
        As for `write`.
    """

    def texts(*blocks: bytes) -> Iterator[Fragment]:
        return (partial(append, deflated(text)) for text in blocks)

    fragments = chain(
        texts(*_head(metadata), PLAIN, VERTICES),
        vertices[1],
        texts(TRIANGLES),
        triangles[1],
        texts(END_OF_MESH, END),
    )
    join(file, fragments, _is_large(vertices[0], triangles[0], False))


def _is_large(vertices: int, triangles: int, coloured: bool) -> bool:
    """True if the text may exceed the 2 GiB of a plain ZIP member; rows take at most 66 and 54 bytes."""
    vertex, triangle = (92, 108) if coloured else (66, 54)  # with a colour for each vertex
    return vertex * vertices + triangle * triangles > 2**31 - 2**20


def _head(metadata: Mapping[str, str], model: str = MODEL) -> Iterator[bytes]:
    """Text before the resources."""
    yield model.encode()
    for key, value in metadata.items():
        name = key if key in CORE_NAMES else f"fracslice:{key}"
        yield f'<metadata name="{escape(name)}">{escape(value)}</metadata>\n'.encode()
    yield b"<resources>"


def _model(mesh: Mesh, metadata: Mapping[str, str]) -> Iterator[bytes]:
    if mesh.colours is None:
        yield from _head(metadata)
        yield PLAIN
        yield from mesh_element(mesh)
    else:
        yield from _head(metadata, MODEL.replace("<model ", f'<model xmlns:m="{MATERIALS}" '))
        colours, index = np.unique(mesh.colours, axis=0, return_inverse=True)
        yield f'<m:colorgroup id="{GROUP}">\n'.encode()
        yield from rows('<m:color color="#%02X%02X%02X"/>\n', colours)
        yield f'</m:colorgroup>\n<object id="1" type="model" pid="{GROUP}" pindex="0">'.encode()
        yield from mesh_element(mesh, index.reshape(-1).astype(np.int32))
    yield END


def mesh_element(mesh: Mesh, colours: NDArray[np.int32] | None = None) -> Iterator[bytes]:
    """Encode a mesh as the mesh element of an object, in blocks.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    colours : ndarray of int32, shape (n,), optional
        Number of each vertex's colour in the group of colours.

    Yields
    ------
    bytes
        Part of the element.
    """
    yield VERTICES
    yield from vertex_rows(mesh.vertices.astype(np.float32))
    yield TRIANGLES
    if colours is None:
        yield from triangle_rows(mesh.triangles)
    else:
        template = f'<triangle v1="%d" v2="%d" v3="%d" pid="{GROUP}" p1="%d" p2="%d" p3="%d"/>\n'
        yield from rows(template, np.hstack([mesh.triangles, colours[mesh.triangles]]))
    yield END_OF_MESH


def vertex_rows(vertices: NDArray[np.float32]) -> Iterator[bytes]:
    """Encode vertices, in blocks of `text.ROWS`.

    Parameters
    ----------
    vertices : ndarray of float32, shape (n, 3)
        Vertices, mm.
    """
    return rows('<vertex x="%.9g" y="%.9g" z="%.9g"/>\n', vertices)


def triangle_rows(triangles: NDArray[np.integer]) -> Iterator[bytes]:
    """Encode triangles, in blocks of `text.ROWS`.

    Parameters
    ----------
    triangles : ndarray of int, shape (n, 3)
        Indices of vertices.
    """
    return rows('<triangle v1="%d" v2="%d" v3="%d"/>\n', triangles)
