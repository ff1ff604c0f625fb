"""Texts in fonts: glyphs with holes, ligatures, scripts from the right, variable fonts, and refusals."""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import shapely
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.basePen import BasePen
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib import TTFont

from fracslice import make_mesh
from fracslice.errors import SceneError
from fracslice.fields.devices import reference
from fracslice.formulas import text
from fracslice.mesh import outlines
from fracslice.scene import read, reads, scene, to_xml
from tests.examples import FONT

pytestmark = pytest.mark.once


def squares(path: Path, kind: str = "static") -> str:
    """A font of 1000 units: A is two squares that overlap, B a square of 500 that grows to 700 by wght."""
    builder = FontBuilder(1000, isTTF=True)
    builder.setupGlyphOrder([".notdef", "space", "A", "B"])
    builder.setupCharacterMap({32: "space", 65: "A", 66: "B"})
    glyphs = {".notdef": [], "space": [], "A": [(0, 0, 400), (200, 200, 400)], "B": [(0, 0, 500)]}
    builder.setupGlyf({name: glyph(shapes) for name, shapes in glyphs.items()})
    builder.setupHorizontalMetrics(dict.fromkeys(glyphs, (300, 0)))
    builder.setupHorizontalHeader(ascent=800, descent=-200)
    builder.setupNameTable({"familyName": "Squares", "styleName": "Regular"})
    builder.setupOS2()
    builder.setupPost()
    if kind == "variable":
        from fontTools.ttLib.tables.TupleVariation import TupleVariation

        builder.setupFvar([("wght", 400, 400, 900, "Weight")], [])
        grown = [(0, 0), (200, 0), (200, 200), (0, 200), (0, 0), (0, 0), (0, 0), (0, 0)]
        builder.setupGvar({"B": [TupleVariation({"wght": (0, 1, 1)}, grown)]})
    builder.save(path)
    return str(path)


def glyph(shapes: list[tuple[int, int, int]]) -> object:
    pen = TTGlyphPen(None)
    for x, y, size in shapes:
        pen.moveTo((x, y))
        for corner in ((x + size, y), (x + size, y + size), (x, y + size)):
            pen.lineTo(corner)
        pen.closePath()
    return pen.glyph()


class Flat(BasePen):
    """Rings of glyphs, of curves in many pieces."""

    def __init__(self, glyphs: object, scale: float) -> None:
        super().__init__(glyphs)
        self.scale, self.rings = scale, []

    def _moveTo(self, point: tuple[float, float]) -> None:
        self.rings.append([point])

    def _lineTo(self, point: tuple[float, float]) -> None:
        self.rings[-1].append(point)

    def _curveToOne(self, a: tuple, b: tuple, c: tuple) -> None:
        t, start = np.linspace(0, 1, 200)[1:, None], np.array(self.rings[-1][-1])
        a, b, c = map(np.array, (a, b, c))
        points = (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * a + 3 * (1 - t) * t**2 * b + t**3 * c
        self.rings[-1].extend(map(tuple, points))

    def area(self) -> shapely.Geometry:
        polygons = [shapely.Polygon(np.array(ring) * self.scale) for ring in self.rings]
        total = polygons[0]
        for polygon in polygons[1:]:
            total = total ^ polygon
        return total


@pytest.mark.parametrize("letter", ["o", "8", "B", "i", "ä"])
def test_letters_have_the_distances_of_their_curves(letter: str) -> None:
    glyphs = TTFont(FONT).getGlyphSet()
    pen = Flat(glyphs, 10 / 2048)
    glyphs[TTFont(FONT).getBestCmap()[ord(letter)]].draw(pen)
    known, root = pen.area(), text(letter, FONT, size=10, depth=100, place="as is")
    low, high = np.reshape(known.bounds, (2, 2))
    rng = np.random.default_rng(3)
    points = rng.uniform(low - 2, high + 2, (10_000, 2))
    given = shapely.points(points)
    shapely.prepare(known)
    exact = shapely.distance(known.boundary, given) * np.where(shapely.contains(known, given), -1, 1)
    found = root.distance(np.insert(points, 2, 50, axis=1))
    assert np.abs(found - exact).max() < 10 * outlines.TOLERANCE + 1e-4
    space = np.insert(points, 2, rng.uniform(-2, 102, len(points)), axis=1).T
    assert np.abs(root.kernel().points(*space) - reference(root)(*space)).max() < 1e-5


def area(file: str, words: str, variations: str = "") -> shapely.Geometry:
    return outlines.area_of(outlines.lettered(file, words, variations), 1.0)


def test_glyphs_that_overlap_are_one_solid(tmp_path: Path) -> None:
    file = squares(tmp_path / "a.ttf")
    assert area(file, "A").area == pytest.approx(0.16 + 0.16 - 0.04)
    assert area(file, "BB").area == pytest.approx(0.5 * 0.8)  # each 0.3 em after the other
    inside = text("BB", file, size=10, depth=20).distance([(1.0, 0, 0), (-1.0, 0, 0), (0, 0, 0)])
    assert inside == pytest.approx(-2.5)
    made = make_mesh(text("AB", file, size=10, depth=4), resolution=65)
    assert made.volume == pytest.approx(400 * area(file, "AB").area, rel=1e-6) and made.is_watertight


def test_a_variable_font_is_drawn_at_a_place_on_its_axes(tmp_path: Path) -> None:
    file = squares(tmp_path / "a.ttf", "variable")
    for weight, side in ((400, 0.5), (650, 0.6), (900, 0.7)):
        assert area(file, "B", f"wght={weight}").area == pytest.approx(side**2, rel=1e-3)
    assert area(file, "B").area == pytest.approx(0.25)


def glyphs_of(words: str) -> int:
    return len(outlines.lettered(FONT, words, ""))


def test_ligatures_and_scripts_from_the_right() -> None:
    assert glyphs_of("fi") == 1 and glyphs_of("f i") == 2
    alef, beh = "\u0627", "\u0628"
    assert glyphs_of("\u0644" + alef) == 1  # lam-alef
    first, second = (area(FONT, letter).bounds for letter in (alef, beh))
    both = area(FONT, alef + beh).bounds
    assert both[0] == pytest.approx(second[0], abs=1e-6)  # the second is on the left
    assert both[2] > first[2] + 0.5


def test_a_blank_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="has nothing to draw for ' '"):
        text(" ", squares(tmp_path / "a.ttf")).bounds  # noqa: B018


def test_a_scene_keeps_the_text() -> None:
    made = scene(text("<o> & \"8'", FONT, depth=2), unit=1.0)
    assert reads(to_xml(made), files_outside=True) == made


def test_size_and_place(tmp_path: Path) -> None:
    file = squares(tmp_path / "a.ttf")
    for place, low, high in (
        ("centre", (-2.5, -2.5, -1), (2.5, 2.5, 1)),
        ("bed", (-2.5, -2.5, 0), (2.5, 2.5, 2)),
        ("as is", (0, 0, 0), (5, 5, 2)),
    ):
        box = text("B", file, size=10, depth=2, place=place).bounds.box
        assert box.lo == pytest.approx(low) and box.hi == pytest.approx(high)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("text='A' font='none.ttf'", "no such file"),
        ("text='A' font='a.png'", "not a font that can be read; known are .otc, .otf, .ttc, .ttf"),
        ("text='A' font='bad.ttf'", "not a font that can be read"),
        ("text='A' font='cut.ttf'", "not a font that can be read"),
        ("text='AC' font='a.ttf'", "has no glyph for 'C'"),
        ("text='A&#x416;' font='a.ttf'", "has no glyph for 'Ж'"),
        ("text='' font='a.ttf'", "expected a text of 1 to 1000 characters, found 0"),
        ("text='A' font='a.ttf' variations='wght=5'", 'variations="wght=5": expected none, it has no axes'),
        ("text='A' font='v.ttf' variations='wght=5'", 'variations="wght=5": expected wght=400..900'),
        ("text='A' font='v.ttf' variations='bold'", 'variations="bold": expected wght=400..900'),
        (f"text='{'A' * 2000}' font='a.ttf'", "expected a text of 1 to 1000 characters, found 2000"),
        ("text='A' font='../a.ttf'", "expected a file in the folder of the scene"),
        ("text='A' font='a.ttf' size='nan'", "expected a number > 0"),
        ("font='a.ttf'", 'needs the attribute text="..."'),
    ],
)
def test_bad_input_is_one_line(values: str, message: str, tmp_path: Path) -> None:
    whole = Path(squares(tmp_path / "a.ttf")).read_bytes()
    squares(tmp_path / "v.ttf", "variable")
    (tmp_path / "bad.ttf").write_bytes(bytes(range(256)) * 99)
    (tmp_path / "cut.ttf").write_bytes(whole[:200])
    (tmp_path / "a.xml").write_text(
        f"<scene version='1'><solid size='1mm'>\n<text {values}/></solid></scene>"
    )
    began = time.perf_counter()
    with pytest.raises(SceneError) as error:
        read(tmp_path / "a.xml").root.distance((0, 0, 0))
    assert time.perf_counter() - began < 5
    assert str(error.value).startswith(f"{tmp_path}/a.xml:2: <text> ") and message in str(error.value)
    assert "\n" not in str(error.value)


def test_without_harfbuzz_that_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = squares(tmp_path / "a.ttf")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "uharfbuzz", None)
    with pytest.raises(
        SceneError, match='texts need uharfbuzz, which is not installed: pip install "uharfbuzz"'
    ):
        text("A", file).bounds  # noqa: B018
