"""Frames of a film: numbered files, each whole or absent."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from ..errors import RenderError
from ..export import application
from ..export.images import write_image
from ..files import replacing, reported
from ..formulas.parameters import Number, validated
from ..formulas.registry import Node
from ..keys import key, program
from ..rendering import Renderer, develop, picture
from ..rendering.sequence import SampleRange
from ..rendering.setup import default_lights
from ..scene.model import Scene
from ..work import Work
from .depths import gradual_depths
from .timeline import Timeline

TURNS = 5
"""Step through the depths from one time of the shutter to the next, so that a late one is not a deep one."""

JOURNAL = "film.json"
"""File in the folder that says whose frames these are."""


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
    """

    timeline: Timeline
    size: tuple[int, int]
    samples: int
    fps: float
    ending: str = ".png"
    device: str = "auto"

    def __post_init__(self) -> None:
        validated("fps", self.fps, Number(24.0, "", above=0, most=1000), RenderError)

    @property
    def frames(self) -> int:
        """Number of frames of the whole film."""
        return max(round(self.timeline.animation.duration * self.fps), 1)

    @property
    def key(self) -> str:
        """Hash of everything that determines the frames."""
        scene = self.timeline.scene
        return key(program(), scene.hash, self.size, self.samples, self.fps, self.ending)

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
        moments, shift = self.moments(number), number + 1 if self.timeline.animation.noise == "moving" else 0
        share, begin = self.samples // len(moments), 0
        mean = np.zeros((self.size[1], self.size[0], 4), np.float32)
        for scene, same in groupby(moments):
            count = len(list(same))
            part = SampleRange(begin, shift)
            renderer = Renderer(scene.root, scene.view, self.size, work, self.device, part)
            *_, done = renderer.passes(count * share)
            mean += done.mean * np.float32(count / len(moments))
            begin += count * share
        return mean

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
        Threads, progress and cancellation.

    Returns
    -------
    list of Path
        The frames, in order.

    Raises
    ------
    RenderError
        If the folder has the frames of another film, or files that are no frames of a film.
    """
    _claim(job, folder, resume)
    scene, paths = job.timeline.scene, [job.path(folder, number) for number in numbers]
    for done, (number, path) in enumerate(zip(numbers, paths, strict=True)):
        work.progress(f"frame {number}", done / len(paths))
        if resume and path.exists():
            continue
        mean, at = job.light(number, replace(work, progress=lambda *_: None)), job.scene(number)
        view = replace(at.view, lights=at.view.lights or default_lights(at.root))
        text = {"Title": scene.name, "Software": application(), "scene_hash": scene.hash}
        write_image(path, develop(mean, view), picture(mean, view.shading.mode), text=text)
    work.progress("frames", 1.0)
    return paths


def _claim(job: FilmJob, folder: Path, resume: bool) -> None:
    """Make the folder this film's; frames of an earlier film are removed, unless it is to be resumed."""
    journal = folder / JOURNAL
    if journal.exists():
        known = json.loads(journal.read_text())["key"]
        if known == job.key:
            return
        if resume:
            raise RenderError(f"{folder}: has frames of another film: expected those of this one, to resume")
        for path in folder.glob("frame?????.*"):
            path.unlink()
    elif folder.exists() and any(folder.iterdir()):
        raise RenderError(f"{folder}: expected an empty folder, or one with the frames of a film")
    with reported(folder):
        folder.mkdir(exist_ok=True)
    with replacing(journal) as file:
        file.write(json.dumps({"key": job.key, "fps": job.fps}).encode())
