"""OpenVDB: nothing is lost on the way to a file and back, and other programs read it."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from fracslice.errors import VolumeError
from fracslice.mesh.contouring import extract
from fracslice.volume.bricks import INSIDE, NAME, Bricks, from_grid, read_vdb, to_grid, write_vdb
from tests.fields import blobs, bricks_of, grid_points

pytestmark = pytest.mark.once


def ball(side: int = 48, scale: float = 1.0) -> Bricks:
    x, y, z, origin, voxel = grid_points(side, 1.3)
    return bricks_of(scale * (np.sqrt(x**2 + y**2 + z**2) - 1), origin, voxel)


def assert_same(a: Bricks, b: Bricks) -> None:
    assert a.origin == pytest.approx(b.origin)
    assert a.voxel == pytest.approx(b.voxel)
    assert np.array_equal(a.ijk, b.ijk)
    assert a.values.tobytes() == b.values.tobytes()
    size = tuple(slice(0, n) for n in b.index.shape)
    assert np.array_equal(a.index[size], b.index)
    assert (a.index >= 0).sum() == (b.index >= 0).sum()


@pytest.mark.parametrize("seed", range(5))
def test_a_grid_gives_back_its_bricks(seed: int) -> None:
    bricks = bricks_of(blobs(seed, side=48, blur=8), origin=(0.5, -3, 7), voxel=0.25)
    assert (bricks.index == INSIDE).any()
    assert_same(bricks, from_grid(to_grid(bricks)))


def test_a_file_gives_back_its_bricks_and_text(tmp_path: Path) -> None:
    bricks = ball()
    write_vdb(bricks, tmp_path / "ball.vdb", {"creator": "a test"})
    again = read_vdb(tmp_path / "ball.vdb", NAME)
    assert_same(bricks, again)
    assert np.array_equal(extract(bricks).triangles, extract(again).triangles)


def test_the_same_samples_make_the_same_file(tmp_path: Path) -> None:
    """OpenVDB draws the identifier of a file at random."""
    files = [tmp_path / f"{name}.vdb" for name in ("first", "again", "other")]
    for path, scale in zip(files, (1.0, 1.0, 2.0), strict=True):
        write_vdb(ball(scale=scale), path, {"creator": "a test"})
    first, again, other = (path.read_bytes() for path in files)
    assert first == again
    assert first[21:57] != other[21:57]


@pytest.mark.skipif(not shutil.which("vdb_print"), reason="vdb_print is not installed")
def test_a_file_is_a_narrow_band_level_set_to_vdb_print(tmp_path: Path) -> None:
    bricks = ball()
    write_vdb(bricks, tmp_path / "ball.vdb", {"creator": "a test"})
    shown = subprocess.run(["vdb_print", "-l", tmp_path / "ball.vdb"], capture_output=True, text=True).stdout
    assert "Name: surface" in shown
    assert "class: level set" in shown
    assert f"Leaf({len(bricks)} x 8^3)" in shown
    assert f"Background value: {np.abs(bricks.values).max():.6}" in shown
    assert f"Number of active voxels:       {512 * len(bricks):,}" in shown
    assert "creator: a test" in shown


def test_what_cannot_be_written_or_read_is_said(tmp_path: Path) -> None:
    with pytest.raises(VolumeError, match="No such file"):
        write_vdb(ball(), tmp_path / "missing" / "ball.vdb")
    with pytest.raises(VolumeError, match=r"none\.vdb"):
        read_vdb(tmp_path / "none.vdb")
    (tmp_path / "text.vdb").write_text("not a grid")
    with pytest.raises(VolumeError, match=r"text\.vdb"):
        read_vdb(tmp_path / "text.vdb")
    write_vdb(ball(), tmp_path / "ball.vdb")
    with pytest.raises(VolumeError, match="no grid of numbers named other"):
        read_vdb(tmp_path / "ball.vdb", "other")
    whole = (tmp_path / "ball.vdb").read_bytes()
    (tmp_path / "half.vdb").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(VolumeError, match=r"half\.vdb"):
        read_vdb(tmp_path / "half.vdb")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk_is_noticed() -> None:
    with pytest.raises(VolumeError, match="No space left"):
        write_vdb(ball(), "/dev/full")


def test_redistancing_makes_a_field_of_distances() -> None:
    steep = ball(scale=3.0)
    distances = from_grid(to_grid(steep).redistance())
    p = np.indices((8, 8, 8)).reshape(3, -1).T + distances.ijk[:, None, :]
    away = np.linalg.norm(p * distances.voxel + np.array(distances.origin), axis=2) - 1
    near = np.abs(away) < 3 * distances.voxel
    assert np.abs(distances.values - away)[near].max() < 0.3 * distances.voxel
    assert np.abs(steep.values - away)[near].max() > distances.voxel
    assert extract(distances).volume == pytest.approx(extract(steep).volume, rel=1e-3)


@pytest.mark.parametrize("distance", [-0.35, -0.05, 0.05, 0.25])
def test_offset_moves_the_surface(distance: float) -> None:
    moved = from_grid(to_grid(ball()).offset(distance))
    assert extract(moved).volume == pytest.approx(4 / 3 * np.pi * (1 + distance) ** 3, rel=0.02)
