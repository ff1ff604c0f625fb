"""From a scene to a mesh: sizes, what is kept, the report, cancelling, and what does not fit."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fracslice import MeshJob, Work, make_mesh
from fracslice.common import memory
from fracslice.errors import Cancelled, KeptError, SceneError, VolumeError
from fracslice.formulas import (
    box,
    cone,
    difference,
    intersection,
    julia,
    mandelbulb,
    plane,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.jobs import mesh_steps
from fracslice.jobs.mesh import import_ahead
from fracslice.scene import Print, read, scene

pytestmark = pytest.mark.once

BALL = scene(sphere(radius=3), size="40mm", name="ball")


LANTERN = read("scenes/gallery/lantern.xml")
"""A plate of 0.27 mm under a ball of gyroid, 80 mm long."""


def moved(node, *by):
    return transform(node, translate=by)


def test_the_longest_side_is_the_size_and_it_stands_on_the_bed():
    mesh = make_mesh(scene(moved(box(size=(1, 2, 3)), 5, 5, 5), size="45mm"), MeshJob(resolution=48)).mesh
    low, high = mesh.bounds
    assert high[2] - low[2] == np.float32(45)
    assert low[2] == 0
    assert np.allclose((low + high)[:2], 0, atol=1e-5)
    assert np.allclose(mesh.size, (15, 30, 45), atol=0.1)


def test_the_job_may_ask_for_another_size():
    result = make_mesh(BALL, MeshJob(size=10, resolution=32))
    assert result.place.scale == 10 / 6  # the mesh itself lies within the ball
    assert result.mesh.size.max() == pytest.approx(10, rel=1e-3)
    assert result.report.size_mm == 10
    assert result.report.scene_hash == BALL.hash


def test_a_voxel_in_mm_is_that_of_the_finished_object():
    report = make_mesh(BALL, MeshJob(voxel=1)).report
    assert math.isclose(report.voxel_mm, 1, rel_tol=0.01)


def test_a_ball_has_the_volume_of_a_ball():
    report = make_mesh(BALL, MeshJob(resolution=96)).report
    assert math.isclose(report.mesh.volume_mm3, 4 / 3 * math.pi * 20**3, rel_tol=0.005)


def test_the_report_is_json_with_all_it_has_to_say():
    result = make_mesh(BALL, MeshJob(resolution=32))
    reported = json.loads(json.dumps(result.report.as_dict()))
    wanted = """triangles vertices watertight manifold self_intersections components genus volume_mm3
        area_mm2 bbox_mm surface_error_mm evaluations bricks seconds peak_rss_mb scene_hash version"""
    assert set(wanted.split()) <= set(reported)
    assert reported["surface_error_mm"].keys() == {"mean", "p99", "max"}
    assert reported["triangles"] == len(result.mesh.triangles)
    assert (reported["genus"], reported["components"], reported["watertight"]) == (0, 1, True)
    assert reported["scene_hash"] == BALL.hash
    total = reported["seconds"].pop("total")
    assert total >= max(reported["seconds"].values())
    assert reported["evaluations"] > 1000
    assert reported["peak_rss_mb"] > 10


def test_the_surface_error_is_measured_and_small():
    error = make_mesh(BALL, MeshJob(resolution=64)).report.surface_error_mm
    assert 0 < error.mean <= error.p99 <= error.max < 40 / 64 / 4


def test_the_placement_leads_back_to_the_scene():
    result = make_mesh(scene(moved(sphere(radius=3), 1, 2, 3), size="40mm"), MeshJob(resolution=64))
    back = (result.mesh.vertices - result.place.offset) / result.place.scale
    assert np.allclose(np.linalg.norm(back - (1, 2, 3), axis=1), 3, atol=0.02)


TWO = scene(union(sphere(radius=1), moved(sphere(radius=0.3), 2, 0, 0)), size="40mm")


def test_all_bodies_are_kept_or_the_largest_which_then_has_the_size():
    both = make_mesh(TWO, MeshJob(resolution=64))
    largest = make_mesh(TWO, MeshJob(resolution=64, printing=Print(keep="largest")))
    assert both.report.mesh.components == 2
    assert largest.report.mesh.components == 1
    assert largest.report.voxel_mm == pytest.approx(40 / 64, rel=1e-6)
    assert largest.place.scale == pytest.approx(20, rel=1e-6)


def test_dust_is_dropped():
    small = 4 / 3 * math.pi * (0.3 * 40 / 3.3) ** 3
    assert make_mesh(TWO, MeshJob(resolution=64, dust=small * 0.9)).report.mesh.components == 2
    assert make_mesh(TWO, MeshJob(resolution=64, dust=small * 1.1)).report.mesh.components == 1
    with pytest.raises(SceneError, match="dust 1000000000 mm3: expected at most the object's volume"):
        make_mesh(TWO, MeshJob(resolution=64, dust=1e9))


def test_cavities_are_kept_or_filled():
    hollow = scene(difference(sphere(radius=1), sphere(radius=0.5)), size="40mm")
    kept = make_mesh(hollow, MeshJob(resolution=48)).report
    filled = make_mesh(hollow, MeshJob(resolution=48, printing=Print(cavities="fill"))).report
    assert (kept.mesh.cavities, filled.mesh.cavities) == (1, 0)
    assert filled.mesh.volume_mm3 == pytest.approx(kept.mesh.volume_mm3 * 8 / 7, rel=0.02)


@pytest.mark.parametrize("node", [sphere(), box(size=(1, 2, 3)), cone(radius=2, height=1)])
def test_a_base_is_cut_off_the_object_that_has_the_size(node):
    result = make_mesh(scene(node, size="40mm"), MeshJob(resolution=64, printing=Print(base=4)))
    assert result.report.problems == ()
    flat = result.mesh.vertices[:, 2] == 0
    assert flat.sum() > 10
    whole = make_mesh(scene(node, size="40mm"), MeshJob(resolution=64))
    assert whole.mesh.size[2] - result.mesh.size[2] == pytest.approx(4, abs=result.report.voxel_mm / 2)


def test_a_base_higher_than_the_object_is_refused():
    with pytest.raises(VolumeError, match="base of 30 mm leaves nothing"):
        make_mesh(
            scene(torus(radius=1, tube=0.2), size="40mm"), MeshJob(resolution=48, printing=Print(base=30))
        )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"voxel": 1, "resolution": 64}, "expected one of them"),
        ({"resolution": 4}, "resolution=4: expected a number >= 8 and <= 16384"),
        ({"resolution": math.nan}, "resolution=nan: expected a number"),
        ({"voxel": 0}, "voxel=0: expected a length above zero"),
        ({"size": -1}, "size=-1: expected a length"),
        ({"dust": -1}, "dust=-1: expected a number >= 0"),
        ({"voxel": 30}, "voxel 30mm: expected 0.002441mm to 5mm for an object of 40mm"),
    ],
)
def test_impossible_jobs_are_refused(values, message):
    with pytest.raises(SceneError, match=message):
        make_mesh(BALL, MeshJob(**values))


@pytest.mark.parametrize(
    ("node", "message"),
    [
        (plane(), "no end along"),
        (intersection(sphere(), moved(sphere(), 5, 0, 0)), "empty"),
        (difference(sphere(), sphere(radius=2)), "every point is outside"),
    ],
)
def test_scenes_without_a_finite_surface_are_refused(node, message):
    with pytest.raises((SceneError, VolumeError), match=message):
        make_mesh(scene(node, size="40mm"), MeshJob(resolution=32))


def test_what_does_not_fit_in_memory_is_refused_before_it_is_meshed(monkeypatch):
    monkeypatch.setattr("fracslice.jobs.mesh_steps.available_bytes", lambda: 1 << 27)
    with pytest.raises(
        VolumeError, match=r"a voxel of .*mm needs about .* GB .* a voxel of ([0-9.]+)mm fits"
    ) as caught:
        make_mesh(BALL, MeshJob(resolution=600))
    fits = float(str(caught.value).split("a voxel of ")[2].split("mm")[0])
    assert 40 / 600 < fits < 1


def test_the_memory_of_a_mesh_follows_its_vertices():
    """All vertices of a ball but a few are on grid edges."""
    result = make_mesh(BALL, MeshJob(resolution=96))
    signs = result.bricks.signs
    counted = mesh_steps.crossings_a_brick(signs) * len(signs)
    assert counted == pytest.approx(result.report.mesh.vertices, rel=0.05)


def test_there_is_memory():
    assert 1 << 20 < memory.available_bytes() < 1 << 60


FIRST = ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
SECOND = ("/sys/fs/cgroup", "memory.max", "memory.current", "inactive_file")


@pytest.mark.parametrize(("line", "names"), [("4:memory:/job/task", FIRST), ("0::/job/task", SECOND)])
@pytest.mark.parametrize("limited", ["", "/job", "/job/task"])
def test_limits_of_control_groups_count_at_every_level(line, names, limited, monkeypatch):
    """The root's, as a container sees it, that of the job and that of a task in it."""
    root, most, used, cached = names
    files = {"/proc/self/cgroup": ["9:name=systemd:/", "3:cpuset:/job", line]}
    for place in ("", "/job", "/job/task"):
        files[f"{root}{place}/{used}"] = ["700000"]
        files[f"{root}{place}/{most}"] = ["1000000"] if place == limited else ["max"]
        files[f"{root}{place}/memory.stat"] = ["cache 1", f"{cached} 50000"]
    monkeypatch.setattr(memory, "_lines", lambda path: files.get(path.replace("//", "/").rstrip("/"), []))
    assert memory.available_bytes() == 350_000


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs /proc")
def test_a_limit_of_addresses_counts():
    own = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (1 << 30,) * 2);"
        "from fracslice.common.memory import available_bytes; print(available_bytes())"
    )
    left = int(subprocess.run([sys.executable, "-c", own], capture_output=True, text=True).stdout)
    assert 1 << 29 < left < 1 << 30


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
def test_peak_memory_is_not_that_of_the_process_that_started_this_one():
    own = "from fracslice.common.memory import peak_rss_mb; print(peak_rss_mb())"
    large = (
        f"import subprocess, sys; held = b'x' * (300 << 20); subprocess.run([sys.executable, '-c', {own!r}])"
    )
    done = subprocess.run([sys.executable, "-c", large], capture_output=True, text=True, check=True)
    assert 1 < float(done.stdout) < 200


def test_cancelling_stops_it():
    cancel = threading.Event()
    stages = []

    def progress(stage, done):
        stages.append(stage)
        if stage == "sampling":
            cancel.set()

    with pytest.raises(Cancelled):
        make_mesh(BALL, MeshJob(resolution=64), Work(progress=progress, cancel=cancel))
    assert "checking" not in stages


def test_a_file_is_named_that_is_written_when_its_last_check_is_cancelled(monkeypatch, tmp_path):
    def stopped(*_):
        raise Cancelled("cancelled")

    monkeypatch.setattr("fracslice.volume.amount.mesh_amount", stopped)
    target = tmp_path / "ball.stl"
    with pytest.raises(KeptError, match=r"^.*ball\.stl is written$"):
        make_mesh(BALL, MeshJob(resolution=16), path=target)
    assert target.exists()
    with pytest.raises(Cancelled, match="cancelled"):
        make_mesh(BALL, MeshJob(resolution=16))


def test_a_file_is_named_that_is_written_when_the_work_is_cancelled(tmp_path):
    target = tmp_path / "ball.stl"
    cancel = SimpleNamespace(is_set=target.exists)
    with pytest.raises(KeptError, match=r"^.*ball\.stl is written$"):
        make_mesh(BALL, MeshJob(resolution=16), Work(cancel=cancel), path=target)


def test_the_result_does_not_depend_on_threads_or_run():
    scene_ = scene(union(sphere(), box(), smooth=0.1), size="40mm")
    one, two = (make_mesh(scene_, MeshJob(resolution=64), Work(threads=n)).mesh for n in (1, 3))
    assert (one.vertices == two.vertices).all()
    assert (one.triangles == two.triangles).all()


def test_what_is_thinner_than_a_voxel_and_missing_is_reported():
    """Of the dust -99.97 % was in no line."""
    dust = scene(julia(c=(-0.2703, 0.3049, 0.68, -0.5194), iterations=12), size="40mm")
    report = make_mesh(dust, MeshJob(resolution=48)).report
    amount = report.amount_mm3
    assert amount.off < -0.2 and amount.made == pytest.approx((1 + amount.off) * amount.object)
    assert f"{-amount.off:.1%} of the object's volume is finer than the samples" in report.problems[-1]
    assert json.loads(json.dumps(report.as_dict()))["amount_mm3"]["off"] == amount.off
    assert report.measured == ("julia",)


def test_what_is_all_there_is_not_reported():
    report = make_mesh(BALL, MeshJob(resolution=48)).report
    assert report.amount_mm3.off == 0 and report.notes == report.depths == report.measured == ()
    assert report.amount_mm3.object == pytest.approx(4 / 3 * math.pi * 20**3, rel=0.01)


def test_small_triangles_around_a_lowest_vertex_are_not_folded_onto_the_bed() -> None:
    report = make_mesh(scene(mandelbulb(iterations=10), size="80mm"), MeshJob(resolution=256)).report
    assert report.mesh.self_intersections == 0


def test_modules_of_later_stages_are_there() -> None:
    import_ahead()


@pytest.mark.usefixtures("only_samples")
def test_a_job_that_lost_its_object_samples_finer_and_says_so(tmp_path):
    report = make_mesh(LANTERN, MeshJob(resolution=144), path=tmp_path / "lantern.stl").report
    assert report.voxel_mm < 80 / 144 / 1.9 and report.problems == ()
    assert report.mesh.volume_mm3 == pytest.approx(report.amount_mm3.object, rel=0.02)
    assert report.notes[0].startswith("voxel 0.278 mm instead of 0.556 mm: ")
    assert "100.0% of the object's volume is finer than the samples and missing" in report.notes[0]


@pytest.mark.usefixtures("only_samples")
def test_a_lost_object_is_no_success(monkeypatch):
    """Where finer samples are too many, the report says how much is missing, and which voxel would do."""
    monkeypatch.setattr("fracslice.jobs.mesh.RAISED", 0)
    report = make_mesh(LANTERN, MeshJob(resolution=144)).report
    assert report.missing_volume_share > 0.99 and report.problems == report.lost
    assert "of the object's volume is finer than the samples and missing: a voxel of" in report.problems[-1]
    plain = report.as_dict()
    assert plain["printable"] is False and plain["problems"] == list(report.problems)
    assert plain["missing_volume_share"] > 0.99


@pytest.mark.usefixtures("only_samples")
@pytest.mark.parametrize("tube", [0.006, 0.02], ids=["no sample", "crumbs"])
def test_an_element_that_vanished_is_named_however_small(tube, monkeypatch):
    monkeypatch.setattr("fracslice.jobs.mesh.RAISED", 0)
    ring = scene(union(sphere(), torus(radius=1.5, tube=tube)), size=30)
    (problem,) = make_mesh(ring, MeshJob(resolution=32)).report.problems
    assert "of <torus> is finer than the samples and missing: a voxel of" in problem
    report = make_mesh(ring, MeshJob(resolution=32, printing=Print(keep="largest"))).report
    assert report.problems == (), "what is left out on purpose is not missing"
