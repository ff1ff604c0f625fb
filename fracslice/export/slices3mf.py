"""3MF with the slice extension 1.0: contours of every layer and a mesh of the same field."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from fracslice.export.files import replacing
from fracslice.export.jobs import SliceRun
from fracslice.export.journal import journal
from fracslice.export.text import rows
from fracslice.export.threemf import RELATIONS, TYPES, mesh_element
from fracslice.mesh import Mesh
from fracslice.mesh.clean import clean
from fracslice.mesh.components import select
from fracslice.mesh.extract import contour
from fracslice.meshjob import DUST, RESOLUTION
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


def write_3mf(run: SliceRun, path: str | Path) -> Path:
    """Write the slice stack of an object, streamed, and its mesh for programs that do not read slices.

    Parameters
    ----------
    run : SliceRun
        The layers to write.
    path : str or path
        The file to write.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        For an error of the file system.
    """
    mesh = _mesh(run)
    with journal(path, run.key("3mf")) as kept:
        for slice_ in run.slicer.map(lambda layer: _slice(run, layer), range(kept.count, run.layers)):
            kept.append(slice_)
        with (
            replacing(path) as file,
            zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive,
        ):
            for name, text in (("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS)):
                with archive.open(name, "w") as part:
                    part.write(text.encode())
            with archive.open("3D/3dmodel.model", "w", force_zip64=run.layers > 1000) as part:
                part.write(HEAD.encode())
                part.writelines(kept)
                part.write(OBJECT.encode())
                part.writelines(mesh_element(mesh))
                part.write(b'</object>\n</resources>\n<build><item objectid="2"/></build>\n</model>\n')
    return Path(path)


def _slice(run: SliceRun, layer: Layer) -> bytes:
    found = layer.contours
    parts = [f'<s:slice ztop="{layer.top:.6f}">\n'.encode()]
    if len(found):
        parts += [
            b"<s:vertices>\n",
            *rows('<s:vertex x="%.5f" y="%.5f"/>\n', found.points + _middle(run)),
            b"</s:vertices>\n",
        ]
    for first, end in zip(found.starts[:-1], found.starts[1:], strict=True):
        following = np.concatenate([np.arange(first + 1, end), [first]])
        parts += [
            f'<s:polygon startv="{first}">\n'.encode(),
            *rows('<s:segment v2="%d"/>\n', following[:, None]),
        ]
        parts.append(b"</s:polygon>\n")
    return b"".join([*parts, b"</s:slice>\n"])


def _middle(run: SliceRun) -> np.ndarray:
    """Offset from the window's corner to its middle: build coordinates must not be negative."""
    return np.array(run.stack.shape[::-1]) * run.stack.pixel / 2


def _mesh(run: SliceRun) -> Mesh:
    """Mesh of the object in mm, aligned with its slices."""
    from fracslice.printing.connectivity import shown  # imported here: only this format needs Numba

    stack, longest = run.stack, max(run.stack.size)
    finest = max(*stack.pixel, float(stack.heights.max()))
    samples = min(longest / finest, RESOLUTION)
    bricks = shown(stack.root, stack.outer, longest / stack.scale, samples, run.work)
    run.work.progress("meshing", 0.0)
    found = contour(stack.root, bricks, run.work)
    bottom = float(stack.z[0]) - float(stack.heights[0]) / stack.scale / 2
    placed = replace(found, vertices=(found.vertices - (*stack.corner, bottom)) * stack.scale)
    whole, _ = select(placed, keep="all", dust_mm3=DUST * placed.volume, cavities="keep")
    return clean(whole)
