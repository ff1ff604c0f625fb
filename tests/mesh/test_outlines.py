"""Outlines as solids: distances and sides against shapely, SVG against known shapes, and refusals."""

from __future__ import annotations

import importlib.util
import math
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry import Point, Polygon

from fracslice import make_mesh
from fracslice.errors import SceneError
from fracslice.expr.intervals import ARRAYS, Interval
from fracslice.fields.devices import enclosure, reference
from fracslice.formulas import Node, cylinder, extrude, revolve, shell, twist
from fracslice.mesh import outlines
from fracslice.scene import read, reads, scene, to_xml

pytestmark = pytest.mark.once

RNG = np.random.default_rng(8)
MM = 25.4 / 96


def drawn(inside: str, path: Path, root: str = "width='100mm' height='80mm' viewBox='0 0 100 80'") -> str:
    """An SVG file of some elements, by default in mm."""
    path.write_text(f"<svg xmlns='http://www.w3.org/2000/svg' {root}>\n{inside}\n</svg>")
    return str(path)


def area(inside: str, tmp_path: Path, **root: str) -> shapely.Geometry:
    """What elements fill, mm."""
    return outlines.area_of(outlines.read_svg(drawn(inside, tmp_path / "area.svg", **root)))


def star(count: int, inner: float, outer: float, at: complex = 0) -> Polygon:
    angle = np.arange(2 * count) * math.pi / count
    points = at + np.where(np.arange(2 * count) % 2, inner, outer) * np.exp(1j * angle)
    return Polygon(points.view(float).reshape(-1, 2))


def path_of(shape: shapely.Geometry) -> str:
    """Path data, y down."""
    rings = [ring for part in shapely.get_parts(shape) for ring in (part.exterior, *part.interiors)]
    return " ".join("M" + " ".join(f"{x!r},{-y!r}" for x, y in ring.coords[:-1]) + "z" for ring in rings)


CHECKS = shapely.union_all(
    [
        shapely.box(x, y, x + 10, y + 10)
        for x in range(0, 40, 10)
        for y in range(0, 40, 10)
        if (x + y) % 20 == 0
    ]
)
AREAS: dict[str, shapely.Geometry] = {
    "square": shapely.box(0, 0, 10, 7),
    "star": star(9, 2, 30),
    "needle": Polygon([(0, 0), (50, 1e-7), (0, 2)]),
    "rings": Point(0, 0).buffer(30, quad_segs=200) - Point(1, 2).buffer(20) | star(5, 4, 9, 3 + 1j),
    "touching": CHECKS,
    "hole that touches": shapely.box(0, 0, 20, 20) - Polygon([(0, 10), (10, 4), (10, 16)]),
}


@pytest.fixture(params=AREAS)
def known(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Node, shapely.Geometry]:
    """An extruded area, and the area."""
    shape = AREAS[request.param]
    file = drawn(f"<path d='{path_of(shape)}' fill-rule='evenodd'/>", tmp_path / "a.svg")
    return extrude(file, height=1e6, place="as is"), shape


def around(shape: shapely.Geometry, count: int) -> np.ndarray:
    """Random points around a shape, half of them near its boundary and corners."""
    low, high = np.array(shape.bounds).reshape(2, 2)
    anywhere = RNG.uniform(low - 0.3 * (high - low), high + 0.3 * (high - low), (count // 2, 2))
    rings = shape.boundary
    on = shapely.get_coordinates(rings.interpolate(RNG.uniform(0, rings.length, count // 4)))
    corners = shapely.get_coordinates(rings)
    near = np.concatenate([on, corners[RNG.integers(0, len(corners), count // 4)]])
    return np.concatenate([anywhere, near + RNG.normal(size=near.shape) * 0.01 * (high - low).max()])


def signed(shape: shapely.Geometry, points: np.ndarray) -> np.ndarray:
    given = shapely.points(points)
    shapely.prepare(shape)
    return shapely.distance(shape.boundary, given) * np.where(shapely.contains_properly(shape, given), -1, 1)


def flat(root: Node, points: np.ndarray) -> np.ndarray:
    """Distances in the middle of a tall extrusion."""
    return root.distance(np.column_stack([points, np.full(len(points), 5e5)]))


def test_distances_and_sides_are_those_of_shapely(known: tuple[Node, shapely.Geometry]) -> None:
    root, shape = known
    points = around(shape, 100_000 if len(shapely.get_coordinates(shape)) < 100 else 20_000)
    assert np.abs(flat(root, points) - signed(shape, points)).max() < 1e-9


def test_kernels_agree_with_the_reference(known: tuple[Node, shapely.Geometry]) -> None:
    root, shape = known
    low = root.changed(height=7)
    made = twist(shell(low, thickness=0.2), degrees=3)
    points = np.column_stack([around(shape, 1000), RNG.uniform(-3, 10, 1000)]).T
    exact = reference(made)(*points)
    assert np.allclose(made.kernel("cpu", "float64").points(*points), exact, rtol=0, atol=1e-12)
    assert np.allclose(low.kernel().points(*points), reference(low)(*points), rtol=1e-6, atol=1e-5)


def test_an_extrusion_is_an_exact_distance(known: tuple[Node, shapely.Geometry]) -> None:
    root, shape = known
    root = root.changed(height=8)
    points = np.column_stack([around(shape, 4000), RNG.uniform(-8, 16, 4000)])
    d, h = signed(shape, points[:, :2]), abs(points[:, 2] - 4) - 4
    exact = np.hypot(np.maximum(d, 0), np.maximum(h, 0)) + np.minimum(np.maximum(d, h), 0)
    assert np.abs(root.distance(points) - exact).max() < 1e-9
    others = points + RNG.normal(size=points.shape) * RNG.uniform(0, 1, (len(points), 1)) ** 6
    change = abs(root.distance(points) - root.distance(others))
    assert (change <= np.linalg.norm(points - others, axis=1) * (1 + 1e-12) + 1e-12).all()


def test_enclosures_hold_all_values(known: tuple[Node, shapely.Geometry]) -> None:
    root, shape = known
    root, half = root.changed(height=8), 0.07
    centres = np.column_stack([around(shape, 200), RNG.uniform(-2, 10, 200)]).T
    within = centres[:, :, None] + RNG.uniform(-half, half, (3, 200, 50))
    values = root.distance(np.moveaxis(within, 0, -1))
    bounds = enclosure(root)(*(Interval(c - half, c + half, ARRAYS) for c in centres))
    for precision in ("float32", "float64"):
        low, high = root.cells(precision).bounds(centres, half)
        assert (low[:, None] <= values).all() and (values <= high[:, None]).all()
        assert np.allclose(low, bounds.lo, atol=1e-3) and np.allclose(high, bounds.hi, atol=1e-3)


def test_a_distance_does_not_depend_on_the_point_before(known: tuple[Node, shapely.Geometry]) -> None:
    root, shape = known
    points = around(shape, 2000)
    order = RNG.permutation(len(points))
    assert np.array_equal(flat(root, points)[order], flat(root, points[order]))


def test_points_far_away(tmp_path: Path) -> None:
    root = extrude(drawn("<rect width='9' height='9'/>", tmp_path / "a.svg"))
    found = root.distance([(np.nan, 0, 0), (np.inf, 0, 0), (1e30, 0, 0)])
    assert np.isnan(found[0]) and np.isinf(found[1]) and found[2] == pytest.approx(1e30)


SHARP = {
    "square": AREAS["square"],
    "star": star(5, 12, 30),
    "holes": shapely.box(0, 0, 20, 15) - star(5, 2.5, 4, 5 + 7j) - star(2, 3, 4, 15 + 7j),
}


@pytest.mark.parametrize("name", SHARP)
def test_a_mesh_has_the_volume_and_the_edges(name: str, tmp_path: Path) -> None:
    shape = SHARP[name]
    file = drawn(f"<path d='{path_of(shape)}' fill-rule='evenodd'/>", tmp_path / "a.svg")
    made = make_mesh(extrude(file, height=8), resolution=97)
    assert made.is_watertight and made.volume == pytest.approx(8 * shape.area, rel=1e-6)
    corners = shapely.get_coordinates(shape) - np.reshape(shape.bounds, (2, 2)).mean(0)
    away = np.linalg.norm(made.vertices[None] - np.insert(corners, 2, 8, axis=1)[:, None], axis=2).min(1)
    assert away.max() < 1e-4


def test_a_circle_is_one_within_the_tolerance(tmp_path: Path) -> None:
    for inside in (
        "<circle cx='50' cy='40' r='30'/>",
        "<path d='M20 40A30 30 0 0 1 80 40 30 30 0 0 1 20 40'/>",
        "<path d='M80 40A30 30 0 1120 40a30 30 0 1160 0z'/>",
        "<rect x='20' y='10' width='60' height='60' rx='30'/>",
        "<g transform='translate(50,40) rotate(30) scale(3 1)'><ellipse rx='10' ry='30'/></g>",
    ):
        points = shapely.get_coordinates(area(inside, tmp_path))
        middles = (points[1:] + points[:-1]) / 2
        for given in (points, middles):
            away = np.hypot(given[:, 0] - 50, given[:, 1] + 40) - 30
            assert np.abs(away).max() <= 60 * outlines.TOLERANCE


SQUARE = "M0 0h10v10h-10z"
FIGURES: dict[str, tuple[str, float]] = {
    "nonzero, the same way": (f"<path d='{SQUARE} M2 2h4v4h-4z'/>", 100),
    "nonzero, the other way": (f"<path d='{SQUARE} M2 2v4h4v-4z'/>", 84),
    "even-odd": (f"<path fill-rule='evenodd' d='{SQUARE} M2 2h4v4h-4z'/>", 84),
    "a rule of a style": (f"<path style='fill-rule:evenodd' d='{SQUARE} M2 2h4v4h-4z'/>", 84),
    "an inherited rule": (f"<g fill-rule='evenodd'><path d='{SQUARE} M2 2h4v4h-4z'/></g>", 84),
    "a rule of a style sheet": (
        f"<style>/* */ .a, #b {{fill-rule: evenodd}}</style><path class='a' d='{SQUARE} M2 2h4v4h-4z'/>",
        84,
    ),
    "overlapping": (f"<path d='{SQUARE}'/><path d='M5 5h10v10h-10z'/>", 175),
    "crossing itself": ("<path d='M0 0L10 10 0 10 10 0z'/>", 50),
    "a pentagram": ("<path d='M0 0L10 0 0 10 10 10 5 -5z' fill-rule='nonzero'/>", -1),
    "not closed": ("<path d='M0 0h10v10h-10'/>", 100),
    "after a closed one": ("<path d='M0 0h10v10h-10zl0 -5h10z'/>", 125),
    "relative": ("<path d='m0 0 10 0 0 10-10 0zm20,0 1 0 0 1-1 0z'/>", 101),
    "no fill": (f"<path d='{SQUARE}'/><rect width='90' height='80' fill='none'/>", 100),
    "no fill of a group": (
        f"<path d='{SQUARE}'/><g style='fill: none'><rect width='90' height='9'/></g>",
        100,
    ),
    "not shown": (f"<path d='{SQUARE}'/><rect width='90' height='80' display='none'/>", 100),
    "only defined": (f"<path d='{SQUARE}'/><defs><rect width='90' height='80'/></defs>", 100),
    "used": ("<defs><rect id='r' width='10' height='9'/></defs><use href='#r'/><use href='#r' x='20'/>", 180),
    "used before": (
        "<use href='#r' transform='scale(2)'/><defs><g id='r'><rect width='5' height='4'/></g></defs>",
        80,
    ),
    "a symbol": (
        "<symbol id='s' viewBox='0 0 2 2'><rect width='2' height='1'/></symbol>"
        "<use href='#s' width='10' height='10'/>",
        50,
    ),
    "nested": (
        "<svg x='5' y='5' width='20' height='20' viewBox='0 0 10 10'><rect width='5' height='5'/></svg>",
        100,
    ),
    "transforms": (
        "<g transform='rotate(90) scale(2,3)'>"
        "<rect width='2' height='1' transform='matrix(1 0 1 1 3 4)'/></g>",
        12,
    ),
    "a polygon": ("<polygon points='0,0 10,0 10,10'/>", 50),
    "a polyline": ("<polyline points='0,0,10,0,10,10'/>", 50),
    "lengths": ("<rect width='1cm' height='10mm'/>", (10 / MM) ** 2),
    "quadratics": ("<path d='M0 0Q5 10 10 0T20 0'/>", -2),
}


@pytest.mark.parametrize("name", FIGURES)
def test_what_is_filled(name: str, tmp_path: Path) -> None:
    inside, size = FIGURES[name]
    found = area(inside, tmp_path)
    assert shapely.is_valid(found)
    if size == -1:
        points = [(0, 0), (10, 0), (0, -10), (10, -10), (5, 5), (0, 0)]
        exact = shapely.union_all([shapely.LineString(points)])
        size = shapely.union_all(list(shapely.polygonize([exact]).geoms)).area
    elif size == -2:
        size = 2 * (2 / 3 * 10 * 5)
    assert found.area == pytest.approx(size, rel=1e-3 if name == "quadratics" else 1e-9)


def turned(points: np.ndarray) -> np.ndarray:
    """Points [r, z] at random angles around the axis."""
    angle = RNG.uniform(0, math.tau, len(points))
    return np.column_stack([points[:, 0] * np.cos(angle), points[:, 0] * np.sin(angle), points[:, 1]])


@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_a_revolution_is_an_exact_distance(offset: float, tmp_path: Path) -> None:
    profile = Polygon([(0, 0), (8, 0), (6, 3), (9, 7), (0, 9), (0, 6), (3, 4), (0, 4)])
    root = revolve(drawn(f"<path d='{path_of(profile)}'/>", tmp_path / "a.svg"), offset=offset, place="bed")
    right = shapely.transform(profile, lambda points: points + (offset, 0))
    section = right | shapely.transform(right, lambda points: points * (-1, 1))
    points = abs(around(section, 20_000)) * (1, np.sign(RNG.uniform(-1, 5)))
    assert np.abs(root.distance(turned(points)) - signed(section, points)).max() < 1e-9
    assert root.bounds.box.hi == pytest.approx((9 + offset, 9 + offset, 9))
    small = root.kernel().points(*turned(points).T.astype(np.float32))
    assert np.abs(small - signed(section, points)).max() < 1e-5
    a, b = (RNG.uniform(-15, 15, (3000, 3)) for _ in range(2))
    b = a + (b - a) * RNG.uniform(0, 1, (3000, 1)) ** 4
    change = abs(root.distance(a) - root.distance(b))
    assert (change <= np.linalg.norm(a - b, axis=1) * (1 + 1e-12) + 1e-12).all()


def test_a_turned_rectangle_is_a_cylinder(tmp_path: Path) -> None:
    root = revolve(drawn("<rect x='5' width='3' height='8'/>", tmp_path / "a.svg"))
    points = RNG.uniform(-8, 8, (10_000, 3))
    assert np.abs(root.distance(points) - cylinder(radius=3, height=8).distance(points)).max() < 1e-12
    assert make_mesh(root, resolution=97).volume == pytest.approx(72 * math.pi, rel=2e-4)


@pytest.mark.parametrize(
    ("root", "mm"),
    [
        ("", MM),
        ("viewBox='0 0 100 100'", MM),
        ("width='50' viewBox='0 0 100 80'", MM / 2),
        ("width='100%' height='100%' viewBox='0 0 100 80'", MM),
        ("width='4in' height='2in' viewBox='0 0 100 100'", 0.508),
        ("width='10cm' height='10cm' viewBox='50 50 100 100'", 1),
    ],
)
def test_units(root: str, mm: float, tmp_path: Path) -> None:
    low, high = np.array(area("<rect x='1' width='10' height='5'/>", tmp_path, root=root).bounds).reshape(
        2, 2
    )
    assert high - low == pytest.approx((10 * mm, 5 * mm))


@pytest.mark.parametrize(
    ("values", "low", "high"),
    [
        ({}, (-5, -2.5, -0.5), (5, 2.5, 0.5)),
        ({"place": "bed", "size": 1}, (-0.5, -0.25, 0), (0.5, 0.25, 1)),
        ({"place": "as is", "height": 2}, (10, -25, 0), (20, -20, 2)),
    ],
)
def test_size_and_place(values: dict[str, object], low: tuple, high: tuple, tmp_path: Path) -> None:
    root = extrude(drawn("<rect x='10' y='20' width='10' height='5'/>", tmp_path / "a.svg"), **values)
    assert root.bounds.box.lo == pytest.approx(low) and root.bounds.box.hi == pytest.approx(high)


OPENING = "<scene version='1'>\n<solid size='1mm'>\n"


def refused(data: str | bytes, path: Path) -> str:
    """The error of a scene whose third line extrudes a file, without what stands before in each."""
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    (path.parent / "a.xml").write_text(f"{OPENING}<extrude file='{path.name}'/></solid></scene>")
    began = time.perf_counter()
    with pytest.raises(SceneError) as error:
        read(path.parent / "a.xml").root.distance((0, 0, 0))
    assert time.perf_counter() - began < 5
    before = f'{path.parent}/a.xml:3: <extrude> file="{path}": '
    assert str(error.value).startswith(before) and "\n" not in str(error.value)
    return str(error.value).removeprefix(before)


def svg_of(inside: str) -> str:
    return f"<svg xmlns='http://www.w3.org/2000/svg'>\n{inside}</svg>"


BOMB = "".join(
    f"<g id='g{k}'>" + f"<use href='#g{k - 1}'/>" * 10 + "</g>" if k else f"<path id='g0' d='{SQUARE}'/>"
    for k in range(12)
)
LAUGHS = "<!DOCTYPE svg [<!ENTITY a 'ha'>" + "".join(
    f"<!ENTITY {b} '{'&' + a + ';' * 1}'>" for a, b in zip("abcd", "bcde", strict=True)
)
BAD: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", "not an SVG file: no element found"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(99), "not an SVG file: not well-formed"),
    "another XML": ("<scene version='1'/>", "not an SVG file: expected <svg>, found <scene>"),
    "strokes": (
        svg_of(f"<path fill='none' stroke='red' d='{SQUARE}'/>"),
        "has no closed path that is filled",
    ),
    "a line": (svg_of("<path d='M0 0L10 10'/>"), "has no path with an area"),
    "no width": (svg_of("<path d='M0 0L10 10 20 20z'/>"), "has no path with an area"),
    "NaN": (svg_of("<path d='M0 0L10 NaN 20 20z'/>"), "line 2: <path> d: expected numbers, found N"),
    "infinite": (svg_of("<path d='M0 0L10 1e999 20 20z'/>"), "line 2: <path> d: expected finite numbers"),
    "too large": (svg_of("<path d='M0 0L1 1e300 2 -1e308z' transform='scale(1e9)'/>"), "not a finite number"),
    "no move": (svg_of("<path d='L10 10'/>"), "line 2: <path> d: expected M first, found L"),
    "many segments": (
        svg_of("<path d='M0 0h1v1z" + "m0 0a1e6 1e6 0 1 1 1 1 1 1 0 1 1 1 1z" * 4000 + "'/>"),
        "expected an outline of at most 262144 segments, found ",
    ),
    "crossings": (
        svg_of(
            "<path d='M0 0" + "".join(f"L{k * 7919 % 5003} {k * 104729 % 4999}" for k in range(5000)) + "z'/>"
        ),
        "expected an outline whose segments cross at most 32768 times",
    ),
    "elements": (svg_of("<rect width='1' height='1'/>" * 9000), "expected at most 8192 elements"),
    "odd": (svg_of("<path d='M0 0 10'/>"), "line 2: <path> d: M with 3 numbers"),
    "bad points": (
        svg_of("<polygon points='1 2 3'/>"),
        "line 2: <polygon> points: expected pairs of numbers",
    ),
    "bad length": (svg_of("<rect width='5furlong'/>"), 'line 2: <rect> width="5furlong": expected a number'),
    "bad transform": (svg_of("<g transform='spin(3)'/>"), "line 2: <g> transform: expected matrix"),
    "numbers of a transform": (
        svg_of("<g transform='rotate(3 4 5 6)'/>"),
        "transform: rotate with 4 numbers",
    ),
    "bad use": (svg_of("<use href='#none'/>"), 'line 2: <use> href="#none": expected the id'),
    "a loop": (svg_of("<g id='a'><use href='#a'/></g>"), "elements, 64 inside each other"),
    "copies": (svg_of(BOMB + "<use href='#g11'/>"), "expected at most 8192 elements"),
    "entities": (LAUGHS + "]>" + svg_of("&e;"), "line 1: entities are not allowed in an SVG file"),
    "deep": (svg_of("<g>" * 90 + "</g>" * 90), "expected at most 64 elements inside each other"),
    "text": (svg_of("<text>A</text>"), "line 2: <text> expected paths"),
    "large": (svg_of(" " * (9 << 20)), "expected an SVG file of at most 8 MB"),
    "a million segments": (
        svg_of("<path d='M0 0" + "".join(f"L{k % 1000} {k // 999}" for k in range(900_000)) + "'/>"),
        "line 2: <path> expected at most 262144 curves in a file, found 900001",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line(name: str, tmp_path: Path) -> None:
    data, message = BAD[name]
    assert message in refused(data, tmp_path / "bad.svg")


def test_the_example_is_read() -> None:
    plate = read(Path(__file__).parents[2] / "examples" / "name-plate.xml")
    assert plate.root.bounds.box.size == pytest.approx((90, 93, 90))


def test_without_shapely_that_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    message = 'outlines need shapely, which is not installed: pip install "shapely"'
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "shapely", None)
    for make in (extrude, revolve):
        made = make(drawn("<rect width='9' height='9'/>", tmp_path / f"{make.name}.svg"), size=1)
        with pytest.raises(SceneError, match=message):
            made.bounds  # noqa: B018


def test_a_scene_knows_its_outline_by_the_hash(tmp_path: Path) -> None:
    file = drawn("<rect width='9' height='9'/>", tmp_path / "a.svg")
    root = extrude(file, height=3)
    assert reads(to_xml(scene(root, unit=1.0)), files_outside=True).root == root
    drawn("<rect width='9' height='8'/>", tmp_path / "a.svg")
    assert extrude(file, height=3).key != root.key
    with pytest.raises(SceneError, match=r"not an outline that can be read; known are \.svg"):
        extrude(str(tmp_path / "a.png"))
    with pytest.raises(SceneError, match="no such file"):
        extrude(str(tmp_path / "none.svg"))
