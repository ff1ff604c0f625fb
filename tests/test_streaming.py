"""A mesh larger than memory: the same object as one made in memory, whatever the pieces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice import streaming as module
from fracslice.errors import Cancelled, ExportError, SceneError
from fracslice.export import write
from fracslice.formulas import box, difference, mandelbulb, menger, sphere, transform, union
from fracslice.mesh.reading import read_mesh
from fracslice.scene import Print, Scene, scene
from fracslice.streaming import stream_mesh
from fracslice.work import Work


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
}
JOBS = {
    "plain": MeshJob(resolution=64),
    "largest": MeshJob(resolution=48, printing=Print(keep="largest")),
    "filled": MeshJob(resolution=48, printing=Print(cavities="fill")),
    "dust": MeshJob(resolution=48, dust_mm3=900),
}


@pytest.mark.parametrize(
    ("name", "job"), [("fractal", "plain"), ("corners", "plain"), *(("nested", job) for job in JOBS)]
)
def test_streamed_is_what_would_have_been_made_in_memory(
    name: str, job: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "BRICKS", 40)
    what = JOBS[job]
    streamed, whole = tmp_path / "streamed.stl", tmp_path / "whole.stl"
    report, made = stream_mesh(SCENES[name], streamed, what), make_mesh(SCENES[name], what)
    write(made.mesh, whole)
    assert len(read_mesh(streamed).triangles) == report.mesh.triangles
    assert report.amount_mm3.object == pytest.approx(made.report.amount_mm3.object, rel=1e-6)
    told, expected = report.mesh.as_dict(), made.report.mesh.as_dict()
    for key in ("volume_mm3", "area_mm2"):
        assert told.pop(key) == pytest.approx(expected.pop(key), rel=1e-6)
    assert np.allclose(told.pop("bbox_mm"), expected.pop("bbox_mm"), atol=1e-5)
    assert told == expected
    assert told["printable"]
    assert report.removed.bodies == made.report.removed.bodies
    assert report.removed.cavities == made.report.removed.cavities
    assert sorted(p.name for p in tmp_path.iterdir()) == ["streamed.stl", "whole.stl"]


def test_defects_are_counted_at_seams_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles taken out of every piece: each open edge is counted once, wherever the pieces end."""
    from fracslice.mesh.check import check_mesh
    from fracslice.mesh.extract import contour_pieces
    from fracslice.mesh.window import Window
    from fracslice.volume import plan, sample_scene_signs

    planned = plan(menger(level=2), 40)
    signs = sample_scene_signs(planned)
    whole = next(p.mesh for p in contour_pieces(planned.root, signs, most=10**6))
    lost = np.random.default_rng(1).random(len(whole.triangles)) < 0.01
    centres = {tuple(c) for c in whole.corners[lost].mean(axis=1).tolist()}
    window, passed = Window(planned.voxel), 0
    pieces = list(contour_pieces(planned.root, signs, most=1))
    for number, piece in enumerate(pieces):
        keep = np.array([tuple(c) not in centres for c in piece.mesh.corners.mean(axis=1).tolist()])
        end = piece.end if number < len(pieces) - 1 else np.inf
        passed += len(window.add(piece.mesh.selected(keep), end).triangles)
    truth, told = check_mesh(whole.selected(~lost)), window.report(1, 0, 0)
    assert len(pieces) > 4 and passed == truth.triangles == told.triangles
    assert told.open_edges == truth.open_edges > 100
    assert (told.vertices, told.nonmanifold_vertices) == (truth.vertices, truth.nonmanifold_vertices)
    assert not told.watertight and told.genus is None


def test_what_needs_the_whole_is_refused_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="<print> cannot change a mesh that does not fit in memory"):
        stream_mesh(SCENES["corners"], tmp_path / "x.stl", MeshJob(printing=Print(base=2)))
    with pytest.raises(ExportError, match="does not exist"):
        stream_mesh(SCENES["corners"], tmp_path / "missing" / "x.stl")


@pytest.mark.parametrize("stage", ["sampling", "meshing", "finishing"])
def test_cancelled_leaves_nothing(stage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BRICKS", 40)
    work = Work()

    def stop(now: str, _: float) -> None:
        if now == stage:
            work.cancel.set()

    with pytest.raises(Cancelled):
        stream_mesh(
            SCENES["fractal"], tmp_path / "x.stl", MeshJob(resolution=64), replace(work, progress=stop)
        )
    assert not list(tmp_path.iterdir())


def test_size_and_place(tmp_path: Path) -> None:
    path = tmp_path / "ball.stl"
    ball: Scene = scene(moved(sphere(radius=2), 3, 1, 7), size="25mm", name="ball")
    stream_mesh(ball, path, MeshJob(resolution=40))
    low, high = read_mesh(path).bounds
    assert low[2] == 0 and high[2] == pytest.approx(25, rel=1e-3)  # the mesh lies within the ball
    assert np.allclose((low + high)[:2], 0, atol=1e-5)


@pytest.mark.parametrize("most", [1, 10**6])
def test_the_volume_of_a_speck_far_from_the_origin(most: int) -> None:
    """A single sample inside: the octahedron around it has 1e-12 of a voxel, and its sign."""
    from fracslice.mesh.extract import contour_pieces
    from fracslice.mesh.survey import Survey
    from fracslice.volume import SignBricks

    signs = np.zeros((2, 8, 8), np.uint8)
    signs[1, 0, 3] = 16  # x = 8: the surface goes through the seam between the bricks
    ijk, index = np.array([[0, 0, 0], [8, 0, 0]], np.int32), np.array([[[0]], [[1]]], np.int32)
    bricks, voxel = SignBricks((1.0, 1.0, 1.0), 1e-3, ijk, signs, index), 1e-3
    x, y, z = 1 + voxel * np.array([8, 3, 4])
    survey, speck = Survey(), transform(sphere(radius=1e-6), translate=(x, y, z))
    pieces = [p for p in contour_pieces(speck, bricks, most=most) if survey.add(p) is not None]
    (volume,) = survey.shells().volumes
    assert len(pieces) == (2 if most == 1 else 1)
    assert volume == pytest.approx(4 / 3 * 1e-18, rel=1e-6)
