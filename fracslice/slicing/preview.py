"""Previews of planned layers: a contact sheet, an animation, and the worst layers of a check.

All raise `SliceError` if a layer cannot be sampled, and `Cancelled` when the work is cancelled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

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
