"""Colours for printers with several filaments: chosen, painted on triangles, and as bodies."""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice import make_mesh
from fracslice.common.arrays import Filaments
from fracslice.errors import SceneError
from fracslice.formulas import box, material, sphere, transform, union
from fracslice.mesh import Mesh
from fracslice.mesh.filaments import (
    FINEST,
    chosen_colours,
    filament_text,
    nearest_filament,
    oklab,
    paint_triangles,
    painted_mesh,
    spread_points,
)
from fracslice.records import MeshJob, Palette
from fracslice.work import Work
from tests.mesh import shapes

pytestmark = pytest.mark.once

RED, BLUE = (0.9, 0.1, 0.2), (0.1, 0.2, 0.8)
TWO = union(
    material(box(size=(2, 2, 2)), colour=RED),
    transform(material(sphere(radius=1), colour=BLUE), translate=(1, 0, 0)),
)


def test_oklab_has_the_published_values() -> None:
    """Of white, red and blue, by Ottosson's implementation."""
    expected = [(1, 0, 0), (0.6280, 0.2249, 0.1258), (0.4520, -0.0325, -0.3115)]
    given = np.array([(255, 255, 255), (255, 0, 0), (0, 0, 255)], np.uint8)
    np.testing.assert_allclose(oklab(given), expected, atol=1e-4)


def test_as_few_colours_as_there_are_stay_and_the_largest_is_first() -> None:
    known = np.array([(0, 0, 0), (250, 10, 20), (255, 255, 255)], np.uint8)
    colours = known[[0, 1, 1, 1, 2, 2]]
    assert chosen_colours(colours, np.ones(6), 4).tolist() == known[[1, 2, 0]].tolist()
    assert chosen_colours(colours, np.array([9, 1, 1, 1, 1, 1.0]), 4)[0].tolist() == [0, 0, 0]


def test_clusters_are_found_however_they_are_ordered() -> None:
    """Five of clear colours, each of 40 that are close to it."""
    rng = np.random.default_rng(3)
    middles = np.array([(20, 20, 20), (230, 230, 230), (200, 30, 40), (30, 60, 200), (60, 180, 60)])
    colours = (middles[:, None] + rng.integers(-9, 10, (5, 40, 3))).reshape(-1, 3).astype(np.uint8)
    found = chosen_colours(colours, np.ones(200), 5)
    assert np.abs(found[nearest_filament(middles.astype(np.uint8), found)] - middles).max() < 6
    mixed = rng.permutation(200)
    assert np.array_equal(chosen_colours(colours[mixed], np.ones(200), 5), found)


def test_colours_between_vertices_count() -> None:
    """Simplified to its corners, a bar has a stripe that no vertex has."""
    bar, stripe = material(box(size=(2, 1, 1)), colour=RED), material(box(size=(0.3, 1, 1)), colour=BLUE)
    made = make_mesh(
        union(stripe, bar), size="30mm", resolution=24, colour="material", filaments=3, simplify=0.01
    )
    assert made.colours is not None and len(np.unique(made.colours, axis=0)) == 1
    assert made.mesh.filaments is not None and len(made.mesh.filaments.colours) == 2
    points = spread_points(shapes.cube(2, (0, 0, 0)), 6000)
    for axis in range(3):
        for side in (0, 2):
            assert (points[:, axis] == side).sum() == pytest.approx(1000, abs=3)
    assert points.mean(0) == pytest.approx(1, abs=0.01)


Painted = list[tuple[np.ndarray, int]]


def unpainted(text: str, corners: np.ndarray) -> Painted:
    """Parts of a triangle with their filaments, as TriangleSelector::deserialize has them."""
    digits = iter(int(digit, 16) for digit in reversed(text))

    def part(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> Painted:
        code = next(digits)
        if code & 3 == 0:
            state = next(digits) + 3 if code >> 2 == 3 else code >> 2
            return [(np.array([a, b, c]), max(state - 1, 0))]
        assert code == 3
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        children = (a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca)
        return [one for child in reversed(children) for one in part(*child)]

    parts = part(*corners)
    assert next(digits, None) is None
    return parts


def test_texts_are_those_of_slicers() -> None:
    """The first filament is that of the object, which is not painted."""
    assert [filament_text(k) for k in (0, 1, 2, 3, 15)] == ["0", "8", "0C", "1C", "DC"]


def test_large_triangles_are_split_where_colours_meet() -> None:
    """A cube of twelve triangles with five slabs across a diagonal."""
    cube, normal = shapes.cube(5, (0, 0, 0)), np.array([0.36, 0.48, 0.8])

    def slab(points: np.ndarray) -> np.ndarray:
        return np.floor(points @ normal / 1.7).clip(0, 4).astype(np.uint8)

    of, texts, text = paint_triangles(cube, slab(cube.vertices), slab, Work())
    grey = np.arange(5, dtype=np.uint8)[:, None] * np.uint8([50, 50, 50])
    drawn = painted_mesh(Mesh(cube.vertices, cube.triangles, filaments=Filaments(grey, of, texts, text)))
    assert drawn.volume == pytest.approx(125, rel=1e-9) and drawn.colours is not None
    shown = drawn.colours[drawn.triangles][:, :, 0] // 50
    there = drawn.corners.mean(1) @ normal / 1.7
    inner = np.abs(there - np.rint(there)) * 1.7 > FINEST
    assert inner.any() and (shown[inner] == slab(drawn.corners.mean(1))[inner, None]).all()
    for number, corners in enumerate(cube.corners):
        parts = unpainted(texts[text[number]], corners)
        shapes_of, filaments = np.array([one for one, _ in parts]), np.array([k for _, k in parts])
        double = np.linalg.norm(np.cross(*np.moveaxis(shapes_of[:, 1:] - shapes_of[:, :1], 1, 0)), axis=1)
        assert double.sum() == pytest.approx(25, rel=1e-12)  # twice half of a side
        middles = shapes_of.mean(1)
        wrong = slab(middles) != filaments
        border = np.abs(middles @ normal / 1.7 - np.rint(middles @ normal / 1.7)) * 1.7
        assert (border[wrong] < FINEST).all() and set(filaments) == set(np.unique(slab(middles)))
        assert np.bincount(filaments, double).argmax() == of[number]


@pytest.fixture(scope="module")
def two() -> Mesh:
    return make_mesh(TWO, size="20mm", resolution=24, colour="material", filaments=4).mesh


def of_strict_lib3mf(path: Path) -> tuple[int, list[int]]:
    """Warnings of lib3mf, and triangles of the objects."""
    lib3mf = pytest.importorskip("lib3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    meshes, counts = model.GetMeshObjects(), []
    while meshes.MoveNext():
        counts.append(meshes.GetCurrentMeshObject().GetTriangleCount())
    return reader.GetWarningCount(), counts


def test_painted_triangles_are_in_the_file(two: Mesh, tmp_path: Path) -> None:
    """All but the attribute of Bambu Studio, which has no namespace, is valid by the strict reader."""
    assert two.filaments is not None
    with zipfile.ZipFile(two.export(tmp_path / "two.3mf")) as file:
        members = {name: file.read(name) for name in file.namelist()}
    model = members["3D/3dmodel.model"].decode()
    rows = re.findall(
        r'<triangle [^>]*?(?: pid="(\d+)" p1="0")?(?: slic3rpe:mmu_segmentation="(\w+)"[^>]*)?/>', model
    )
    assert len(rows) == len(two.triangles)
    assert [int(pid or 2) - 2 for pid, _ in rows] == two.filaments.of.tolist()
    assert [text or "0" for _, text in rows] == [two.filaments.texts[k] for k in two.filaments.text]
    assert re.findall(r'color="(#\w+)"/></m:colorgroup>', model) == ["#E61A33", "#1A33CC"]
    assert re.findall(r'mmu_segmentation="(\w+)"', model) == re.findall(r'paint_color="(\w+)"', model)
    members["3D/3dmodel.model"] = re.sub(r' paint_color="\w+"', "", model).encode()
    with zipfile.ZipFile(tmp_path / "plain.3mf", "w") as file:
        for name, text in members.items():
            file.writestr(name, text)
    assert of_strict_lib3mf(tmp_path / "plain.3mf") == (0, [len(two.triangles)])


@pytest.mark.skipif(not shutil.which("prusa-slicer"), reason="needs prusa-slicer")
def test_prusaslicer_changes_tools_where_colours_change(two: Mesh, tmp_path: Path) -> None:
    """The box is left of x = 0; right of the sphere's start, all walls are of the second filament."""
    four = {"nozzle_diameter": "0.4", "filament_diameter": "1.75", "temperature": "200"}
    settings = "".join(f"{name} = {','.join([value] * 2)}\n" for name, value in four.items())
    (tmp_path / "two.ini").write_text(f"{settings}layer_height = 0.3\nskirts = 0\nfill_density = 0%\n")
    command = ["prusa-slicer", "--export-gcode", "--load", "two.ini", "--dont-arrange", "two.3mf"]
    two.export(tmp_path / "two.3mf")
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    tool, found = 0, []
    for line in (tmp_path / "two.gcode").read_text().splitlines():
        tool = int(line[1]) if re.match(r"T\d", line) else tool
        if match := re.match(r"G1 X(\S+) Y\S+ E\d", line):
            found.append((float(match[1]), tool))
    x, tools = np.array(found).T
    left, right = x < x.min() + 6, x > x.max() - 5
    assert left.sum() > 100 < right.sum()
    assert (tools[left] == 0).mean() > 0.97 < (tools[right] == 1).mean()


def test_bodies_are_closed_meet_and_add_up(tmp_path: Path) -> None:
    pytest.importorskip("manifold3d")
    made = make_mesh(
        TWO, size="20mm", resolution=24, colour="material", filaments=("#1a33cc", "#e61a33"), bodies=True
    ).mesh
    assert made.filaments is not None
    bodies = [Mesh(body.vertices, body.triangles) for body in made.filaments.bodies]
    assert all(body.is_watertight for body in bodies)
    assert sum(body.volume for body in bodies) == pytest.approx(made.volume, rel=1e-9)
    x, y, z = np.meshgrid(np.linspace(-1, 2, 151), *2 * [np.linspace(-1, 1, 101)], indexing="ij")
    cube, ball = np.abs([x, y, z]).max(0) - 1, np.sqrt((x - 1) ** 2 + y * y + z * z) - 1
    share = ((ball < cube) & (ball < 0)).sum() / (np.minimum(ball, cube) < 0).sum()
    assert bodies[0].volume / made.volume == pytest.approx(share, abs=0.01)
    warnings, counts = of_strict_lib3mf(made.export(tmp_path / "two.3mf"))
    assert warnings == 0 and counts == [len(body.triangles) for body in bodies]
    with zipfile.ZipFile(tmp_path / "two.3mf") as file:
        settings = file.read("Metadata/model_settings.config").decode()
    parts = re.findall(r'<part id="(\d+)".*?key="extruder" value="(\d)"', settings)
    assert parts == [("4", "1"), ("5", "2")]


def test_palettes_have_the_names_of_materials() -> None:
    from typing import get_args

    from fracslice.formulas.material import PALETTES

    assert get_args(Palette) == tuple(PALETTES)
    assert MeshJob(colour="point", palette="#000, #F80").palette == ("#000000", "#ff8800")
    made = make_mesh(TWO, size="2cm", resolution=8, colour="steps", palette=("#123456", "#123456"))
    assert set(map(tuple, made.colours.tolist())) == {(0x12, 0x34, 0x56)}  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ("--colour material --filaments 17", "'17': expected a number from 2 to 16 or 2 to 16 colours"),
        ("--colour material --filaments #000", "'#000': expected a number from 2 to 16"),
        ("--colour point --palette nice", "'nice': expected viridis, plasma"),
        ("--colour material --palette viridis", "palette: expected a property of the orbit as the colour"),
        ("--filaments 3", "filaments: expected a colour, too, such as material or point"),
        ("--colour point --bodies", "bodies: expected filaments, too, such as 4"),
        ("--colour point --filaments 2 --bodies", "bodies: expected a file that holds them, .3mf"),
    ],
)
def test_what_is_wrong_is_one_line(
    options: str, line: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    command = ["mesh", "mandelbulb", "-o", str(tmp_path / "x.ply"), "--resolution", "16", *options.split()]
    assert run(command) == 2
    found = capfd.readouterr().err
    assert line in found and found.count("\n") == 1 and not list(tmp_path.iterdir())


def test_python_says_what_it_expects() -> None:
    with pytest.raises(SceneError, match="filaments=1: expected a number from 2 to 16"):
        MeshJob(colour="point", filaments=1)


def test_heights_of_layers_are_those_of_the_slope(tmp_path: Path) -> None:
    """A ball on which the least height holds where the surface is flat, three times that at the middle."""
    made = make_mesh(sphere(radius=10), voxel="1mm", heights="0.1mm..0.3mm")
    path = made.mesh.export(tmp_path / "ball.3mf")
    with zipfile.ZipFile(path) as file:
        text = file.read("Metadata/Slic3r_PE_layer_heights_profile.txt").decode()
        assert file.read("Metadata/layer_heights_profile.txt").decode() == text
    assert of_strict_lib3mf(path)[0] == 0 and text.startswith("object_id=1|")
    z, height = np.array(text.partition("|")[2].split(";"), float).reshape(-1, 2).T
    assert z[0] == 0 and z[-1] == pytest.approx(np.ptp(made.vertices[:, 2]), abs=1e-6)
    assert (z[2::2] == z[1:-1:2]).all() and (np.diff(z)[:-2:2] > 0.099).all()
    slope = np.abs((z[::2] + z[1::2]) / 2 - 10) / 10  # vertical component of the normal
    assert (height[::2][slope > 0.55] < 0.11).all() and (height[::2][slope < 0.25] > 0.29).all()
    assert (height[::2] * slope < 0.1 + 0.3 * 0.04).all()


def test_heights_need_a_range_and_a_file_that_holds_them(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="heights: expected a range, such as"):
        MeshJob(heights="0.1mm")
    with pytest.raises(SceneError, match="heights: expected a file that holds them"):
        make_mesh(sphere(radius=10), heights="0.1mm..0.2mm", path=tmp_path / "x.stl")
