"""Layers as contours: SVG, Common Layer Interface and JSON."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from isal.isal_zlib import crc32

from fracslice.export.jobs import SliceRun
from fracslice.slicing import Contours, Layer

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


def write_svg_folder(run: SliceRun, path: str | Path) -> Path:
    """Write a folder with an SVG file for each layer: one path with all contours, in mm.

    An interrupted job resumes.

    Parameters
    ----------
    run : SliceRun
        The layers to write.
    path : str or path
        The folder; it must be new, empty, or left by an interrupted job.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        For a folder with other files, or an error of the file system.
    """

    def make(layer: Layer) -> bytes:
        rings = layer.contours
        d = " ".join("M" + _pairs(_down(run, rings[i]), "%.4f,%.4f", " ") + "z" for i in range(len(rings)))
        title = f"<title>top {layer.top:.6g} mm, height {layer.height:.6g} mm</title>"
        data = f'{_head(run)}{title}\n<path fill-rule="evenodd" d="{d}"/>\n</svg>\n'.encode()
        return data + _checksum(data)

    return run.into_folder(path, "svg", make, _is_whole, {})


def _checksum(data: bytes) -> bytes:
    """Comment with the CRC-32 of what precedes it, by which a damaged layer is recognised."""
    return b"<!-- crc32 %08x -->\n" % crc32(data)


def _is_whole(data: bytes) -> bool:
    """True if the bytes are a complete layer, undamaged."""
    end = len(_checksum(b""))
    return data[-end:] == _checksum(data[:-end])


def write_svg_layers(run: SliceRun, path: str | Path) -> Path:
    """Write one SVG file with a group for each layer, as Slic3r writes it and DLP software reads it.

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

    def make(layer: Layer) -> bytes:
        rings = layer.contours
        lines = [f'<g id="layer{layer.index}" slic3r:z="{layer.top:.6g}">']
        for i, hole in enumerate(_holes(rings)):
            kind, fill = ("hole", "black") if hole else ("contour", "white")
            points = _pairs(_down(run, rings[i]), "%.4f,%.4f", " ")
            lines.append(f'<polygon slic3r:type="{kind}" points="{points}" style="fill: {fill}"/>')
        return ("\n".join([*lines, "</g>"]) + "\n").encode()

    head = _head(run, ' xmlns:slic3r="http://slic3r.org/namespaces/slic3r"')
    return run.into_file(path, head.encode(), make, b"</svg>\n")


# --- Common Layer Interface, version 2.0 (1994)
def write_cli(run: SliceRun, path: str | Path) -> Path:
    """Write a Common Layer Interface file as text.

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
    return run.into_file(path, _cli_head(run, "ASCII") + b"$$GEOMETRYSTART\n", _cli_text, b"$$GEOMETRYEND\n")


def write_cli_binary(run: SliceRun, path: str | Path) -> Path:
    """Write a binary Common Layer Interface file with long layer and polyline commands.

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
    return run.into_file(path, _cli_head(run, "BINARY").rstrip(b"\n"), _cli_bytes, b"")


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
    return "\n".join(["$$HEADERSTART", *lines, "$$HEADEREND\n"]).encode()


def _closed(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points, points[:1]]) / MICRON


def _cli_text(layer: Layer) -> bytes:
    rings = layer.contours
    lines = [f"$$LAYER/{layer.top / MICRON:.3f}"]
    for i, hole in enumerate(_holes(rings)):
        points = _closed(rings[i])
        lines.append(f"$$POLYLINE/1,{0 if hole else 1},{len(points)}," + _pairs(points, "%.3f,%.3f", ","))
    return ("\n".join(lines) + "\n").encode()


def _cli_bytes(layer: Layer) -> bytes:
    rings = layer.contours
    commands = [struct.pack("<Hf", 127, layer.top / MICRON)]
    for i, hole in enumerate(_holes(rings)):
        points = _closed(rings[i])
        commands += [
            struct.pack("<Hiii", 130, 1, 0 if hole else 1, len(points)),
            points.astype("<f4").tobytes(),
        ]
    return b"".join(commands)


# --- JSON
def write_json(run: SliceRun, path: str | Path) -> Path:
    """Write contours as JSON: for each layer its top, height and polygons with their parents, in mm.

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
    head = json.loads(run.describe())
    del head["layers"]
    opening = json.dumps(head)[:-1] + ', "unit": "mm", "layers": ['

    def make(layer: Layer) -> bytes:
        rings = layer.contours
        polygons = ", ".join(
            f'{{"parent": {parent}, "points": [{_pairs(rings[i], "[%.6g,%.6g]", ",")}]}}'
            for i, parent in enumerate(rings.parent)
        )
        comma = "," if layer.index else ""
        begin = f'{comma}\n{{"top": {layer.top:.6g}, "height": {layer.height:.6g}'
        return f'{begin}, "contours": [{polygons}]}}'.encode()

    return run.into_file(path, opening.encode(), make, b"\n]}\n")


WRITERS: dict[str, Callable[[SliceRun, str | Path], Path]] = {
    "svg": write_svg_folder,
    "slic3r": write_svg_layers,
    "cli": write_cli,
    "cli-binary": write_cli_binary,
    "json": write_json,
}
