"""Work that is kept: the same arrays, made once; nothing stale, nothing half-written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fracslice import MeshJob, Work, make_mesh
from fracslice.common import cache
from fracslice.errors import FracsliceWarning, VolumeError
from fracslice.fields.cpu import compile_scene
from fracslice.fields.field import Field
from fracslice.formulas import Box, Node, mandelbulb, offset, sphere
from fracslice.printing.edits import EditedField
from fracslice.printing.walls import Samples
from fracslice.scene import scene
from fracslice.store import Store
from fracslice.volume import Lattice, Plan, sample, sample_scene

BOX = Box((-1.25, -1.25, -1.25), (1.25, 1.25, 1.25))
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
    larger = make_mesh(BULB, MeshJob(resolution=48, size=70, dust=1), work)
    assert larger.report.evaluations == 0
    assert larger.mesh.size.max() == pytest.approx(70, rel=0.02)
    finer = make_mesh(BULB, MeshJob(resolution=49), work)
    other = make_mesh(
        scene(mandelbulb(iterations=4, power=7), size="40mm", name="bulb"), MeshJob(resolution=48), work
    )
    assert finer.report.evaluations > 0 and other.report.evaluations > 0


def sampled(work: Work, *roots: Node) -> list[int]:
    """The evaluations that sampling each of them takes: none, if it was kept."""
    return [sample_scene(planned(root), work).evaluations for root in roots]


def planned(root: Field) -> Plan:
    """To be sampled in the same places, whatever its bounds."""
    return Plan(root=root, box=BOX, outer=BOX, tips=np.zeros((3, 6)), voxel=0.1)


def test_samples_follow_from_what_is_known_of_a_field(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its text and its numbers being the same: its bounds say where it is looked at."""
    work = Work(store=Store(tmp_path))
    first, again = sampled(work, sphere(), sphere())
    assert first > 0 == again
    monkeypatch.setitem(vars(sphere), "lipschitz", 1.5)
    assert sampled(work, sphere())[0] > first
    assert sampled(work, sphere()) == [0]
    monkeypatch.setitem(sphere.hooks, "bounds", lambda _: Box((-2, -2, -2), (2, 2, 2)))
    assert sampled(work, sphere())[0] > 0


def test_samples_follow_from_the_guard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work = Work(store=Store(tmp_path))
    assert sampled(work, sphere())[0] > 0
    monkeypatch.setattr(Node, "conservative", lambda self: offset(self, distance=0.1))
    assert sampled(work, sphere())[0] > 0


CHANGED = ["formulas/primitives.py", "fields/linker.py", "common/arrays.py", "_native"]


@pytest.mark.parametrize("changed", CHANGED)
def test_what_is_kept_follows_from_the_program(
    changed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = Path.read_bytes

    def edited(self: Path) -> bytes:
        return read(self) + b"#" * (changed in str(self))

    before = cache.program()
    monkeypatch.setattr(Path, "read_bytes", edited)
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "cache"))
    cache.program.cache_clear()
    after = cache.program()
    monkeypatch.undo()
    cache.program.cache_clear()
    assert after != before == cache.program()


def test_keys_tell_arrays_of_other_shapes_and_types_apart() -> None:
    a = np.zeros((2, 3), np.float32)
    parts = [(a,), (a.T,), (a.astype(np.int32),), (a, a), ("a", "b"), ("ab",), (1,), (1.0,), (True,), (b"1",)]
    assert len({cache.key(*p) for p in parts}) == len(parts)
    assert cache.key(a.T) == cache.key(np.ascontiguousarray(a.T))


def test_an_edited_field_is_kept_and_known_by_all_its_parts(tmp_path: Path) -> None:
    work, near = Work(store=Store(tmp_path)), Lattice.around(BOX, 0.2)
    inner = [sample(compile_scene(s), s.bounds, near) for s in (sphere(radius=0.5), sphere(radius=0.6))]
    roots = [EditedField(sphere(), does, Samples(bricks)) for bricks in inner for does in ("cut", "add")]
    assert len({root.key for root in roots}) == len(roots)
    result = [sample_scene(planned(roots[0]), work) for _ in range(2)]
    assert result[0].evaluations > 0 == result[1].evaluations
    assert result[0].values.tobytes() == result[1].values.tobytes()


def test_a_folder_that_others_can_write_is_not_used(tmp_path: Path) -> None:
    store, made = Store(tmp_path / "kept"), []
    for mode in (0o755, 0o777):
        for _ in range(2):
            store.get(("x",), lambda: made.append(1) or {"a": np.arange(5)})
        (tmp_path / "kept").chmod(mode)
    assert len(made) == 1
    with pytest.warns(FracsliceWarning, match="others can write in this folder: the files in"):
        store.get(("x",), lambda: made.append(1) or {"a": np.arange(6)})
    assert len(made) == 2
    (tmp_path / "kept").chmod(0o700)
    assert len(store.get(("x",), dict)["a"]) == 5


def test_a_spoilt_file_is_made_again(tmp_path: Path) -> None:
    store, made = Store(tmp_path), []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"a": np.arange(5)}

    for spoil in (b"", b"no archive", b"\x00", None):
        store.get(("x", 1), make)
        (path,) = tmp_path.iterdir()
        whole = path.read_bytes()
        flipped = whole[:150] + bytes([whole[150] ^ 1]) + whole[151:]
        path.write_bytes(whole[:-9] if spoil is None else flipped if spoil == b"\x00" else spoil)
        count = len(made)
        assert (store.get(("x", 1), make)["a"] == np.arange(5)).all()
        assert len(made) == count + 1
    assert [p.suffix for p in tmp_path.iterdir()] == [".npz"]


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(VolumeError, match="file/cache: Not a directory"):
        make_mesh(BULB, MeshJob(resolution=16), replace(Work(), store=Store(tmp_path / "file" / "cache")))


def test_files_of_the_program_are_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And again when one of them changes, even to as many bytes."""
    package, hashed, texts = tmp_path / "package", [], cache.texts
    (package / "inner").mkdir(parents=True)
    for name in ("a.py", "inner/b.py", "inner/c.txt"):
        (package / name).write_text("1")
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(cache, "PACKAGE", package)
    monkeypatch.setattr(cache, "texts", lambda *paths: hashed.append(paths) or texts(*paths))

    def program() -> str:
        return str(cache.program.__wrapped__())

    before = program()
    assert program() == before
    assert len(hashed) == 1
    assert {path.name for path in hashed[0]} >= {"a.py", "b.py", "version.py"}
    (package / "inner" / "c.txt").write_text("2")
    assert program() == before
    (package / "inner" / "b.py").write_text("2")
    assert program() != before
    assert len(hashed) == 2


def test_a_file_under_another_name_is_made_again(tmp_path: Path) -> None:
    """Two complete files that were exchanged: both are of another field."""
    work = Work(store=Store(tmp_path))
    sampled(work, sphere(), sphere(radius=0.5))
    one, other = sorted(tmp_path.iterdir())
    for a, b in ((one, tmp_path / "kept"), (other, one), (tmp_path / "kept", other)):
        a.rename(b)
    own = [sample_scene(planned(root), Work()).evaluations for root in (sphere(), sphere(radius=0.5))]
    assert sampled(work, sphere(), sphere(radius=0.5)) == own
    kept = cache.Kept(tmp_path / "texts")
    assert (kept.cached("a", lambda: b"1"), kept.cached("b", lambda: b"2")) == (b"1", b"2")
    (kept.folder / "a").replace(kept.folder / "b")
    assert kept.cached("b", lambda: b"2") == b"2"
