"""Bodies that touch at points or edges only: the report names them and the option that joins them."""

from __future__ import annotations

import re
from typing import Literal

import numpy as np
import pytest

from fracslice import make_mesh
from fracslice._native import near_bodies
from fracslice.formulas import box, capsule, cells, flake, shell, sphere, transform, union
from fracslice.mesh.shells import NearBodies, WholeShells

pytestmark = pytest.mark.once


@pytest.mark.nightly
def test_a_flake_whose_corners_touch_is_joined_by_the_thickness_that_its_report_names() -> None:
    root = flake(solid="tetrahedron", level=1)
    made = make_mesh(root, size="60mm", resolution=32)
    assert made.report.mesh.components == 4
    (note,) = (note for note in made.report.notes if "two voxels" in note)
    assert int(re.match(r"(\d+) bodies", note)[1]) == 4  # type: ignore[index]
    thickness = re.search(r"--thickness (\S+mm)", note)[1]  # type: ignore[index]
    joined = make_mesh(root, size="60mm", resolution=32, thickness=thickness)
    assert joined.report.mesh.components == 1
    assert not any("two voxels" in note for note in joined.report.notes)


def test_one_line_says_what_is_lost_and_which_options_help() -> None:
    """A tetrahedron of four voxels is sampled as its middle and four tips; its sharp edges hold most tips."""
    root = flake(solid="tetrahedron", level=3)
    made = make_mesh(root, size="60mm", resolution=32)
    assert made.report.mesh.components == 64
    assert made.report.removed.bodies <= 4
    (note,) = made.report.notes
    assert re.match(
        r"60 bodies come within two voxels .* --set flake\.level=1 makes them about 8 voxels wide or more, "
        r"--thickness 5\.6mm or --bridge 5\.6mm joins them, --keep largest leaves one; .*% of the object's",
        note,
    )
    assert make_mesh(root, size="60mm", resolution=32, thickness=5.6).report.mesh.components == 1
    whole = make_mesh(flake(solid="tetrahedron", level=1), size="60mm", resolution=32)
    assert whole.report.mesh.components == 4


@pytest.mark.parametrize(("keep", "side"), [("largest", 60.0), (3, 20.0)])
def test_bodies_that_stay_have_the_size_and_the_voxels_that_were_asked_for(
    keep: Literal["largest"] | int, side: float
) -> None:
    """Tetrahedra of a flake, each between four corners of a cube of a quarter of its size."""
    made = make_mesh(flake(solid="tetrahedron", level=2), size="60mm", resolution=32, keep=keep)
    count = 1 if keep == "largest" else keep
    assert made.report.mesh.components == count
    assert made.size.max() == pytest.approx(60, rel=5e-3)
    assert made.volume == pytest.approx(count * side**3 / 3, rel=0.05)
    assert made.report.voxel_mm == pytest.approx(60 / 32, rel=2e-3)


def test_the_largest_of_distant_bodies_is_sampled_anew() -> None:
    balls = [transform(sphere(r), translate=(x, x / 2, 0)) for r, x in ((0.1, -1), (0.08, 1), (0.05, 0))]
    made = make_mesh(union(*balls), size="60mm", resolution=32, keep="largest")
    assert made.report.voxel_mm == pytest.approx(60 / 32, rel=1e-3)
    assert made.volume == pytest.approx(np.pi / 6 * 60**3, rel=0.01)


@pytest.mark.nightly
def test_cells_that_touch_along_edges_become_one_body() -> None:
    root = cells(keep=(0, 2), level=2)
    assert make_mesh(root, size="60mm", resolution=36).report.mesh.components == 196
    assert make_mesh(root, size="60mm", resolution=36, thickness="3mm").report.mesh.components == 1


def test_the_bridge_joins_what_the_voxels_of_the_mesh_break() -> None:
    """Balls on a rod thinner than a voxel, no crumb of which is dropped, and a loose ball."""
    rod = capsule(**{"from": (-1, -0.9, -0.8), "to": (1, 0.8, 0.9), "radius": 0.02})
    ends = (transform(sphere(0.5), translate=at) for at in ((-1, -0.9, -0.8), (1, 0.8, 0.9)))
    root = union(rod, *ends, transform(sphere(0.3), translate=(0.3, -0.8, 0.9)))
    assert make_mesh(root, size="60mm", resolution=32).report.mesh.components >= 3
    assert make_mesh(root, size="60mm", resolution=32, bridge="6mm").report.mesh.components == 1


def test_a_gap_is_no_contact() -> None:
    """Of 1.6 samples of the solid: thickened bodies stay two."""
    plates = [transform(box(size=(2, 2, 0.4)), translate=(0, 0, z)) for z in (-0.2125, 0.2125)]
    made = make_mesh(union(*plates), size="20mm", resolution=100, thickness="2mm")
    assert made.report.mesh.components == 2


def test_distant_bodies_and_cavities_do_not_touch() -> None:
    distant = make_mesh(union(*(transform(sphere(0.3), translate=(x, 0, 0)) for x in (-1, 1))), resolution=32)
    assert distant.report.mesh.components == 2
    hollow = make_mesh(shell(sphere(), thickness=0.1), resolution=48)
    assert hollow.report.mesh.cavities == 1
    for made in (distant, hollow):
        assert not any("two voxels" in note for note in made.report.notes)


@pytest.mark.parametrize("largest", [0, 3])
def test_bodies_with_points_in_one_cube_are_near(largest: int) -> None:
    """As by sorting the points; the same for any number of threads."""
    random = np.random.default_rng(1)
    labels = random.integers(0, 400, 60_000).astype(np.int32)
    bodies = np.where(np.arange(400) % 5 == 4, -1, np.arange(400) % 300).astype(np.int32)
    points = random.random((300, 3))[bodies[labels]] + 0.02 * random.random((len(labels), 3))
    near = set[int]()
    for shift in (0.0, 0.5):
        cubes = np.floor((points + 0.1) / 0.06 + shift).astype(int)
        rows = np.unique(np.column_stack([cubes, bodies[labels]])[bodies[labels] >= 0], axis=0)
        same = (rows[1:, :3] == rows[:-1, :3]).all(axis=1)
        near |= set(rows[1:, 3][same]) | set(rows[:-1, 3][same])
    assert 20 < len(near) < 230
    for threads in (1, 2):
        made = near_bodies(points, labels, bodies, 300, largest, (-0.1,) * 3, 0.06, threads)
        assert made.tolist() == sorted(near)
    with pytest.raises(ValueError, match="names no body"):
        near_bodies(points, labels, bodies[:399], 300, largest, (-0.1,) * 3, 0.06)


def test_bodies_meet_across_a_seam() -> None:
    ends = np.array([[[-1.0, 0, 0]] * 3 + [[-0.1, 0, 0]] * 3, [[0.1, 0, 0]] * 3 + [[1, 0, 0]] * 3])
    shells = WholeShells(
        np.arange(2, dtype=np.int32), np.ones(2), np.ones(2), ends, np.zeros(2, np.int32), np.arange(2)
    )
    near = NearBodies(shells, np.ones(2, bool), 0.2)
    one, other = ((ends[body], np.full(6, body, np.int32)) for body in (0, 1))
    assert near.several and near.within(*one).size == near.within(*other).size == 0
    assert near.across(0.0, one, other).tolist() == [0, 1]
