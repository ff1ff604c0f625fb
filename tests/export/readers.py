"""Readers of print files, written from the formats' descriptions alone; they refuse a damaged file.

Each gives the picture, the height above the platform and the exposure of every layer, and the previews.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from PIL import Image

from tests.export import decoders


class DamagedError(Exception):
    """The file is not whole."""


@dataclass
class Read:
    pictures: list[np.ndarray]
    tops: list[float]
    exposures: list[float]
    previews: list[np.ndarray] = field(default_factory=list)
    about: dict[str, Any] = field(default_factory=dict)
    lifts: list[tuple[float, ...]] = field(default_factory=list)  # and speeds, of layers, mm and mm/min


class Bytes:
    """A file read from front to back, in one byte order."""

    def __init__(self, data: bytes, order: str) -> None:
        self.data, self.order, self.at = data, order, 0

    def raw(self, size: int) -> bytes:
        if self.at + size > len(self.data):
            raise DamagedError
        self.at += size
        return self.data[self.at - size : self.at]

    def get(self, kinds: str) -> tuple[Any, ...]:
        return struct.unpack(self.order + kinds, self.raw(struct.calcsize(self.order + kinds)))

    def expect(self, data: bytes) -> None:
        if self.raw(len(data)) != data:
            raise DamagedError


def colours(words: np.ndarray) -> np.ndarray:
    """Pictures of 16 bits per pixel as 5 bits per channel."""
    return np.stack([words >> 11 & 31, words >> 6 & 31, words & 31], -1)


def goo(data: bytes) -> Read:
    """A .goo file: the layout of the crate goo 0.1.1."""
    file = Bytes(data, ">")
    file.expect(b"V3.0\x07\0\0\0DLP\0")
    texts = [file.raw(size).split(b"\0")[0].decode() for size in (32, 24, 24, 32, 32, 32)]
    file.get("3H")
    previews = []
    for side in (116, 290):
        previews.append(colours(np.frombuffer(file.raw(2 * side * side), ">u2").reshape(side, side)))
        file.expect(b"\r\n")
    layers, columns, rows, mirror_x, mirror_y = file.get("I2H2?")
    file.get("3f")
    thickness, exposure = file.get("2f")
    rests, _, motion = file.get("?8f")[2:8], file.get("I"), file.get("16f")
    file.get("2H")
    (each_layer,) = file.get("?")
    seconds, volume, weight, _ = file.get("I3f")
    file.raw(8)
    begin, grey, _ = file.get("I?H")
    assert each_layer and grey and begin == file.at == 195477
    about = {"volume": volume, "weight": weight, "texts": texts, "mirror": mirror_x}
    read = Read([], [], [], previews, about | {"rests": rests, "motion": motion, "layers": []})
    for _ in range(layers):
        _, _, top, seconds = file.get("H3f")
        read.about["layers"].append(file.get("12f"))
        read.lifts.append(read.about["layers"][-1][4:6])
        file.get("H")
        file.expect(b"\r\n")
        (size,) = file.get("I")
        picture = file.raw(size)
        file.expect(b"\r\n")
        if picture[-1] != ~sum(picture[1:-1]) & 0xFF:
            raise DamagedError
        read.pictures.append(decoders.picture(decoders.goo(picture), (rows, columns)))
        read.tops.append(top)
        read.exposures.append(seconds)
    file.expect(b"\0\0\0\x07\0\0\0DLP\0")
    return read


def ctb(data: bytes) -> Read:
    """catibo, "CTB/CBDDLP file formats"; version 3 by UVtools."""
    file = Bytes(data, "<")
    magic, version = file.get("2I")
    if magic not in (0x12FD0086, 0x12FD0019):
        raise DamagedError
    file.get("3f")
    file.expect(bytes(8))
    height, thickness, exposure, bottom, off, bottoms, columns, rows = file.get("5f3I")
    large, table, layers, small, seconds, mirror, motion, motion_size = file.get("8I")
    sets, _, _, key, slicer, slicer_size = file.get("I2H3I")
    assert key == 0 and motion_size == 60 and slicer_size == 76
    previews = []
    for at in (large, small):
        file.at = at
        width, tall, begin, size = file.get("4I")
        file.at = begin
        previews.append(_rle15(file.raw(size)).reshape(tall, width, 3))
    file.at = motion
    volume, weight, _ = file.get("5f3f")[5:]
    file.at = slicer + 28
    name_at, name_size, mode, _, levels = file.get("5I")
    assert mode == {0x12FD0019: 8, 2: 0xF, 3: 0x2000000F}[magic if magic == 0x12FD0019 else version]
    file.at = name_at
    about = {"volume": volume, "name": file.raw(name_size).decode(), "version": version, "height": height}
    read = Read([], [], [], previews, about)
    file.at = table
    entries = [file.get("3f6I") for _ in range(layers * sets)]
    for k in range(layers):
        level = np.zeros((rows, columns), np.int32)
        for number in range(sets):
            top, seconds, _, begin, size, _, extra, _, _ = entries[number * layers + k]
            file.at = begin - extra
            if extra:
                assert extra == 84
                assert file.get("3f6I") == entries[number * layers + k]
                length, *moved = file.get("I11f")
                assert length == extra + size
                read.lifts.append((moved[0], moved[1]))
            data = file.raw(size)
            decode = decoders.rle7 if magic == 0x12FD0086 else decoders.rle1
            try:
                level += decoders.picture(decode(data), (rows, columns))
            except (AssertionError, IndexError):
                raise DamagedError from None
        read.pictures.append(level)
        read.tops.append(top)
        read.exposures.append(seconds)
    return read


def cxdlp(data: bytes) -> Read:
    """UVtools' description of version 4 of Creality's files."""
    checksum = 0
    for byte in data[:-4]:
        checksum = CRC_TABLE[(checksum ^ byte) & 255] ^ checksum >> 8
    if struct.pack(">I", checksum) != data[-4:]:
        raise DamagedError
    file = Bytes(data, ">")
    assert file.get("I9sH")[1:] == (b"CXSW3DV2\0", 4)
    (length,) = file.get("I")
    about: dict[str, Any] = {"name": file.raw(length).rstrip(b"\0").decode()}
    file.order = "<"
    columns, rows, *_, tall, thickness = file.get("2H5f")
    bottoms, small, table, layers, large, seconds, mirror, motion, motion_size, levels = file.get("10I")
    light, bottom_light, key, more, more_size = file.get("2H3I")
    assert (light, bottom_light, key, motion_size, more_size) == (255, 255, 0, 68, 76)
    previews = []
    for at in (small, large):
        file.at = at
        width, height, begin, size = file.get("4I")
        file.at = begin
        previews.append(_rle15(file.raw(size)).reshape(height, width, 3))
    file.at = motion
    about["volume"] = file.get("10f")[5]
    file.at = table
    read = Read([], [], [], previews, about | {"height": tall})
    entries = [file.get("3f7I") for _ in range(layers)]
    assert file.at == entries[0][3]
    for top, exposure, _, begin, size, *_ in entries:
        file.at = begin
        read.about["motion"] = file.get("11f")
        read.lifts.append(read.about["motion"][:2])
        read.pictures.append(decoders.picture(decoders.rle7(file.raw(size - 44)), (rows, columns)))
        read.tops.append(top)
        read.exposures.append(exposure)
    return read


CRC_TABLE = []
for number in range(256):
    for _ in range(8):
        number = number >> 1 ^ (0xEDB88320 if number & 1 else 0)
    CRC_TABLE.append(number)


def _rle15(data: bytes) -> np.ndarray:
    words, pixels = np.frombuffer(data, "<u2").tolist(), []
    at = 0
    while at < len(words):
        length = 1
        if words[at] & 0x20:
            assert words[at + 1] >> 12 == 3
            length += words[at + 1] & 0xFFF
        pixels += [words[at]] * length
        at += 2 if words[at] & 0x20 else 1
    return colours(np.array(pixels))


def photon(data: bytes) -> Read:
    """Anycubic's sections, as PrusaSlicer and UVtools describe them."""
    file = Bytes(data, "<")
    file.expect(b"ANYCUBIC\0\0\0\0")
    version, count = file.get("2I")
    assert (version, count) in ((1, 4), (515, 4), (516, 8), (517, 9))
    header, software, preview, _, table = file.get("5I")
    images = file.get("3I" if version >= 516 else "2I")[-1]
    model = file.get("I")[0] if version == 517 else 0
    file.at = header
    file.expect(b"HEADER\0\0\0\0\0\0")
    assert file.get("I") == (92 if version == 517 else 80,)
    um, thickness, exposure, _, bottom, bottoms, lift, up, down, volume = file.get("10f")
    _, columns, rows, weight, _, currency, each_layer, seconds = file.get("3I2f3I")
    assert each_layer == 1 and currency == ord("$")
    file.at = preview
    file.expect(b"PREVIEW\0\0\0\0\0")
    _, width, dpi, tall = file.get("4I")
    picture = colours(np.frombuffer(file.raw(2 * width * tall), "<u2").reshape(tall, width))
    read = Read([], [], [], [picture], {"volume": volume, "um": um})
    file.at = table
    file.expect(b"LAYERDEF\0\0\0\0")
    size, layers = file.get("2I")
    assert size == 4 + 32 * layers
    entries = [file.get("2I4f2I") for _ in range(layers)]
    if version >= 516:
        file.expect(b"EXTRA\0\0\0\0\0\0\0")
        file.get("2I6fI6f")
        file.expect(b"MACHINE\0\0\0\0\0")
        assert file.get("I") == (156,)
        file.raw(140)
    if version == 517:
        assert file.at == software
        assert file.get("32sI")[1] == 164
        file.raw(128)
        assert file.at == model
        file.expect(b"MODEL\0\0\0\0\0\0\0")
        length, *read.about["box"], supports, _ = file.get("I6fIf")
        assert (length, supports) == (48, 0)
    assert entries[0][0] == images == file.at
    top = 0.0
    for begin, size, lift, speed, seconds, height, _, _ in entries:
        file.at, top = begin, top + height
        read.lifts.append((lift, 60 * speed))
        try:
            read.pictures.append(decoders.picture(decoders.rle4(file.raw(size)), (rows, columns)))
        except (AssertionError, IndexError):
            raise DamagedError from None
        read.tops.append(top)
        read.exposures.append(seconds)
    return read


def nanodlp(data: bytes) -> Read:
    """docs.nanodlp.com/manual/format."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if archive.testzip() is not None:
                raise DamagedError
            plate, info = (json.loads(archive.read(f"{name}.json")) for name in ("plate", "info"))
            pictures = []
            for k in range(plate["LayersCount"]):
                with Image.open(io.BytesIO(archive.read(f"{k + 1}.png"))) as image:
                    pictures.append(np.asarray(image))
            with Image.open(io.BytesIO(archive.read("3d.png"))) as image:
                preview = np.asarray(image) >> 3
    except zipfile.BadZipFile:
        raise DamagedError from None
    tops = np.cumsum([layer["LayerHeight"] for layer in info]) / 1000
    about = {"volume": plate["TotalSolidArea"] / 1e6}
    return Read(pictures, tops.tolist(), plate["CureTimes"], [preview], about)


def pwsz(data: bytes) -> Read:
    """UVtools' description, as far as it reads: AnycubicZipFile.cs."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if archive.testzip() is not None:
                raise DamagedError
            settings, layers, amounts = (
                json.loads(archive.read(name))
                for name in ("anycubic_photon_resins.pwsp", "layers_controller.conf", "print_info.json")
            )
            machine, resins = settings["machine_type"], settings["machine_extern"]
            (active,) = (
                one for one in resins["user_resins"] if one["property"]["name"] == resins["active_resins"][0]
            )
            shape = machine["res_y"], machine["res_x"]
            coded = [archive.read(f"layer_images/layer_{k}.pw0Img") for k in range(layers["count"])]
            scene = Bytes(archive.read("scene.slice"), "<")
            previews = []
            for k in range(3):
                with Image.open(io.BytesIO(archive.read(f"preview_images/preview_{k}.png"))) as image:
                    previews.append(np.asarray(image) >> 3)
    except zipfile.BadZipFile:
        raise DamagedError from None
    pictures = [decoders.picture(decoders.rle4(one), shape) for one in coded]
    assert scene.raw(16).rstrip(b"\0") == b"ANYCUBIC-PWSZ"
    scene.raw(64)
    assert scene.get("4IfI")[-1] == layers["count"]
    box = scene.get("6f")
    scene.raw(4 + 256)
    scene.expect(b"<---")
    extents = [scene.get("6fIf8I")[:8] for _ in range(*scene.get("I"))]
    scene.expect(b"--->")
    rows = layers["paras"]
    tops = np.cumsum([row["layer_thickness"] for row in rows]).tolist()
    about = {"volume": amounts["volume"], "resin": active, "box": box, "extents": extents}
    lifts = [(row["zup_height"], 60 * row["zup_speed"]) for row in rows]
    return Read(pictures, tops, [row["exposure_time"] for row in rows], previews, about, lifts)


def sl1(data: bytes) -> Read:
    """An archive of PrusaSlicer: config.ini, and pictures in the order of their names."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if archive.testzip() is not None:
                raise DamagedError
            config = dict(line.split(" = ") for line in archive.read("config.ini").decode().splitlines())
            pictures = []
            for name in sorted(n for n in archive.namelist() if n.startswith(config["jobDir"])):
                with Image.open(io.BytesIO(archive.read(name))) as image:
                    pictures.append(np.asarray(image))
            with Image.open(io.BytesIO(archive.read("thumbnail/thumbnail400x400.png"))) as image:
                preview = np.asarray(image) >> 3
    except zipfile.BadZipFile:
        raise DamagedError from None
    count, height = len(pictures), float(config["layerHeight"])
    bottoms, times = int(config["numFade"]), (float(config["expTimeFirst"]), float(config["expTime"]))
    exposures = np.interp(np.arange(count), [0, bottoms], times).tolist()
    return Read(pictures, (height * np.arange(1, count + 1)).tolist(), exposures, [preview])
