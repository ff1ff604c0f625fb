"""Walls and gaps thinner than the samples, kept, bridged and filled: what is in one piece stays so."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice.formulas import Node, box, julia, mandelbulb, shell, sphere, transform, union
from fracslice.mesh import contouring
from fracslice.mesh.contouring import contour_pieces
from fracslice.printing import bridging, printable
from fracslice.printing import thin_features as connectivity
from fracslice.printing.edits import EditedField
from fracslice.printing.preparation import COARSE
from fracslice.printing.thin_features import resolve_connectivity, thin_features
from fracslice.printing.walls import SolidComponents, components_of, sign_samples
from fracslice.scene import Print, scene
from fracslice.volume import Lattice, Plan, plan, sample, sample_scene_signs
from fracslice.volume.amount import Sizing
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once

SIZE = 20.0
VOXEL = 2 / COARSE
"""Of objects two units large, about, in their units."""


def made(root: Node, **printing: float | str) -> Plan:
    return printable(plan(root, COARSE), Sizing(SIZE), Print(**printing))[0]  # type: ignore[arg-type]


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


def inside(made: Plan, points: np.ndarray) -> np.ndarray:
    return made.root.kernel("cpu", "float64").points(*points.T) < 0


def on_sphere(radius: float) -> np.ndarray:
    directions = np.random.default_rng(0).normal(size=(5000, 3))
    return np.asarray(radius * directions / np.linalg.norm(directions, axis=1)[:, None])


def components(made: Plan, voxels: float) -> tuple[SolidComponents, float]:
    """On samples that are finer."""
    voxel = max(made.box.size) / COARSE * voxels
    lattice = Lattice.around(made.outer, voxel)
    return components_of(sample(made.root.kernel(), made.root.bounds, lattice)), voxel


def test_a_plate_between_all_samples_needs_no_finer_ones() -> None:
    for middle in (0.0, 0.3):
        plate = at(box(size=(2, 0.1 * VOXEL, 2)), 0, middle, 0)
        bricks = connectivity.sampled_object(plate, plate.bounds.box, 2, COARSE, Work())
        assert bricks.voxel == pytest.approx(VOXEL) and (bricks.values < 0).any()


def plates(thick: float, gap: float) -> Node:
    """Two, the lower one smaller, in voxels."""
    z = (thick + gap) / 2
    pair = union(*(at(box(size=(s, s, thick * VOXEL)), 0, 0, h * VOXEL) for s, h in ((2, z), (1.8, -z))))
    return transform(pair, rotate=(1, 0.3, 0.2, 31))


BALL = at(sphere(radius=0.1), 1.3, 0, 0)


@pytest.mark.parametrize("voxels", stamped([0.6, 1.0], [1.0]))
def test_the_inside_of_a_thin_sealed_shell_is_filled(voxels: float) -> None:
    filled = made(shell(sphere(), thickness=voxels * VOXEL), cavities="fill")
    for radius in (0.1, 0.9, 1 - 0.5 * voxels * VOXEL):
        assert inside(filled, on_sphere(radius)).all()
    assert not inside(filled, on_sphere(1.001)).any()


@pytest.mark.parametrize("voxels", [0.6, 1.0])
def test_a_thin_shell_is_kept_whole(voxels: float) -> None:
    kept = made(union(shell(sphere(), thickness=voxels * VOXEL), BALL), keep="largest")
    assert inside(kept, on_sphere(1 - 0.5 * voxels * VOXEL)).all()
    assert not inside(kept, on_sphere(0.9)).any()
    assert not inside(kept, np.array([[1.3, 0, 0], [1.39, 0, 0]])).any()


def test_what_floats_in_a_cavity_is_of_the_body_around_it() -> None:
    """Of a shell less than the ball in it, and than the one beside it."""
    inner, beside = sphere(radius=0.7), at(sphere(radius=0.9), 2, 0, 0)
    root = union(shell(sphere(), thickness=0.05), inner, beside)
    kept = made(root, cavities="fill", keep="largest")
    assert inside(kept, on_sphere(0.8)).all() and inside(kept, on_sphere(0.6)).all()
    assert not inside(kept, np.array([[2.0, 0, 0]])).any()
    joined = made(root, cavities="fill", bridge=1)
    assert inside(joined, np.array([[1.05, 0, 0]])).all()
    assert not inside(joined, np.array([[-1.05, 0, 0], [0, 0, 1.05]])).any()


@pytest.mark.parametrize("then", [{"keep": "largest"}, {"bridge": 1}], ids=str)
def test_cavities_and_bodies_are_distinguished_by_the_same_samples(
    then: dict[str, float | str], monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = []
    monkeypatch.setattr(
        connectivity, "thin_features", lambda *those: looks.append(those) or thin_features(*those)
    )
    root = union(shell(sphere(), thickness=0.1), BALL)
    for how in ({"cavities": "fill"}, {"cavities": "fill", **then}):
        made(root, **how)  # type: ignore[arg-type]
    assert len(looks) == 2


@pytest.mark.nightly
def test_a_thin_shell_is_not_bridged_to_itself() -> None:
    thin = shell(sphere(), thickness=0.4 * VOXEL)
    assert not isinstance(made(thin, bridge=1).root, EditedField)
    joined = made(union(thin, BALL), bridge=1)
    assert inside(joined, np.array([[1.1, 0, 0]])).all()
    assert not inside(joined, on_sphere(0.8)).any()
    assert not inside(joined, np.array([[-1.1, 0, 0], [0, 0, 1.1], [0, 0, -1.1]])).any()


@pytest.mark.parametrize(("thick", "gap"), stamped([(0.5, 0.4), (0.5, 2.5), (2, 0.4)], [(0.5, 0.4)]))
def test_plates_however_near_stay_two(thick: float, gap: float) -> None:
    """Only the larger one is kept, whole; and both are joined by a strut."""
    root = plates(thick, gap)
    both, voxel = components(plan(root, COARSE), 0.2)
    assert len(both.bodies) == 2
    volumes = both.count[both.bodies] * voxel**3
    one, voxel = components(made(root, keep="largest"), 0.2)
    assert one.count[one.bodies] * voxel**3 == pytest.approx(volumes[:1], rel=0.01)
    assert len(components(made(root, bridge=1), 0.2)[0].bodies) == 1


def test_the_straight_way_between_contacts_goes_from_sample_to_sample() -> None:
    for last in ((3, -5, 1), (0, 0, 2), (0, 0, 0)):
        way = bridging._straight(np.array([1, 2, -3]), np.array([1, 2, -3]) + last)
        assert way[:, 0].tolist() == [1, 2, -3] and (way[:, -1] - way[:, 0]).tolist() == list(last)
        assert (np.abs(np.diff(way)).sum(axis=0) == 1).all() and way.shape[1] == sum(map(abs, last)) + 1


def test_what_is_thick_is_not_looked_at_again() -> None:
    for root, loose in ((box(), True), (mandelbulb(iterations=4), False)):
        planned = plan(root, 48)
        bricks = sample(planned.root.kernel(), planned.root.bounds, planned.lattice)
        assert resolve_connectivity(planned.root, bricks, 1e-3, loose, Work()) is bricks


@pytest.mark.nightly
def test_a_thin_shell_is_kept_and_thickened_in_a_mesh() -> None:
    """Whose voxels are six times as large as its wall. The size is the shell's before it is thickened, as
    far as these tell.
    """
    thin = scene(union(shell(sphere(), thickness=0.013), BALL), size="20mm")
    how = Print(keep="largest", thickness=1.5)
    result = make_mesh(thin, MeshJob(resolution=32, printing=how))
    assert result.report.problems == ()
    assert result.report.mesh.components == 1
    assert result.mesh.size == pytest.approx([21.4] * 3, abs=0.4)


THIN = scene(union(shell(sphere(), thickness=0.01), BALL), size="20mm")
"""Of which a mesh of 48 voxels has crumbs, the ball the largest of them."""


@pytest.fixture
def contoured(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Calls of the mesher, of the voxel that was asked for."""
    calls: list[object] = []
    monkeypatch.setattr("fracslice.jobs.mesh.RAISED", 0)
    monkeypatch.setattr(
        contouring, "contour_pieces", lambda *those: calls.append(those) or contour_pieces(*those)
    )
    return calls


@pytest.mark.usefixtures("only_samples")
def test_a_mesh_in_pieces_does_not_tell_which_body_is_the_largest(contoured: list[object]) -> None:
    """The field does: of the shell all crumbs stay, at the shell's size, and it is said that they are."""
    whole, kept = (
        make_mesh(THIN, MeshJob(resolution=48, printing=Print(keep=keep))) for keep in ("all", "largest")
    )
    assert len(contoured) == 2  # once for each: bodies are chosen before anything is meshed
    assert min(result.report.mesh.components for result in (whole, kept)) > 100
    assert kept.mesh.size == pytest.approx([20] * 3, rel=0.03)
    for result in (whole, kept):
        note = result.report.notes[0]
        assert "tips and walls thinner than the voxel of 0.42mm" in note
        assert f"--thickness {3 * result.report.voxel_mm:.2g}mm" in note


@pytest.mark.parametrize("thickness", [0.4, 0.8, 1.25, 2.5])
def test_the_share_of_thin_walls_is_that_of_the_thickness(thickness: float) -> None:
    """Of a shell in voxels and a thick ball of a twentieth of its area."""
    planned = plan(union(shell(sphere(), thickness=thickness / 24), at(sphere(radius=0.25), 1.4, 0, 0)), 64)
    share = components_of(sign_samples(sample_scene_signs(planned))).thin_share
    assert share > 0.5 if thickness < 1 else share == 0


def test_a_mesh_in_pieces_is_filled_by_what_the_field_tells(contoured: list[object]) -> None:
    filled = make_mesh(THIN, MeshJob(resolution=48, printing=Print(cavities="fill"))).report
    scale = 20 / 2.4
    assert filled.notes == () and len(contoured) == 1
    assert filled.mesh.volume_mm3 == pytest.approx(4 / 3 * np.pi * (1 + 0.1**3) * scale**3, rel=0.02)


@pytest.mark.nightly
def test_a_fractal_in_pieces_is_kept_and_thickened() -> None:
    """It has the size that was asked for, not one of its crumbs; and plain fractals are not in pieces."""
    julias = shell(julia(c=(-0.291, -0.399, 0.339, 0.437), iterations=8), thickness=0.001)
    how = Print(keep="largest", thickness=1.7)
    report = make_mesh(scene(julias, size="40mm"), MeshJob(resolution=48, printing=how)).report
    low, high = np.array(report.mesh.bbox_mm)
    assert (high - low).max() == pytest.approx(41.7, abs=0.5)
    assert report.mesh.components == 1
    reports = [report]
    for fractal in (mandelbulb(), shell(mandelbulb(iterations=6), thickness=0.02)):
        reports.append(make_mesh(scene(fractal, size="40mm"), MeshJob(resolution=48)).report)
    assert not any("fell to pieces" in note for report in reports for note in report.notes)


@pytest.mark.parametrize(("voxels", "looks"), [(16, 0), (0, 1)])
def test_a_coarse_mesh_keeps_the_bodies_that_a_finer_one_would(
    voxels: int, looks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Samples as of a mesh of 128 voxels tell bodies from crumbs; layers look for what these miss."""
    found = []
    monkeypatch.setattr(
        connectivity, "thin_features", lambda *those: found.append(those) or thin_features(*those)
    )
    root = union(shell(sphere(), thickness=3 * VOXEL), BALL)
    how = Print(keep="largest")
    kept, _ = printable(plan(root, voxels or COARSE), Sizing(SIZE), how, measured=not voxels)
    assert len(found) == looks
    assert inside(kept, on_sphere(1 - 1.5 * VOXEL)).all()
    assert not inside(kept, np.array([[1.3, 0, 0], [1.39, 0, 0]])).any()
