"""3MF with the volumetric and implicit extensions 0.8: an object as a formula, in the form that lib3mf 2.5
reads and writes. (There arctan2 of the specification is atan2.)

The function has the input "pos", mm, and the output "shape": at most the distance from the surface, mm,
negative inside. It is evaluated within a box.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..common.files import replacing
from ..common.packages import HEAD, package
from ..formats._3mf import CORE_NAMES, mesh_element
from ..mesh.model import Mesh

if TYPE_CHECKING:
    from ..fields.box import Box
    from ..fields.operations import Operation

LEVEL = 9
ELEMENTS = {
    "add": "addition", "subtract": "subtraction", "multiply": "multiplication", "divide": "division",
    "minimum": "min", "maximum": "max", "absolute": "abs",
}  # fmt: skip
"""Names of elements that differ from the operation's."""

MODEL = (
    HEAD + '<model unit="millimeter" xml:lang="en-US" requiredextensions="v i" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:v="http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01" '
    'xmlns:i="http://schemas.3mf.io/3dmanufacturing/implicit/2023/12" '
    'xmlns:fracslice="urn:fracslice:metadata">\n'
)
FUNCTION = (
    '<resources>\n<i:implicitfunction id="1" displayname="{}">\n'
    '<i:in><i:vector identifier="pos" displayname="position"/></i:in>\n'
    '<i:decomposevector identifier="p"><i:in><i:vectorref identifier="A" ref="inputs.pos"/></i:in><i:out>'
    '<i:scalar identifier="x"/><i:scalar identifier="y"/><i:scalar identifier="z"/></i:out>'
    "</i:decomposevector>\n"
)
OBJECT = (
    '<i:out><i:scalarref identifier="shape" displayname="distance" ref="{}"/></i:out>\n'
    '</i:implicitfunction>\n<object id="2" type="model">'
)
LEVEL_SET = (
    '</object>\n<object id="3" type="model"><v:levelset functionid="1" channel="shape" meshid="2" '
    'meshbboxonly="true" minfeaturesize="{:.9g}"/></object>\n</resources>\n'
    '<build><item objectid="3"/></build>\n</model>\n'
)


def write_implicit(
    operations: Sequence[Operation], box: Box, finest: float, path: str | Path, metadata: Mapping[str, str]
) -> Path:
    """Write an object as a formula.

    `operations`, `box`, `finest` in mm.
    """
    with replacing(path) as file:
        package(file, _model(operations, box, finest, metadata), False, LEVEL)
    return Path(path)


def _model(
    operations: Sequence[Operation], box: Box, finest: float, metadata: Mapping[str, str]
) -> Iterator[bytes]:
    yield MODEL.encode()
    for key, value in metadata.items():
        name = key if key in CORE_NAMES else f"fracslice:{key}"
        yield f'<metadata name="{escape(name)}">{escape(value)}</metadata>\n'.encode()
    yield FUNCTION.format(escape(metadata.get("Title", ""))).encode()
    references: list[str] = []
    for operation in operations:
        text, reference = _element(operation, references)
        references.append(reference)
        yield text.encode()
    yield OBJECT.format(references[-1]).encode()
    yield from (text() for text in mesh_element(_cuboid(box)))
    yield LEVEL_SET.format(finest).encode()


def _element(operation: Operation, references: Sequence[str]) -> tuple[str, str]:
    """Element of an operation, and the reference to its output."""
    if operation.name in ("x", "y", "z"):
        return "", f"p.{operation.name}"
    name = f"n{len(references)}"
    if operation.name == "constant":
        text = f'<i:constant identifier="{name}" value="{operation.value!r}">'
        return f'{text}<i:out><i:scalar identifier="value"/></i:out></i:constant>\n', f"{name}.value"
    element = ELEMENTS.get(operation.name, operation.name)
    given = "".join(
        f'<i:scalarref identifier="{letter}" ref="{references[k]}"/>'
        for letter, k in zip("ABCD", operation.operands, strict=False)
    )
    text = (
        f'<i:{element} identifier="{name}"><i:in>{given}</i:in><i:out><i:scalar identifier="result"/></i:out>'
    )
    return f"{text}</i:{element}>\n", f"{name}.result"


def _cuboid(box: Box) -> Mesh:
    """Triangles of a box."""
    corners = np.array([[(box.lo, box.hi)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
    return Mesh(corners, np.array(triangles, np.int32))
