"""Objects in parts with colours: filaments that all parts share, painted triangles, bodies, files."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice.common.arrays import GREY
from fracslice.formulas import box, difference, material, sphere, transform, union
from fracslice.jobs.divided import Parted, make_parts, write_parts
from fracslice.jobs.report import Result
from fracslice.mesh import Mesh, filaments
from fracslice.mesh.filaments import painted_mesh
from fracslice.mesh.models import read_mesh
from fracslice.records import MeshJob, PartsJob
from fracslice.scene import scene
from fracslice.work import Work
from tests.mesh.test_filaments import of_strict_lib3mf

pytestmark = pytest.mark.once

RED, BLUE = (230, 26, 51), (26, 51, 204)


@pytest.fixture(scope="module")
def made() -> Parted:
    """A red bar with a blue end. Its green core is seen where it is cut."""
    pytest.importorskip("manifold3d")
    bar = material(box(size=(60, 30, 20)), colour=(0.9, 0.1, 0.2))
    end = transform(material(box(size=(20, 40, 30)), colour=(0.1, 0.2, 0.8)), translate=(25, 0, 0))
    core = material(sphere(radius=0.02), colour=(0.1, 0.8, 0.1))
    solid = scene(difference(union(bar, end), core), unit=1.0)
    job = MeshJob(voxel="2.5mm", colour="material", filaments=3, bodies=True)
    with pytest.MonkeyPatch.context() as coarse:
        coarse.setattr(filaments, "CELLS", 16)
        return make_parts(solid, job, PartsJob(parts="2x1x1"))


def painted(made: Parted) -> Parted:
    """Parts without bodies of their own."""

    def plain(part: Result) -> Result:
        assert part.mesh.filaments is not None
        mesh = replace(part.mesh, filaments=replace(part.mesh.filaments, bodies=()))
        return Result(part.report, part.place, part.planned, mesh)

    return replace(made, meshes=[plain(part) for part in made.meshes])


def test_parts_have_the_filaments_of_the_surface_and_bodies_that_add_up(made: Parted) -> None:
    shares = []
    for part in made.meshes:
        printed = part.mesh.filaments
        assert printed is not None and printed.colours.tolist() == [list(RED), list(BLUE)]
        bodies = [Mesh(body.vertices, body.triangles) for body in printed.bodies]
        assert all(body.is_watertight for body in bodies if len(body.triangles))
        shares.append([body.volume / part.volume for body in bodies])
        assert sum(shares[-1]) == pytest.approx(1, abs=1e-12)
    assert shares[0] == pytest.approx([1, 0], abs=1e-12)
    x, y, z = np.meshgrid(np.arange(0.25, 35, 0.5), *2 * [np.arange(-19.75, 20, 0.5)], indexing="ij")
    bar, end = (
        np.max([abs(x - middle) - a, abs(y) - b, abs(z) - c], axis=0)
        for middle, a, b, c in ((0, 30, 15, 10), (25, 10, 20, 15))
    )
    blue = ((end < bar) & (end < 0)).sum() / 8
    assert shares[1][1] * made.meshes[1].volume == pytest.approx(blue, rel=0.02)


def test_a_file_has_the_bodies_of_each_part(made: Parted, tmp_path: Path) -> None:
    path = tmp_path / "bodies.3mf"
    write_parts(made, path, {}, Work())
    warnings, counts = of_strict_lib3mf(path)
    assert (
        made.peg is not None and warnings == 0 and len(counts) == 4 and counts[-1] == len(made.peg.triangles)
    )
    whole = sum(mesh.volume * count for _, mesh, count in made.named)
    assert read_mesh(path).volume == pytest.approx(whole, rel=1e-6)
    with zipfile.ZipFile(path) as file:
        settings = file.read("Metadata/model_settings.config").decode()
        model = file.read("3D/3dmodel.model").decode()
    objects = re.findall(r'<object id="(\d)">(.*?)</object>', settings, re.DOTALL)
    parts = {n: re.findall(r'<part id="(\d+)".*?"extruder" value="(\d)"', text) for n, text in objects}
    assert parts == {"1": [("6", "1")], "2": [("8", "1"), ("9", "2")]}
    assert '<component objectid="8"/><component objectid="9"/></components></object>' in model


def test_a_file_has_the_painted_triangles_of_each_part(made: Parted, tmp_path: Path) -> None:
    """By the groups of their colours, and by their painting."""
    path = tmp_path / "painted.3mf"
    write_parts(painted(made), path, {}, Work())
    with zipfile.ZipFile(path) as file:
        objects = file.read("3D/3dmodel.model").decode().split("</object>")
    for part, text in zip(made.meshes, objects, strict=False):
        printed = part.mesh.filaments
        assert printed is not None
        assert text.count(' pid="5" p1="0"') == (printed.of == 1).sum()
        assert text.count("mmu_segmentation") == (printed.text != printed.texts.index("0")).sum()
    blue = painted_mesh(made.meshes[1].mesh)
    of = (blue.colours[blue.triangles[:, 0]] == BLUE).all(1)  # type: ignore[index]
    area = np.linalg.norm(blue.normals[of], axis=1).sum() / 2
    assert area == pytest.approx(2 * (20 * 40 + 20 * 30 + 30 * 40) - 30 * 20, rel=0.03)
    assert "<object" in objects[2] and "pid" not in objects[2]  # the peg
    shown = made.exploded().colours
    assert shown is not None and {*map(tuple, shown.tolist())} == {RED, BLUE, GREY}


def test_the_command_takes_colours_and_says_which_file_holds_them(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "a.xml"
    source.write_text('<scene version="1"><solid unit="1mm"><box size="50 30 20"/></solid></scene>')
    words = ["mesh", str(source), "--parts", "2x1x1", "--colour", "material", "--voxel", "2mm"]
    for options, line in (
        (["-o", "x.stl"], "colour: expected a file that holds colours: "),
        (
            ["-o", "x.ply", "--filaments", "#000,#fff", "--bodies"],
            "bodies: expected a file that holds them, .3mf",
        ),
        (["-o", "x.3mf", "--heights", "0.1mm..0.2mm"], "--heights: not for an object in parts"),
    ):
        name = str(tmp_path / options[1])
        assert run([*words, "-o", name, *options[2:]]) == 2
        found = capfd.readouterr().err
        assert line in found and found.count("\n") == 1 and list(tmp_path.iterdir()) == [source]
    assert run([*words, "-o", str(tmp_path / "y.ply"), "-q"]) == 0
    parts = [read_mesh(tmp_path / f"y-{n}.ply") for n in (1, 2)]
    assert sum(float(part.size[0]) for part in parts) == pytest.approx(50, rel=1e-6)
    assert b"property uchar red" in (tmp_path / "y-1.ply").read_bytes()[:600]
