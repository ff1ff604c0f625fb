"""Work that is kept: the same arrays, made once; nothing stale, nothing half-written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fracslice import MeshJob, Work, make_mesh
from fracslice.errors import VolumeError
from fracslice.formulas import mandelbulb
from fracslice.scene import scene
from fracslice.store import Store

BULB = scene(mandelbulb(iterations=4), size="40mm", name="bulb")


def test_a_second_job_evaluates_nothing_and_makes_the_same(tmp_path: Path) -> None:
    work = Work(store=Store(tmp_path))
    first, again = (make_mesh(BULB, MeshJob(resolution=48), work) for _ in range(2))
    plain = make_mesh(BULB, MeshJob(resolution=48))
    assert first.report.evaluations == plain.report.evaluations > 0
    assert again.report.evaluations == 0
    for mesh in (first.mesh, again.mesh):
        assert mesh.vertices.tobytes() == plain.mesh.vertices.tobytes()
        assert mesh.triangles.tobytes() == plain.mesh.triangles.tobytes()


def test_what_does_not_change_the_samples_does_not_make_them_again(tmp_path: Path) -> None:
    work = Work(store=Store(tmp_path))
    make_mesh(BULB, MeshJob(resolution=48), work)
    larger = make_mesh(BULB, MeshJob(resolution=48, size_mm=70, dust_mm3=1), work)
    assert larger.report.evaluations == 0
    assert larger.mesh.size.max() == pytest.approx(70, rel=1e-6)
    finer = make_mesh(BULB, MeshJob(resolution=49), work)
    other = make_mesh(
        scene(mandelbulb(iterations=4, power=7), size="40mm", name="bulb"), MeshJob(resolution=48), work
    )
    assert finer.report.evaluations > 0 and other.report.evaluations > 0


def test_a_spoilt_file_is_made_again(tmp_path: Path) -> None:
    store, made = Store(tmp_path), []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"a": np.arange(5)}

    for spoil in (b"", b"no archive", None):
        store.get(("x", 1), make)
        (path,) = tmp_path.iterdir()
        path.write_bytes(path.read_bytes()[:-9] if spoil is None else spoil)
        count = len(made)
        assert (store.get(("x", 1), make)["a"] == np.arange(5)).all()
        assert len(made) == count + 1
    assert [p.suffix for p in tmp_path.iterdir()] == [".npz"]


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(VolumeError, match="file/cache: Not a directory"):
        make_mesh(BULB, MeshJob(resolution=16), replace(Work(), store=Store(tmp_path / "file" / "cache")))
