"""Layers as contours: SVG, Common Layer Interface and JSON."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterable
from itertools import chain
from typing import BinaryIO

import numpy as np
from isal.isal_zlib import crc32

from ...slicing import Contours, Layer
from ..layer_formats import FileFormat, FolderFormat
from ..slice_run import SliceRun

MICRON = 0.001
"""Unit of Common Layer Interface files, mm."""


def _pairs(points: np.ndarray, template: str, between: str) -> str:
    """Points [n, 2] as text, each formatted by a %-template."""
    return between.join([template] * len(points)) % tuple(points.ravel().tolist())


def _holes(rings: Contours) -> np.ndarray:
    """Mask of the contours that are holes, bool [m]: contours at an odd nesting depth."""
    depth = np.zeros(len(rings), np.int32)
    for i, parent in enumerate(rings.parent):
        depth[i] = depth[parent] + 1 if parent >= 0 else 0
    return np.asarray(depth % 2 == 1)


# --- SVG
def _size(run: SliceRun) -> tuple[float, float]:
    """Width and height of the layers' window, mm."""
    ny, nx = run.stack.shape
    return nx * run.stack.pixel[0], ny * run.stack.pixel[1]


def _down(run: SliceRun, points: np.ndarray) -> np.ndarray:
    """Points in SVG coordinates: mm from the upper left corner, y down."""
    return np.array(_size(run)) / 2 + points * (1, -1)


def _head(run: SliceRun, namespaces: str = "") -> str:
    width, height = (f"{s:.6g}" for s in _size(run))
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<svg xmlns="http://www.w3.org/2000/svg"{namespaces} '
        f'width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">\n'
    )


def _svg(run: SliceRun, layer: Layer) -> bytes:
    """An SVG file: one path with all contours, in mm."""
    rings = layer.contours
    d = " ".join("M" + _pairs(_down(run, rings[i]), "%.4f,%.4f", " ") + "z" for i in range(len(rings)))
    title = f"<title>top {layer.top:.6g} mm, height {layer.height:.6g} mm</title>"
    data = f'{_head(run)}{title}\n<path fill-rule="evenodd" d="{d}"/>\n</svg>\n'.encode()
    return data + _checksum(data)


def _checksum(data: bytes) -> bytes:
    """Comment with the CRC-32 of what precedes it, by which a damaged layer is recognised."""
    return b"<!-- crc32 %08x -->\n" % crc32(data)


def _slic3r_head(run: SliceRun) -> bytes:
    return _head(run, ' xmlns:slic3r="http://slic3r.org/namespaces/slic3r"').encode()


def _slic3r(run: SliceRun, layer: Layer) -> bytes:
    """A group, as Slic3r writes it and DLP software reads it."""
    rings = layer.contours
    lines = [f'<g id="layer{layer.index}" slic3r:z="{layer.top:.6g}">']
    for i, hole in enumerate(_holes(rings)):
        kind, fill = ("hole", "black") if hole else ("contour", "white")
        points = _pairs(_down(run, rings[i]), "%.4f,%.4f", " ")
        lines.append(f'<polygon slic3r:type="{kind}" points="{points}" style="fill: {fill}"/>')
    return ("\n".join([*lines, "</g>"]) + "\n").encode()


# --- Common Layer Interface, version 2.0 (1994)
def _cli_head(run: SliceRun, kind: str) -> bytes:
    x, y = (s / 2 for s in run.stack.size[:2])
    box = ",".join(f"{v:.6f}" for v in (-x, -y, 0.0, x, y, float(run.stack.tops[-1])))
    lines = [
        f"$${kind}",
        f"$$UNITS/{MICRON:015.6f}",
        "$$VERSION/200",
        "$$LABEL/1,fracslice",
        f"$$DIMENSION/{box}",
    ]
    lines.append(f"$$LAYERS/{run.layers:06d}")
    return "\n".join(["$$HEADERSTART", *lines, "$$HEADEREND"]).encode()


def _close_outline(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points, points[:1]]) / MICRON


def _cli_text(_: SliceRun, layer: Layer) -> bytes:
    rings = layer.contours
    lines = [f"$$LAYER/{layer.top / MICRON:.3f}"]
    for i, hole in enumerate(_holes(rings)):
        points = _close_outline(rings[i])
        lines.append(f"$$POLYLINE/1,{0 if hole else 1},{len(points)}," + _pairs(points, "%.3f,%.3f", ","))
    return ("\n".join(lines) + "\n").encode()


def _cli_bytes(_: SliceRun, layer: Layer) -> bytes:
    rings = layer.contours
    commands = [struct.pack("<Hf", 127, layer.top / MICRON)]
    for i, hole in enumerate(_holes(rings)):
        points = _close_outline(rings[i])
        commands += [
            struct.pack("<Hiii", 130, 1, 0 if hole else 1, len(points)),
            points.astype("<f4").tobytes(),
        ]
    return b"".join(commands)


# --- JSON
def _json_head(run: SliceRun) -> bytes:
    head = json.loads(run.describe())
    del head["layers"]
    return (json.dumps(head)[:-1] + ', "unit": "mm", "layers": [').encode()


def _json(_: SliceRun, layer: Layer) -> bytes:
    """Top, height, and polygons with their parents, in mm."""
    rings = layer.contours
    polygons = ", ".join(
        f'{{"parent": {parent}, "points": [{_pairs(rings[i], "[%.6g,%.6g]", ",")}]}}'
        for i, parent in enumerate(rings.parent)
    )
    comma = "," if layer.index else ""
    begin = f'{comma}\n{{"top": {layer.top:.6g}, "height": {layer.height:.6g}'
    return f'{begin}, "contours": [{polygons}]}}'.encode()


def _between(
    name: str,
    encode: Callable[[SliceRun, Layer], bytes],
    head: Callable[[SliceRun], bytes],
    tail: bytes,
    *endings: str,
) -> FileFormat:
    """Format of a file with the layers between a head and a tail."""

    def assemble(run: SliceRun, layers: Iterable[bytes], file: BinaryIO) -> None:
        file.writelines(chain([head(run)], layers, [tail]))

    return FileFormat(name, encode, assemble, endings=endings)


FORMATS = (
    FolderFormat("svg", _svg, lambda _: {}),
    _between("slic3r", _slic3r, _slic3r_head, b"</svg>\n", ".svg"),
    _between(
        "cli",
        _cli_text,
        lambda run: _cli_head(run, "ASCII") + b"\n$$GEOMETRYSTART\n",
        b"$$GEOMETRYEND\n",
        ".cli",
    ),
    _between("cli-binary", _cli_bytes, lambda run: _cli_head(run, "BINARY"), b""),
    _between("json", _json, _json_head, b"\n]}\n", ".json"),
)
