"""3MF with the slice extension 1.0: contours of every layer and a mesh of the same field."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import BinaryIO

import numpy as np

from ...common.files import package, rows
from ...errors import ExportError
from ...slicing import Layer
from ..layer_formats import FileFormat
from ..slice_run import Encode, SliceRun

LEVEL = 1
HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<model unit="millimeter" xml:lang="en-US" requiredextensions="s" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07">\n'
    '<metadata name="Application">fracslice</metadata>\n<resources>\n<s:slicestack id="1" zbottom="0">\n'
)
OBJECT = '</s:slicestack>\n<object id="2" type="model" s:slicestackid="1" s:meshresolution="fullres">'
BUILD = (
    "</object>\n</resources>\n<build>"
    '<item objectid="2" transform="1 0 0 0 1 0 0 0 1 {:.6f} {:.6f} 0"/></build>\n</model>\n'
)
"""Tail of the model. Objects are centred; coordinates of the build must not be negative."""


class SlicesAndMesh(FileFormat):
    """The slice stack of an object, and its mesh for programs that do not read slices."""

    def encoder(self, run: SliceRun) -> Encode:
        if run.mesh is None:
            raise ExportError("a 3MF file needs the mesh of the object")
        return super().encoder(run)


def _assemble(run: SliceRun, layers: Iterable[bytes], file: BinaryIO) -> None:
    from ...formats._3mf import mesh_element  # of this format alone

    assert run.mesh
    middle = np.array(run.stack.shape[::-1]) * run.stack.pixel / 2
    build, mesh = BUILD.format(*middle).encode(), (text() for text in mesh_element(run.mesh()))
    package(file, chain([HEAD.encode()], layers, [OBJECT.encode()], mesh, [build]), run.layers > 1000, LEVEL)


def _slice(_: SliceRun, layer: Layer) -> bytes:
    rings = layer.contours
    texts = [f'<s:slice ztop="{layer.top:.6f}">\n'.encode()]
    if len(rings):
        vertices = rows('<s:vertex x="%.5f" y="%.5f"/>\n', rings.points)
        texts += [b"<s:vertices>\n", *vertices, b"</s:vertices>\n"]
    for first, end in zip(rings.starts[:-1], rings.starts[1:], strict=True):
        following = np.concatenate([np.arange(first + 1, end), [first]])
        texts += [
            f'<s:polygon startv="{first}">\n'.encode(),
            *rows('<s:segment v2="%d"/>\n', following[:, None]),
            b"</s:polygon>\n",
        ]
    return b"".join([*texts, b"</s:slice>\n"])


FORMATS = (SlicesAndMesh("3mf", _slice, _assemble, endings=(".3mf",)),)
