""".goo V3.0 of Elegoo, and .prz of Phrozen, after UVtools, PrusaSlicer and the crate goo.

All numbers are big-endian; pixels have 8 bits; each layer has its own height and exposure.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

from ..._slices import Encoding
from ...slicing.printers import Resin
from ...version import __version__
from ..layer_formats import PrintData, pixel_format, rgb565, second_stages

MAGIC = b"\x07\0\0\0DLP\0"
DELIMITER = b"\r\n"
END = bytes(3) + MAGIC
SMALL, LARGE = 116, 290
"""Sides of the two previews, pixels."""

_SETTINGS = struct.Struct(">I2H2?5f?8fI16f2H?I3f8sI?H")
"""Header after the previews."""

HEADER = 4 + len(MAGIC) + 32 + 24 + 24 + 3 * 32 + 3 * 2 + 2 * (SMALL**2 + LARGE**2 + 2) + _SETTINGS.size
_LAYER = struct.Struct(">H15fH2sI")


def _assemble(job: PrintData, file: BinaryIO) -> None:
    file.write(_header(job))
    for index, picture in enumerate(job):
        file.write(_layer(job, index, len(picture)))
        file.write(picture)
        file.write(DELIMITER)
    file.write(END)


def _header(job: PrintData) -> bytes:
    created = f"{job.run.created:%Y-%m-%d %H:%M:%S}"
    texts = [("fracslice", 32), (__version__, 24), (created, 24), (job.printer.title, 32)]
    texts += [("Default", 32), (job.resin.name, 32)]
    named = b"".join(text.encode("ascii", "replace")[: size - 1].ljust(size, b"\0") for text, size in texts)
    previews = b"".join(
        rgb565(job.preview(side, side)).astype(">u2").tobytes() + DELIMITER for side in (SMALL, LARGE)
    )
    screen = job.run.screen
    levels = struct.pack(">3H", min(screen.levels, 8), int(screen.levels > 1), screen.blur)
    return b"V3.0" + MAGIC + named + levels + previews + _settings(job)


def _settings(job: PrintData) -> bytes:
    resin, (rows, columns) = job.resin, job.run.screen.shape
    first = (resin.lift, resin.lift_speed) * 2 + (resin.retract, resin.retract_speed) * 2
    return _SETTINGS.pack(
        *(job.layers, columns, rows, job.mirrored, False),
        *(*job.printer.screen, job.printer.height, float(job.heights.max()), resin.exposure),
        True,  # rests instead of a time without light
        0,  # time without light
        *(_rests(resin) * 2),
        resin.bottom_exposure,
        resin.bottom_layers,
        *(*first, *(second_stages(resin)[:2] * 2), *(second_stages(resin)[2:] * 2)),
        *(255, 255, True, round(job.seconds)),
        *(1000 * job.volume_ml, job.weight_g, job.cost, b"", HEADER, True, resin.transition_layers),
    )


def _layer(job: PrintData, index: int, size: int) -> bytes:
    resin = job.resins[index]
    return _LAYER.pack(
        *(0, 0, float(job.tops[index]), float(job.exposures[index]), 0, *_rests(resin)),
        *(resin.lift, resin.lift_speed, *second_stages(resin)[:2]),
        *(resin.retract, resin.retract_speed, *second_stages(resin)[2:]),
        *(255, DELIMITER, size),
    )


def _rests(resin: Resin) -> tuple[float, float, float]:
    """Rests after a layer, after the lift and before a layer, s."""
    return resin.wait_after, resin.wait_lifted, resin.wait


FORMATS = (pixel_format("goo", Encoding.GOO, _assemble, endings=(".goo", ".prz"), also={".prz": ".goo"}),)
