"""fracslice render: a picture of a scene."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.errors import Cancelled, SharedError

from .bands import announced, check_options, light_of, render_to
from .cluster import cluster_options, pooled
from .families import families
from .inputs import check_folder, check_targets, load_scene
from .options import NAME, Whole, device_option, output_option, run_options, samples_option, source_argument
from .sizes import duration, part, pixels
from .working import KeptError, working

if TYPE_CHECKING:
    import numpy as np

    from fracslice.rendering import Pass, Renderer
    from fracslice.scene import Scene


@click.command(short_help="Render a picture of SCENE.")
@source_argument("SCENE")
@output_option(
    "FILE",
    "A .png, .jpg or .webp file, or .exr or .tif for linear floats.",
)
@samples_option
@click.option(
    "--size",
    callback=pixels,
    metavar="WxH",
    help="Pixels across and down; the scene's by default, or 1280x720.",
)
@click.option(
    "--crop",
    callback=part,
    metavar="X,Y,W,H",
    help="Render only this part: left, top, width and height in pixels.",
)
@click.option(
    "--seed",
    type=Whole(0, 2**31 - 1),
    default=0,
    metavar="N",
    help="Number of the random samples; 0 by default.",
)
@click.option(
    "--layers", is_flag=True, help="Add depth, normal, position, albedo and samples to the .exr file."
)
@click.option("--denoise", is_flag=True, help="Remove the noise that is left.")
@device_option
@click.option(
    "--time",
    "limit",
    callback=duration,
    metavar="TIME",
    help="Stop after this time: 10s, 2min or 1h.",
)
@click.option(
    "--bits",
    type=click.Choice(["8", "16"]),
    default="8",
    help="Bits per channel of a PNG; 8 by default.",
)
@click.option("--pass-images", type=NAME, metavar="DIR", help="Write the picture of every pass there.")
@click.option(
    "--state",
    type=NAME,
    metavar="FILE.npz",
    help="Resume from this file if it exists, and save to it after every pass.",
)
@click.option("--watch", is_flag=True, help="Show the picture in a window while it is rendered.")
@cluster_options
@run_options
@families("output", "state", "pass_images")
def render(
    source: str,
    output: str,
    samples: int | None,
    size: tuple[int, int] | None,
    crop: tuple[int, int, int, int] | None,
    seed: int,
    layers: bool,
    denoise: bool,
    device: str,
    limit: float | None,
    bits: str,
    pass_images: str | None,
    state: str | None,
    watch: bool,
    cluster: str | None,
    shard: str | None,
    store: str | None,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
) -> None:
    """Render a picture of SCENE, as its camera, lights and materials say."""
    from fracslice.export.images import check_image
    from fracslice.rendering import Renderer
    from fracslice.rendering.bands import rows_of_bands
    from fracslice.rendering.layers import layers as rendered_layers
    from fracslice.rendering.sequence import SampleRange
    from fracslice.work import Work

    if check_image(output) != ".exr" and layers:
        raise click.BadParameter("expected an .exr file as --output, which holds them", param_hint="--layers")
    check_targets(source, output, state)
    if pass_images:
        check_folder(Path(pass_images))
    scene, start = load_scene(source, settings), time.monotonic()
    if denoise and scene.view.shading.mode != "light":
        raise click.BadParameter('expected a scene with shading mode="light"', param_hint="--denoise")
    film = size or (scene.view.film.width, scene.view.film.height)
    if crop is None and (rows := rows_of_bands(film)) < film[1]:
        whole = {"--layers": layers, "--denoise": denoise, "--time": limit, "--pass-images": pass_images}
        whole |= {"--watch": watch, "--state": state, "--cluster": cluster, "--shard": shard}
        check_options(output, whole)
        click.echo(announced(film, rows), err=True)
        with working(threads, quiet) as work:
            made = work, device, SampleRange(seed=seed), samples, int(bits)
            line = render_to(output, scene, film, rows, *made, text_of(scene))
        if not quiet:
            click.echo(f"{line}, {time.monotonic() - start:.1f} s")
        return
    with (
        pooled(output, threads, cluster, shard, store) as pool,
        working(Work(threads, cluster=pool), quiet) as work,
    ):
        renderer = Renderer(scene.root, scene.view, size, work, device, SampleRange(seed=seed), crop)
        aside = None if pool is None or state else pool.pieces.path(f"{renderer.key}.npz")
        state = state or aside
        if state and Path(state).exists():
            renderer.resume(state)
        first = pool is None or pool.first

        def write(path: str | Path, done: Pass, bits: str) -> str:
            save(path, done, scene, bits, threads)
            return described(path, renderer, done)

        try:
            passes = timed(renderer, samples, limit)
            for done in shown(passes, renderer, scene.name) if watch else passes:
                rate = f"{reached(done)}, {done.rate / 1e6:.2f} M samples/s"
                work.progress(rate, fraction(done, renderer, samples))
                if pass_images:
                    Path(pass_images).mkdir(exist_ok=True)
                    write(Path(pass_images) / f"pass{done.number:04}.png", done, "8")
                if state and first:
                    save_state(renderer, state)
            if limit and state and first:
                save_state(renderer, state)  # of a pass that the limit interrupted
        except Cancelled:
            kept = renderer.seen()
            if not first or not kept.samples:
                raise
            if state:
                save_state(renderer, state)
            raise KeptError(write(output, kept, bits)) from None
    if not first:
        raise SharedError("the samples are made; shard 1 writes the file")
    more = rendered_layers(renderer) if layers else None
    done = without_noise(renderer) if denoise else renderer.seen()
    save(output, done, scene, bits, threads, more)
    if pool and aside:
        Path(aside).unlink(missing_ok=True)
        if not shard:
            pool.pieces.tidy()
    if not quiet:
        took = time.monotonic() - start
        about = f"{renderer.setup.precision}, {renderer.device}, {took:.1f} s"
        click.echo(f"{described(output, renderer, done)}, {about}")


def shown(passes: Iterator[Pass], renderer: Renderer, name: str) -> Iterator[Pass]:
    """Passes that are shown in a window."""
    from fracslice.viewer import previewed

    return previewed(passes, f"fracslice  {name}", (renderer.width, renderer.height))


def without_noise(renderer: Renderer) -> Pass:
    """Picture of a renderer without noise; note if Open Image Denoise is not installed."""
    from fracslice.rendering.denoising import advice, denoised

    if missing := advice():
        click.echo(f"--denoise: {missing}", err=True)
    return denoised(renderer)


def timed(renderer: Renderer, samples: int | None, limit: float | None) -> Iterator[Pass]:
    """Iterate over passes until a time limit, in seconds, which interrupts a pass.

    A limit that ends before the first sample is doubled.
    """
    cancel, expired = renderer.work.cancel, threading.Event()

    def expire() -> None:
        expired.set()
        cancel.set()

    if limit is None:
        yield from renderer.passes(samples)
        return
    timer = threading.Timer(limit, expire)
    timer.start()
    try:
        yield from renderer.passes(samples)
        return
    except Cancelled:
        if not expired.is_set():
            raise
    finally:
        timer.cancel()
        if expired.is_set():
            cancel.clear()
    if not renderer.seen().samples:
        yield from timed(renderer, samples, 2 * limit)


def reached(done: Pass) -> str:
    """Samples per pixel and error of a pass, as text."""
    samples = f"{done.samples:.1f}" if done.samples >= 1 else f"{done.samples:.1g}"
    return f"{samples} samples a pixel, error {done.error:.2g}"


def fraction(done: Pass, renderer: Renderer, samples: int | None) -> float:
    """Completed fraction of the samples, from 0 to 1."""
    return min(done.samples / (samples or renderer.setup.view.film.samples), 1.0)


def described(path: str | Path, renderer: Renderer, done: Pass) -> str:
    """Line on a written picture."""
    return f"{path}: {renderer.width} x {renderer.height} pixels, {reached(done)}"


def save(
    path: str | Path,
    done: Pass,
    scene: Scene,
    bits: str,
    threads: int,
    layers: dict[str, np.ndarray] | None = None,
) -> None:
    """Write the picture of a pass, with the scene and the samples in its metadata."""
    from fracslice.export.images import LINEAR, check_image, write_image
    from fracslice.work import Work

    text = {**text_of(scene), "samples": f"{done.samples:.2f}"}
    picture = light_of(done) if check_image(path) in LINEAR else done.developed
    write_image(path, picture, picture, int(bits), text, Work(threads), layers)  # looks at one of both


def text_of(scene: Scene) -> dict[str, str]:
    """Metadata of every picture of a scene."""
    from fracslice.export import application

    return {"Title": scene.name, "Software": application(), "scene_hash": scene.hash}


def save_state(renderer: Renderer, path: str) -> None:
    """Write the state of a renderer, from which it can resume."""
    from fracslice.export import replacing

    with replacing(path) as file:
        renderer.save(file)
