"""Plates and wires thinner than a voxel, with exact volumes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracslice.errors import EmptyError
from fracslice.fields.node import Node
from fracslice.formulas import box, capsule, sphere, torus, transform, union
from fracslice.jobs.mesh import make_mesh
from fracslice.jobs.report import Result
from fracslice.mesh.roots import Segments
from fracslice.mesh.subgrid import FINEST, ThinParts
from fracslice.mesh.tetrahedra import Tetrahedra
from fracslice.records import MeshJob
from fracslice.volume import Plan, plan
from fracslice.work import Work
from tests.test_job import scene

pytestmark = pytest.mark.once

VOXELS = 32
ENDS = np.array([(-0.6, -0.5, -0.62), (0.63, 0.57, 0.6)])


def plate(voxels: float) -> Node:
    """A turned plate of so many voxels."""
    thickness = voxels * max(plan(plate_of(0.01), VOXELS).box.size) / VOXELS
    return plate_of(thickness)


def plate_of(thickness: float) -> Node:
    return transform(box(size=(2, 2, thickness)), rotate=(1, 2, 3, 37.0))


def wire(voxels: float) -> Node:
    """A slanted wire of so many voxels across."""
    radius = voxels * np.ptp(ENDS, axis=0).max() / VOXELS / 2
    return capsule(from_=ENDS[0].tolist(), to=ENDS[1].tolist(), radius=radius)


def volume(node: Node) -> float:
    """Exact volume, scene units^3."""
    if node.formula.name == "transform":
        return math.prod(node.children[0]["size"])
    radius = node["radius"]
    return math.pi * radius**2 * (np.linalg.norm(np.diff(ENDS, axis=0)) + 4 / 3 * radius)


def made(node: Node, voxels: float = VOXELS) -> Result:
    return make_mesh(scene(node, size="40mm"), MeshJob(resolution=voxels))


def planned(node: Node) -> Plan:
    return plan(node, VOXELS)


@pytest.mark.parametrize(
    ("shape", "voxels", "off"),
    [(plate, 0.6, 0.01), (plate, 0.05, 0.01), (wire, 0.3, 0.01), (wire, 0.05, 0.02)],
)
def test_what_is_thinner_than_a_voxel_is_one_whole_body(shape, voxels, off):
    """A turned plate of 0.6 voxels was 3,859 bodies and lacked 71 %; a wire was no body at all."""
    node = shape(voxels)
    result = made(node)
    report = result.report
    assert report.problems == () and report.mesh.components == 1 and report.mesh.cavities == 0
    assert report.mesh.self_intersections == report.mesh.open_edges == 0
    assert report.mesh.volume_mm3 / result.place.scale**3 == pytest.approx(volume(node), rel=off)
    assert report.voxel_mm == pytest.approx(40 / VOXELS)
    (note,) = (note for note in report.notes if "tetrahedra" in note)
    assert note.startswith("tetrahedra show what is thinner than a voxel; samples lose ")


def test_vertices_are_on_the_surface():
    result = made(plate(0.3))
    assert result.report.surface_error_mm.max < 1.1e-3 * result.report.voxel_mm


def test_the_mesh_does_not_depend_on_threads():
    one, three = (
        make_mesh(scene(wire(0.3), size="40mm"), MeshJob(resolution=16), Work(threads=n)) for n in (1, 3)
    )
    assert (one.vertices == three.vertices).all() and (one.triangles == three.triangles).all()


def test_a_thin_element_beside_a_thick_one_is_there():
    report = made(union(sphere(), torus(radius=1.5, tube=0.006))).report
    assert report.problems == () and report.mesh.components == 2
    assert any("samples lose an element of the scene" in note for note in report.notes)


def test_nothing_is_split_where_nothing_is_thin(monkeypatch):
    monkeypatch.setattr("fracslice.mesh.subgrid.thin_surface", lambda *_: pytest.fail("split"))
    assert made(plate(2.5)).report.problems == ()


def test_what_is_thinner_than_the_finest_step_is_refused():
    with pytest.raises(EmptyError, match="thinner than a voxel"):
        made(plate(FINEST / 8))


def test_split_cells_fill_the_same_space_and_none_is_turned_over():
    parts = ThinParts(planned(wire(0.3)).root, planned(wire(0.3)).lattice, Work())
    mesh = parts.mesh
    whole = signed(mesh).sum()
    parts.run()
    assert signed(mesh).sum() == pytest.approx(whole, rel=1e-12) and signed(mesh).min() > 0


def signed(mesh: Tetrahedra) -> np.ndarray:
    """Volumes of the cells."""
    a, b, c, d = mesh.points[:, mesh.cells].transpose(1, 0, 2)
    return ((b - a) * np.cross(c - a, d - a, axis=0)).sum(axis=0) / 6


def test_segments_find_a_sheet_between_points_outside():
    node, finest = box(size=(2, 2, 0.004)), 0.002
    starts = np.array([(0, 0, -0.5), (0, 0, 0.1), (0.3, 0, -0.001)]).T
    along = np.array([(0.2, 0, 1.0), (0.2, 0, 1.0), (0.1, 0.2, 0.4)]).T
    ends = np.array([node.kernel("cpu", "float64").points(*p) for p in (starts, starts + along)])
    below, above = Segments(node, 0.1, finest, Work()).approach(starts, along, ends)
    assert 0.498 <= below[0] <= 0.502 and 0.498 <= above[0] <= 0.502
    assert below[1] < 0 and above[1] < 0, "no sheet there"
    assert below[2] == pytest.approx(0.0075, abs=0.006) and below[2] > above[2] - 0.02, "one root"
