"""Real units, compensation of shrinkage and orientation, in meshes and layers alike."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice import make_mesh, slice_layers
from fracslice.errors import SceneError
from fracslice.formulas import (
    Node,
    box,
    cylinder,
    difference,
    julia,
    mandelbulb,
    menger,
    quaternion_mandelbrot,
    sphere,
    transform,
    union,
)
from fracslice.jobs.mesh import make_mesh as mesh_of
from fracslice.records import MeshJob
from fracslice.scene import Print, Scene, reads, scene, to_xml
from fracslice.volume import extent
from fracslice.volume.amount import Sizing, sizing
from fracslice.volume.extent import _kept
from tests.examples import stamped

pytestmark = pytest.mark.once

BORE = 17.0


def ring() -> Node:
    """A ring with a bore of 17 units from which a fractal sticks out."""
    band = difference(cylinder(radius=10.5, height=4), cylinder(radius=BORE / 2, height=6))
    stone = transform(menger(level=2), scale=(2.0,), rotate=(1, 1, 0, 40), translate=(12.5, 0, 0))
    return union(band, stone)


def bore(made: Scene, voxel: float, **job: object) -> tuple[float, float]:
    """Diameters of the bore along x and y in a mesh, mm."""
    result = mesh_of(made, MeshJob(voxel=voxel, **job))  # type: ignore[arg-type]
    points = result.place.units(result.mesh.vertices)
    inner = (np.hypot(points[:, 0], points[:, 1]) < BORE / 2 + 0.1) & (np.abs(points[:, 2]) < 1.9)
    x, y, _ = np.ptp(result.mesh.vertices[inner], axis=0).tolist()
    return x, y


def test_the_bore_of_a_ring_is_as_wide_as_stated_whatever_sticks_out() -> None:
    voxel = 0.6
    assert bore(scene(ring(), unit="1mm"), voxel) == pytest.approx((17.0, 17.0), abs=voxel / 50)
    assert bore(scene(ring(), size="24mm"), voxel)[0] < 16.5


@pytest.mark.nightly
def test_the_bore_of_a_ring_is_as_wide_as_stated_in_another_unit() -> None:
    assert bore(scene(ring(), unit=2), 1.2) == pytest.approx((34.0, 34.0), abs=0.6 / 25)


def test_the_bore_in_layers_is_as_wide_as_stated() -> None:
    layer = slice_layers(scene(ring(), unit="1mm"), layer=1, pixel=0.1)[2]
    solid = np.flatnonzero(layer[layer.shape[0] // 2] > 127)
    assert 0.1 * (np.diff(solid).max() - 1) == pytest.approx(BORE, abs=0.11)


def test_scale_compensates_shrinkage_along_each_axis() -> None:
    part = scene(box(size=(10, 20, 5)), unit="1mm")
    for options in ({"unit": 1}, {"size": 20}):
        made = scene(box(size=(10, 20, 5)), **options)
        mesh = make_mesh(made, resolution=20, scale="102%,102%,101%")
        assert mesh.size.tolist() == pytest.approx([10.2, 20.4, 5.05], rel=1e-6)
    assert make_mesh(part, resolution=20, scale=1.02).size.tolist() == pytest.approx([10.2, 20.4, 5.1])
    stack = slice_layers(part, layer=0.5, pixel=0.5, scale=(1.0, 1.0, 1.1)).stack
    assert stack.size == pytest.approx((10, 20, 5.5), rel=1e-6)


def test_the_tallest_side_of_a_size_is_the_one_before_compensation() -> None:
    mesh = make_mesh(scene(box(size=(1, 2, 4)), size=40), resolution=20, scale=(1.1, 1.0, 1.0))
    assert mesh.size.tolist() == pytest.approx([11, 20, 40], rel=1e-6)


def test_up_turns_meshes_as_it_turns_layers() -> None:
    part = box(size=(1, 2, 4))
    mesh = make_mesh(part, resolution=20, up=(1, 0, 0))
    assert mesh.size.tolist() == pytest.approx(slice_layers(part, 0.1, up=(1, 0, 0)).size) == [4, 2, 1]


def test_the_body_that_stays_does_not_change_the_unit() -> None:
    two = scene(union(box(), transform(box(), scale=(0.5,), translate=(3, 0, 0))), unit=10)
    mesh = mesh_of(two, MeshJob(resolution=40, printing=Print(keep="largest"))).mesh
    assert mesh.size.tolist() == pytest.approx([10, 10, 10])


FRACTALS = {
    "mandelbulb of power 3": mandelbulb(power=3, iterations=10),
    "disconnected Julia set": julia(c=(-0.4969, 0.3651, 0.6223, 0.4209), iterations=12),
    "quaternion Mandelbrot set": quaternion_mandelbrot(iterations=12),
    "mandelbulb of power 8": mandelbulb(power=8, iterations=10),
}


@pytest.mark.parametrize("name", stamped(FRACTALS, ["disconnected Julia set", "mandelbulb of power 8"]))
def test_a_unit_of_the_scene_is_as_long_in_every_mesh_and_layer(name: str) -> None:
    """Specks that the voxel or the dust takes away do not change the scale, and what they held is said."""
    root = FRACTALS[name]
    part, expected = scene(root, size=30), 30 / max(extent(root).box.size)
    for resolution, dust in ((32, None), (64, 0.0), (64, None)):
        _kept.clear()
        made = mesh_of(part, MeshJob(resolution=resolution, dust=dust))
        assert made.place.scale == pytest.approx(expected, rel=1e-6)
        size, report = np.array(extent(root).box.size) * expected, made.report
        assert np.array(report.lost_mm) == pytest.approx(np.maximum(size - made.mesh.size, 0), abs=1e-4)
        said = any(note.startswith("the mesh is ") and " mm of " in note for note in report.notes)
        assert said == (max(report.lost_mm) > report.voxel_mm)
    for pixel in (0.5, 0.2):
        _kept.clear()
        assert slice_layers(part, pixel, pixel=pixel).stack.scale == pytest.approx(expected, rel=1e-6)


def test_a_speck_that_is_removed_changes_no_size() -> None:
    """The ball stays at its place and size, and the note says that the speck reached farther."""
    two = scene(union(sphere(), transform(sphere(radius=0.02), translate=(1.98, 0, 0))), size=30)
    with_speck, without = (mesh_of(two, MeshJob(resolution=150, dust=dust)) for dust in (0.0, 1.0))
    assert without.place.scale == pytest.approx(10, rel=1e-6) == with_speck.place.scale
    assert without.mesh.size == pytest.approx([20] * 3, abs=5e-3)
    assert without.mesh.vertices[:, 0].min() == pytest.approx(with_speck.mesh.vertices[:, 0].min())
    note = "the mesh is 20.00 mm of 30.00 mm along x: bodies that were removed reach farther"
    assert note in without.report.notes and note not in with_speck.report.notes


def test_a_unit_is_written_measured_and_overridden() -> None:
    text = '<scene version="1"><solid unit="2.5cm"><box/></solid></scene>'
    made = reads(text)
    assert (made.size_mm, made.unit_mm) == (None, 25) and reads(to_xml(made)) == made
    assert sizing(made) == Sizing(25, 25) and sizing(made, 40) == Sizing(40)
    assert made.with_values(["solid.size=4cm"]).size_mm == 40
    assert made.with_values(["solid.unit=1in"]).unit_mm == 25.4
    with pytest.raises(SceneError, match="size and unit: expected one of them"):
        scene(box())
    with pytest.raises(SceneError, match="expected a percentage such as 102%"):
        MeshJob(scale="2%")  # type: ignore[arg-type]
