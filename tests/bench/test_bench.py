"""The benchmark: what it tells is true, a peer is run beside, bad input and failures are told."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice.bench import measurements
from fracslice.bench.measure import WORKLOADS, errors, surface_points
from fracslice.bench.measurements import BenchmarkTask, Peer, measure
from fracslice.cluster import ResultFolder, Shard
from fracslice.errors import BenchError, Cancelled, SharedError
from fracslice.formats import write
from fracslice.work import Work

from ..mesh import shapes

pytestmark = pytest.mark.once

COPY = """
import shutil, sys, time
shutil.copy(sys.argv[1], sys.argv[2])
time.sleep(0.2)  # long enough that its memory is seen
print('{"wall_s": 7.5, "cpu_s": 8}')
"""


@pytest.fixture
def peer(tmp_path: Path) -> str:
    """A peer that has the answer ready: a sphere of a radius 1 % too large."""
    write(shapes.sphere(1.01, level=5), tmp_path / "ready.ply")
    (tmp_path / "copy.py").write_text(COPY)
    command = f"{sys.executable} {tmp_path}/copy.py {tmp_path}/ready.ply"
    return f"ready={command} {{output}} {{workload}} {{resolution}}"


def test_memory_of_a_peer_is_not_that_of_this_process() -> None:
    held = b"x" * (300 << 20)
    used = measurements._run_command([sys.executable, "-c", "import time; time.sleep(0.2)"], "", Work(1))[1]
    assert held and used["peak_mb"] < 100


def test_errors_are_those_of_the_mesh():
    result = errors(shapes.sphere(1.01, level=5), WORKLOADS["sphere"], 240)
    assert result["error_voxels"] == pytest.approx(1, rel=0.03), "a voxel is 0.01 there"
    assert result["volume"] == pytest.approx(1.01**3 - 1, abs=0.003)


def test_samples_lie_evenly_on_the_mesh():
    points = surface_points(shapes.cube(2, (-1, -1, -1)), 6000)
    assert np.abs(points).max(axis=1) == pytest.approx(1)
    counts = [(points[:, k] == side).sum() for k in range(3) for side in (-1, 1)]
    assert min(counts) > 800


def test_every_closed_form_is_that_of_its_field():
    from fracslice.bench.measure import exact

    for name in ("sphere", "torus", "menger3"):
        what = WORKLOADS[name]
        mesh, *_ = exact(what, 96, Work())
        assert mesh.volume == pytest.approx(what.volume, rel=0.01)
        assert mesh.area == pytest.approx(what.area, rel=0.01)


def test_the_command_writes_page_numbers_and_plots(tmp_path, peer, capfd):
    folder = tmp_path / "out"
    options = ["--workload", "sphere", "--resolution", "32", "--repeat", "1", "--peer", peer]
    assert run(["bench", "-o", str(folder), *options]) == 0
    reported = json.loads((folder / "numbers.json").read_text())["measurements"]
    by_method = {one["method"]: one["numbers"] for one in reported}
    assert (by_method["ready"]["wall_s"], by_method["ready"]["cpu_s"]) == (7.5, 8)
    assert by_method["ready"]["error_voxels"] == pytest.approx(0.01 / (2.4 / 32), rel=0.05)
    assert abs(by_method["exact"]["volume"]) < abs(by_method["ready"]["volume"])
    assert by_method["exact, simplified"]["triangles"] < by_method["exact"]["triangles"] / 2
    assert by_method["dense grid, scikit-image"]["evaluations"] == 33**3
    assert all(one["peak_mb"] > 1 for one in by_method.values())
    page = (folder / "report.md").read_text()
    for picture in ("error.png", "growth.png", "memory.png"):
        assert picture in page
        assert (folder / picture).read_bytes().startswith(b"\x89PNG")
    assert "report.md: 5 measurements" in capfd.readouterr().out


@pytest.mark.nightly
def test_a_peer_that_fails_is_reported_and_the_rest_goes_on():
    broken = Peer.read(f"broken={sys.executable} -c 1/0 {{workload}} {{resolution}} {{output}}")
    missing = Peer.read("missing=/no/such/program {workload} {resolution} {output}")
    result = measure(BenchmarkTask(("sphere",), (16,), (broken, missing), repeats=1), Work())
    failed = {one.method: one.failed for one in result if one.failed}
    assert failed == {
        "broken": "ZeroDivisionError: division by zero",
        "missing": "/no/such/program: No such file or directory",
    }
    assert any(one.method == "exact" and one.numbers for one in result)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--workload cube", "workload 'cube': expected one of sphere, torus"),
        ("--resolution 4", "4 is not in the range 16<=x<=2048"),
        ("--peer name=command", "peer 'name=command': expected NAME=COMMAND with {workload}"),
        ("--repeat 0", "0 is not in the range"),
        ("-o none/deep", "none/deep: the folder"),
    ],
)
def test_bad_input_is_refused_before_any_work(arguments, message, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert run(["bench", *arguments.split()]) == 2
    err = capfd.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_without_matplotlib_it_says_what_to_install(monkeypatch, capfd):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert run(["bench"]) == 2
    assert 'pip install "matplotlib"' in capfd.readouterr().err


def test_it_can_be_cancelled():
    work = Work()
    work.cancel.set()
    with pytest.raises(Cancelled):
        measure(BenchmarkTask(("sphere",), (16,)), work)


def test_a_peer_needs_all_its_places():
    with pytest.raises(BenchError, match="expected NAME=COMMAND"):
        Peer.read("a=b {workload} {output}")


@pytest.mark.nightly
def test_shards_share_the_measurements(tmp_path: Path, peer: str) -> None:
    task = BenchmarkTask(("sphere",), (16,), (Peer.read(peer),), repeats=1)
    pieces = ResultFolder(str(tmp_path / "pieces"))
    with pytest.raises(SharedError, match=r"this shard made [23] measurements; shard 1 writes the report"):
        measure(task, Work(1, cluster=Shard(pieces, 2, 2)))
    result = measure(task, Work(1, cluster=Shard(pieces, 1, 2)))
    alone = measure(task, Work(1))
    assert [(r.workload, r.method) for r in result] == [(r.workload, r.method) for r in alone]
    ours, theirs = ([r.numbers["error_voxels"] for r in rows] for rows in (result, alone))
    assert ours == theirs
