""".ctb versions 2 and 3, and .cbddlp, of ChiTu boards, unencrypted (Biffle, "CTB/CBDDLP file formats",
github.com/cbiffle/catibo).

All numbers are little-endian. A .ctb has 7 bits per pixel; version 3 adds motion to each layer. A .cbddlp has
several pictures of one bit per layer, of the pixels above a level each.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from itertools import accumulate
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..._slices import Encoding
from ...slicing import Layer
from ...slicing.printers import Resin
from ..layer_formats import ADDRESSED, PrintData, PrintFormat, pixel_format, rgb15_runs
from ..slice_run import SliceRun

CTB, CBDDLP = 0x12FD0086, 0x12FD0019
LEVELS = 4
"""Pictures per layer of a .cbddlp."""

LARGE, SMALL = (400, 300), (200, 125)
"""Width and height of the previews, pixels."""

SOFTWARE = 0x01060300
"""Version of the program that first wrote such files."""

_HEADER = struct.Struct("<2I3f8x5f3I4I2I2II2HI2I")
_MOTION = struct.Struct("<10fI16x")
_SLICER = struct.Struct("<28x6If2I8x4x")
_PREVIEW = struct.Struct("<4I16x")
_LAYER = struct.Struct("<3f6I")
_LAYER_MOTION = struct.Struct("<I11f")
"""Version 3: after a copy of the layer's entry in the table."""


def _assemble_ctb(job: PrintData, file: BinaryIO) -> None:
    _write(job, file, CTB, 2 if job.printer.version == 2 else 3, np.array([job.sizes]), job)


def _assemble_cbddlp(job: PrintData, file: BinaryIO) -> None:
    sizes = np.array([struct.unpack_from(f"<{LEVELS}I", picture) for picture in job]).T
    _write(job, file, CBDDLP, 2, sizes, (picture[4 * LEVELS :] for picture in job))


def _level_sets(run: SliceRun, layer: Layer) -> bytes:
    """Sizes of the pictures of a layer, then the pictures, the one of the highest level first."""
    levels = np.arange(256)
    tables = [np.uint8(255) * (levels >= 256 * (k + 0.5) / LEVELS) for k in reversed(range(LEVELS))]
    pictures = [run.screen.encoded(layer, Encoding.RLE1, table) for table in tables]
    return struct.pack(f"<{LEVELS}I", *map(len, pictures)) + b"".join(pictures)


def _write(
    job: PrintData,
    file: BinaryIO,
    magic: int,
    version: int,
    sizes: NDArray[np.int64],
    data: Iterable[bytes],
) -> None:
    """Write header, previews, settings, layer table and layers. sizes: of the pictures, [levels, layers]."""
    previews = [rgb15_runs(job.preview(*size)) for size in (LARGE, SMALL)]
    name = job.title
    lengths = [
        _HEADER.size,
        *(_PREVIEW.size + len(p) for p in previews),
        _MOTION.size,
        _SLICER.size,
        len(name),
    ]
    large, small, motion, slicer, machine, table = accumulate(lengths)
    extra = _LAYER.size + _LAYER_MOTION.size if version == 3 else 0
    ends = np.cumsum(sizes.T.ravel() + extra).reshape(sizes.shape[::-1]).T
    places = table + _LAYER.size * sizes.size + ends - sizes
    entries = [
        _LAYER.pack(*_timing(job, k), int(places[level, k]), int(sizes[level, k]), 0, extra, 0, 0)
        for level in range(len(sizes))
        for k in range(job.layers)
    ]
    file.write(_header(job, magic, version, len(sizes), (large, small, motion, slicer, table)))
    for (width, height), at, preview in zip((LARGE, SMALL), (large, small), previews, strict=True):
        file.write(_PREVIEW.pack(width, height, at + _PREVIEW.size, len(preview)) + preview)
    file.write(_motion(job) + _slicer(job, magic, version, len(sizes), machine, len(name)) + name)
    file.writelines(entries)
    for index, (entry, picture) in enumerate(zip(entries, data, strict=False)):
        if extra:
            file.write(entry + _layer_motion(job.resins[index], extra + len(picture)))
        file.write(picture)


def _header(job: PrintData, magic: int, version: int, levels: int, places: tuple[int, ...]) -> bytes:
    resin, (rows, columns), (large, small, motion, slicer, table) = job.resin, job.run.screen.shape, places
    return _HEADER.pack(
        *(magic, version, *job.printer.screen, job.printer.height, float(job.tops[-1])),
        *(float(job.heights.max()), resin.exposure, resin.bottom_exposure, resin.rest, resin.bottom_layers),
        *(columns, rows, large, table, job.layers, small, round(job.seconds), int(job.mirrored)),
        *(motion, _MOTION.size, levels, 255, 255, 0, slicer, _SLICER.size),
    )


def _motion(job: PrintData) -> bytes:
    resin = job.resin
    return _MOTION.pack(
        *((resin.whole_lift, resin.lift_speed) * 2 + (resin.retract_speed,)),
        *(job.volume_ml, job.weight_g, job.cost, resin.rest, resin.rest, resin.bottom_layers),
    )


def _slicer(job: PrintData, magic: int, version: int, levels: int, machine: int, size: int) -> bytes:
    mode = 8 if magic == CBDDLP else 0x2000000F if version == 3 else 0xF
    return _SLICER.pack(machine, size, mode, 0, levels, SOFTWARE, 0, 0, job.resin.transition_layers)


def _timing(job: PrintData, layer: int) -> tuple[float, float, float]:
    """Height of the platform, exposure and time without light."""
    return float(job.tops[layer]), float(job.exposures[layer]), job.resin.rest


def _layer_motion(resin: Resin, size: int) -> bytes:
    return _LAYER_MOTION.pack(
        size, resin.whole_lift, resin.lift_speed, 0, 0, resin.retract_speed, *(0,) * 5, 255
    )


FORMATS = (
    pixel_format("ctb", Encoding.RLE7, _assemble_ctb, most=ADDRESSED, endings=(".ctb",)),
    PrintFormat(
        "cbddlp",
        _level_sets,
        _assemble_cbddlp,
        most=ADDRESSED,
        endings=(".cbddlp", ".photon"),
        also={".photon": ".cbddlp"},
    ),
)
