"""Files of the frames of a film: numbered, each whole or absent."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from ..cluster import Shard
from ..common.cache import key
from ..common.files import locked_folder, remove_leftovers, replacing, reporting_errors
from ..common.messages import format_count
from ..errors import RenderError, SharedError
from ..export.resuming import FinishedFiles, sort_finished
from ..expr.host import toolchain
from ..fields.devices import choose_device
from ..scene import reads, to_xml
from ..work import Work
from .film import FilmJob
from .timeline import Timeline

AT_ONCE, MOST_PIXELS = 4, 1 << 25
"""Frames that this process makes at once, and pixels of them together."""

JOURNAL = "film.json"
"""File in the folder with the key of the film."""


@dataclass(frozen=True)
class FrameTask:
    """Frame of a film as a task of a cluster."""

    scene: str  # XML and name of the scene
    title: str
    size: tuple[int, int]  # as for `FilmJob`
    samples: int
    fps: float
    ending: str
    layers: bool
    job: str  # key of the film
    number: int  # number of the frame, from 0

    @classmethod
    def all(cls, job: FilmJob, numbers: Sequence[int]) -> list[FrameTask]:
        """Tasks of some frames."""
        scene, film = job.timeline.scene, key(toolchain(), job.key)
        about = job.size, job.samples, job.fps, job.ending, job.layers, film
        return [cls(to_xml(scene), scene.name, *about, number) for number in numbers]

    @property
    def name(self) -> str:
        """Name of the frame."""
        return f"frame-{self.number:05}"

    def make(self, work: Work) -> bytes:
        """File of the frame; see `Task.make`."""
        about = self.size, self.samples, self.fps, self.ending, "cpu", self.layers
        return FilmJob(_timeline(self.scene, self.title), *about).file(self.number, work)


@lru_cache(maxsize=1)
def _timeline(scene: str, title: str) -> Timeline:
    """Timeline of a scene, read once in a process."""
    return Timeline(reads(scene, title, files_outside=True))


def write_frames(job: FilmJob, numbers: Sequence[int], folder: Path, resume: bool, work: Work) -> list[Path]:
    """Write frames into a folder.

    Parameters
    ----------
    job : FilmJob
        The film.
    numbers : sequence of int
        Numbers of the frames, from 0.
    folder : Path
        Folder, made if it is missing.
    resume : bool
        True to keep frames that are there; False to make them again.
    work : Work
        Threads or pool, progress and cancellation.

    Returns
    -------
    list of Path
        The frames, in order.

    Raises
    ------
    RenderError
        If the folder has the frames of another film, or files that are no frames of a film.
    ExportError
        For an error of the file system, or if another process is writing there.
    SharedError
        For a shard that does not write the frames, when its own are made.
    """
    if work.cluster is not None:
        job = replace(job, device="cpu")  # that of the tasks
    if isinstance(work.cluster, Shard) and not work.cluster.first:
        count = work.cluster.share(FrameTask.all(job, numbers), work)
        raise SharedError(f"this shard made {format_count(count, 'frame')}; shard 1 writes them")
    with reporting_errors(folder):
        folder.mkdir(exist_ok=True)
    with locked_folder(folder):
        _claim(job, folder, resume)
        with FinishedFiles.of(folder / JOURNAL) as finished:
            names = {number: job.path(folder, number).name for number in numbers}
            missing = [number for number in numbers if not (resume and names[number] in finished)]
            _write(job, missing, folder, finished, work)
        sort_finished(folder / JOURNAL)
    return [job.path(folder, number) for number in numbers]


def _write(job: FilmJob, numbers: Sequence[int], folder: Path, finished: FinishedFiles, work: Work) -> None:
    """Make frames and write them, by the pool of the work if there is one."""

    def write(number: int, data: bytes) -> None:
        path = job.path(folder, number)
        with replacing(path) as file:
            file.write(data)
        finished.add(path.name, data)

    if work.cluster is None:
        _write_here(job, numbers, write, work)
    elif numbers:
        tasks = FrameTask.all(job, numbers)
        for number, data in zip(numbers, work.cluster.results(tasks, work, "frames"), strict=True):
            write(number, data)
        work.cluster.finished(tasks[0].job)


def _write_here(
    job: FilmJob, numbers: Sequence[int], write: Callable[[int, bytes], None], work: Work
) -> None:
    """Make frames in this process, some at once: the end of one frame does not keep all threads busy."""
    at_once = min(AT_ONCE, work.threads, max(1, MOST_PIXELS // math.prod(job.size)))
    if choose_device(job.device) != "cpu":
        at_once = 1
    own = replace(work, threads=work.threads // at_once, progress=lambda *_: None)
    crew = replace(work, threads=at_once)
    for done, _ in enumerate(crew.ordered(lambda number: write(number, job.file(number, own)), numbers), 1):
        work.progress("frames", done / len(numbers))


def _claim(job: FilmJob, folder: Path, resume: bool) -> None:
    """Make a folder this film's; frames of an earlier film are removed, unless it is to be resumed.

    What killed processes were writing is removed.
    """
    journal = folder / JOURNAL
    remove_leftovers(folder)
    if not journal.exists():
        if any(folder.iterdir()):
            raise RenderError(f"{folder}: expected an empty folder, or one with the frames of a film")
    elif _film_key(journal) == job.key:
        return
    elif resume:
        raise RenderError(
            f"{folder}: has frames of another film or device: expected those of this one, to resume"
        )
    for path in folder.glob("frame?????.*"):
        path.unlink()
    with replacing(journal) as file:
        file.write(json.dumps({"key": job.key, "fps": job.fps}).encode() + b"\n")


def _film_key(journal: Path) -> str:
    """Key of the film whose frames are in a folder."""
    try:
        return str(json.loads(journal.read_text().partition("\n")[0])["key"])
    except (ValueError, KeyError, TypeError):
        raise RenderError(f"{journal}: expected the journal of a film") from None
