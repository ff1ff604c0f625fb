"""fracslice animate: a film of a scene with an <animation>."""

from __future__ import annotations

import re
from pathlib import Path
from typing import ClassVar

import click

from fracslice.common.messages import format_count
from fracslice.records import RenderJob

from .execution import check_folder, check_targets, load_scene, refuse_moved, refuse_options
from .options import (
    DEVICE,
    INTERVAL,
    POSITIVE,
    ClusterOptions,
    Parsed,
    Records,
    SceneOptions,
    argument,
    command,
    flag,
    option,
    output,
)

SMALLER, FEWER = 4, 4
"""Of --preview: divisor of the size, and samples."""

OF_FRAMES = {"samples", "preview", "resume", "cluster", "shard", "store"}
"""Options without effect on the scene of a frame."""


def read_frames(text: str) -> range:
    """Parse numbers of frames, such as 10..20 or 7."""
    match = re.fullmatch(r"\s*(\d{1,5})\s*(?:\.\.\s*(\d{1,5})\s*)?", text)
    if not match or int(match[2] or match[1]) < int(match[1]):
        raise ValueError("frames, such as 10..20 or 7, counted from 0")
    return range(int(match[1]), int(match[2] or match[1]) + 1)


class FilmOptions(ClusterOptions, SceneOptions):
    """Options of `animate`."""

    records: ClassVar[Records] = (RenderJob,)
    without = frozenset(RenderJob.kinds()) - {"size", "samples"}
    source: str = argument("SCENE")
    output: str = output(
        "OUT",
        "A film (.mp4, .webm, .mkv, .mov, .gif, .apng), a contact sheet (.png), the first frame's "
        "scene (.xml), or a folder of frames.",
    )
    frames: range | None = option(
        Parsed(read_frames, "N[..N]"), "Frames to render, counted from 0; all by default."
    )
    fps: float | None = option(POSITIVE, "Frames per second; the scene's by default.")
    size: tuple[int, int] | None
    samples: int | None
    fly: float | None = option(
        INTERVAL,
        "Fly along the surface for this time, such as 10s; the field makes the path. With OUT an .xml file, "
        "write the scene of the flight.",
    )
    preview: bool = flag(
        "Render at a quarter of the size, with 4 samples per pixel unless --samples is given."
    )
    resume: bool = flag("Keep the frames that are there.")
    exr: bool = flag("Write frames of linear floats, into a folder.")
    layers: bool = flag("Add depth, normal, position, albedo and samples to --exr frames.")
    device: str = DEVICE


@command(FilmOptions, short_help="Render a film of SCENE.")
def animate(given: FilmOptions) -> None:
    """Render a film of SCENE, which has an <animation>.

    The frames are numbered files, in OUT or in a folder beside it: --resume goes on with a film that stopped.

    Examples
    --------
    fracslice animate my.xml -o film.mp4 --preview
    fracslice animate mandelbulb -o flight.mp4 --fly 10s --size 640x360
    """
    from fracslice.animation import (
        FilmJob,
        Timeline,
        check_film,
        encode,
        sheet_frames,
        with_flight,
        write_frames,
    )
    from fracslice.common.files import replacing
    from fracslice.scene.model import to_xml

    target, ending = Path(given.output), Path(given.output).suffix.lower()
    if given.exr and ending:
        raise click.UsageError("--exr: expected a folder as OUT; films are made of PNG frames")
    if given.layers and not given.exr:
        raise click.UsageError("--layers: expected --exr, whose frames hold them")
    folder = target.with_suffix(".preview.frames" if given.preview else ".frames") if ending else target
    check_targets(given.source, given.output if ending else None)
    check_folder(folder)
    if ending == ".xml":
        refuse_options(OF_FRAMES, "only for frames, and an .xml file is a scene")
    scene = load_scene(given.source, given.settings)
    refuse_moved(scene, given.settings)
    film = scene.view.film
    width, height = given.size or (film.width, film.height)
    samples = given.samples or (FEWER if given.preview else film.samples)
    if given.fly:
        scene = with_flight(scene, given.fly, (width, height))
    timeline = Timeline(scene)
    if given.preview:
        width, height = max(width // SMALLER, 1), max(height // SMALLER, 1)
    rate = given.fps or timeline.animation.fps
    if ending and ending != ".xml":
        check_film(target, rate)
    form = ".exr" if given.exr else ".png"
    job = FilmJob(timeline, (width, height), samples, rate, form, given.device, given.layers)
    chosen = given.frames or range(job.frames)
    if chosen[-1] >= job.frames:
        raise click.UsageError(f"--frames: expected frames from 0 to {job.frames - 1}")
    if ending == ".xml":
        whole = given.fly and given.frames is None
        with replacing(target) as file:
            file.write(to_xml(scene if whole else job.scene(chosen[0])).encode())
        if not given.quiet:
            click.echo(
                f"{given.output}: " + ("the film as a scene" if whole else f"scene of frame {chosen[0]}")
            )
        return
    numbers = sheet_frames(chosen) if ending == ".png" else chosen
    with given.working(f"the frames in {folder} are whole, and --resume goes on") as work:
        paths = write_frames(job, numbers, folder, given.resume, work)
        if ending:
            encode(paths, target, rate, work)
    if not given.quiet:
        frames = format_count(len(paths), "frame")
        click.echo(f"{given.output}: {frames} of {width} x {height} pixels, {len(chosen) / rate:.2f} s")
