"""Outlines that are swept along paths: distances against shapely, shapes known otherwise, and refusals."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh

from fracslice.errors import SceneError
from fracslice.fields.devices import reference
from fracslice.formulas import Node, extrude, revolve, sweep
from fracslice.mesh import sweeps
from fracslice.scene import read, reads, scene, to_xml
from tests.examples import WASHER

pytestmark = pytest.mark.once

RNG = np.random.default_rng(3)
TURN = np.linspace(0, 2 * math.pi, 120, endpoint=False)
BEND = np.linspace(0, math.pi, 80)


def drawn(inside: str, path: Path) -> str:
    path.write_text(f"<svg xmlns='http://www.w3.org/2000/svg'>{inside}</svg>")
    return str(path)


def meshes(made: Node) -> list[trimesh.Trimesh]:
    """Meshes of a swept outline."""
    outline = sweeps.profile(made["file"], made["sha256"], made["size"], made["anchor"] == "centre")
    path = sweeps.Path(made["points"], made["closed"] == "yes")
    return [
        trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        for mesh in sweeps._meshes(outline, path)
    ]


LINES = {
    "corner": ([(0, 0), (4, 0), (4, 4)], False, 1),
    "acute": ([(0, 0), (4, 0), (1, 1.5)], False, 1),
    "ring": ([(0, 0), (4, 0), (1, 2.5)], True, 1),
    "narrow corners": ([(0, 0), (2, 0), (2.2, 0.3), (2.3, 0.9), (4, 2)], False, 3),
    "tight": (np.stack([3 * np.cos(TURN), 0.6 * np.sin(TURN)], 1), True, None),
    "eight": (np.stack([3 * np.cos(TURN), 2 * np.sin(2 * TURN)], 1), True, 2),
    "line beside a bend": ([(-3, 0), *zip(1 - np.cos(BEND), np.sin(BEND), strict=True), (2, -2)], False, 3),
    "crossing itself": ([(-3, 0), (3, 0.3), (0, 3), (0.2, -3), (-2, 2)], False, None),
}  # fmt: skip


@pytest.mark.parametrize("name", LINES)
def test_distances_are_those_of_a_buffered_line(name: str, tmp_path: Path) -> None:
    points, closed, parts = LINES[name]
    file = drawn("<rect width='10mm' height='4mm'/>", tmp_path / "bar.svg")
    corners = np.pad(np.asarray(points, float), [(0, 0), (0, 1)])
    made = sweep(file, size=1, points=corners, closed="yes" if closed else "no")
    line = (shapely.LinearRing if closed else shapely.LineString)(corners[:, :2])
    area = line.buffer(0.5, join_style="mitre", mitre_limit=9, cap_style="flat")
    at = RNG.uniform([-5, -5, -0.5], [5, 5, 0.5], (4000, 3))
    at[::2, :2] = corners[RNG.integers(len(corners), size=2000), :2] + RNG.normal(0, 0.5, (2000, 2))
    places = shapely.points(at[:, :2])
    across = shapely.distance(area.boundary, places) * np.where(shapely.contains(area, places), -1, 1)
    up = abs(at[:, 2]) - 0.2
    known = np.hypot(np.maximum(across, 0), np.maximum(up, 0)) + np.minimum(np.maximum(across, up), 0)
    found = reference(made)(*at.T)
    outside = known > 0
    assert abs(found - known)[outside].max() < 1e-11
    assert (found[known < -1e-9] < 0).all()
    assert (found >= known - 1e-11).all()  # inside it is a bound where the path meets itself
    if parts == 1:
        assert abs(found - known).max() < 1e-11
    if parts:
        assert len(meshes(made)) == parts
    assert all(mesh.is_watertight and mesh.volume > 0 for mesh in meshes(made))
    assert made.bounds.lipschitz == 1


def test_where_a_path_turns_back_it_ends_flat(tmp_path: Path) -> None:
    file = drawn("<rect width='10mm' height='4mm'/>", tmp_path / "bar.svg")
    for back in (0.0, 0.1):
        made = sweep(file, size=1, points=((0, 0, 0), (4, 0, 0), (1, back, 0)))
        one, other = (sweep(file, size=1, points=p) for p in (made["points"][:2], made["points"][1:]))
        at = RNG.uniform(-1, 5, (3, 2000))
        known = np.minimum(reference(one)(*at), reference(other)(*at))
        np.testing.assert_allclose(reference(made)(*at), known)


def test_straight_and_round_paths_are_extruded_and_turned(tmp_path: Path) -> None:
    at = RNG.uniform(-3, 3, (5000, 3)).T * np.array([[1], [1], [0.3]])
    straight = sweep(WASHER, size=1, points="0 0 -0.5, 0 0 0.5")
    assert reference(straight)(*at) == pytest.approx(
        reference(extrude(WASHER, size=1, height=1))(*at), abs=1e-12
    )
    circle = drawn("<circle r='30' fill='none'/>", tmp_path / "circle.svg")
    turned = reference(revolve(WASHER, size=1, offset=1.5))(*at)
    assert reference(sweep(WASHER, size=1, path=circle, length=4))(*at) == pytest.approx(turned, abs=3e-4)


@pytest.mark.parametrize(
    ("points", "closed"),
    [
        ("0 0 0, 5 0 0, 5 5 2, 0 5 -1", "yes"),  # where the outline turns on its way around
        (np.stack([5 * np.cos(3 * TURN), 5 * np.sin(3 * TURN), TURN], 1), "no"),
    ],
)  # fmt: skip
def test_volume_is_that_of_the_outline_times_the_path(points: object, closed: str) -> None:
    made = sweep(WASHER, size=1, points=points, closed=closed)
    (mesh,) = meshes(made)
    path = np.array(made["points"] + made["points"][: closed == "yes"])
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(length * 0.875, rel=2e-4)


def test_an_outline_is_seen_along_the_path(tmp_path: Path) -> None:
    file = drawn("<path d='M0 0H10V-2H0z'/><rect y='-8' width='2' height='8'/>", tmp_path / "l.svg")
    made = sweep(file, size=1, points="0 0 0, 0 5 0", anchor="origin")
    assert made.bounds.box.lo == pytest.approx((0, 0, 0)) and made.bounds.box.hi == pytest.approx((1, 5, 0.8))
    assert (made.distance([(0.9, 2, 0.1), (0.1, 2, 0.7)]) < 0).all() and made.distance((0.9, 2, 0.7)) > 0


def test_all_lines_of_a_file_are_swept(tmp_path: Path) -> None:
    path = drawn(
        "<line x1='0' y1='0' x2='30' y2='0'/><polyline points='0 10 10 20 30 10' fill='none'/>"
        "<path d='M40 0h9v9z' visibility='hidden'/><path d='M0 40h9v9z'/>",
        tmp_path / "path.svg",
    )
    made = sweep(WASHER, size=2, path=path, length=49, place="as is")
    assert (made.distance([(15, -0.75, 0), (5, -15.75, 0), (4, -40.75, 0), (4.5, -44, -0.75)]) < 0).all()
    assert made.distance((44, -0.75, 0)) > 5
    assert reads(to_xml(scene(made, unit=1.0)), files_outside=True).root == made
    drawn("<line x2='9'/>", tmp_path / "path.svg")
    assert sweep(WASHER, size=2, path=path, length=49, place="as is").key != made.key


LONG = ", ".join(f"{k} 0 0" for k in range(100000))
BAD = {
    "points='0 0 0'": 'points="0 0 0": expected 2 to 100000 points such as 0 0 0, 5 0 0, 5 5 2, found 1',
    "points='0 0 0, 1 2'": "expected points such as 0 0 0",
    "points='0 0 0, 1 nan 2'": "expected points such as 0 0 0",
    "points='0 0 0, 0 0 0'": "expected a path of at least 2 points that are apart",
    "points='0 0 0, 9 0 0' closed='yes'": "expected a path of at least 3 points that are apart",
    "": "path and points: expected one of them",
    "path='washer.svg' points='0 0 0, 9 0 0'": "path and points: expected one of them",
    "path='none.svg'": "none.svg\": no such file",
    "path='dot.svg'": "dot.svg\": has no path with a length",
    "path='washer.svg' closed='yes'": 'closed="yes": expected points with it',
    "points='0 0 0, 9 0 0' length='3'": "length and place: expected a path of a file with them",
    f"points='{LONG}' file='round.svg'": "triangles along the path: expected at most",
}  # fmt: skip


@pytest.mark.parametrize("given", BAD)
def test_bad_input_is_one_line(given: str, tmp_path: Path) -> None:
    drawn("<path d='M3 3'/>", tmp_path / "dot.svg")
    drawn("<circle r='9'/>", tmp_path / "round.svg")
    (tmp_path / "washer.svg").write_bytes(Path(WASHER).read_bytes())
    file = "" if "file=" in given else "file='washer.svg'"
    (tmp_path / "a.xml").write_text(
        f"<scene version='1'><solid size='9mm'>\n<sweep {file} {given}/></solid></scene>"
    )
    began = time.perf_counter()
    with pytest.raises(SceneError) as error:
        read(tmp_path / "a.xml").root.distance((0, 0, 0))
    assert time.perf_counter() - began < 5
    message = str(error.value)
    assert BAD[given] in message and f"{tmp_path}/a.xml:2: <sweep> " in message and "\n" not in message
