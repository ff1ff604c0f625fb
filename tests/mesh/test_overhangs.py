"""Triangles at which supports are advised."""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fracslice import make_mesh
from fracslice.errors import SceneError
from fracslice.formulas import box, cylinder, sphere, transform, union
from fracslice.mesh.checks import HANGS, IS_THIN, marked, overhanging
from fracslice.records import MeshJob
from tests.mesh import shapes

pytestmark = pytest.mark.once

TABLE = union(box(size=(8, 8, 20)), transform(box(size=(30, 30, 4)), translate=(0, 0, 12)))
"""A foot of 20 mm below a plate of 4 mm."""


def test_the_lower_side_of_a_table_is_held() -> None:
    made = make_mesh(TABLE, voxel="1mm", paint_supports=True).mesh
    assert made.supported is not None
    middles, area = made.corners.mean(1), np.linalg.norm(made.normals, axis=1) / 2
    assert area[made.supported].sum() == pytest.approx(30 * 30 - 8 * 8, rel=0.02)
    assert np.abs(middles[made.supported, 2] - 20).max() < 0.01


def test_what_stands_on_the_plate_needs_none_and_the_lowest_of_a_hanging_ball_does() -> None:
    assert not overhanging(shapes.cube(9, (0, 0, 0))).any()
    leg = transform(cylinder(radius=3, height=20), translate=(0, 0, 10))
    arm = transform(cylinder(radius=1, height=16), translate=(7, 0, 15), rotate=(0, 1, 0, 90))
    ball = transform(sphere(radius=4), translate=(14, 0, 14))
    made = make_mesh(union(leg, arm, ball), voxel="0.5mm")
    held = overhanging(made.mesh)
    low = made.corners.mean(1)[held]
    x = made.vertices[:, 0].max() - 4  # of the ball's middle
    near = low[np.hypot(low[:, 0] - x, low[:, 1]) < 4]
    assert near[:, 2].min() == pytest.approx(10, abs=0.1) and near[:, 2].max() < 10 + 4 * (1 - 0.707) + 0.1
    assert held.mean() < 0.2 and not held[made.corners.mean(1)[:, 2] < 9].any()


def test_pictures_mark_what_hangs_and_what_is_thin() -> None:
    fin = transform(box(size=(0.6, 12, 10)), translate=(10, 0, 18))
    mesh = make_mesh(union(TABLE, fin), voxel="0.5mm").mesh
    shown = marked(mesh, 0.8)
    assert shown.colours is not None and shown.volume == pytest.approx(mesh.volume)
    colours, middles = shown.colours[shown.triangles[:, 0]], shown.corners.mean(1)
    x = mesh.vertices[:, 0].max() - 5  # of the fin
    in_fin = (middles[:, 2] > 24.5) & (middles[:, 2] < 33)
    sides = in_fin & (np.abs(np.abs(middles[:, 0] - x) - 0.3) < 0.01)
    assert sides.any() and (colours[sides] == IS_THIN).all(1).mean() > 0.95
    far = np.abs(middles[:, 0] - x) > 1.5
    assert not (colours[far] == IS_THIN).all(1).any()
    assert np.array_equal((colours == HANGS).all(1), overhanging(mesh))


@pytest.mark.skipif(not shutil.which("prusa-slicer"), reason="needs prusa-slicer")
def test_prusaslicer_puts_supports_there_alone(tmp_path: Path) -> None:
    settings = "support_material = 1\nsupport_material_auto = 0\nlayer_height = 0.3\nskirts = 0\n"
    (tmp_path / "a.ini").write_text(f"{settings}bed_shape = 0x0,200x0,200x200,0x200\n")
    layers = []
    for painted in (False, True):
        make_mesh(TABLE, voxel="1mm", paint_supports=painted, path=tmp_path / "a.3mf")
        command = ["prusa-slicer", "--export-gcode", "--load", "a.ini", "a.3mf"]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
        layers.append(len(re.findall(r"^;TYPE:Support material$", (tmp_path / "a.gcode").read_text(), re.M)))
    assert layers[0] == 0 and layers[1] > 40


def test_files_have_both_attributes_and_other_files_are_refused(tmp_path: Path) -> None:
    made = make_mesh(TABLE, voxel="1mm", paint_supports=True, path=tmp_path / "a.3mf").mesh
    assert made.supported is not None
    with zipfile.ZipFile(tmp_path / "a.3mf") as file:
        model = file.read("3D/3dmodel.model").decode()
    assert model.count('slic3rpe:custom_supports="4" paint_supports="4"') == made.supported.sum()
    with pytest.raises(SceneError, match="paint_supports: expected a file that holds them"):
        make_mesh(TABLE, voxel="1mm", paint_supports=True, path=tmp_path / "a.stl")
    with pytest.raises(SceneError, match="paint_supports and a colour: expected filaments, too"):
        MeshJob(colour="material", paint_supports=True)
    with pytest.raises(SceneError, match="paint_supports and bodies: expected one of them"):
        MeshJob(colour="material", filaments=2, bodies=True, paint_supports=True)
