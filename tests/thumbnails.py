"""``python -m tests.thumbnails``: the small pictures of shipped scenes and shapes in the lists of the studio.

One picture of cells, and the names of the cells by rows. To be run when a scene or a shape is new or looks
different; it takes a minute on 16 cores.
"""

from __future__ import annotations

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from fracslice.errors import FracsliceError
from fracslice.formulas import intersection, sphere
from fracslice.rendering import Renderer
from fracslice.scene import library, read, reads
from fracslice.scene.layout import formulas
from fracslice.scene.model import Scene
from fracslice.studio.document import empty_element
from fracslice.studio.panels import CELL, COLUMNS, THUMBNAILS
from fracslice.work import Work

AROUND = 1.5
"""Radius of the ball that is shown of a solid without an end."""

SAMPLES = 16
"""Samples of each pixel."""


def scene(name: str) -> Scene:
    """Shipped scene, or a shape with the values that it has at first."""
    if name in (*library.names(), *library.gallery()):
        return read(library.path(name))
    made = reads(f'<scene version="1"><solid size="40mm">{empty_element(name)}</solid></scene>', name)
    if made.root.bounds.box.finite:
        return made
    return replace(made, root=intersection(made.root, sphere(radius=AROUND)))


def picture(name: str) -> np.ndarray | None:
    """Picture of a cell, uint8 [height, width, 3]; None of what needs more than its first values."""
    try:
        made = scene(name)
        view = replace(made.view, film=replace(made.view.film, width=CELL[0], height=CELL[1]))
        *_, last = Renderer(made.root, view, CELL, Work(threads=1), "cpu").passes(SAMPLES)
    except (FracsliceError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return None
    return last.shown[..., :3]


def main(to: Path = THUMBNAILS) -> None:
    """Write the picture and the names beside it."""
    shapes = sorted(formula.name for formula in formulas() if formula.kind == "shape")
    names = [*dict.fromkeys([*library.names(), *library.gallery(), *shapes])]
    with ProcessPoolExecutor() as pool:
        made = {n: p for n, p in zip(names, pool.map(picture, names), strict=True) if p is not None}
    width, height = CELL
    sheet = np.zeros((-(-len(made) // COLUMNS) * height, COLUMNS * width, 3), np.uint8)
    for number, cell in enumerate(made.values()):
        row, column = divmod(number, COLUMNS)
        sheet[row * height : (row + 1) * height, column * width : (column + 1) * width] = cell
    Image.fromarray(sheet).save(to, quality=75, method=6)
    to.with_suffix(".json").write_text(json.dumps([*made]) + "\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
