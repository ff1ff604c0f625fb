""".cxdlpv4 of Creality's Halot printers since the Mage, after UVtools' description, not encrypted.

All numbers are little-endian but those of the head and the checksum. It is much like .ctb: 7 bits per pixel,
motion of each layer; a CRC-32 without inversions ends it.
"""

from __future__ import annotations

import struct
from itertools import accumulate
from typing import BinaryIO

from isal.isal_zlib import crc32

from ..._slices import Encoding
from ...slicing.printers import Resin
from ..layer_formats import ADDRESSED, PrintData, pixel_format, rgb15_runs, second_stages

MAGIC = b"CXSW3DV2\0"
VERSION = 4

MODELS = {"halot-mage-pro": "CL-103"}
"""Names that the makers give to printers in their files."""

SMALL, LARGE = (120, 120), (300, 300)
"""Width and height of the previews, pixels."""

_HEADER = struct.Struct("<2H5f10I2H3I")
_MOTION = struct.Struct("<10fI2f16x")
_MORE = struct.Struct("<7f4I5fI8x")
_PREVIEW = struct.Struct("<4I16x")
_LAYER = struct.Struct("<3f5I8x")
_LAYER_MOTION = struct.Struct("<11f")


def _assemble(job: PrintData, file: BinaryIO) -> None:
    checksum = 0xFFFFFFFF  # it begins with zeros

    def write(data: bytes) -> None:
        nonlocal checksum
        checksum = crc32(data, checksum)
        file.write(data)

    write(_before_pictures(job))
    for own, picture in zip(job.resins, job, strict=True):
        write(_layer_motion(own) + picture)
    file.write(struct.pack(">I", checksum ^ 0xFFFFFFFF))


def _before_pictures(job: PrintData) -> bytes:
    """Head, header, previews, settings and the table of layers."""
    model = MODELS.get(job.printer.name, job.printer.title).encode("ascii", "replace") + b"\0"
    head = struct.pack(">I", len(MAGIC)) + MAGIC + struct.pack(">HI", VERSION, len(model)) + model
    previews = [rgb15_runs(job.preview(*size)) for size in (SMALL, LARGE)]
    lengths = [
        len(head) + _HEADER.size,
        *(_PREVIEW.size + len(p) for p in previews),
        _MOTION.size,
        _MORE.size,
    ]
    small, large, motion, more, table = accumulate(lengths)
    parts = [head + _header(job, (small, large, motion, more, table))]
    for (width, height), at, preview in zip((SMALL, LARGE), (small, large), previews, strict=True):
        parts.append(_PREVIEW.pack(width, height, at + _PREVIEW.size, len(preview)) + preview)
    return b"".join([*parts, _motion(job), _more(job), _layers(job, table + _LAYER.size * job.layers)])


def _header(job: PrintData, places: tuple[int, ...]) -> bytes:
    resin, (rows, columns), (small, large, motion, more, table) = job.resin, job.run.screen.shape, places
    return _HEADER.pack(
        *(columns, rows, *job.printer.screen, job.printer.height, float(job.tops[-1])),
        *(float(job.heights.max()), resin.bottom_layers, small, table, job.layers, large, round(job.seconds)),
        *(int(job.mirrored), motion, _MOTION.size, 1, 255, 255, 0, more, _MORE.size),
    )


def _motion(job: PrintData) -> bytes:
    resin = job.resin
    return _MOTION.pack(
        *((resin.whole_lift, resin.lift_speed) * 2 + (resin.retract_speed,)),
        *(job.volume_ml, job.weight_g, job.cost, 0, 0, resin.bottom_layers),
        *(resin.exposure, resin.bottom_exposure),
    )


def _more(job: PrintData) -> bytes:
    """Second stages, rests, exposures and transition layers; each layer has settings of its own."""
    resin, minutes = job.resin, int(job.run.created.timestamp()) // 60
    up, up_speed, down, down_speed = second_stages(resin)
    return _MORE.pack(
        *(up, up_speed, up, up_speed, down, down_speed, resin.wait_lifted, 1, minutes, 1, 0),
        *(resin.wait, resin.wait_after, resin.exposure, resin.bottom_exposure, resin.wait_lifted),
        resin.transition_layers,
    )


def _layers(job: PrintData, first: int) -> bytes:
    places = accumulate((_LAYER_MOTION.size + size for size in job.sizes), initial=first)
    return b"".join(
        _LAYER.pack(
            float(top), float(exposure), 0, place, _LAYER_MOTION.size + size, 0, 0, round(1000 * area)
        )
        for top, exposure, place, size, area in zip(
            job.tops, job.exposures, places, job.sizes, job.areas.tolist(), strict=False
        )
    )


def _layer_motion(resin: Resin) -> bytes:
    """Motion of a layer, before its picture."""
    up, up_speed, down, down_speed = second_stages(resin)
    lift = resin.whole_lift, resin.lift_speed, up, up_speed
    rests = resin.wait_after, resin.wait_lifted, resin.wait
    return _LAYER_MOTION.pack(*lift, resin.retract_speed, down, down_speed, *rests, 255)


FORMATS = (pixel_format("cxdlpv4", Encoding.RLE7, _assemble, most=ADDRESSED, endings=(".cxdlpv4",)),)
