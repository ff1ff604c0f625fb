"""Sizes, parts and times of pictures, as types of options."""

from __future__ import annotations

import re

from .value_types import Parsed

UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def read_pixels(text: str) -> tuple[int, int]:
    """Parse a size such as 1280x720 into pixels across and down."""
    match = re.fullmatch(r"\s*(\d{1,5})\s*x\s*(\d{1,5})\s*", text)
    if not match or not all(1 <= int(n) <= 32768 for n in match.groups()):
        raise ValueError("pixels across and down, such as 1280x720, from 1 to 32768")
    return int(match[1]), int(match[2])


def read_part(text: str) -> tuple[int, ...]:
    """Parse a part of a picture such as 100,50,640,480: left, top, width and height."""
    match = re.fullmatch(r"\s*(\d{1,5})" + 3 * r"\s*,\s*(\d{1,5})" + r"\s*", text)
    if not match:
        raise ValueError("left, top, width and height, such as 100,50,640,480")
    return tuple(map(int, match.groups()))


def read_duration(text: str) -> float:
    """Parse a time such as 10s into seconds."""
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(s|min|h)?\s*", text)
    if not match or not 0 < float(match[1]) < 1e6:
        raise ValueError("a time above zero, such as 10s, 2min or 1h")
    return float(match[1]) * UNITS[match[2] or "s"]


PIXELS, PART = Parsed(read_pixels, "WxH"), Parsed(read_part, "X,Y,W,H")
DURATION = Parsed(read_duration, "TIME")
