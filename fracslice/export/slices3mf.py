"""3MF with the slice extension 1.0: contours of every layer and a mesh of the same field."""

from __future__ import annotations

from itertools import chain
from pathlib import Path

import numpy as np

from fracslice.errors import ExportError
from fracslice.export.jobs import SliceRun
from fracslice.export.text import rows
from fracslice.export.threemf import mesh_element, package
from fracslice.files import replacing
from fracslice.slicing import Layer

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


def write_3mf(run: SliceRun, path: str | Path) -> Path:
    """Write the slice stack of an object, streamed, and its mesh for programs that do not read slices.

    Parameters
    ----------
    run : SliceRun
        The layers to write, with a mesh.
    path : str or path
        The file to write.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        Without a mesh, or for an error of the file system.
    """
    if run.mesh is None:
        raise ExportError(f"{path}: a 3MF file needs the mesh of the object")
    with run.encoded(path, "3mf", _slice) as layers:
        middle = np.array(run.stack.shape[::-1]) * run.stack.pixel / 2
        build, mesh = BUILD.format(*middle).encode(), run.mesh()
        model = chain([HEAD.encode()], layers, [OBJECT.encode()], mesh_element(mesh), [build])
        with replacing(path) as file:
            package(file, model, run.layers > 1000, LEVEL)
    return Path(path)


def _slice(layer: Layer) -> bytes:
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
