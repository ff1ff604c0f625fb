""".pwmx and its family, of Anycubic's Photon Workshop, versions 1 and 516.

All numbers are little-endian; a section is a name, a length and its contents. Pixels have 4 bits; each layer
has its own height and exposure. PrusaSlicer writes the same layout since version 2.5.
"""

from __future__ import annotations

import struct
from itertools import accumulate
from typing import BinaryIO

from ..._slices import Encoding
from ..layer_formats import ADDRESSED, PrintData, pixel_format, rgb565

PREVIEW = 224, 168
"""Width and height of the preview, pixels."""

DPI = 42
DOLLARS = 0x24
PALETTE = 0, 16, *(0xFFFFFFFF,) * 4, 0
"""Version 516: what follows the preview in files of the maker's program."""

BOARD = 0x634701
"""Version 516: the last number of the machine's section in files of the maker's program."""

_HEADER = struct.Struct("<10f3I2f5I")
_LAYER = struct.Struct("<2I4f8x")
_MACHINE = struct.Struct("<96s24s3f2I")


def _assemble(job: PrintData, file: BinaryIO) -> None:
    file.write(_before_pictures(job))
    file.writelines(job)


def _before_pictures(job: PrintData) -> bytes:
    """All sections before the pictures, after their offsets."""
    wide = job.printer.version == 516
    version = 516 if wide else 1
    header = _section("HEADER", _settings(job)) + bytes(4 * wide)
    preview = _preview(job, wide)
    table = _section("LAYERDEF", bytes(4 + _LAYER.size * job.layers))
    extra, machine = (_motion(job), _machine(job)) if wide else (b"", b"")
    palette = struct.pack("<7I", *PALETTE) if wide else b""
    begin = 12 + 4 * (10 if wide else 9)
    lengths = [begin, *map(len, (header, preview, palette, table, extra, machine))]
    at_header, at_preview, at_palette, at_table, at_extra, at_machine, pictures = accumulate(lengths)
    offsets = [version, 8 if wide else 4, at_header, 0, at_preview, at_palette * wide, at_table]
    offsets += [at_extra, at_machine, pictures] if wide else [0, pictures]
    table = _section("LAYERDEF", struct.pack("<I", job.layers) + _layers(job, pictures))
    intro = b"ANYCUBIC".ljust(12, b"\0") + struct.pack(f"<{len(offsets)}I", *offsets)
    return intro + header + preview + palette + table + extra + machine


def _section(name: str, contents: bytes, counted: int = 0) -> bytes:
    """A section. counted: bytes of its head that its length includes."""
    return name.encode().ljust(12, b"\0") + struct.pack("<I", len(contents) + counted) + contents


def _settings(job: PrintData) -> bytes:
    resin, (rows, columns) = job.resin, job.run.screen.shape
    return _HEADER.pack(
        *(1000 * max(job.printer.pixel), float(job.heights.max()), resin.exposure, resin.rest),
        *(resin.bottom_exposure, resin.bottom_layers, resin.whole_lift, resin.lift_speed / 60),
        *(resin.retract_speed / 60, job.volume_ml, 1, columns, rows, job.weight_g, job.cost, DOLLARS),
        *(1, round(job.seconds), resin.transition_layers, 0),
    )


def _preview(job: PrintData, wide: bool) -> bytes:
    width, height = PREVIEW
    pixels = rgb565(job.preview(width, height)).astype("<u2").tobytes()
    return _section("PREVIEW", struct.pack("<3I", width, DPI, height) + pixels, 16 * wide)


def _layers(job: PrintData, first: int) -> bytes:
    places = accumulate(job.sizes, initial=first)
    how = job.resin.whole_lift, job.resin.lift_speed / 60
    return b"".join(
        _LAYER.pack(place, size, *how, float(exposure), float(height))
        for place, size, exposure, height in zip(places, job.sizes, job.exposures, job.heights, strict=False)
    )


def _motion(job: PrintData) -> bytes:
    """Version 516: motion in two steps, of bottom layers and of others: way, speed up and speed down of each.

    The way back has the same steps.
    """
    resin = job.resin
    last = (resin.retract_speed_2 if resin.retract_2 else resin.retract_speed) / 60
    first = resin.lift, resin.lift_speed / 60, last
    then = resin.lift_2, resin.lift_speed_2 / 60, resin.retract_speed / 60
    if not resin.lift_2:
        first, then = (resin.lift / 2, *first[1:]), (resin.lift / 2, first[1], then[2])
    steps = struct.pack("<I6f", 2, *first, *then)
    return b"EXTRA".ljust(12, b"\0") + struct.pack("<I", 24) + steps + steps


def _machine(job: PrintData) -> bytes:
    size, name = (*job.printer.screen, job.printer.height), job.title
    contents = _MACHINE.pack(name[:95], b"pw0Img", *size, 516, BOARD)
    return _section("MACHINE", contents, 16)


ENDINGS = "pwmx pwmo pwms pmsq pwma pwmb pmx2 pm3 pm3m pm3r dlp dl2p pw0 pwx"
"""Extensions, one for each model."""

FORMATS = (
    pixel_format(
        "pwmx",
        Encoding.RLE4,
        _assemble,
        most=ADDRESSED,
        endings=tuple(f".{ending}" for ending in ENDINGS.split()),
    ),
)
