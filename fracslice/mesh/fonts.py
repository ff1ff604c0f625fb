"""Texts in a font as fills: glyphs are chosen and placed by HarfBuzz, which knows ligatures and scripts."""

from __future__ import annotations

import re
from typing import Any

from ..common.files import open_regular
from ..common.messages import lacking
from ..errors import MeshError
from .svg import Curve, Fill, quadratic

LARGEST, MOST_CHARACTERS = 64 << 20, 1000
"""Most bytes of a font, and characters of a text."""

_VARIATION = re.compile(r"\s*([\x21-\x7e]{4})\s*=\s*([-+]?\d+\.?\d*)\s*")


def lettered(file: str, text: str, variations: str) -> list[Fill]:
    """Fills of a text in one line, in ems, from the origin along the base line.

    Raises
    ------
    MeshError
        If it is no font, or has no glyph for a character.
    """
    if reason := lacking("uharfbuzz", "texts need") or lacking("shapely", "texts need"):
        raise MeshError(reason)
    import uharfbuzz as hb

    if not 0 < len(text) <= MOST_CHARACTERS:
        raise MeshError(f"expected a text of 1 to {MOST_CHARACTERS} characters, found {len(text)}")
    font, shaped = _font(file, variations), hb.Buffer()
    shaped.add_str(text)
    shaped.guess_segment_properties()
    hb.shape(font, shaped)
    pen, x, y = _Pen(font.face.upem), 0, 0
    for glyph, place in zip(shaped.glyph_infos, shaped.glyph_positions, strict=True):
        if glyph.codepoint == 0:
            raise MeshError(f"has no glyph for {text[glyph.cluster]!r}")
        pen.begin(complex(x + place.x_offset, y + place.y_offset))
        font.draw_glyph(glyph.codepoint, pen.functions, pen)
        x, y = x + place.x_advance, y + place.y_advance
    if not pen.fills:
        raise MeshError(f"has nothing to draw for {text!r:.40}")
    return pen.fills


def _font(file: str, variations: str) -> Any:
    """Font of a file, at a place on its axes."""
    import uharfbuzz as hb

    with open_regular(file) as opened:
        data = opened.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise MeshError(f"expected a font of at most {LARGEST >> 20} MB")
    face = hb.Face(hb.Blob(data))
    if not face.glyph_count:
        raise MeshError("not a font that can be read")
    font, axes = hb.Font(face), {axis.tag: axis for axis in face.axis_infos}
    chosen = {}
    for part in filter(None, variations.split(",")):
        match = _VARIATION.fullmatch(part)
        axis = axes.get(match[1]) if match else None
        if not match or axis is None or not axis.min_value <= float(match[2]) <= axis.max_value:
            ranges = (f"{a.tag}={a.min_value:g}..{a.max_value:g}" for a in axes.values())
            raise MeshError(
                f'variations="{variations:.40}": expected {", ".join(ranges) or "none, it has no axes"}'
            )
        chosen[match[1]] = float(match[2])
    font.set_variations(chosen)
    return font


class _Pen:
    """Takes the outlines of glyphs."""

    def __init__(self, em: int) -> None:
        import uharfbuzz as hb

        self.em, self.origin, self.at = em, 0j, 0j
        self.fills: list[Fill] = []
        self.curves: list[Curve] = []
        self.rings: list[tuple[complex, list[Curve]]] = []
        self.functions = hb.DrawFuncs()
        self.functions.set_move_to_func(lambda x, y, pen: pen.move(x, y))
        self.functions.set_line_to_func(lambda x, y, pen: pen.add(x, y))
        self.functions.set_quadratic_to_func(lambda a, b, x, y, pen: pen.quadratic(a, b, x, y))
        self.functions.set_cubic_to_func(lambda *numbers: numbers[-1].add(*numbers[:-1]))
        self.functions.set_close_path_func(lambda pen: None)

    def begin(self, origin: complex) -> None:
        """Begin a glyph."""
        self.origin, self.rings = origin, []

    def points(self, *numbers: float) -> list[complex]:
        """Points of a glyph, in ems."""
        return [
            (self.origin + complex(x, y)) / self.em for x, y in zip(numbers[::2], numbers[1::2], strict=True)
        ]

    def move(self, x: float, y: float) -> None:
        """Begin a ring."""
        if not self.rings:
            self.fills.append(Fill(self.rings, True))
        (self.at,), self.curves = self.points(x, y), []
        self.rings.append((self.at, self.curves))

    def add(self, *numbers: float) -> None:
        """Add a line or a cubic."""
        self.curves.append(tuple(points := self.points(*numbers)))
        self.at = points[-1]

    def quadratic(self, *numbers: float) -> None:
        """Add a quadratic, as a cubic."""
        middle, end = self.points(*numbers)
        self.curves.append(quadratic(self.at, middle, end))
        self.at = end
