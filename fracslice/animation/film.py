"""Frames of a film, one by one, with automatic depths that change without a jump; their numbered files,
made to films by ffmpeg, to animated pictures and contact sheets by Pillow.
"""

from __future__ import annotations

import json
import math
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain, groupby, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..cluster import Shard
from ..common.cache import key, program
from ..common.files import locked_folder, remove_leftovers, replacing, reporting_errors, temporary_folder
from ..common.messages import format_count, lacking
from ..common.parameters import Number, validate_value
from ..errors import ExportError, RenderError, SharedError
from ..export.images import encoded_image
from ..export.resuming import FinishedFiles, sort_finished
from ..expr.runtime import toolchain
from ..fields.depth import resolve_depths
from ..fields.devices import choose_device
from ..fields.registry import Node
from ..rendering import Renderer, develop, picture
from ..rendering.accumulator import SampleRange
from ..rendering.progressive import layers
from ..rendering.setup import DETAIL, default_lights, footprint, surroundings
from ..scene import reads, to_xml
from ..scene.model import Scene
from ..scene.view import Camera
from ..version import APPLICATION
from ..work import Work
from .timeline import Timeline

CODECS = {
    ".mp4": ("libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"),
    ".webm": ("libvpx-vp9", "-pix_fmt", "yuv420p", "-crf", "24", "-b:v", "0", "-row-mt", "1"),
    ".mov": ("prores_ks", "-profile:v", "3", "-pix_fmt", "yuv422p10le"),
    ".mkv": ("libsvtav1", "-pix_fmt", "yuv420p", "-crf", "28", "-preset", "6"),
}
"""Codec and options of ffmpeg by ending: H.264, VP9, ProRes 422 HQ and AV1."""
COLOURS = ("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv")
"""Tags of a film's colours: a player guesses the matrix of a film without them by its size."""
ALIKE = ("-fflags", "+bitexact")
"""No random identity in .webm and .mkv: the same frames are the same file."""
COLUMNS, ROWS, THUMBNAIL = 6, 4, 240
"""Pictures of a contact sheet, and their width in pixels."""
FASTEST_GIF = 50.0
"""Most frames per second of a .gif: browsers take a frame of a hundredth of a second for one of a tenth."""
ENDINGS = (*CODECS, ".gif", ".apng", ".png")


def check_film(path: Path, fps: float) -> None:
    """Check that a film file can be made.

    Parameters
    ----------
    path : Path
        The file.
    fps : float
        Frames per second.

    Raises
    ------
    ExportError
        For an unknown ending, a missing imageio-ffmpeg, or too many frames per second.
    """
    if path.suffix.lower() not in ENDINGS:
        raise ExportError(f"{path}: unknown kind of film; known are {', '.join(ENDINGS)}, and a folder")
    missing = lacking("imageio_ffmpeg", f"{path.suffix} films need", "imageio-ffmpeg")
    if path.suffix.lower() in CODECS and missing:
        raise ExportError(missing)
    if path.suffix.lower() == ".gif" and fps > FASTEST_GIF:
        raise ExportError(f"{path}: {fps:g} frames per second: expected at most {FASTEST_GIF:g} for .gif")


def encode(frames: Sequence[Path], path: Path, fps: float, work: Work) -> None:
    """Write frames as one file, by its ending: a film, an animated picture, or a contact sheet (.png).

    Parameters
    ----------
    frames : sequence of Path
        PNG files, in order.
    path : Path
        The file.
    fps : float
        Frames per second.
    work : Work
        Progress and cancellation.

    Raises
    ------
    ExportError
        If the file cannot be made.
    Cancelled
        When the work is cancelled.
    """
    check_film(path, fps)
    ending = path.suffix.lower()
    pictures = _pictures(frames, work)
    with replacing(path) as file:
        if ending in CODECS:
            file.write(_encode_film(pictures, ending, fps))
        elif ending == ".png":
            _contact_sheet(pictures, len(frames)).save(file, "png")
        elif ending == ".gif":
            first, *others = map(_of_few_colours, pictures)
            times = _hundredths(len(frames), fps)
            first.save(file, "gif", save_all=True, append_images=others, duration=times, loop=0)
        else:
            first, *others = pictures
            first.save(file, "png", save_all=True, append_images=others, duration=1000 / fps, loop=0)


def sheet_frames(frames: Sequence[int]) -> list[int]:
    """Choose the frames of a contact sheet, at equal intervals.

    Parameters
    ----------
    frames : sequence of int
        Numbers of the frames of a film.

    Returns
    -------
    list of int
        At most `COLUMNS` x `ROWS` of them, the first and the last one included.
    """
    count = min(COLUMNS * ROWS, len(frames))
    return [frames[k * (len(frames) - 1) // max(count - 1, 1)] for k in range(count)]


def _contact_sheet(pictures: Iterator[Any], count: int) -> Any:
    """Sheet of pictures in rows."""
    from PIL import Image

    sheet = None
    for k, frame in enumerate(pictures):
        width = min(THUMBNAIL, frame.width)
        height = max(round(width * frame.height / frame.width), 1)
        sheet = sheet or Image.new("RGB", (width * min(COLUMNS, count), height * -(-count // COLUMNS)))
        small = frame.resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(small, (k % COLUMNS * width, k // COLUMNS * height))
    return sheet


def _hundredths(count: int, fps: float) -> list[int]:
    """Milliseconds of each frame of a .gif: whole hundredths of a second, whose sum is the film's."""
    ends = [10 * round(100 * k / fps) for k in range(count + 1)]
    return [after - before for before, after in pairwise(ends)]


def _of_few_colours(picture: Any) -> Any:
    """Picture of 256 colours: means of clusters, since a median cut leaves few to what is small and vivid."""
    return picture.quantize(kmeans=max(picture.width * picture.height // 100, 1))


def _pictures(frames: Sequence[Path], work: Work) -> Iterator[Any]:
    """Pictures of the frames, one by one."""
    for done, frame in enumerate(frames, 1):
        work.check()
        yield _open_picture(frame)
        work.progress("film", done / len(frames))


def _open_picture(path: Path) -> Any:
    """Picture of a file; the file is closed."""
    from PIL import Image

    with Image.open(path) as picture:
        return picture.convert("RGB")


def _encode_film(pictures: Iterator[Any], ending: str, fps: float) -> bytes:
    """Film made by ffmpeg, in a process of its own."""
    import imageio_ffmpeg

    first = _even(next(pictures))
    height, width, _ = first.shape
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-framerate", repr(fps)]
    codec, *options = CODECS[ending]
    with temporary_folder() as folder, tempfile.TemporaryFile() as log:
        film = folder / f"film{ending}"
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", *source, "-i", "-"]
        command += ["-vf", "scale=out_color_matrix=bt709", "-c:v", codec, *options, *COLOURS]
        command += [*ALIKE, str(film)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log) as process:
            assert process.stdin
            try:
                for pixels in chain([first], map(_even, pictures)):
                    process.stdin.write(pixels.tobytes())
            except BrokenPipeError:  # ffmpeg's own message says more
                pass
            except BaseException:
                process.kill()
                raise
        if process.returncode:
            log.seek(0)
            lines = log.read().decode(errors="replace").split("\n")
            raise ExportError(f"ffmpeg: {next(filter(None, reversed(lines)), 'failed')}")
        return film.read_bytes()


def _even(picture: Any) -> np.ndarray:
    """Pixels of a picture; the last row or column is repeated for even sides, as the codecs need."""
    pixels = np.asarray(picture)
    height, width, _ = pixels.shape
    return np.pad(pixels, ((0, height % 2), (0, width % 2), (0, 0)), "edge")


SPAN = 4.0
"""Ratio of the coarsest detail of a frame to its finest one."""


def gradual_depths(root: Node, camera: Camera, size: tuple[int, int], count: int) -> list[Node]:
    """Resolve the depths of a frame for a range of details.

    A depth is a whole number, so a picture of one depth jumps to the next one. The mean of pictures over a
    range of details changes from one depth to the next as gradually as the camera moves.

    `size` in pixels. Returns trees from the coarsest detail, half a pixel, to the finest.
    """
    growth, base = footprint(camera, size)
    detail = DETAIL * (growth * (surroundings(root, camera, growth) if growth else 0.0) + base)
    coarsest = resolve_depths(root, detail)
    if coarsest is root:
        return [root] * count
    return [resolve_depths(root, detail * SPAN ** (-(k + 0.5) / count)) for k in range(count)]


TURNS = 5
"""Step through the depths from one time of the shutter to the next, so that a late one is not a deep one."""


@dataclass(frozen=True)
class FilmJob:
    """Film to make.

    Attributes
    ----------
    timeline : Timeline
        Scene over time.
    size : tuple of int
        Width and height, pixels.
    samples : int
        Maximum samples per pixel.
    fps : float
        Frames per second.
    ending : {".png", ".exr"}
        Format of the frames.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.
    layers : bool
        True to add depth, normal, position, albedo and samples to .exr frames.
    """

    timeline: Timeline
    size: tuple[int, int]
    samples: int
    fps: float
    ending: str = ".png"
    device: str = "auto"
    layers: bool = False

    def __post_init__(self) -> None:
        validate_value("fps", self.fps, Number(24.0, "", above=0, most=1000), RenderError)

    @property
    def frames(self) -> int:
        """Number of frames of the whole film."""
        return max(round(self.timeline.animation.duration * self.fps), 1)

    @property
    def key(self) -> str:
        """Hash of everything that determines the frames, the pictures that the scene names included.

        The device is one of them: pictures of a GPU may differ in the last place.
        """
        scene = self.timeline.scene
        names = [light.file for light in scene.view.lights]
        names += [node.values.get("texture") for node in scene.root.walk()]
        pictures = [path.read_bytes() for path in map(Path, filter(None, names)) if path.is_file()]
        about = self.size, self.samples, self.fps, self.ending, self.layers, choose_device(self.device)
        return key(program(), scene.hash, *about, *pictures)

    def path(self, folder: Path, number: int) -> Path:
        """Return the file of a frame.

        Parameters
        ----------
        folder : Path
            Folder of the frames.
        number : int
            Number of the frame, from 0.

        Returns
        -------
        Path
            The file.
        """
        return folder / f"frame{number:05}{self.ending}"

    def scene(self, number: int) -> Scene:
        """Return the scene of a frame, at the time at which its shutter opens.

        Parameters
        ----------
        number : int
            Number of the frame, from 0.

        Returns
        -------
        Scene
            The scene.
        """
        return self.timeline.at(number / self.fps)

    def light(self, number: int, work: Work) -> np.ndarray:
        """Render a frame.

        The points of a pixel's sample set are divided among the times of an open shutter, and among depths if
        the automatic ones are about to change; see `gradual_depths`.

        Parameters
        ----------
        number : int
            Number of the frame, from 0.
        work : Work
            Threads and cancellation.

        Returns
        -------
        ndarray of float32, shape (height, width, 4)
            Mean of the samples; see `Pass.mean`.
        """
        return self._traced(number, work)[0]

    def _traced(self, number: int, work: Work) -> tuple[np.ndarray, np.ndarray]:
        """Mean of the samples of a frame, and their number at each pixel."""
        moments, shift = self.moments(number), number + 1 if self.timeline.animation.noise == "moving" else 0
        taken, begin = 0, 0
        mean = np.zeros((*self.size[::-1], 4), np.float32)
        counts = np.zeros(self.size[::-1], np.float32)
        for scene, same in groupby(moments):
            count = len(list(same))
            taken += count
            end = self.samples * taken // len(moments)
            part = SampleRange(begin, shift)
            renderer = Renderer(scene.root, scene.view, self.size, work, self.device, part)
            *_, done = renderer.passes(end - begin)
            mean += done.mean * np.float32(count / len(moments))
            counts += renderer.accumulator.host().counts
            begin = end
        return mean, counts

    def file(self, number: int, work: Work) -> bytes:
        """Render and encode a frame.

        Parameters
        ----------
        number : int
            Number of the frame, from 0.
        work : Work
            Threads and cancellation.

        Returns
        -------
        bytes
            PNG or OpenEXR file; the same for any number of threads.
        """
        (mean, counts), at, scene = self._traced(number, work), self.scene(number), self.timeline.scene
        view = replace(at.view, lights=at.view.lights or default_lights(at.root))
        text = {"Title": scene.name, "Software": APPLICATION, "scene_hash": scene.hash}
        more = self._layers(at, work) | {"samples": counts} if self.layers else None
        light = picture(mean, view.shading.mode)
        return encoded_image(self.ending, develop(mean, view), light, text=text, layers=more)

    def _layers(self, at: Scene, work: Work) -> dict[str, np.ndarray]:
        """Layers of a frame, at the time at which its shutter opens."""
        return layers(Renderer(at.root, at.view, self.size, work, self.device))

    def moments(self, number: int) -> list[Scene]:
        """Return the scenes that a frame is the mean of: its times, each with another depth.

        Parameters
        ----------
        number : int
            Number of the frame, from 0.

        Returns
        -------
        list of Scene
            Scenes; equal ones follow each other.
        """
        animation, count = self.timeline.animation, min(self.timeline.animation.times, self.samples)
        if not animation.shutter:
            scene = self.scene(number)
            return [replace(scene, root=root) for root in self.depths(scene, count)]
        times = ((number + animation.shutter * (k + 0.5) / count) / self.fps for k in range(count))
        scenes = [self.timeline.at(time) for time in times]
        return [
            replace(scene, root=self.depths(scene, count)[k * TURNS % count])
            for k, scene in enumerate(scenes)
        ]

    def depths(self, scene: Scene, count: int) -> list[Node]:
        """Trees of a scene for a range of details; see `gradual_depths`."""
        camera = scene.view.camera
        return gradual_depths(scene.root, camera, self.size, count) if camera else [scene.root] * count


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
    elif has_frames(job, folder):
        return
    elif resume:
        raise RenderError(
            f"{folder}: has frames of another film or device: expected those of this one, to resume"
        )
    for path in folder.glob("frame?????.*"):
        path.unlink()
    with replacing(journal) as file:
        file.write(json.dumps({"key": job.key, "fps": job.fps}).encode() + b"\n")


def has_frames(job: FilmJob, folder: Path) -> bool:
    """Return whether a folder has frames of this film, perhaps not all: whether it can be resumed.

    Parameters
    ----------
    job : FilmJob
        The film.
    folder : Path
        Folder, which may be missing.

    Returns
    -------
    bool
        False for frames of another film, size, number of samples, rate or device.

    Raises
    ------
    RenderError
        If the folder has the journal of something else.
    """
    journal = folder / JOURNAL
    return journal.exists() and _film_key(journal) == job.key


def _film_key(journal: Path) -> str:
    """Key of the film whose frames are in a folder."""
    try:
        return str(json.loads(journal.read_text().partition("\n")[0])["key"])
    except (ValueError, KeyError, TypeError):
        raise RenderError(f"{journal}: expected the journal of a film") from None
