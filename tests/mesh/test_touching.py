"""Bodies that touch at points or edges only: the report names them and the option that joins them."""

from __future__ import annotations

import re

from fracslice import make_mesh
from fracslice.formulas import flake, shell, sphere, transform, union
from fracslice.mesh.touching import near_bodies


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


def test_bodies_apart_and_cavities_do_not_touch() -> None:
    spheres = make_mesh(union(*(transform(sphere(0.3), translate=(x, 0, 0)) for x in (-1, 1))), resolution=32)
    assert spheres.report.mesh.components == 2 and near_bodies(spheres, 2 * spheres.report.voxel_mm) == 0
    assert not any("two voxels" in note for note in spheres.report.notes)
    hollow = make_mesh(shell(sphere(), thickness=0.1), resolution=48)
    assert near_bodies(hollow, 4 * hollow.report.voxel_mm) == 0
