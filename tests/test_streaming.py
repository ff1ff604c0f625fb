"""A mesh larger than memory: the same object as one made in memory, whatever the pieces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice.errors import Cancelled, ExportError, SceneError, TooLargeError
from fracslice.formulas import (
    box,
    cone,
    difference,
    flake,
    mandelbulb,
    menger,
    octahedron,
    shell,
    sphere,
    transform,
    union,
)
from fracslice.jobs import mesh_steps
from fracslice.mesh.models import read_mesh
from fracslice.scene import Print, scene
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once


def moved(node, *by):
    return transform(node, translate=by)


HOLLOW = union(
    difference(sphere(radius=1), sphere(radius=0.8)),
    sphere(radius=0.3),
    moved(box(size=(0.4, 0.4, 0.4)), 1.6, 0, 0),
)
SCENES = {
    "fractal": scene(mandelbulb(iterations=5), size="40mm", name="bulb"),
    "corners": scene(menger(level=2), size="30mm", name="sponge"),
    "nested": scene(HOLLOW, size="40mm", name="nested"),
    "tips": scene(union(octahedron(radius=0.5), moved(cone(radius=0.3, height=1.2), 0.9, 0, 0)), size="40mm"),
    "sharp": scene(
        union(
            transform(box(size=(1, 0.7, 0.8)), rotate=(1, 2, 3, 40)),
            moved(transform(octahedron(radius=0.5), rotate=(1, 2, 3, 37)), 1.2, 0, 0),
        ),
        size="40mm",
    ),
    "touching": scene(flake(solid="tetrahedron", level=2), size="40mm"),
    "thin": scene(shell(sphere(), thickness=0.02), size="40mm"),
}
JOBS = {
    "plain": MeshJob(resolution=40),
    "largest": MeshJob(resolution=48, printing=Print(keep="largest")),
    "filled": MeshJob(resolution=48, printing=Print(cavities="fill")),
    "dust": MeshJob(resolution=48, dust=900),
    "base": MeshJob(resolution=48, printing=Print(base=2, raft=2)),
}
CASES = [
    *((name, "plain") for name in ("fractal", "corners", "nested", "tips", "sharp", "touching")),
    *(("nested", job) for job in JOBS if job != "plain"),
    ("thin", "filled"),
]


@pytest.fixture
def pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """No mesh fits in memory, and pieces are small."""
    monkeypatch.setattr(mesh_steps, "available_bytes", lambda: 1)
    monkeypatch.setattr(mesh_steps, "BRICKS", 20)


@pytest.mark.parametrize(
    ("name", "job"), stamped(CASES, [("touching", "plain"), ("sharp", "plain"), ("nested", "dust")])
)
def test_streamed_is_what_would_have_been_made_in_memory(
    name: str, job: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """The same bytes, and the same report."""
    what = JOBS[job]
    streamed, whole = tmp_path / "streamed.stl", tmp_path / "whole.stl"
    made = make_mesh(SCENES[name], what, path=whole)
    assert len(made.mesh.triangles) == made.report.mesh.triangles
    request.getfixturevalue("pieces")
    result = make_mesh(SCENES[name], what, path=streamed)
    assert streamed.read_bytes() == whole.read_bytes()
    reported, expected = result.report.as_dict(), made.report.as_dict()
    for key in ("volume_mm3", "area_mm2", "cavities_mm3"):
        assert reported.pop(key) == pytest.approx(expected.pop(key), rel=1e-9)
    for one in (reported, expected):
        for key in ("surface_error_mm", "amount_mm3", "removed", "seconds", "peak_rss_mb"):
            one.pop(key)
    notes = reported.pop("notes"), expected.pop("notes")
    assert set(notes[0]) == set(notes[1])
    assert name != "touching" or any("bodies come within" in note for note in notes[0])
    assert reported == expected and reported["printable"]
    removed, there = result.report.removed, made.report.removed
    assert (removed.bodies, removed.cavities) == (there.bodies, there.cavities)
    assert result.report.amount_mm3.made == pytest.approx(made.report.amount_mm3.made, rel=1e-6)
    error = result.report.surface_error_mm
    assert error.max == pytest.approx(made.report.surface_error_mm.max, rel=1e-6)
    assert result.bricks.ijk.tobytes() == made.bricks.ijk.tobytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["streamed.stl", "whole.stl"]


def test_tips_are_in_streamed_meshes(pieces: None, tmp_path: Path) -> None:
    """An octahedron ended a voxel short on all sides."""
    path = tmp_path / "x.stl"
    make_mesh(
        scene(transform(octahedron(), rotate=(1, 2, 3, 37)), size=50), MeshJob(resolution=64), path=path
    )
    mesh = read_mesh(path)
    assert mesh.volume == pytest.approx(4 / 3 * (50 / np.ptp(corners(37), axis=0).max()) ** 3, rel=2e-4)
    assert mesh.size.max() == pytest.approx(50, abs=1e-4)


def test_a_mesh_that_is_only_in_its_file_is_reported_so(pieces: None, tmp_path: Path) -> None:
    made = make_mesh(sphere(), size="30mm", resolution=64, path=tmp_path / "x.stl")
    assert repr(made) == (
        f"<Result of {made.report.mesh.triangles:,} triangles, {made.report.mesh.vertices:,} vertices, "
        "only in its file>"
    )
    with pytest.raises(TooLargeError, match="it is in the file"):
        _ = made.vertices


def corners(degrees: float) -> np.ndarray:
    """Of a turned octahedron."""
    from scipy.spatial.transform import Rotation

    axis = np.array([1, 2, 3]) / np.sqrt(14)
    matrix = Rotation.from_rotvec(np.radians(degrees) * axis).as_matrix()
    return np.concatenate([matrix.T, -matrix.T])


def test_defects_are_counted_at_seams_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles taken out of every piece: each open edge is counted once, wherever the pieces end."""
    from fracslice.mesh.checks import Tally, check_mesh
    from fracslice.mesh.cleaning import SelectedPiece, finished_piece
    from fracslice.mesh.contouring import contour_pieces
    from fracslice.volume import plan, sample_scene_signs

    planned = plan(menger(level=2), 40)
    signs = sample_scene_signs(planned)
    whole = next(p.mesh for p in contour_pieces(planned.root, signs, most=10**6))
    lost = np.random.default_rng(1).random(len(whole.triangles)) < 0.01
    centres = {tuple(c) for c in whole.corners[lost].mean(axis=1).tolist()}
    tally, passed, kept = Tally(), 0, list[SelectedPiece | None]()
    pieces = list(contour_pieces(planned.root, signs, most=1))
    for piece in pieces:
        keep = np.array([tuple(c) not in centres for c in piece.mesh.corners.mean(axis=1).tolist()])
        mesh = piece.mesh.selected(keep)
        kept.append(SelectedPiece(mesh, np.ones(len(mesh.vertices), bool), np.empty(0, np.int64)))
    ends = [-np.inf, *(piece.end for piece in pieces)]
    for n, (before, own, after) in enumerate(zip([None, *kept], kept, [*kept[1:], None], strict=False)):
        assert own
        finished = finished_piece(own, before, after, (ends[n], ends[n + 1]), planned.voxel)
        tally.add(finished)
        passed += len(finished.passed.triangles)
    truth, reported = check_mesh(whole.selected(~lost)), tally.report(1, 0, 0)
    assert len(pieces) > 4 and passed == truth.triangles == reported.triangles
    assert reported.open_edges == truth.open_edges > 100
    assert (reported.vertices, reported.nonmanifold_vertices) == (truth.vertices, truth.nonmanifold_vertices)
    assert not reported.watertight and reported.genus is None


@pytest.mark.parametrize(("name", "job"), [("chord", {"chord": 0.1}), ("simplify", {"simplify": 0.1})])
def test_what_needs_the_whole_is_refused(name: str, job: dict, pieces: None, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=rf"{name} 0\.1mm needs the whole mesh: a voxel of .* .* fits$"):
        make_mesh(SCENES["corners"], MeshJob(resolution=48, **job), path=tmp_path / "x.stl")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", [None, "x.3mf"])
def test_a_mesh_too_large_for_memory_goes_to_an_stl_only(
    name: str | None, pieces: None, tmp_path: Path
) -> None:
    with pytest.raises(TooLargeError, match=r"an \.stl file is written piece after piece"):
        make_mesh(SCENES["corners"], MeshJob(resolution=48), path=name and tmp_path / name)
    assert not list(tmp_path.iterdir())
    result = make_mesh(SCENES["corners"], MeshJob(resolution=48), path=tmp_path / "x.stl")
    assert len(read_mesh(tmp_path / "x.stl").triangles) == result.report.mesh.triangles
    with pytest.raises(TooLargeError, match="it is in the file"):
        _ = result.mesh


def test_a_path_that_cannot_be_is_refused_before_any_work(tmp_path: Path) -> None:
    def begun(stage: str, _: float) -> None:
        raise AssertionError(stage)

    for path, message in (("missing/x.stl", "does not exist"), ("x.txt", "unknown kind of file")):
        with pytest.raises(ExportError, match=message):
            make_mesh(SCENES["corners"], work=Work(progress=begun), path=tmp_path / path)


@pytest.mark.parametrize("stage", ["sampling", "meshing", "finishing", "checking", "writing"])
def test_cancelled_leaves_nothing(stage: str, pieces: None, tmp_path: Path) -> None:
    work = Work()

    def stop(now: str, _: float) -> None:
        if now == stage:
            work.cancel.set()

    how = replace(work, progress=stop)
    with pytest.raises(Cancelled):
        make_mesh(SCENES["fractal"], MeshJob(resolution=64), how, path=tmp_path / "x.stl")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("most", [1, 10**6])
def test_the_volume_of_a_speck_far_from_the_origin(most: int) -> None:
    """A single sample inside: the octahedron around it has 1e-12 of a voxel, and its sign."""
    from fracslice.mesh.contouring import contour_pieces
    from fracslice.mesh.shells import Pieces, survey
    from fracslice.volume import SignBricks

    signs = np.zeros((2, 8, 8), np.uint8)
    signs[1, 0, 3] = 16  # x = 8: the surface goes through the seam between the bricks
    ijk, index = np.array([[0, 0, 0], [8, 0, 0]], np.int32), np.array([[[0]], [[1]]], np.int32)
    bricks, voxel = SignBricks((1.0, 1.0, 1.0), 1e-3, ijk, signs, index), 1e-3
    x, y, z = 1 + voxel * np.array([8, 3, 4])
    pieces, speck = Pieces(), transform(sphere(radius=1e-6), translate=(x, y, z))
    for piece in contour_pieces(speck, bricks, most=most):
        pieces.add(piece)
    (volume,) = survey(pieces, voxel).volumes
    assert len(pieces) == (2 if most == 1 else 1)
    assert volume == pytest.approx(4 / 3 * 1e-18, rel=1e-6)
