"""Pictures larger than the memory: rendered in bands of rows, which are written at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from .inputs import refuse_options

if TYPE_CHECKING:
    import numpy as np

    from fracslice.rendering import Pass
    from fracslice.rendering.sequence import SampleRange
    from fracslice.scene import Scene
    from fracslice.work import Work


def announced(film: tuple[int, int], rows: int) -> str:
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
