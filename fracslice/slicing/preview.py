"""Layers to look at: a contact sheet, an animation, and the layers that a check found worst."""

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

CELLS, CELL, FRAMES = 24, 200, 60
INK = np.array([(24, 26, 33), (240, 196, 105)], float)
ALARM = (214, 60, 60)


def thumbnail(image: np.ndarray) -> Image:
    """A layer's coverage, at most `CELL` pixels a side, each the mean of what it covers."""
    from PIL import Image

    small = Image.fromarray(np.ascontiguousarray(image[::-1]))
    small.thumbnail((CELL, CELL), Image.Resampling.BOX, reducing_gap=None)
    share = np.asarray(small, float)[..., None] / 255
    return Image.fromarray(np.uint8(INK[0] + share * (INK[1] - INK[0])))


def _spread(stack: Stack, count: int) -> list[int]:
    """So many layers, evenly over the height, from the middle of the first part to that of the last."""
    total = len(stack.z)
    return sorted({int((i + 0.5) * total / min(count, total)) for i in range(min(count, total))})


def contact_sheet(
    stack: Stack, file: BinaryIO, work: Work | None = None, layers: Sequence[int] | None = None
) -> None:
    """A PNG with chosen layers, or 24 over the height, each with its height above the bed."""
    from PIL import Image, ImageDraw

    chosen = list(layers) if layers is not None else _spread(stack, CELLS)
    images = list(Slicer(stack, work or Work()).map(lambda layer: thumbnail(layer.coverage), chosen))
    across = math.ceil(math.sqrt(1.5 * max(len(images), 1)))
    down = math.ceil(max(len(images), 1) / across)
    sheet = Image.new("RGB", (across * (CELL + 8) + 8, down * (CELL + 24) + 8), "white")
    draw = ImageDraw.Draw(sheet)
    for n, (index, image) in enumerate(zip(chosen, images, strict=True)):
        x, y = 8 + n % across * (CELL + 8), 8 + n // across * (CELL + 24)
        sheet.paste(image, (x, y))
        draw.text((x, y + image.height + 2), f"layer {index}, {stack.tops[index]:.2f} mm", "black")
    sheet.save(file, "PNG")


def animation(stack: Stack, file: BinaryIO, work: Work | None = None) -> None:
    """An endless animated WebP that climbs through the object in up to 60 layers, three seconds long."""
    frames = list(
        Slicer(stack, work or Work()).map(lambda layer: thumbnail(layer.coverage), _spread(stack, FRAMES))
    )
    frames[0].save(file, "WEBP", save_all=True, append_images=frames[1:], duration=50, loop=0, lossless=True)


def worst_layers(stack: Stack, layers: Sequence[int], file: BinaryIO, work: Work | None = None) -> None:
    """A PNG of layers, what has nothing below it in red."""
    from PIL import Image

    wanted = sorted({n for k in layers for n in (max(k - 1, 0), k)})
    solid = dict(zip(wanted, Slicer(stack, work or Work()).map(_solid, wanted), strict=True))
    pictures = []
    for k in layers:
        bare = solid[k] & ~solid[k - 1] if k else np.zeros_like(solid[k])
        colours = np.array([INK[0], INK[1], ALARM], np.uint8)
        pictures.append(Image.fromarray(colours[solid[k] + 1 * bare][::-1]))
    width = sum(p.width + 8 for p in pictures) + 8
    sheet = Image.new("RGB", (width, max((p.height for p in pictures), default=0) + 16), "white")
    x = 8
    for picture in pictures:
        sheet.paste(picture, (x, 8))
        x += picture.width + 8
    sheet.save(file, "PNG")


def _solid(layer: Layer) -> np.ndarray:
    return layer.coverage >= 128
