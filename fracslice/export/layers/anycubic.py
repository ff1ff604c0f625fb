""".pwmx and its family, of Anycubic's Photon Workshop, versions 1, 516 and 517.

All numbers are little-endian; a section is a name, a length and its contents. Pixels have 4 bits; each layer
has its own height and exposure. PrusaSlicer writes the same layout since version 2.5; UVtools describes
version 517.
"""

from __future__ import annotations

import struct
from itertools import accumulate
from typing import BinaryIO

from ..._slices import Encoding
from ...version import __version__
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
_MACHINE = struct.Struct("<96s16s2I3f2I")
_SOFTWARE = struct.Struct("<32sI32s64s32s")
ADVANCED = struct.pack("<I2HI", 0, 0, 0, 0)
"""Version 517: advanced mode, grey, blur and kind of resin, behind the settings."""


def _assemble(job: PrintData, file: BinaryIO) -> None:
    file.write(_before_pictures(job))
    file.writelines(job)


def _before_pictures(job: PrintData) -> bytes:
    """All sections before the pictures, after their offsets."""
    version = job.printer.version if job.printer.version in (516, 517) else 1
    wide, newest = version >= 516, version == 517
    header = _section("HEADER", _settings(job) + ADVANCED * newest) + bytes(4 * (version == 516))
    preview = _preview(job, wide)
    table = _section("LAYERDEF", bytes(4 + _LAYER.size * job.layers))
    extra, machine = (_motion(job), _machine(job, version)) if wide else (b"", b"")
    software, model = (_software(), _model(job)) if newest else (b"", b"")
    palette = struct.pack("<7I", *PALETTE) if wide else b""
    begin = 12 + 4 * {1: 9, 516: 10, 517: 11}[version]
    lengths = [begin, *map(len, (header, preview, palette, table, extra, machine, software, model))]
    at_header, at_preview, at_palette, at_table, *others = accumulate(lengths)
    at_extra, at_machine, at_software, at_model, pictures = others
    count = {1: 4, 516: 8, 517: 9}[version]
    offsets = [version, count, at_header, at_software * newest, at_preview, at_palette * wide, at_table]
    offsets += [at_extra, at_machine, pictures] if wide else [0, pictures]
    offsets += [at_model] * newest
    table = _section("LAYERDEF", struct.pack("<I", job.layers) + _layers(job, pictures))
    intro = b"ANYCUBIC".ljust(12, b"\0") + struct.pack(f"<{len(offsets)}I", *offsets)
    return intro + header + preview + palette + table + extra + machine + software + model


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
    return b"".join(
        _LAYER.pack(place, size, own.whole_lift, own.lift_speed / 60, float(exposure), float(height))
        for place, size, own, exposure, height in zip(
            places, job.sizes, job.resins, job.exposures, job.heights, strict=False
        )
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


def _machine(job: PrintData, version: int) -> bytes:
    size, name = (*job.printer.screen, job.printer.height), job.title
    levels = (16, 7) if version == 517 else (0, 0)
    contents = _MACHINE.pack(name[:95], b"pw0Img", *levels, *size, version, BOARD)
    return _section("MACHINE", contents, 16)


def _software() -> bytes:
    """Version 517: the program, its version, and two texts on its machine, which stay empty."""
    return _SOFTWARE.pack(b"fracslice", _SOFTWARE.size, __version__.encode(), b"", b"")


def _model(job: PrintData) -> bytes:
    """Version 517: extent of the object from the middle of the bed, mm; no supports."""
    x, y, _ = job.run.stack.size
    contents = struct.pack("<6fIf", -x / 2, -y / 2, 0, x / 2, y / 2, float(job.tops[-1]), 0, 0)
    return _section("MODEL", contents, 16)


ENDINGS = "pwmx pwmo pwms pmsq pwma pwmb pmx2 pm3 pm3m pm3r pm3n pm4n pm5 dlp dl2p pw0 pwx"
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
