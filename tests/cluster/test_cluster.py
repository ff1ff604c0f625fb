"""Slices, frames and meshes by a scheduler and its workers."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fracslice.cli.main import run as command

from fracslice import meshsampling, meshtasks
from fracslice.animation import FilmJob, Timeline, write_frames
from fracslice.cluster import ResultFolder, Workers, connected, workers
from fracslice.cluster.identity import Identity
from fracslice.errors import Cancelled, ClusterError
from fracslice.export.slices import write_slices
from fracslice.formulas import mandelbulb, sphere
from fracslice.job import make_mesh
from fracslice.meshjob import MeshJob
from fracslice.rendering import Renderer, parts
from fracslice.scene import scene
from fracslice.scene.reader import reads
from fracslice.scene.view import Camera, View
from fracslice.scene.writer import to_xml
from fracslice.slicerecipe import SliceRecipe
from fracslice.slicing import SliceJob
from fracslice.volume import exploration
from fracslice.work import Work

from .processes import SECONDS, Cluster, wait_until

pytest.importorskip("distributed")
ROOT = mandelbulb(iterations=4)
RECIPE = SliceRecipe(to_xml(scene(ROOT, size="20mm")), "bulb", SliceJob(20.0, 0.1, (0.05, 0.05)), None, "cli")
MESHED = scene(mandelbulb(iterations=4) | sphere(radius=0.1).translate((-1.5, 0.0, 0.0)), size="20mm")
VIEW = View(camera=Camera(eye=(2.0, -2.0, 1.0)))
SIZE, SAMPLES = (96, 72), 6
FILM = """<scene version="1"><solid size="80mm"><mandelbulb iterations="4"/></solid><camera eye="2 -2 1"/>
<animation duration="1s" shutter="0.5" times="2"/>
<track of="camera.eye" keys="0s: 2 -2 1; 1s: 2 -1.5 1"/></scene>"""

Job = Callable[[Work, Path], bytes]


def sliced(work: Work, folder: Path) -> bytes:
    """Layers of a file."""
    return write_slices(RECIPE.run(work), folder / "a.cli").read_bytes()


def rendered(work: Work, folder: Path) -> bytes:
    """Sums of a picture after its passes; progress after each."""
    of = Renderer(ROOT, VIEW, SIZE, work, "cpu")
    for done in of.passes(SAMPLES, 0.0):
        work.progress("rendering", min(0.99, done.number / 100))
    return of.accumulator.host().sums.tobytes()


def meshed(work: Work, folder: Path) -> bytes:
    """STL file of a mesh with dust that is removed."""
    make_mesh(MESHED, MeshJob(resolution=40, dust_mm3=5.0), work, folder / "a.stl")
    return (folder / "a.stl").read_bytes()


def filmed(work: Work, folder: Path) -> bytes:
    """Frames of a film."""
    timeline = Timeline(reads(FILM))
    job = FilmJob(timeline, (32, 24), 4, 6.0, device="cpu")
    paths = write_frames(job, range(job.frames), folder / "frames", False, work)
    return b"".join(path.read_bytes() for path in paths)


JOBS: dict[str, Job] = {"slice": sliced, "render": rendered, "mesh": meshed}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    started = Cluster(tmp_path_factory.mktemp("cluster"))
    yield started
    started.end()


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Results of one machine."""
    folder = tmp_path_factory.mktemp("expected")
    return {name: job(Work(2), folder) for name, job in JOBS.items()}


@pytest.fixture(autouse=True)
def no_workers_of_other_tests(cluster: Cluster) -> Iterator[None]:
    """A test that fails leaves nothing behind that hangs the next one."""
    yield
    cluster.end_workers()


@pytest.fixture(autouse=True)
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "PIXELS", 1024)
    monkeypatch.setattr(meshtasks, "LEAST", 1)
    monkeypatch.setattr(exploration, "MANY", 1)
    monkeypatch.setattr(meshsampling, "BRICKS", 32)
    monkeypatch.setattr(workers, "CONNECT", SECONDS)  # the machine may be busy


@pytest.mark.parametrize("name", JOBS)
def test_a_killed_worker_and_a_late_one(
    name: str, cluster: Cluster, expected: dict[str, bytes], tmp_path: Path
) -> None:
    """SIGKILL in the middle of a job, with nobody left; then another worker comes."""
    first, late, made = cluster.worker(), [], []
    shares: dict[str, list[float]] = {}
    pieces = tmp_path / "pieces"

    def progress(stage: str, share: float) -> None:
        shares.setdefault(stage, []).append(share)
        shared = stage in ("slicing", "rendering", "meshing", "frames")
        if shared and 0 < share < 1 and not late and first.poll() is None:
            first.send_signal(signal.SIGKILL)
            first.wait()
            made.append(len(list(pieces.glob("*/*-*"))))
            late.append(cluster.worker())

    with connected(cluster.address, str(pieces)) as pool:
        result = JOBS[name](Work(1, progress=progress, cluster=pool), tmp_path)
    assert late
    assert made[0] < 25
    assert all(
        of == sorted(of) for stage, of in shares.items() if stage in ("slicing", "rendering", "frames")
    )
    assert result == expected[name]
    assert not any(pieces.iterdir())


def test_a_worker_that_hangs(
    cluster: Cluster, expected: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its tasks are given to another one after a while without a result; nothing is fetched from it."""
    monkeypatch.delattr("distributed.Future.result")
    hung = cluster.worker()
    cluster.worker()

    def progress(_: str, share: float) -> None:
        hung.send_signal(signal.SIGSTOP)

    with connected(cluster.address, str(tmp_path / "pieces")) as pool:
        pool.client.wait_for_workers(2, timeout=SECONDS)
        quick = Workers(pool.client, pool.pieces, patience=0.5)
        assert sliced(Work(1, progress=progress, cluster=quick), tmp_path) == expected["slice"]


SHARED = {
    "slice": (["--layer", "0.1mm", "--pixel", "0.05mm"], "layers-*", "a.cli"),
    "mesh": (["--resolution", "40", "--dust", "5"], "surface-*", "a.stl"),
}
"""Options, pieces and file of a command."""


@pytest.mark.parametrize("name", SHARED)
def test_the_client_dies_and_the_same_command_goes_on(
    name: str, cluster: Cluster, expected: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options, piece, file = SHARED[name]
    (tmp_path / "bulb.xml").write_text(RECIPE.scene if name == "slice" else to_xml(MESHED))
    output, pieces = tmp_path / file, tmp_path / ".fracslice-pieces"
    given = [name, str(tmp_path / "bulb.xml"), "-o", str(output), *options, "--quiet"]
    given += ["--cluster", cluster.address]
    started = (
        "from fracslice import meshtasks; meshtasks.LEAST = 1; from fracslice.cli.main import main; main()"
    )
    cluster.worker()
    client = subprocess.Popen([sys.executable, "-c", started, *given])
    wait_until(lambda: len(list(pieces.glob(f"*/{piece}"))) > 2)
    client.kill()
    client.wait()
    assert not output.exists()
    submitted: list[str] = []
    submit = workers._Attempt.submit
    monkeypatch.setattr(
        workers._Attempt,
        "submit",
        lambda of, numbers: (submitted.extend(of.tasks[n].name for n in numbers), submit(of, numbers)),
    )
    assert command(given) == 0
    assert output.read_bytes() == expected[name]
    assert submitted
    assert not {piece.replace("*", first) for first in ("00000", "000000-000016")} & set(submitted)
    assert not pieces.exists()


def test_a_worker_of_another_version_is_not_used(
    cluster: Cluster, expected: dict[str, bytes], tmp_path: Path
) -> None:
    old = tmp_path / "old.py"
    old.write_text('from fracslice.cluster import identity\nidentity.__version__ = "0.0.9"\n')
    cluster.worker("--preload", str(old))
    good = cluster.worker()
    with (
        connected(cluster.address, str(tmp_path / "pieces")) as pool,
        warnings.catch_warnings(record=True) as lines,
    ):
        warnings.simplefilter("always")
        pool.client.wait_for_workers(2, timeout=SECONDS)
        result = sliced(Work(1, cluster=pool), tmp_path)
    assert result == expected["slice"]
    (line,) = {str(one.message) for one in lines if "not used" in str(one.message)}
    assert line.endswith("is not used: fracslice 0.0.9, expected 0.1.0")
    good.kill()
    good.wait()
    with connected(cluster.address, str(tmp_path / "pieces")) as pool:
        wait_until(lambda: len(pool.client.scheduler_info()["workers"]) == 1)
        with pytest.raises(ClusterError, match="no worker fits"):
            sliced(Work(1, cluster=pool), tmp_path)


def test_what_differs_is_named() -> None:
    here = Identity("0.1.0", "3.11.7", "a" * 32, "b" * 32)
    assert here.difference(here) == ""
    other = Identity("0.1.0", "3.12.1", "a" * 32, "b" * 32)
    assert other.difference(here) == "Python 3.12.1, expected 3.11.7"


def test_time_limits_and_cancellation(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No worker; no scheduler; Ctrl-C."""
    with connected(cluster.address, str(tmp_path / "pieces")) as pool:
        wait_until(lambda: not pool.client.scheduler_info()["workers"])
        alone = Workers(pool.client, pool.pieces, patience=0.2, limit=0.6)
        with pytest.raises(ClusterError, match=r"no task ended within 0\.6 s; 0 workers"):
            sliced(Work(1, cluster=alone), tmp_path)
        work = Work(1, cluster=pool)
        threading.Timer(0.3, work.cancel.set).start()
        with pytest.raises(Cancelled):
            sliced(work, tmp_path)
    monkeypatch.setattr(workers, "CONNECT", 0.3)
    with pytest.raises(ClusterError, match="no scheduler answers"), connected("tcp://127.0.0.1:9", "x"):
        pass


@pytest.mark.parametrize("name", JOBS)
def test_a_memory_file_system(name: str, expected: dict[str, bytes], tmp_path: Path) -> None:
    """Threads of this process as workers; results in fsspec's memory."""
    from distributed import Client

    with Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address=":0") as client:
        pool = Workers(client, ResultFolder(f"memory://{tmp_path.name}"))
        assert JOBS[name](Work(1, cluster=pool), tmp_path) == expected[name]


def test_an_object_store_keeps_the_first_of_two_results(tmp_path: Path) -> None:
    pieces = ResultFolder(f"memory://{tmp_path.name}")
    for data in (b"first", b"second"):
        pieces.write("job", "piece", data)
    assert pieces.read("job", "piece") == b"first"
    assert pieces.read("job", "piece", 1, 3) == b"ir"


def test_local_workers_are_processes(tmp_path: Path) -> None:
    with connected("local:2", str(tmp_path / "pieces"), 2) as pool:
        result = pool.client.scheduler_info(n_workers=-1)["workers"].values()
    assert [worker["nthreads"] for worker in result] == [1, 1]


def test_a_client_of_dask_is_a_cluster(
    expected: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import Client

    monkeypatch.chdir(tmp_path)
    with Client(processes=False, n_workers=1, dashboard_address=":0") as client:
        assert sliced(Work(1, cluster=client), tmp_path) == expected["slice"]
