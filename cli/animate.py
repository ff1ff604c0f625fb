"""fracslice animate: a film of a scene with an <animation>."""

from __future__ import annotations

import re
from pathlib import Path

import click

from .cluster import cluster_options, pooled
from .inputs import check_folder, check_targets, load_scene
from .options import (
    Positive,
    device_option,
    moment,
    output_option,
    run_options,
    samples_option,
    source_argument,
)
from .sizes import pixels
from .working import StoppedError, working

SMALLER, FEWER = 4, 4
"""Of --preview: divisor of the size, and samples."""


def numbers(_: click.Context, __: click.Parameter, text: str | None) -> range | None:
    """Parse a frame or a range of frames, both ends included."""
    if text is None:
        return None
    match = re.fullmatch(r"\s*(\d{1,5})\s*(?:\.\.\s*(\d{1,5})\s*)?", text)
    if not match or int(match[2] or match[1]) < int(match[1]):
        raise click.BadParameter(f"{text!r}: expected frames, such as 10..20 or 7, counted from 0")
    return range(int(match[1]), int(match[2] or match[1]) + 1)


@click.command(short_help="Render a film of SCENE.")
@source_argument("SCENE")
@output_option(
    "OUT",
    "A film (.mp4, .webm, .mkv, .mov, .gif, .apng), a contact sheet (.png), the first frame's "
    "scene (.xml), or a folder of frames.",
)
@click.option(
    "--frames", callback=numbers, metavar="N[..N]", help="These frames, counted from 0; all by default."
)
@click.option("--fps", type=Positive(), metavar="N", help="Frames per second; the scene's by default.")
@click.option(
    "--size", callback=pixels, metavar="WxH", help="Pixels across and down; the scene's by default."
)
@samples_option
@click.option(
    "--fly",
    callback=moment,
    metavar="TIME",
    help="Fly along the surface for this time, such as 10s, on a path by the field; OUT may be its "
    ".xml file.",
)
@click.option("--preview", is_flag=True, help="A quarter of the size, and 4 samples per pixel.")
@click.option("--resume", is_flag=True, help="Keep the frames that are there.")
@click.option("--exr", is_flag=True, help="Frames of linear floats, in a folder.")
@click.option(
    "--layers", is_flag=True, help="Add depth, normal, position, albedo and samples to --exr frames."
)
@device_option
@cluster_options
@run_options
def animate(
    source: str,
    output: str,
    frames: range | None,
    fps: float | None,
    size: tuple[int, int] | None,
    samples: int | None,
    fly: float | None,
    preview: bool,
    resume: bool,
    exr: bool,
    layers: bool,
    device: str,
    cluster: str | None,
    shard: str | None,
    store: str | None,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
) -> None:
    """Render a film of SCENE, which has an <animation>.

    The frames are numbered files, in OUT or in a folder beside it: --resume goes on with a film that stopped.
    """
    from fracslice.animation import FilmJob, Timeline, check_film, encode, flown, write_frames
    from fracslice.export import replacing
    from fracslice.scene.writer import to_xml
    from fracslice.work import Work

    target, ending = Path(output), Path(output).suffix.lower()
    if ending and ending != ".xml":
        check_film(target)
    if exr and ending:
        raise click.UsageError("--exr: expected a folder as OUT; films are made of PNG frames")
    if layers and not exr:
        raise click.UsageError("--layers: expected --exr, whose frames hold them")
    folder = target.with_suffix(".preview.frames" if preview else ".frames") if ending else target
    check_folder(folder)
    check_targets(source, output if ending else None)
    scene = load_scene(source, settings)
    film = scene.view.film
    width, height = size or (film.width, film.height)
    if fly:
        scene = flown(scene, fly, (width, height))
    timeline = Timeline(scene)
    if preview:
        width, height, samples = max(width // SMALLER, 1), max(height // SMALLER, 1), FEWER
    rate = fps or timeline.animation.fps
    form = ".exr" if exr else ".png"
    job = FilmJob(timeline, (width, height), samples or film.samples, rate, form, device, layers)
    chosen = range(job.frames) if frames is None else frames
    if chosen[-1] >= job.frames:
        raise click.UsageError(f"--frames: expected frames from 0 to {job.frames - 1}")
    if ending == ".xml":
        whole = fly and frames is None
        with replacing(target) as file:
            file.write(to_xml(scene if whole else job.scene(chosen[0])).encode())
        return
    try:
        with (
            pooled(output, threads, cluster, shard, store) as pool,
            working(Work(threads, cluster=pool), quiet) as work,
        ):
            paths = write_frames(job, chosen, folder, resume, work)
    except StoppedError as error:
        error.args = (f"stopped; the frames in {folder} are whole, and --resume goes on",)
        raise
    if ending:
        encode(paths, target, rate)
    if not quiet:
        click.echo(f"{output}: {len(paths)} frames of {width} x {height} pixels, {len(paths) / rate:.2f} s")
