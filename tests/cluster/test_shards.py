"""Shards of a job without a scheduler."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from fracslice.cli.main import run as command

from fracslice.cluster import Pieces, Shard
from fracslice.errors import ClusterError
from fracslice.export.slices import write_slices
from fracslice.rendering import parts
from fracslice.work import Work

from .test_cluster import RECIPE, rendered, sliced

pytest.importorskip("fsspec")


@pytest.fixture
def line(tmp_path: Path) -> list[str]:
    (tmp_path / "bulb.xml").write_text(RECIPE.scene)
    return [
        "slice",
        str(tmp_path / "bulb.xml"),
        "-o",
        str(tmp_path / "b.cli"),
        "--layer",
        "0.1mm",
        "--pixel",
        "0.05mm",
    ]


def test_shards_of_layers_make_one_file(
    line: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in (2, 3):
        assert command([*line, "--shard", f"{number}/3", "--quiet"]) == 0
        assert "shard 1 writes the file" in capsys.readouterr().err
        assert not (tmp_path / "b.cli").exists()
    assert command([*line, "--shard", "1/3", "--quiet"]) == 0
    assert (tmp_path / "b.cli").read_bytes() == sliced(Work(2), tmp_path)


def test_a_shard_makes_what_others_leave(tmp_path: Path) -> None:
    shard = Shard(Pieces(str(tmp_path / "pieces")), 1, 3, patience=0)
    run = RECIPE.run(Work(1, cluster=shard))
    write_slices(run, tmp_path / "b.cli")
    assert (tmp_path / "b.cli").read_bytes() == sliced(Work(2), tmp_path)


def test_shards_of_a_frame_work_at_the_same_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "PIXELS", 1024)
    shards = [Shard(Pieces(str(tmp_path / "pieces")), number, 2) for number in (1, 2)]
    with ThreadPoolExecutor(2) as pool:
        sums = list(pool.map(lambda shard: rendered(Work(1, cluster=shard), tmp_path), shards))
    assert sums == [rendered(Work(2), tmp_path)] * 2


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "a/b", "1/0"])
def test_bad_shards(text: str, line: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ClusterError, match="such as 3/64"):
        Shard.read(text, Pieces("x"))
    assert command([*line, "--shard", text]) != 0
    assert "such as 3/64" in capsys.readouterr().err


def test_options_that_exclude_each_other(line: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert command([*line, "--shard", "1/2", "--cluster", "local"]) == 2
    assert command([*line, "--store", "x"]) == 2
    assert command([*line, "--cluster", "local:x"]) != 0
    assert "expected local, local:N" in capsys.readouterr().err
