"""Objects to print that show what a printer and a resin do: fine details, fits, the foot of bottom layers.

All lie flat on z = 0; lengths are mm. Numbers are engraved with segments, as on a display.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ..errors import SceneError
from ..formulas import Node, box, cylinder, difference, transform, union
from .model import Scene, scene

SEGMENTS = {
    "0": "abcdef",
    "1": "bc",
    "2": "abged",
    "3": "abgcd",
    "4": "fgbc",
    "5": "afgcd",
    "6": "afgedc",
    "7": "abc",
    "8": "abcdefg",
    "9": "abcdfg",
    "-": "g",
    ".": ".",
}
"""Segments of a display that show a sign: a to f clockwise from the top, g in the middle."""

HEIGHT, STROKE, DEPTH = 2.2, 0.4, 0.5
"""Height of engraved numbers, width of their lines, and depth."""

PLATE = 2.0
"""Thickness of plates."""

PITCH = 8.0
"""Distance of the details of neighbouring sizes."""

LONGEST = 12
"""Most signs of a label, and most sizes of an object."""

FINEST, LARGEST = 0.02, 3.0
"""Limits of a size."""


def bars(text: str, height: float, stroke: float) -> Iterator[tuple[float, float, float, float]]:
    """Middles along x and y and sizes of the lines of a number, centred.

    `height`: between the middles of its lowest and highest lines; `stroke`: width of lines.
    """
    wide = height / 2
    widths = [stroke if sign == "." else wide for sign in text]
    left = -(sum(widths) + 2 * stroke * (len(text) - 1)) / 2
    for sign, width in zip(text, widths, strict=True):
        for across, along, dx, dy in map(_segment, SEGMENTS[sign]):
            sides = across * width + stroke, along * wide + stroke
            yield (left + width / 2 + dx * width, dy * wide, *sides)
        left += width + 2 * stroke


def number(text: str, x: float, y: float, top: float) -> Node:
    """Number to cut out of a face, centred at x and y, as deep as `DEPTH` below `top`."""
    return union(
        *(
            transform(box(size=(across, along, 2 * DEPTH)), translate=(x + u, y + v, top))
            for u, v, across, along in bars(text, HEIGHT, STROKE)
        )
    )


def _segment(name: str) -> tuple[float, float, float, float]:
    """Extent along x and y of a segment, and its middle, in widths and half heights of a sign."""
    if name == ".":
        return 0.0, 0.0, 0.0, -1.0
    x, y = {"a": (0, 1), "g": (0, 0), "d": (0, -1), "b": (1, 1), "c": (1, -1), "f": (-1, 1), "e": (-1, -1)}[
        name
    ]
    return (1.0, 0.0, 0.0, float(y)) if name in "agd" else (0.0, 1.0, x / 2, y / 2)


def _block(x: float, y: float, z: float, *size: float) -> Node:
    """Box from z upwards, centred at x and y."""
    return transform(box(size=size), translate=(x, y, z + size[2] / 2))


def _rod(x: float, y: float, z: float, across: float, height: float) -> Node:
    """Upright cylinder from z upwards."""
    return transform(cylinder(radius=across / 2, height=height), translate=(x, y, z + height / 2))


def _columns(sizes: Sequence[float]) -> Iterator[tuple[float, float]]:
    """Each size and its x."""
    for k, size in enumerate(sizes):
        yield size, PITCH * (k - (len(sizes) - 1) / 2)


def _plate(sizes: Sequence[float], depth: float) -> Node:
    return _block(0, 0, 0, PITCH * len(sizes) + 2, depth, PLATE)


def walls(sizes: Sequence[float], label: str) -> Node:
    """Walls, pins, slots and holes of several sizes on a plate."""
    added, cut = [_plate(sizes, 36.0)], list[Node]()
    for size, x in _columns(sizes):
        added += [_block(x, 13, PLATE, size, 6, 6), _rod(x, 6, PLATE, size, 4), _block(x, -1, PLATE, 5, 6, 4)]
        cut += [_block(x, -1, PLATE, size, 7, 5), _rod(x, -8, -1, size, PLATE + 2)]
        cut.append(number(f"{size:g}", x, -13, PLATE))
    return difference(union(*added), *cut, *_labelled(label, 0, -16.2, PLATE))


def tolerance(sizes: Sequence[float], label: str) -> Node:
    """A bar with holes, wider than 6 mm by each size, and a peg of 6 mm in front of it.

    A groove lets air into each hole, which the printer's plate would close.
    """
    bar = _block(0, 0, 0, 11 * len(sizes) + 2, 18, 5)
    cut = list[Node]()
    for k, size in enumerate(sizes):
        x = 11 * (k - (len(sizes) - 1) / 2)
        cut += [_rod(x, 3, -1, 6 + size, 7), _block(x, 6.5, -1, 2, 7, 2), number(f"{size:g}", x, -4, 5)]
    peg = union(_block(0, -17, 0, 12, 8, 3), _rod(0, -17, 2, 6, 9))
    return union(difference(bar, *cut, *_labelled(label, 0, -7.5, 5)), peg)


def elephant_foot(sizes: Sequence[float], label: str) -> Node:
    """Blocks apart by each size, from the plate of the printer up, on a bridge, and a cube of 15 mm."""
    parts = [_cut(_block(0, 18, 0, 15, 15, 10), _labelled(label, 0, 18, 10))]
    for k, size in enumerate(sizes):
        x = 14 * (k - (len(sizes) - 1) / 2)
        slit, sign = _block(x, 0, -1, size, 12, 4), number(f"{size:g}", x, 0, 6)
        parts.append(difference(_block(x, 0, 0, 12, 10, 6), slit, sign))
    return union(*parts)


def exposure(sizes: Sequence[float], label: str) -> Node:
    """A chip of pins and holes of several sizes, and squares that meet at a corner."""
    added, cut = [_plate(sizes, 24.0)], list[Node]()
    for size, x in _columns(sizes):
        added += [
            _rod(x, 8, PLATE, size, 2),
            _block(x - 1, -5, PLATE, 2, 2, 1),
            _block(x + 1, -3, PLATE, 2, 2, 1),
        ]
        cut += [_rod(x, 3, -1, size, PLATE + 2), number(f"{size:g}", x, -9, PLATE)]
    tab = _block(0, -15, 0, 16, 8, PLATE)
    return difference(union(*added, tab), *cut, *_labelled(label, 0, -15, PLATE))


def depth(sizes: Sequence[float], label: str) -> Node:
    """Bridges of several thicknesses, 6 mm long, which grow downwards by the light that passes them."""
    wide = PITCH * len(sizes) + 2
    walls = [_block(0, y, PLATE, wide, 2, 2) for y in (5, 13)]
    added, cut = [_plate(sizes, 30.0), *walls], list[Node]()
    for size, x in _columns(sizes):
        added.append(_block(x, 9, PLATE + 2, 5, 10, size))
        cut.append(number(f"{size:g}", x, -5, PLATE))
    return difference(union(*added), *cut, *_labelled(label, 0, -11, PLATE))


def _cut(solid: Node, cuts: Sequence[Node]) -> Node:
    return difference(solid, *cuts) if cuts else solid


def _labelled(label: str, x: float, y: float, top: float) -> list[Node]:
    return [number(label, x, y, top)] if label else []


OBJECTS: dict[str, tuple[Callable[[Sequence[float], str], Node], tuple[float, ...]]] = {
    "depth": (depth, (1.0, 1.5, 2.0)),
    "elephant-foot": (elephant_foot, (0.1, 0.2, 0.3, 0.4, 0.6)),
    "exposure": (exposure, (0.2, 0.3, 0.4, 0.5, 0.6, 0.8)),
    "tolerance": (tolerance, (0.05, 0.1, 0.15, 0.2, 0.3, 0.4)),
    "walls": (walls, (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)),
}
"""Objects by name, and their usual sizes."""


def calibration(kind: str, sizes: Sequence[float] = (), label: str = "") -> Scene:
    """Scene of an object of `OBJECTS`.

    `sizes` in mm; by default the usual ones. `label`: digits, points and minus signs to engrave.

    Raises
    ------
    SceneError
        For a size or a label that it cannot have.
    """
    made, usual = OBJECTS[kind]
    chosen = tuple(sizes) or usual
    if len(chosen) > LONGEST or not all(FINEST <= size <= LARGEST for size in chosen):
        limits = f"1 to {LONGEST} sizes of {FINEST:g} to {LARGEST:g} mm"
        raise SceneError(f"sizes {','.join(f'{size:g}' for size in chosen)}: expected {limits}")
    if len(label) > LONGEST or not set(label) <= SEGMENTS.keys():
        raise SceneError(f"label {label!r}: expected at most {LONGEST} digits, points and minus signs")
    return scene(made(chosen, label), unit=1.0, name=kind)
