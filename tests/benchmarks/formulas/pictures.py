"""The contact sheet of elements.md: a picture of every example that has an end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import ExifTags, Image, ImageDraw

from fracslice import render
from fracslice.formulas import Node, bounds
from fracslice.volume import extent, with_depths
from tests.examples import EXAMPLES, OF_FILES

SIZE, COLUMNS, SAMPLES = (150, 128), 8, 8
SHEET = Path(__file__).parents[3] / "docs/figures/elements.webp"
SHOWN = [name for name, root in EXAMPLES.items() if root.bounds.box.finite and name not in OF_FILES]


def picture(root: Node) -> Image.Image:
    """The solid in the box that it fills."""
    box = extent(with_depths(root)).box
    near = box.grown(0.005 * max(box.size))
    shown = render(bounds(root, min=near.lo, max=near.hi), size=SIZE, samples=SAMPLES)
    return Image.fromarray(np.asarray(shown)[..., :3])


def tile(k: int) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of a picture on the sheet."""
    left, top = k % COLUMNS * SIZE[0], k // COLUMNS * SIZE[1]
    return left, top, left + SIZE[0], top + SIZE[1]


def write(path: Path) -> None:
    """Write the sheet, with the names of the examples in its text."""
    sheet = Image.new("RGB", tile(COLUMNS * -(-len(SHOWN) // COLUMNS) - 1)[2:])
    for k, name in enumerate(SHOWN):
        sheet.paste(picture(EXAMPLES[name]), tile(k)[:2])
        corner = (tile(k)[0] + 4, tile(k)[1] + 3)
        ImageDraw.Draw(sheet).text(corner, name, fill="white", stroke_fill="black", stroke_width=1)
    exif = Image.Exif()
    exif[ExifTags.Base.ImageDescription] = "\n".join(SHOWN)
    sheet.save(path, quality=85, method=6, exif=exif)


def shown(sheet: Image.Image) -> list[str]:
    """Names of the examples on a sheet."""
    return str(sheet.getexif()[ExifTags.Base.ImageDescription]).split("\n")
