"""Sizes, parts and times of pictures, as options."""

from __future__ import annotations

import re

import click

SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def pixels(_: click.Context, __: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """Parse a size such as 1280x720 into pixels across and down."""
    if value is None:
        return None
    match = re.fullmatch(r"\s*(\d{1,5})\s*x\s*(\d{1,5})\s*", value)
    if not match or not all(1 <= int(n) <= 32768 for n in match.groups()):
        raise click.BadParameter(
            f"{value!r}: expected pixels across and down, such as 1280x720, from 1 to 32768"
        )
    return int(match[1]), int(match[2])


def part(_: click.Context, __: click.Parameter, value: str | None) -> tuple[int, int, int, int] | None:
    """Parse a part of a picture such as 100,50,640,480."""
    if value is None:
        return None
    match = re.fullmatch(r"\s*(\d{1,5})\s*,\s*(\d{1,5})\s*,\s*(\d{1,5})\s*,\s*(\d{1,5})\s*", value)
    if not match:
        raise click.BadParameter(f"{value!r}: expected left, top, width and height, such as 100,50,640,480")
    x, y, width, height = map(int, match.groups())
    return x, y, width, height


def duration(_: click.Context, __: click.Parameter, value: str | None) -> float | None:
    """Parse a time such as 10s into seconds."""
    if value is None:
        return None
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(s|min|h)?\s*", value)
    if not match or not 0 < float(match[1]) < 1e6:
        raise click.BadParameter(f"{value!r}: expected a time above zero, such as 10s, 2min or 1h")
    return float(match[1]) * SECONDS[match[2] or "s"]
