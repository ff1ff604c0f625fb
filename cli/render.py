"""fracslice render: a picture of a scene."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import click

from fracslice.records import RenderJob

from .execution import check_folder, check_targets, load_scene, refuse_options
from .options import (
    DEVICE,
    ClusterOptions,
    Name,
    Records,
    SceneOptions,
    argument,
    command,
    flag,
    option,
    output,
)
from .sweeps import families

if TYPE_CHECKING:
    from fracslice.rendering import Pass, Renderer


class RenderOptions(ClusterOptions, SceneOptions):
    """Options of `render`."""

    records: ClassVar[Records] = (RenderJob,)
    source: str = argument("SCENE|MODEL")
    output: str = output("FILE", "A .png, .jpg or .webp file, or .exr or .tif for linear floats.")
    device: str = DEVICE
    pass_images: str | None = option(Name("DIR"), "Write the picture of every pass there.")
    state: str | None = option(
        Name("FILE.npz"), "Resume from this file if it exists, and save to it after every pass."
    )
    watch: bool = flag("Show the picture in a window while it is rendered.")


@command(RenderOptions, short_help="Render a picture of SCENE.")
@families("output", "state", "pass_images")
def render(given: RenderOptions) -> None:
    """Render a picture of SCENE, as its camera, lights and materials say.

    Examples
    --------
    fracslice render mandelbulb -o bulb.png --size 1920x1080 --samples 64
    fracslice render my.xml -o my.exr --time 2min --layers
    """
    from fracslice.jobs import pictures

    start, job = time.monotonic(), RenderJob(**given.values(RenderJob))
    check_targets(given.source, given.output, given.state)
    if given.pass_images:
        check_folder(Path(given.pass_images))
    scene = load_scene(given.source, given.settings)
    pictures.refuse(scene, job, given.output)
    film = job.film(scene.view)
    if (rows := pictures.rows_in_memory(scene, job)) < film[1]:
        refuse_options(("pass_images", "watch", "cluster", "shard"), pictures.WHOLE)
        click.echo(pictures.announcement(film, rows), err=True)

    with given.working() as work:

        def shown(passes: Iterator[Pass], renderer: Renderer) -> Iterator[Pass]:
            if given.watch:
                from fracslice.viewer import previewed

                passes = previewed(passes, f"fracslice  {scene.name}", (renderer.width, renderer.height))
            for done in passes:
                many = pictures.describe_samples(done.samples, done.error)
                rate = f"{many}, {done.rate / 1e6:.2f} M samples/s"
                work.progress(rate, pictures.share(done, renderer, job))
                if given.pass_images:
                    Path(given.pass_images).mkdir(exist_ok=True)
                    path = Path(given.pass_images) / f"pass{done.number:04}.png"
                    pictures.save(path, done, scene, given.threads)
                yield done

        done = pictures.make_picture(
            scene, job, work, given.output, device=given.device, state=given.state, shown=shown
        )
    if job.denoise:
        note_on_denoising()
    if not given.quiet:
        of = done.renderer
        about = f"{of.setup.precision}, {of.device}, " if of else ""
        click.echo(f"{given.output}: {done.description}, {about}{time.monotonic() - start:.1f} s")


def note_on_denoising() -> None:
    """Say if Open Image Denoise is not installed."""
    from fracslice.jobs.pictures import advice

    if missing := advice():
        click.echo(f"--denoise: {missing}", err=True)
