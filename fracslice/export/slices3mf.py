"""3MF with the slice extension 1.0: contours of every layer, and a box that stands for the mesh."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from fracslice.export.files import replacing
from fracslice.export.jobs import SliceRun
from fracslice.export.journal import journal
from fracslice.export.text import rows
from fracslice.export.threemf import RELATIONS, TYPES
from fracslice.slicing import Layer

LEVEL = 1
HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<model unit="millimeter" xml:lang="en-US" requiredextensions="s" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07">\n'
    '<metadata name="Application">fracslice</metadata>\n<resources>\n<s:slicestack id="1" zbottom="0">\n'
)
BOX = (
    (0, 2, 1),
    (0, 3, 2),
    (4, 5, 6),
    (4, 6, 7),
    (0, 1, 5),
    (0, 5, 4),
    (1, 2, 6),
    (1, 6, 5),
    (2, 3, 7),
    (2, 7, 6),
    (3, 0, 4),
    (3, 4, 7),
)


def write_3mf(run: SliceRun, path: str | Path) -> Path:
    """The slice stack of one object, streamed. The mesh has "low resolution": its box, which the extension
    allows where the slices are what is printed.
    """
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
                part.write(f"</s:slicestack>\n{_object(run)}".encode())
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
    """What moves the window's corner to the origin: coordinates of a build must not be negative."""
    return np.array(run.stack.shape[::-1]) * run.stack.pixel / 2


def _object(run: SliceRun) -> str:
    (x, y), z = 2 * _middle(run), run.stack.tops[-1]
    corners = [(a, b, c) for c in (0, z) for a, b in ((0, 0), (x, 0), (x, y), (0, y))]
    vertices = "".join(f'<vertex x="{a:.5f}" y="{b:.5f}" z="{c:.6f}"/>' for a, b, c in corners)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in BOX)
    return (
        '<object id="2" type="model" s:slicestackid="1" s:meshresolution="lowres"><mesh>'
        f"<vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>\n"
        '</resources>\n<build><item objectid="2"/></build>\n</model>\n'
    )
