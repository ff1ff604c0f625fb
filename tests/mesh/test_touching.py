"""Bodies that touch at points or edges only: the report names them and the option that joins them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fracslice import make_mesh
from fracslice._native import near_bodies
from fracslice.formulas import flake, shell, sphere, transform, union
from fracslice.mesh.touching import NearBodies
from fracslice.mesh.whole_shells import WholeShells


def test_a_flake_whose_corners_touch_is_joined_by_the_thickness_that_its_report_names() -> None:
    root = flake(solid="tetrahedron", level=2)
    made = make_mesh(root, size="60mm", resolution=48)
    assert made.report.mesh.components > 16
    (note,) = (note for note in made.report.notes if "two voxels" in note)
    assert int(re.match(r"(\d+) bodies", note)[1]) >= 16  # type: ignore[index]
    thickness = re.search(r"--thickness (\S+mm)", note)[1]  # type: ignore[index]
    joined = make_mesh(root, size="60mm", resolution=48, thickness=thickness)
    assert joined.report.mesh.components == 1
    assert not any("two voxels" in note for note in joined.report.notes)


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
    for body, end in ((0, 0.0), (1, np.inf)):
        near.add(ends[body], np.full(6, body, np.int32), end)
    assert near.count == 2
