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
from ..work import Work
from .packages import HEAD, Fragment, Text, append, deflate, join, number_rows, rows

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
TRIANGLE, END_OF_ROW = ('<triangle v1="', '" v2="', '" v3="'), '"/>\n'
CORE_NAMES = {"Title", "Designer", "Description", "Copyright", "LicenseTerms", "Rating", "Application"}
CORE_NAMES |= {"CreationDate", "ModificationDate"}
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
GROUP = 2
"""Number of the group of colours, of the materials extension."""


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str], work: Work) -> None:
    """Write a mesh, streamed. Threads make and deflate blocks of the text, which are joined.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    file : file
        Binary file, open for writing and able to seek.
    metadata : mapping of str to str
        Names and values; names that 3MF does not define get fracslice's namespace.
    work : Work
        Threads and cancellation.
    """
    coloured = mesh.colours is not None
    is_large = _is_large(len(mesh.vertices), len(mesh.triangles), coloured)
    blocks = work.ordered(lambda text: deflate(text()), _model(mesh, metadata))
    join(file, (partial(append, block) for block in blocks), is_large)


def write_fragments(
    vertices: tuple[int, Iterable[Fragment]],
    triangles: tuple[int, Iterable[Fragment]],
    file: BinaryIO,
    metadata: Mapping[str, str],
) -> None:
    """Write a mesh whose rows are deflated."""

    def texts(*blocks: bytes) -> Iterator[Fragment]:
        return (partial(append, deflate(text)) for text in blocks)

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


def _model(mesh: Mesh, metadata: Mapping[str, str]) -> Iterator[Text]:
    if mesh.colours is None:
        yield from _texts(*_head(metadata), PLAIN)
        yield from mesh_element(mesh)
    else:
        yield from _texts(*_head(metadata, MODEL.replace("<model ", f'<model xmlns:m="{MATERIALS}" ')))
        colours, index = np.unique(mesh.colours, axis=0, return_inverse=True)
        yield from _texts(f'<m:colorgroup id="{GROUP}">\n'.encode())
        yield from _texts(*rows('<m:color color="#%02X%02X%02X"/>\n', colours))
        yield from _texts(f'</m:colorgroup>\n<object id="1" type="model" pid="{GROUP}" pindex="0">'.encode())
        yield from mesh_element(mesh, index.reshape(-1).astype(np.int32))
    yield from _texts(END)


def _texts(*blocks: bytes) -> Iterator[Text]:
    return (partial(bytes, block) for block in blocks)


def mesh_element(mesh: Mesh, colours: NDArray[np.int32] | None = None) -> Iterator[Text]:
    """Encode a mesh as the mesh element of an object, in blocks.

    `mesh` in mm; `colours`: int32 (n,).
    """
    yield from _texts(VERTICES)
    yield from vertex_rows(mesh.vertices)
    yield from _texts(TRIANGLES)
    if colours is None:
        yield from triangle_rows(mesh.triangles)
    else:
        before = *TRIANGLE, f'" pid="{GROUP}" p1="', '" p2="', '" p3="'
        yield from number_rows(before, END_OF_ROW, np.hstack([mesh.triangles, colours[mesh.triangles]]))
    yield from _texts(END_OF_MESH)


def vertex_rows(vertices: NDArray[np.floating]) -> Iterator[Text]:
    """Encode vertices, in blocks of `text.ROWS`.

    `vertices`: float (n, 3), mm.
    """
    return number_rows(('<vertex x="', '" y="', '" z="'), END_OF_ROW, vertices)


def triangle_rows(triangles: NDArray[np.integer]) -> Iterator[Text]:
    """Encode triangles, in blocks of `text.ROWS`.

    `triangles`: int (n, 3).
    """
    return number_rows(TRIANGLE, END_OF_ROW, triangles)
