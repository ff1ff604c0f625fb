"""Slices, frames and meshes by a scheduler and its workers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from fracslice.cli.main import run as command

from fracslice.animation import FilmJob, Timeline, write_frames
from fracslice.cluster import ResultFolder, Workers, connect, workers
from fracslice.cluster.workers import Identity
from fracslice.errors import Cancelled, ClusterError, FracsliceWarning
from fracslice.export.layers import write_slices
from fracslice.formulas import mandelbulb, sphere
from fracslice.jobs import shared
from fracslice.jobs.mesh import make_mesh
from fracslice.jobs.slices import SliceRecipe
from fracslice.mesh import shells
from fracslice.records import MeshJob
from fracslice.rendering import Renderer, progressive
from fracslice.scene import Scene, reads, scene, to_xml
from fracslice.scene.view import Camera, View
from fracslice.slicing import SliceJob
from fracslice.volume import sampler
from fracslice.work import Work

from ..examples import stamped
from .processes import SECONDS, Cluster, wait_until

pytestmark = pytest.mark.once

pytest.importorskip("distributed")
ROOT = mandelbulb(iterations=4)
RECIPE = SliceRecipe(
    to_xml(scene(ROOT, size="20mm")), "bulb", SliceJob(size=20.0, layer=0.1, pixel=(0.05, 0.05)), "cli"
)
MESHED = scene(mandelbulb(iterations=4) | sphere(radius=0.1).translate((-1.5, 0.0, 0.0)), size="20mm")
VIEW = View(camera=Camera(eye=(2.0, -2.0, 1.0)))
SIZE, SAMPLES = (96, 72), 6
PICTURED = to_xml(Scene(ROOT, 1.0, view=VIEW))
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
    make_mesh(MESHED, MeshJob(resolution=40, dust=5.0), work, folder / "a.stl")
    return (folder / "a.stl").read_bytes()


def filmed(work: Work, folder: Path) -> bytes:
    """Frames of a film."""
    timeline = Timeline(reads(FILM))
    job = FilmJob(timeline, (32, 24), 4, 6.0, device="cpu")
    paths = write_frames(job, range(job.frames), folder / "frames", False, work)
    return b"".join(path.read_bytes() for path in paths)


Expected = Callable[[str], bytes]
JOBS: dict[str, Job] = {"slice": sliced, "render": rendered, "mesh": meshed, "film": filmed}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    started = Cluster(tmp_path_factory.mktemp("cluster"))
    yield started
    started.end()


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Expected:
    """Results of one machine."""
    folder = tmp_path_factory.mktemp("expected")
    return cache(lambda name: JOBS[name](Work(2), folder))


@pytest.fixture(autouse=True)
def no_workers_of_other_tests(cluster: Cluster) -> Iterator[None]:
    """A test that fails leaves nothing behind that hangs the next one."""
    yield
    cluster.end_workers()


@pytest.fixture(autouse=True)
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progressive, "PIXELS", 1024)
    monkeypatch.setattr(shared, "LEAST", 1)
    monkeypatch.setattr(shells, "FAN", 2)
    monkeypatch.setattr(sampler, "MANY_BRICKS", 1)
    monkeypatch.setattr(shared, "BRICKS", 32)
    monkeypatch.setattr(workers, "CONNECT", SECONDS)  # the machine may be busy


@pytest.mark.parametrize("name", stamped(JOBS, ["mesh"]))
def test_a_killed_worker_and_a_late_one(
    name: str, cluster: Cluster, expected: Expected, tmp_path: Path
) -> None:
    """SIGKILL in the middle of a job, with nobody left; then another worker comes."""
    first, late, made = cluster.worker(), list[subprocess.Popen[bytes]](), list[int]()
    pieces, shares = tmp_path / "pieces", dict[str, list[float]]()

    def progress(stage: str, share: float) -> None:
        shares.setdefault(stage, []).append(share)
        shared = stage in ("slicing", "rendering", "meshing", "frames", "checking layers")
        if shared and 0 < share < 1 and not late:
            first.send_signal(signal.SIGKILL)
            first.wait()
            made.append(len(list(pieces.glob("*/*-*"))))
            late.append(cluster.worker())

    with connect(cluster.address, str(pieces)) as pool:
        result = JOBS[name](Work(1, progress=progress, cluster=pool), tmp_path)
    assert late and made[0] < 25
    ordered = {stage: of == sorted(of) for stage, of in shares.items() if stage != "meshing"}
    assert name == "mesh" or all(ordered.values())
    assert result == expected(name)
    assert not any(pieces.iterdir())


@pytest.mark.nightly
def test_a_worker_that_hangs(
    cluster: Cluster, expected: Expected, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its tasks are given to another one after a while without a result; nothing is fetched from it."""
    monkeypatch.delattr("distributed.Future.result")
    hung = cluster.worker()
    cluster.worker()

    def progress(_: str, share: float) -> None:
        hung.send_signal(signal.SIGSTOP)

    with connect(cluster.address, str(tmp_path / "pieces")) as pool:
        pool.client.wait_for_workers(2, timeout=SECONDS)
        quick = Workers(pool.client, pool.pieces, patience=0.5)
        assert sliced(Work(1, progress=progress, cluster=quick), tmp_path) == expected("slice")


SHARED = {
    "slice": (["--layer", "0.1mm", "--pixel", "0.05mm"], "layers-*", "a.cli"),
    "mesh": (["--resolution", "40", "--dust", "5"], "contour-*", "a.stl"),
    "render": (["--size", "96x72", "--samples", "3"], "../*.npz", "a.png"),
    "animate": (["--size", "32x24", "--samples", "4", "--fps", "12"], "frame-*", "frames"),
}
"""Options, pieces and file of a command."""
PASSES = 4
"""Passes of the rendered command."""
STARTED = """from fracslice.jobs import shared
from fracslice.rendering import progressive
shared.LEAST = 1
progressive.PIXELS = 1024
from fracslice.cli.main import main; main()"""


@pytest.mark.parametrize("name", stamped(SHARED, ["slice"]))
def test_the_client_dies_and_the_same_command_goes_on(
    name: str, cluster: Cluster, expected: Expected, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cluster.worker()
    made: list[str] = []
    submit = workers._Attempt.submit
    monkeypatch.setattr(
        workers._Attempt,
        "submit",
        lambda of, numbers: (
            made.extend(f"{of.tasks[n].job}/{of.tasks[n].name}" for n in numbers),
            submit(of, numbers),
        ),
    )
    scenes = {"slice": RECIPE.scene, "mesh": to_xml(MESHED), "render": PICTURED, "animate": FILM}
    options, piece, file = SHARED[name]
    (tmp_path / "bulb.xml").write_text(scenes[name])
    output, pieces = tmp_path / file, tmp_path / ".fracslice-pieces"
    given = [name, str(tmp_path / "bulb.xml"), "-o", str(output), *options, "--quiet"]
    shared = [*given, "--cluster", cluster.address]
    client = subprocess.Popen([sys.executable, "-c", STARTED, *shared])

    def begun() -> bool:
        return client.poll() is not None or len(list(pieces.glob(f"*/{piece}"))) > (piece[0] != ".") * 2

    wait_until(begun)
    assert client.poll() is None, "it ended before its pieces were seen"
    client.kill()
    client.wait()
    assert name == "animate" or not output.exists()
    there = {f"{path.parent.name}/{path.name}" for path in pieces.glob("*/*-*")}
    made.clear()
    assert command(shared) == 0
    assert made and not there & set(made)
    assert name != "render" or len({task.split("/")[0] for task in made}) < PASSES
    assert not pieces.exists()
    if name in ("slice", "mesh"):
        assert output.read_bytes() == expected(name)
    else:
        alone = tmp_path / f"alone{output.suffix}"
        assert command([*given[:3], str(alone), *options, "--quiet"]) == 0
        assert contents(output) == contents(alone)


def contents(path: Path) -> list[bytes]:
    """Bytes of a file, or of the files of a folder."""
    return [of.read_bytes() for of in (sorted(path.iterdir()) if path.is_dir() else [path])]


OTHER = "fracslice 0.0.9, expected 0.1.0"
LACKING = "No module named 'fracslice.cluster'; 'fracslice' is not a package"


def test_a_worker_of_another_version_is_not_used(
    cluster: Cluster, expected: Expected, tmp_path: Path
) -> None:
    old = tmp_path / "old.py"
    lacking = "import sys\nsys.modules['fracslice.jobs.slices'] = None\n"
    old.write_text(f'{lacking}from fracslice.cluster import workers\nworkers.__version__ = "0.0.9"\n')
    bare = tmp_path / "bare.py"
    bare.write_text("import sys\nsys.modules['fracslice'] = None\n")
    for preload in (old, bare):
        cluster.worker("--preload", str(preload))
    good = cluster.worker()
    with warnings.catch_warnings(record=True) as lines:
        warnings.simplefilter("always")
        with connect(cluster.address, str(tmp_path / "pieces")) as pool:
            pool.client.wait_for_workers(3, timeout=SECONDS)
            assert sliced(Work(1, cluster=pool), tmp_path) == expected("slice")
        good.kill()
        good.wait()
        with connect(cluster.address, str(tmp_path / "pieces")) as pool:
            wait_until(lambda: len(pool.client.scheduler_info()["workers"]) == 2)
            with pytest.raises(ClusterError, match="no worker fits"):
                sliced(Work(1, cluster=pool), tmp_path)
    assert {str(one.message).partition(" is not used: ")[2] for one in lines} - {""} == {OTHER, LACKING}


ARRAYS = """import resource, threading
import numpy as np
from fracslice.common.memory import keep_memory_of_tasks

def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

def tasks():
    keep_memory_of_tasks()
    [np.ones(3 << 20) for _ in range(10)]
    before = faults()
    for _ in range(3):
        [np.ones(3 << 20) for _ in range(10)]
    print(faults() - before)

thread = threading.Thread(target=tasks)
thread.start()
thread.join()"""


@pytest.mark.skipif(sys.platform != "linux", reason="of glibc")
def test_workers_reuse_freed_memory() -> None:
    """Dask's nanny starts them with a setting that returns each array to the system; threads have heaps."""
    arenas = str(workers.SETTINGS["distributed.nanny.pre-spawn-environ.MALLOC_ARENA_MAX"])
    given = {**os.environ, "MALLOC_TRIM_THRESHOLD_": "65536", "MALLOC_ARENA_MAX": arenas}
    done = subprocess.run(
        [sys.executable, "-c", ARRAYS], env=given, capture_output=True, text=True, check=True
    )
    assert int(done.stdout) < 3 * 10, "an array of 24 MB has 12 huge pages, or 6144 small ones"


def test_what_differs_is_named() -> None:
    here = Identity("0.1.0", "3.11.7", "a" * 32, "b" * 32)
    assert here.difference(here) == ""
    other = Identity("0.1.0", "3.12.1", "a" * 32, "b" * 32)
    assert other.difference(here) == "Python 3.12.1, expected 3.11.7"


def test_time_limits_and_cancellation(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No worker; no scheduler; Ctrl-C."""
    with connect(cluster.address, str(tmp_path / "pieces")) as pool:
        wait_until(lambda: not pool.client.scheduler_info()["workers"])
        alone = Workers(pool.client, pool.pieces, patience=0.2, limit=0.6)
        with pytest.raises(ClusterError, match=r"no task ended within 0\.6 s; 0 workers"):
            sliced(Work(1, cluster=alone), tmp_path)
        work = Work(1, cluster=pool)
        threading.Timer(0.3, work.cancel.set).start()
        with pytest.raises(Cancelled):
            sliced(work, tmp_path)
    monkeypatch.setattr(workers, "CONNECT", 0.3)
    with pytest.raises(ClusterError, match="no scheduler answers"), connect("tcp://127.0.0.1:9", "x"):
        pass


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Cluster]:
    """Scheduler of one test, which may stop or kill it."""
    started = Cluster(tmp_path)
    yield started
    started.end()


@pytest.mark.nightly
@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_a_scheduler_that_hangs_or_ends(
    number: int, own: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line each: that nobody works, and that the scheduler is silent; nothing hangs."""
    monkeypatch.setattr(workers, "CONNECT", 3.0)
    with connect(own.address, str(tmp_path / "pieces")) as pool:
        quick = Workers(pool.client, pool.pieces, patience=1.0)

        def after_submission() -> None:
            wait_until(lambda: pool.client.futures)
            own.processes[0].send_signal(number)

        threading.Thread(target=after_submission).start()
        with (
            pytest.warns(FracsliceWarning, match="no worker yet; the job waits 30 min for one"),
            pytest.raises(ClusterError, match=f"{own.address}: the scheduler does not answer"),
        ):
            sliced(Work(1, cluster=quick), tmp_path)


@pytest.mark.nightly
def test_a_task_whose_workers_end(
    expected: Expected, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: Any
) -> None:
    """As one whose memory is too small, after as many as Dask allows; then another worker comes."""
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    own = request.getfixturevalue("own")
    first = own.worker()

    def progress(_: str, share: float) -> None:
        if share < 1 and first.poll() is None:
            first.kill()
            first.wait()
            own.worker()

    with connect(own.address, str(tmp_path / "pieces")) as pool:
        pool.client.wait_for_workers(1, timeout=SECONDS)
        with pytest.warns(FracsliceWarning, match="layers-.*: its workers ended, one by one"):
            assert sliced(Work(1, progress=progress, cluster=pool), tmp_path) == expected("slice")


@pytest.mark.parametrize("name", JOBS)
def test_a_memory_file_system(name: str, expected: Expected, tmp_path: Path) -> None:
    """Threads of this process as workers; results in fsspec's memory."""
    from distributed import Client

    with Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address=":0") as client:
        pool = Workers(client, ResultFolder(f"memory://{tmp_path.name}"))
        assert JOBS[name](Work(1, cluster=pool), tmp_path) == expected(name)


def test_an_object_store_keeps_the_first_of_two_results(tmp_path: Path) -> None:
    pieces = ResultFolder(f"memory://{tmp_path.name}")
    for data in (b"first", b"second"):
        pieces.write("job", "piece", data)
    assert pieces.read("job", "piece") == b"first"
    assert pieces.read("job", "piece", 1, 3) == b"ir"


@pytest.mark.nightly
def test_a_client_of_dask_is_a_cluster(
    expected: Expected, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import Client

    monkeypatch.chdir(tmp_path)
    with Client(processes=False, n_workers=1, dashboard_address=":0") as client:
        assert sliced(Work(1, cluster=client), tmp_path) == expected("slice")
