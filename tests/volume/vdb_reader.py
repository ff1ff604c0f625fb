"""A reader of OpenVDB files of one grid of floats, of version 224, after the source of OpenVDB's `io`, to
judge files by something that is not OpenVDB. Blosc's blocks are of LZ4.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

SIDES = (32, 16, 8)
"""Children, or samples, of a node of each level along an axis."""
HEADER = 57
"""Bytes before the metadata: magic number, versions, a flag and the identifier."""


@dataclass(frozen=True)
class Samples:
    name: str
    metadata: dict[str, Any]
    background: float
    matrix: np.ndarray  # [4, 4], of row vectors
    at: np.ndarray  # [n, 3] indices of all active samples
    values: np.ndarray  # [n]


class Reader:
    def __init__(self, data: bytes) -> None:
        self.data, self.place, self.half = data, 0, False

    def take(self, count: int) -> bytes:
        part = self.data[self.place : self.place + count]
        assert len(part) == count
        self.place += count
        return part

    def unpack(self, form: str) -> Any:
        values = struct.unpack("<" + form, self.take(struct.calcsize("<" + form)))
        return values if len(values) > 1 else values[0]

    def text(self) -> str:
        return self.take(self.unpack("I")).decode()

    def metadata(self) -> dict[str, Any]:
        made: dict[str, Any] = {}
        for _ in range(self.unpack("I")):
            name, kind = self.text(), self.text()
            data = self.take(self.unpack("I"))
            forms = {"bool": "?", "int64": "<q", "int32": "<i", "vec3i": "<3i", "float": "<f"}
            if kind in forms:
                values = struct.unpack(forms[kind], data)
                made[name] = values if len(values) > 1 else values[0]
            elif kind == "string":
                made[name] = data.decode()
        return made

    def mask(self, side: int) -> np.ndarray:
        return np.unpackbits(np.frombuffer(self.take(side**3 // 8), np.uint8), bitorder="little").astype(bool)

    def numbers(self, on: np.ndarray, background: float) -> np.ndarray:
        """Values of a node: those that are on, and up to two others."""
        kind, one, two = self.unpack("B"), background, -background
        one = -background if kind == 1 else self.unpack("f") if kind in (2, 4, 5) else one
        two = self.unpack("f") if kind == 5 else two
        chosen = self.mask(round(len(on) ** (1 / 3))) if kind in (3, 4, 5) else np.zeros(len(on), bool)
        if kind == 4:
            one, two = background, one
        count = len(on) if kind == 6 else int(on.sum())
        size = 2 if self.half else 4
        packed = self.unpack("q") if count or not self.half else 0
        raw = self.take(-packed) if packed <= 0 else blosc(self.take(packed))
        found = np.frombuffer(raw, np.float16 if self.half else np.float32)
        assert len(raw) == size * count
        if kind == 6:
            return found.astype(np.float64)
        values = np.where(chosen, two, one).astype(np.float64)
        values[on] = found
        return values


def blosc(data: bytes) -> bytes:
    """Unpack what Blosc 1 packed with LZ4."""
    flags, (whole, block, _) = data[2], struct.unpack_from("<III", data, 4)
    if flags & 2:
        return data[16 : 16 + whole]
    assert flags >> 5 == 1 and not flags & 4
    starts = struct.unpack_from(f"<{-(-whole // block)}I", data, 16)
    out = b""
    split = 1 if flags & 16 else data[3]
    for k, start in enumerate(starts):
        size = min(block, whole - k * block)
        parts = split if size == block and size % split == 0 else 1
        streams = []
        for _ in range(parts):
            (packed,) = struct.unpack_from("<i", data, start)
            part = data[start + 4 : start + 4 + packed]
            streams.append(part if packed == size // parts else lz4(part))
            start += 4 + packed
        made = b"".join(streams)
        assert len(made) == size
        mixed = size // data[3] * data[3] if flags & 1 else 0
        out += np.frombuffer(made[:mixed], np.uint8).reshape(data[3], -1).T.tobytes() + made[mixed:]
    return out


def lz4(data: bytes) -> bytes:
    """Unpack a block of LZ4."""
    out, k = bytearray(), 0

    def more(length: int) -> int:
        nonlocal k
        while length >= 15:
            length, k = length + data[k], k + 1
            if data[k - 1] < 255:
                break
        return length

    while True:
        token, k = data[k], k + 1
        literal = more(token >> 4)
        out += data[k : k + literal]
        k += literal
        if k >= len(data):
            return bytes(out)
        offset, k = data[k] | data[k + 1] << 8, k + 2
        for _ in range(more(token & 15) + 4):
            out.append(out[-offset])


def read_vdb(path: Path) -> Samples:
    read = Reader(path.read_bytes())
    assert read.unpack("q") == 0x56444220 and read.unpack("I") == 224
    read.place = HEADER
    read.metadata()
    assert read.unpack("I") == 1
    name, kind, _ = read.text(), read.text(), read.text()
    read.half = kind.endswith("_HalfFloat")
    grid, blocks, end = read.unpack("3q")
    assert end == len(read.data) and read.place == grid
    read.unpack("I")  # compression
    metadata = read.metadata()
    assert read.text() == "UniformScaleTranslateMap"
    translation, scale = np.array(read.unpack("3d")), np.array(read.unpack("3d"))
    read.take(4 * 24)
    matrix = np.diag([*scale, 1.0])
    matrix[3, :3] = translation
    assert read.unpack("I") == 1
    background, tiles, children = read.unpack("f"), *read.unpack("2I")
    read.take(13 * tiles + 4 * tiles)
    at, values, leaves = [], [], []

    def node(origin: np.ndarray, level: int) -> None:
        side = SIDES[level]
        if side == 8:
            leaves.append((origin, read.mask(side)))
            return
        child, on = read.mask(side), read.mask(side)
        found = read.numbers(on, background)
        step = 128 if level == 0 else 8
        place = np.indices((side,) * 3).reshape(3, -1).T
        for n in np.flatnonzero(on):
            inner = np.indices((step,) * 3).reshape(3, -1).T
            at.append(origin + step * place[n] + inner)
            values.append(np.full(len(inner), found[n]))
        for n in np.flatnonzero(child):
            node(origin + step * place[n], level + 1)

    for _ in range(children):
        node(np.array(read.unpack("3i")), 0)
    assert read.place == blocks
    place = np.indices((8, 8, 8)).reshape(3, -1).T
    for origin, on in leaves:
        assert (read.mask(8) == on).all()
        values.append(read.numbers(on, background)[on])
        at.append(origin + place[on])
    assert read.place == end
    return Samples(name, metadata, background, matrix, np.concatenate(at), np.concatenate(values))


def turned(data: bytes, matrix: np.ndarray) -> bytes:
    """A file with another transform: a matrix [4, 4] of row vectors."""
    old, new = struct.pack("<I", 24) + b"UniformScaleTranslateMap", struct.pack("<I", 9) + b"AffineMap"
    first = data.index(old)
    rest = data[first + len(old) + 6 * 24 :]
    new += matrix.astype("<f8").tobytes()
    read = Reader(data)
    read.place = HEADER
    read.metadata(), read.unpack("I"), read.text(), read.text(), read.text()
    grid, *ends = read.unpack("3q")
    shift = len(new) - len(old) - 6 * 24
    offsets = struct.pack("<3q", grid, *(end + shift for end in ends))
    return data[: read.place - 24] + offsets + data[read.place : first] + new + rest


def joined(one: bytes, other: bytes) -> bytes:
    """A file with the grids of two."""
    read = Reader(other)
    read.place = HEADER
    read.metadata()
    count = read.place
    read.unpack("I"), read.text(), read.text(), read.text()
    shift = len(one) - count - 4
    offsets = struct.pack("<3q", *(place + shift for place in read.unpack("3q")))
    body = other[count + 4 : read.place - 24] + offsets + other[read.place :]
    return one[:count] + struct.pack("<I", 2) + one[count + 4 :] + body
