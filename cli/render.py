"""fracslice render: a picture of a scene."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fracslice.errors import Cancelled, KeptError, SharedError

from .inputs import check_folder, check_targets, load_scene, refuse_options
from .options import (
    DEVICE,
    DURATION,
    PART,
    PIXELS,
    SAMPLES,
    ClusterOptions,
    Name,
    SceneOptions,
    Whole,
    argument,
    command,
    flag,
    option,
    output,
)
from .sweeps import families

if TYPE_CHECKING:
    import numpy as np

    from fracslice.rendering import Pass, Renderer
    from fracslice.rendering.sequence import SampleRange
    from fracslice.scene import Scene
    from fracslice.work import Work


def announcement(film: tuple[int, int], rows: int) -> str:
    """Line on the memory that a picture needs, whole and in bands."""
    from fracslice.rendering.crops import BYTES, MARGIN

    width, height = film
    whole, part = (BYTES * width * n / 1e9 for n in (height, min(rows + 2 * MARGIN, height)))
    return (
        f"{width} x {height} pixels need {whole:,.1f} GB of memory, more than is free: "
        f"rendered in {-(-height // rows)} bands of {rows} rows, {part:,.1f} GB each"
    )


def check_options(path: str, names: Sequence[str]) -> None:
    """Raise an error for a kind of file and for given options that need the whole picture."""
    from fracslice.export.images import BANDED, check_image

    reason = "expected a picture that fits into the memory; a larger one is rendered in bands"
    if check_image(path) not in BANDED:
        raise click.BadParameter(f"{path}: {reason}, as {', '.join(BANDED)}", param_hint="--output")
    refuse_options(names, reason)


def render_to(
    path: str,
    scene: Scene,
    film: tuple[int, int],
    rows: int,
    work: Work,
    device: str,
    sequence: SampleRange,
    samples: int | None,
    bits: int,
    text: Mapping[str, str],
) -> str:
    """Render a picture in bands and write it; return the line on it."""
    from fracslice.export.images import check_image, write_bands
    from fracslice.rendering.bands import check_bands, render_bands

    view, taken, squares = scene.view, [], []
    check_bands(view, display=check_image(path) == ".png")

    def bands() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        made = render_bands(scene.root, view, film, rows, work, device, sequence, samples)
        for k, band in enumerate(made, 1):
            taken.append(band.samples)
            squares.append(band.error**2)
            work.progress("bands", k * rows / film[1])
            yield band.developed, light_of(band)

    write_bands(path, film, bands(), 4 if view.film.transparent else 3, bits, text, work)
    return (
        f"{path}: {film[0]} x {film[1]} pixels, {sum(taken) / len(taken):.1f} samples a pixel, "
        f"error {(sum(squares) / len(squares)) ** 0.5:.2g}"
    )


def light_of(done: Pass) -> Any:
    """Linear light of a pass, with alpha if the film is transparent."""
    return done.mean if done.view.film.transparent else done.image


class RenderOptions(ClusterOptions, SceneOptions):
    """Options of `render`."""

    source: str = argument("SCENE")
    output: str = output("FILE", "A .png, .jpg or .webp file, or .exr or .tif for linear floats.")
    samples: int | None = SAMPLES
    size: tuple[int, int] | None = option(
        PIXELS, "Pixels across and down; the scene's by default, or 1280x720."
    )
    crop: tuple[int, int, int, int] | None = option(
        PART,
        "Render only this part: left, top, width and height in pixels. Its pixels are those of the whole "
        "picture, except in modes depth, distance and position, which show the range of the part.",
    )
    seed: int = option(Whole(0, 2**31 - 1), "Seed of the random samples; 0 by default.", default=0)
    layers: bool = flag("Add depth, normal, position, albedo and samples to the .exr file.")
    denoise: bool = flag("Remove the noise that is left.")
    device: str = DEVICE
    limit: float | None = option(
        DURATION, "Stop after this time, denoising included: 10s, 2min or 1h.", "--time"
    )
    bits: str = option(click.Choice(["8", "16"]), "Bits per channel of a PNG; 8 by default.", default="8")
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
    from fracslice.kernel.devices import for_picture
    from fracslice.rendering import Renderer
    from fracslice.rendering.bands import rows_of_bands
    from fracslice.rendering.progressive import layers
    from fracslice.rendering.sequence import SampleRange

    scene, start = checked_scene(given), time.monotonic()
    film = given.size or (scene.view.film.width, scene.view.film.height)
    if given.crop is None and (rows := rows_of_bands(film)) < film[1]:
        line = in_bands(given, scene, film, rows)
        if not given.quiet:
            click.echo(f"{line}, {time.monotonic() - start:.1f} s")
        return
    with given.working() as work:
        sequence, pool = SampleRange(seed=given.seed), work.cluster
        samples = given.samples or scene.view.film.samples
        device = for_picture(given.device, given.crop[2:] if given.crop else film, samples)
        renderer = Renderer(scene.root, scene.view, given.size, work, device, sequence, given.crop)
        aside = None if pool is None or given.state else pool.pieces.path(f"{renderer.key}.npz")
        try:
            guides, limit = plan_denoising(renderer, given)
            render_passes(renderer, scene, given.but(state=given.state or aside, limit=limit), work)
            if pool and not pool.first:
                raise SharedError("the samples are made; shard 1 writes the file")
            more = layers(renderer) if given.layers else None
            done = without_noise(renderer, guides) if given.denoise else renderer.seen()
        except Cancelled:
            kept = renderer.seen()
            if not kept.samples or (pool and not pool.first):
                raise
            save(given.output, kept, scene, given.bits, given.threads)
            raise KeptError(describe_picture(given.output, renderer, kept)) from None
        save(given.output, done, scene, given.bits, given.threads, more)
    if pool and aside:
        Path(aside).unlink(missing_ok=True)
        if not given.shard:
            pool.pieces.tidy()
    if not given.quiet:
        took = time.monotonic() - start
        about = f"{renderer.setup.precision}, {renderer.device}, {took:.1f} s"
        click.echo(f"{describe_picture(given.output, renderer, done)}, {about}")


def checked_scene(given: RenderOptions) -> Scene:
    """The scene; raise an error for files that cannot be written and for options that do not fit it."""
    from fracslice.export.images import check_image

    if check_image(given.output) != ".exr" and given.layers:
        raise click.BadParameter("expected an .exr file as --output, which holds them", param_hint="--layers")
    if given.bits == "16" and check_image(given.output) != ".png":
        raise click.BadParameter("expected a .png file as --output", param_hint="--bits")
    check_targets(given.source, given.output, given.state)
    if given.pass_images:
        check_folder(Path(given.pass_images))
    scene = load_scene(given.source, given.settings)
    if given.denoise and scene.view.shading.mode != "light":
        raise click.BadParameter('expected a scene with shading mode="light"', param_hint="--denoise")
    return scene


def in_bands(given: RenderOptions, scene: Scene, film: tuple[int, int], rows: int) -> str:
    """Render a picture larger than the memory; return the line on it."""
    from fracslice.rendering.sequence import SampleRange

    whole = ("layers", "denoise", "limit", "pass_images", "watch", "state", "cluster", "shard")
    check_options(given.output, whole)
    click.echo(announcement(film, rows), err=True)
    with given.working() as work:
        made = work, given.device, SampleRange(seed=given.seed), given.samples, int(given.bits)
        return render_to(given.output, scene, film, rows, *made, text_of(scene))


def render_passes(renderer: Renderer, scene: Scene, given: RenderOptions, work: Work) -> None:
    """Render pass after pass, from --state and into it."""
    state, first, samples = given.state, work.cluster is None or work.cluster.first, given.samples
    if state and Path(state).exists():
        renderer.resume(state)
    try:
        passes = limit_time(renderer, samples, given.limit)
        for done in show_passes(passes, renderer, scene.name) if given.watch else passes:
            rate = f"{describe_pass(done)}, {done.rate / 1e6:.2f} M samples/s"
            work.progress(rate, fraction(done, renderer, samples))
            if given.pass_images:
                Path(given.pass_images).mkdir(exist_ok=True)
                save(Path(given.pass_images) / f"pass{done.number:04}.png", done, scene, "8", given.threads)
            if state and first:
                save_state(renderer, state)
        if given.limit and state and first:
            save_state(renderer, state)  # of a pass that the limit interrupted
    except Cancelled:
        if state and first and renderer.seen().samples:
            save_state(renderer, state)
        raise


def show_passes(passes: Iterator[Pass], renderer: Renderer, name: str) -> Iterator[Pass]:
    """Passes that are shown in a window."""
    from fracslice.viewer import previewed

    return previewed(passes, f"fracslice  {name}", (renderer.width, renderer.height))


def plan_denoising(renderer: Renderer, given: RenderOptions) -> tuple[list[np.ndarray] | None, float | None]:
    """Guides of --denoise where --time is limited, and the time that is left for the passes, seconds.

    Removing noise takes as long from an empty picture as from the one at the end.
    """
    if not given.denoise or given.limit is None:
        return None, given.limit
    from fracslice.rendering.denoising import denoise, guides

    start = time.monotonic()
    made = guides(renderer)
    guided = time.monotonic()
    denoise(renderer, made)
    taken = time.monotonic() - start + (time.monotonic() - guided)
    return made, max(given.limit - taken, given.limit / 10)


def without_noise(renderer: Renderer, guides: list[np.ndarray] | None) -> Pass:
    """Picture of a renderer without noise; note if Open Image Denoise is not installed."""
    from fracslice.rendering.denoising import advice, denoise

    if missing := advice():
        click.echo(f"--denoise: {missing}", err=True)
    return denoise(renderer, guides)


def limit_time(renderer: Renderer, samples: int | None, limit: float | None) -> Iterator[Pass]:
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
        yield from limit_time(renderer, samples, 2 * limit)


def describe_pass(done: Pass) -> str:
    """Samples per pixel of a pass and its error, which less than a sample does not tell, as text."""
    samples = f"{done.samples:.1f}" if done.samples >= 1 else f"{done.samples:.1g}"
    error = f"error {done.error:.2g}" if math.isfinite(done.error) else "error unknown"
    return f"{samples} samples a pixel, {error}"


def fraction(done: Pass, renderer: Renderer, samples: int | None) -> float:
    """Completed fraction of the samples, from 0 to 1."""
    return min(done.samples / (samples or renderer.setup.view.film.samples), 1.0)


def describe_picture(path: str | Path, renderer: Renderer, done: Pass) -> str:
    """Line on a written picture."""
    return f"{path}: {renderer.width} x {renderer.height} pixels, {describe_pass(done)}"


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
