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


def thumbnail(image: np.ndarray) -> Image:
    """Shrink a layer's coverage by box averaging, in colour.

    Parameters
    ----------
    image : uint8 [ny, nx]
        Coverage.

    Returns
    -------
    PIL.Image.Image
        At most `CELL` pixels along a side.
    """
    from PIL import Image

    small = Image.fromarray(np.ascontiguousarray(image[::-1]))
    small.thumbnail((CELL, CELL), Image.Resampling.BOX, reducing_gap=None)
    share = np.asarray(small, float)[..., None] / 255
    return Image.fromarray(np.uint8(INK[0] + share * (INK[1] - INK[0])))


def _spread(stack: Stack, count: int) -> list[int]:
    """Numbers of `count` layers, evenly spaced over the height, each in the middle of its interval."""
    total = len(stack.z)
    return sorted({int((i + 0.5) * total / min(count, total)) for i in range(min(count, total))})


def contact_sheet(stack: Stack, file: BinaryIO, work: Work | None = None) -> None:
    """Write a PNG with 24 layers, evenly spaced, each with its height above the bed."""
    chosen = _spread(stack, CELLS)
    images = list(Slicer(stack, work or Work()).map(lambda layer: thumbnail(layer.coverage), chosen))
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
    frames = list(
        Slicer(stack, work or Work()).map(lambda layer: thumbnail(layer.coverage), _spread(stack, FRAMES))
    )
    frames[0].save(file, "WEBP", save_all=True, append_images=frames[1:], duration=50, loop=0, lossless=True)


def worst_layers(stack: Stack, layers: Sequence[int], file: BinaryIO, work: Work | None = None) -> None:
    """Write a PNG of layers at full resolution, pixels with nothing below them in red.

    Parameters
    ----------
    layers : sequence of int
        Numbers of the layers; the lowest one if empty.
    """
    from PIL import Image

    layers = layers or [0]
    wanted = sorted({n for k in layers for n in (max(k - 1, 0), k)})
    solid = dict(zip(wanted, Slicer(stack, work or Work()).map(_solid, wanted), strict=True))
    pictures = []
    for k in layers:
        bare = solid[k] & ~solid[k - 1] if k else np.zeros_like(solid[k])
        colours = np.array([INK[0], INK[1], ALARM], np.uint8)
        pictures.append(Image.fromarray(colours[solid[k] + 1 * bare][::-1]))
    _sheet(stack, layers, pictures, min(len(layers), ABREAST)).save(file, "PNG")


def _solid(layer: Layer) -> np.ndarray:
    """Pixels of a layer that are at least half covered."""
    return layer.coverage >= 128
