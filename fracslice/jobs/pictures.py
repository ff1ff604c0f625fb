"""The picture job: from a scene to a picture, without noise if asked, in a file too if one is named."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from ..common.memory import available_bytes
from ..common.messages import lacking
from ..errors import Cancelled, KeptError, RenderError, SharedError
from ..export.images import BANDED, LINEAR, check_image, write_bands, write_image
from ..fields.devices import for_picture
from ..fields.registry import Node
from ..records import RenderJob
from ..rendering import Pass, Renderer
from ..rendering.accumulator import COUNT, COVER, GOAL, HostAccumulator, SampleRange
from ..rendering.progressive import BYTES, MARGIN, Crop, layer, layers
from ..rendering.units.camera import UNKNOWN, squared_error
from ..scene import Scene
from ..scene.view import View
from ..work import Work, chunks

Shown = Callable[[Iterator[Pass], Renderer], Iterator[Pass]]
"""Passes them on, and shows or keeps each."""


@dataclass(frozen=True, eq=False)
class Rendered:
    """A rendered picture."""

    size: tuple[int, int]  # pixels across and down
    samples: float  # mean samples per pixel
    error: float  # root mean square of the pixels' standard errors, in displayed brightness
    done: Pass | None = None  # the picture; None if it is only in its file
    renderer: Renderer | None = None

    @property
    def description(self) -> str:
        """Size, samples and error as text."""
        width, height = self.size
        return f"{width} x {height} pixels, {describe_samples(self.samples, self.error)}"


def describe_samples(samples: float, error: float) -> str:
    """Samples per pixel and their error, which less than a sample does not tell, as text."""
    many = f"{samples:.1f}" if samples >= 1 else f"{samples:.1g}"
    return f"{many} samples a pixel, " + (f"error {error:.2g}" if math.isfinite(error) else "error unknown")


def make_picture(
    scene: Scene,
    job: RenderJob | None = None,
    work: Work | None = None,
    path: str | Path | None = None,
    *,
    device: str = "auto",
    state: str | None = None,
    shown: Shown | None = None,
) -> Rendered:
    """Render a picture of a scene, as its camera, lights and materials say.

    Parameters
    ----------
    scene : Scene
        The scene.
    job : RenderJob, optional
        Size, samples and what else is done to the picture.
    work : Work, optional
        Threads, progress, cancellation and pool.
    path : str or Path, optional
        File to write; the extension selects the format. A picture larger than the memory is rendered into a
        .png, .tif or .exr file in bands.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays; by default the GPU if there is one and starting it pays.
    state : str, optional
        An .npz file from which rendering goes on if it exists, and to which it is saved after every pass.
    shown : callable, optional
        Receives the iterator over the passes and the renderer; returns an iterator over the same passes, and
        reports their progress.

    Returns
    -------
    Rendered
        The picture, its samples and its error.

    Raises
    ------
    SceneError, RenderError, ExportError
        For a view that cannot be rendered, a job that does not fit the scene or the kind of file, or a file
        that cannot be written.
    Cancelled
        When the work is cancelled before the first sample, or without a file; `KeptError` if what there was
        is in the file.
    """
    job, work = job or RenderJob(), work or Work()
    refuse(scene, job, path)
    film = job.film(scene.view)
    if (rows := rows_in_memory(scene, job)) < film[1]:
        return _in_bands(scene, job, work, path, rows, device, state)
    return _Picture(scene, job, work, None if path is None else Path(path), state).made(device, shown)


def refuse(scene: Scene, job: RenderJob, path: str | Path | None) -> None:
    """Raise the errors of a job that does not fit the scene or the kind of file."""
    kind = "" if path is None else check_image(path)
    if job.layers and kind != ".exr":
        raise RenderError("layers: expected an .exr file, which holds them")
    if job.bits == 16 and kind != ".png":
        raise RenderError("bits 16: expected a .png file")
    if job.denoise and scene.view.shading.mode != "light":
        raise RenderError('denoise: expected a scene with shading mode="light"')


def rows_in_memory(scene: Scene, job: RenderJob) -> int:
    """Rows of the bands in which a picture is rendered; all of its rows if it fits into the memory."""
    film = job.film(scene.view)
    return film[1] if job.crop else rows_of_bands(film)


def announcement(film: tuple[int, int], rows: int) -> str:
    """Line on the memory that a picture needs, whole and in bands."""
    width, height = film
    whole, part = (BYTES * width * n / 1e9 for n in (height, min(rows + 2 * MARGIN, height)))
    return (
        f"{width} x {height} pixels need {whole:,.1f} GB of memory, more than is free: "
        f"rendered in {-(-height // rows)} bands of {rows} rows, {part:,.1f} GB each"
    )


WHOLE = "expected a picture that fits into the memory; a larger one is rendered in bands"


def _in_bands(
    scene: Scene,
    job: RenderJob,
    work: Work,
    path: str | Path | None,
    rows: int,
    device: str,
    state: str | None,
) -> Rendered:
    """Render a picture larger than the memory into a file."""
    view, film, taken, squares = scene.view, job.film(scene.view), list[float](), list[float]()
    whole = {"layers": job.layers, "denoise": job.denoise, "time": job.time, "state": state}
    whole["cluster or shard"] = work.cluster is not None
    if path is None or check_image(path) not in BANDED:
        raise RenderError(f"{path or 'size'}: {WHOLE}, as {', '.join(BANDED)}")
    for name, value in whole.items():
        if value:
            raise RenderError(f"{name}: {WHOLE}")
    check_bands(view, display=check_image(path) == ".png")
    sequence = SampleRange(seed=job.seed)

    def bands() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        made = render_bands(scene.root, view, film, rows, work, device, sequence, job.samples)
        for k, band in enumerate(made, 1):
            taken.append(band.samples)
            squares.append(band.error**2)
            work.progress("bands", k * rows / film[1])
            yield band.developed, light_of(band)

    write_bands(path, film, bands(), 4 if view.film.transparent else 3, job.bits, metadata(scene), work)
    return Rendered(film, sum(taken) / len(taken), (sum(squares) / len(squares)) ** 0.5)


def light_of(done: Pass) -> Any:
    """Linear light of a pass, with alpha if the film is transparent."""
    return done.mean if done.view.film.transparent else done.image


def metadata(scene: Scene) -> dict[str, str]:
    """Metadata of every picture of a scene."""
    from ..version import APPLICATION

    return {"Title": scene.name, "Software": APPLICATION, "scene_hash": scene.hash}


def save(
    path: str | Path,
    done: Pass,
    scene: Scene,
    threads: int,
    bits: int = 8,
    more: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write the picture of a pass, with the scene and the samples in its metadata.

    `more`: layers of an .exr file, float32 (height, width, 3).
    """
    text = {**metadata(scene), "samples": f"{done.samples:.2f}"}
    picture = light_of(done) if check_image(path) in LINEAR else done.developed
    write_image(path, picture, picture, bits, text, Work(threads), more)


@dataclass(frozen=True)
class _Picture:
    """A picture in one piece."""

    scene: Scene
    job: RenderJob
    work: Work
    path: Path | None  # file of the picture
    state: str | None  # file of the sums

    def made(self, device: str, shown: Shown | None) -> Rendered:
        """Render and write the picture."""
        scene, job, pool = self.scene, self.job, self.work.cluster
        film, view, crop = job.film(scene.view), scene.view, job.crop
        device = for_picture(device, crop[2:] if crop else film, job.most(view))
        renderer = Renderer(scene.root, view, film, self.work, device, SampleRange(seed=job.seed), crop)
        aside = None if pool is None or self.state else pool.pieces.path(f"{renderer.key}.npz")
        try:
            guides, limit = _plan_denoising(renderer, job)
            self._passes(renderer, self.state or aside, limit, shown)
            if pool and not pool.first:
                raise SharedError("the samples are made; shard 1 writes the file")
            more = layers(renderer) if job.layers else None
            done = renderer.seen()
            if job.denoise:
                done = denoise(renderer, guides)
        except Cancelled:
            kept = renderer.seen()
            if self.path is None or not kept.samples or (pool and not pool.first):
                raise
            self._save(kept)
            raise KeptError(f"{self.path}: {_rendered(renderer, kept).description}") from None
        self._save(done, more)
        if pool and aside:
            Path(aside).unlink(missing_ok=True)
        return _rendered(renderer, done)

    def _save(self, done: Pass, more: Mapping[str, np.ndarray] | None = None) -> None:
        if self.path is not None:
            save(self.path, done, self.scene, self.work.threads, self.job.bits, more)

    def _passes(
        self, renderer: Renderer, state: str | None, limit: float | None, shown: Shown | None
    ) -> None:
        """Render pass after pass, from a state and into it."""
        work = self.work
        keep = state if work.cluster is None or work.cluster.first else None
        if state and Path(state).exists():
            renderer.resume(state)
        try:
            passes = _limit_time(renderer, self.job.samples, limit)
            for done in shown(passes, renderer) if shown else passes:
                if not shown:
                    work.progress("rendering", share(done, renderer, self.job))
                if keep:
                    _save_state(renderer, keep)
            if limit and keep:
                _save_state(renderer, keep)  # of a pass that the limit interrupted
        except Cancelled:
            if keep and renderer.seen().samples:
                _save_state(renderer, keep)
            raise


def share(done: Pass, renderer: Renderer, job: RenderJob) -> float:
    """Completed fraction of the samples, from 0 to 1."""
    return min(done.samples / job.most(renderer.setup.view), 1.0)


def _rendered(renderer: Renderer, done: Pass) -> Rendered:
    return Rendered((renderer.width, renderer.height), done.samples, done.error, done, renderer)


def _plan_denoising(renderer: Renderer, job: RenderJob) -> tuple[list[np.ndarray] | None, float | None]:
    """Guides of denoising where the time is limited, and the time that is left for the passes, seconds.

    Removing noise takes as long from an empty picture as from the one at the end.
    """
    if not job.denoise or job.time is None:
        return None, job.time

    start = monotonic()
    made = guides(renderer)
    guided = monotonic()
    denoise(renderer, made)
    taken = monotonic() - start + (monotonic() - guided)
    return made, max(job.time - taken, job.time / 10)


def _limit_time(renderer: Renderer, samples: int | None, limit: float | None) -> Iterator[Pass]:
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
        yield from _limit_time(renderer, samples, 2 * limit)


def _save_state(renderer: Renderer, path: str) -> None:
    """Write the state of a renderer, from which it can resume."""
    from ..common.files import replacing

    with replacing(path) as file:
        renderer.save(file)


SHARE = 0.5
"""Part of the free memory that a band takes."""
ROWS = 64
"""Rows of a band, or a multiple; files store as many rows as one."""
SCALED = ("depth", "distance", "position")
"""Modes whose display values depend on the range of the whole picture."""


def rows_of_bands(film: tuple[int, int]) -> int:
    """Return the rows of a band: all rows if the picture is no larger than the memory.

    `film` in pixels.
    """
    width, height = film
    free = available_bytes()
    if Crop.of(film, None).bytes <= free:
        return height
    rows = int(SHARE * free) // (BYTES * width) - 2 * MARGIN
    return max(rows // ROWS, 1) * ROWS


def check_bands(view: View, display: bool) -> None:
    """Raise an error for a view whose pixels depend on the whole picture."""
    if display and view.film.bloom and view.shading.mode == "light":
        raise RenderError('film.bloom: spreads light over the whole picture; expected bloom="0" in bands')
    if display and view.shading.mode in SCALED:
        raise RenderError(
            f"shading.mode={view.shading.mode}: is scaled by its range; expected .exr or .tif in bands"
        )


def render_bands(
    root: Node,
    view: View,
    film: tuple[int, int],
    rows: int,
    work: Work | None = None,
    device: str = "auto",
    sequence: SampleRange | None = None,
    samples: int | None = None,
) -> Iterator[Pass]:
    """Render a picture band by band; each has the pixels of the whole picture.

    `film` in pixels.
    """
    for part in chunks(film[1], rows):
        crop = 0, part.start, film[0], part.stop - part.start
        *_, last = Renderer(root, view, film, work, device, sequence, crop).passes(samples)
        yield last


GUIDES = ("albedo", "normal")
REACH = 5
"""Half width of the window of non-local means, pixels."""
STRICT = 0.45
"""Factor on the standard deviation in the distance of two patches (Rousselle, Knaus and Zwicker 2012)."""
ALIKE = 0.1
"""Distance of colours or normals at which a pixel has a weight of 1/e."""


def advice() -> str:
    """Return what to install for Open Image Denoise."""
    return lacking("pyoidn", "by non-local means; Open Image Denoise, which leaves less noise, needs")


def guides(renderer: Renderer) -> list[np.ndarray]:
    """Render what guides `denoise`: colours without light and normals, float32 (height, width, 3) each."""
    return [layer(renderer, mode) for mode in GUIDES]


def denoise(renderer: Renderer, known: list[np.ndarray] | None = None) -> Pass:
    """Remove the noise of a renderer's picture, by Open Image Denoise or else by non-local means.

    `known`: the picture's `guides`, if they were made before.
    """
    done, host, cut = renderer.seen(), renderer.accumulator.host(), renderer.crop.within
    mean = done.mean
    albedo, normal = known or guides(renderer)
    light = np.ascontiguousarray(mean[..., :3])
    if not advice():
        import pyoidn

        clean = pyoidn.denoise(light, albedo=np.clip(albedo, 0, 1), normal=normal, hdr=True)
    else:
        bright, squares, n = np.moveaxis(cut(host.channels[..., 3 : COUNT + 1]), -1, 0).astype(np.float64)
        variance = squared_error(bright, squares, n)
        clean = non_local_means(light, np.where(variance < UNKNOWN, variance, 1.0), albedo, normal)
    picture = HostAccumulator.empty(renderer.width, renderer.height, np.dtype(np.float32), host.work)
    picture.passes = done.number
    picture.channels[..., :3] = np.maximum(clean, 0)
    picture.channels[..., (COUNT, GOAL)] = 1
    picture.channels[..., COVER] = mean[..., 3]
    return replace(done, source=picture, crop=Crop.of((renderer.width, renderer.height), None))


def non_local_means(
    light: np.ndarray, variance: np.ndarray, albedo: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Replace each pixel by a weighted mean of those around it whose surroundings look alike.

    Buades, Coll and Morel 2005, "A Non-Local Algorithm for Image Denoising", with the distance of patches of
    Rousselle, Knaus and Zwicker 2012, "Adaptive Rendering with Non-Local Means Filtering", which subtracts
    what noise explains. Other colours and normals are other surfaces.

    `light`: float32 (height, width, 3); `variance`: float (height, width); `albedo`, `normal`: float32
    (height, width, 3). Returns float32 (height, width, 3).
    """
    from scipy.ndimage import uniform_filter

    shown = light @ np.array((0.2126, 0.7152, 0.0722), np.float32)
    grey = shown / (1 + shown)
    guide = np.concatenate([albedo, normal], 2) / np.float32(ALIKE)
    noise = np.minimum(uniform_filter(variance.astype(np.float32), 3, mode="nearest"), 1)
    layers = [
        np.pad(a, [(REACH, REACH)] * 2 + [(0, 0)] * (a.ndim - 2), "edge") for a in (light, grey, noise, guide)
    ]
    height, width = grey.shape
    total, weights = np.zeros_like(light), np.zeros_like(grey)
    for down in range(2 * REACH + 1):
        for across in range(2 * REACH + 1):
            there = (slice(down, down + height), slice(across, across + width))
            colour, g, v, other = (a[there] for a in layers)
            distance = (grey - g) ** 2 - (noise + np.minimum(noise, v))
            patch = uniform_filter(distance / (1e-8 + STRICT * STRICT * (noise + v)), 3, mode="nearest")
            unlike = ((guide - other) ** 2).sum(2)
            weight = np.exp(-np.maximum(patch, 0) - unlike)
            total += weight[..., None] * colour
            weights += weight
    return np.asarray(total / weights[..., None], np.float32)
