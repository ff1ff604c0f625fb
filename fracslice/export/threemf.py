"""3MF: one object in millimetres, by the core specification 1.3 and, for colours, materials 1.2.

Equal meshes give equal bytes.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Iterator, Mapping
from html import escape
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from fracslice.export.text import rows
from fracslice.mesh.model import Mesh

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
TYPES = (
    HEAD + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
RELATIONS = (
    HEAD + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
MODEL = (
    HEAD + '<model unit="millimeter" xml:lang="en-US" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:fracslice="urn:fracslice:metadata">\n'
)
CORE_NAMES = {"Title", "Designer", "Description", "Copyright", "LicenseTerms", "Rating", "Application"}
CORE_NAMES |= {"CreationDate", "ModificationDate"}
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
GROUP = 2
"""Number of the group of colours, of the materials extension."""

LEVEL = 3  # of deflate: a third of the time of the default 6, for files a twentieth larger


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh, streamed.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    file : file
        Binary file, open for writing.
    metadata : mapping of str to str
        Names and values; names that 3MF does not define get fracslice's namespace.
    """
    package(file, _model(mesh, metadata), _is_large(mesh), LEVEL)


def package(file: BinaryIO, model: Iterable[bytes], is_large: bool, level: int) -> None:
    """Write a package with one model, streamed. Members opened by name carry no time.

    Parameters
    ----------
    file : file
        Binary file, open for writing.
    model : iterable of bytes
        Text of the model.
    is_large : bool
        True if the text may exceed 2 GiB.
    level : int
        Level of deflate.
    """
    members = ("[Content_Types].xml", [TYPES.encode()]), ("_rels/.rels", [RELATIONS.encode()])
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=level) as archive:
        for name, texts in (*members, ("3D/3dmodel.model", model)):
            with archive.open(name, "w", force_zip64=is_large) as member:
                member.writelines(texts)


def _is_large(mesh: Mesh) -> bool:
    """True if the text may exceed the 2 GiB of a plain ZIP member; rows take at most 66 and 54 bytes."""
    vertex, triangle = (66, 54) if mesh.colours is None else (92, 108)  # with a colour for each vertex
    return vertex * len(mesh.vertices) + triangle * len(mesh.triangles) > 2**31 - 2**20


def _model(mesh: Mesh, metadata: Mapping[str, str]) -> Iterator[bytes]:
    head = MODEL if mesh.colours is None else MODEL.replace("<model ", f'<model xmlns:m="{MATERIALS}" ')
    yield head.encode()
    for key, value in metadata.items():
        name = key if key in CORE_NAMES else f"fracslice:{key}"
        yield f'<metadata name="{escape(name)}">{escape(value)}</metadata>\n'.encode()
    yield b"<resources>"
    if mesh.colours is None:
        yield b'<object id="1" type="model">'
        yield from mesh_element(mesh)
    else:
        colours, index = np.unique(mesh.colours, axis=0, return_inverse=True)
        yield f'<m:colorgroup id="{GROUP}">\n'.encode()
        yield from rows('<m:color color="#%02X%02X%02X"/>\n', colours)
        yield f'</m:colorgroup>\n<object id="1" type="model" pid="{GROUP}" pindex="0">'.encode()
        yield from mesh_element(mesh, index.reshape(-1).astype(np.int32))
    yield b'</object></resources>\n<build><item objectid="1"/></build>\n</model>\n'


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
    yield b"<mesh>\n<vertices>\n"
    yield from rows('<vertex x="%.9g" y="%.9g" z="%.9g"/>\n', mesh.vertices.astype(np.float32))
    yield b"</vertices>\n<triangles>\n"
    if colours is None:
        yield from rows('<triangle v1="%d" v2="%d" v3="%d"/>\n', mesh.triangles)
    else:
        template = f'<triangle v1="%d" v2="%d" v3="%d" pid="{GROUP}" p1="%d" p2="%d" p3="%d"/>\n'
        yield from rows(template, np.hstack([mesh.triangles, colours[mesh.triangles]]))
    yield b"</triangles>\n</mesh>"
