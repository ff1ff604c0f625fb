"""Previews of planned layers: a contact sheet, an animation, the worst layers of a check, a page of HTML.

All raise `SliceError` if a layer cannot be sampled, and `Cancelled` when the work is cancelled.
"""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..work import Work
from .layers import Layer, Slicer
from .stack import Stack

if TYPE_CHECKING:
    from PIL.Image import Image


CELLS, CELL, CAPTION, FRAMES, ABREAST = 24, 200, 120, 60, 3
INK = np.array([(24, 26, 33), (240, 196, 105)], float)
ALARM = (214, 60, 60)


def thumbnail(layer: Layer) -> Image:
    """Shrink a layer's coverage by box averaging, in colour.

    Returns at most `CELL` pixels along a side.
    """
    from PIL import Image

    whole = Image.fromarray(np.ascontiguousarray(layer.coverage[::-1]))
    small = whole.resize(_square(layer.stack, CELL), Image.Resampling.BOX)
    share = np.asarray(small, float)[..., None] / 255
    return Image.fromarray(np.uint8(INK[0] + share * (INK[1] - INK[0])))


def _square(stack: Stack, most: float = math.inf) -> tuple[int, int]:
    """Width and height of a layer's picture with square pixels, at most `most` along a side."""
    (ny, nx), (across, along) = stack.shape, stack.pixel
    width, height = nx * across, ny * along
    side = max(min(across, along), max(width, height) / most)
    return max(round(width / side), 1), max(round(height / side), 1)


def _spread_layers(layers: range, count: int) -> list[int]:
    """At most `count` of the layers, evenly spaced, each in the middle of its interval."""
    total = len(layers)
    return sorted(layers[int((i + 0.5) * total / min(count, total))] for i in range(min(count, total)))


def contact_sheet(
    stack: Stack, file: BinaryIO, work: Work | None = None, layers: range | None = None
) -> None:
    """Write a PNG with 24 layers, evenly spaced, each with its height above the bed."""
    chosen = _spread_layers(range(len(stack.z)) if layers is None else layers, CELLS)
    images = list(Slicer(stack, work or Work()).map(thumbnail, chosen))
    _sheet(stack, chosen, images, math.ceil(math.sqrt(1.5 * max(len(images), 1)))).save(file, "PNG")


def _sheet(stack: Stack, layers: Sequence[int], images: Sequence[Image], across: int) -> Image:
    """Thumbnails in rows, each with its caption."""
    from PIL import Image, ImageDraw

    width = max([CAPTION, *(i.width for i in images)]) + 8
    height = max([0, *(i.height for i in images)]) + 24
    sheet = Image.new("RGB", (across * width + 8, -(-len(images) // across) * height + 8), "white")
    draw = ImageDraw.Draw(sheet)
    for n, (index, image) in enumerate(zip(layers, images, strict=True)):
        x, y = 8 + n % across * width, 8 + n // across * height
        sheet.paste(image, (x, y))
        draw.text((x, y + image.height + 2), f"layer {index}, {stack.tops[index]:.2f} mm", "black")
    return sheet


def animation(stack: Stack, file: BinaryIO, work: Work | None = None) -> None:
    """Write an endless animated WebP that climbs through up to 60 layers in three seconds."""
    chosen = _spread_layers(range(len(stack.z)), FRAMES)
    frames = list(Slicer(stack, work or Work()).map(thumbnail, chosen))
    frames[0].save(file, "WEBP", save_all=True, append_images=frames[1:], duration=50, loop=0, lossless=True)


def worst_layers(stack: Stack, layers: Sequence[int], file: BinaryIO, work: Work | None = None) -> None:
    """Write a PNG of layers at full resolution, pixels with nothing below them in red."""
    from PIL import Image

    layers = layers or [0]
    wanted = sorted({n for k in layers for n in (max(k - 1, 0), k)})
    solid = dict(zip(wanted, Slicer(stack, work or Work()).map(_solid, wanted), strict=True))
    pictures = []
    for k in layers:
        bare = solid[k] & ~solid[k - 1] if k else np.zeros_like(solid[k])
        colours = np.array([INK[0], INK[1], ALARM], np.uint8)
        picture = Image.fromarray(colours[solid[k] + 1 * bare][::-1])
        pictures.append(picture.resize(_square(stack), Image.Resampling.NEAREST))
    _sheet(stack, layers, pictures, min(len(layers), ABREAST)).save(file, "PNG")


def _solid(layer: Layer) -> np.ndarray:
    """Pixels of a layer that are at least half covered."""
    return layer.coverage >= 128


WIDTH, HEIGHT, MARGIN = 720, 220, 40
"""Size of the plot and the space for its labels, pixels."""

_STYLE = "body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}img,svg{max-width:100%}"


def page(
    title: str,
    lines: Sequence[str],
    verdict: str,
    problems: Sequence[str],
    tops: NDArray[np.float64],
    areas: NDArray[np.float64],
    picture: bytes,
) -> bytes:
    """Compose a summary page.

    `tops`, `areas`: float64 [n], mm, mm2.
    """
    image = b64encode(picture).decode("ascii")
    text = [
        "<!DOCTYPE html>",
        f'<html lang="en"><meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>',
        f"<h1>{escape(title)}</h1>",
        *(f"<p>{escape(line)}</p>" for line in lines),
        f"<h2>{escape(verdict.capitalize())}</h2>",
        *(["<ul>", *(f"<li>{escape(problem)}</li>" for problem in problems), "</ul>"] if problems else []),
        "<h2>Cross-section over height</h2>",
        "<p>The force that peels a layer from the film grows with its area.</p>",
        plot(tops, areas),
        "<h2>Worst layers</h2>",
        "<p>Red has nothing below it.</p>",
        f'<img alt="Worst layers" src="data:image/png;base64,{image}">',
        "</html>",
    ]
    return "\n".join([*text, ""]).encode()


def plot(tops: NDArray[np.float64], areas: NDArray[np.float64]) -> str:
    """Plot areas over height as SVG.

    `tops`, `areas`: float64 [n], mm, mm2.
    """
    most, high = max(float(areas.max(initial=0)), 1e-9), float(tops[-1])
    inner, tall = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    column = np.minimum((tops / high * inner).astype(int), inner - 1)
    largest = np.full(inner, -1.0)
    np.maximum.at(largest, column, areas)
    shown = np.flatnonzero(largest >= 0)
    points = " ".join(f"{MARGIN + x},{MARGIN + tall * (1 - largest[x] / most):.1f}" for x in shown.tolist())
    bottom, label = HEIGHT - MARGIN, HEIGHT - MARGIN / 2
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" font-size="12">'
        f'<path d="M{MARGIN} {MARGIN}V{bottom}H{WIDTH - MARGIN}" fill="none" stroke="#888"/>'
        f'<polyline points="{points}" fill="none" stroke="#b25"/>'
        f'<text x="{MARGIN}" y="{MARGIN - 8}">{most:.4g} mm2</text>'
        f'<text x="{MARGIN}" y="{label}">0</text>'
        f'<text x="{WIDTH - MARGIN}" y="{label}" text-anchor="end">{high:.4g} mm</text></svg>'
    )
