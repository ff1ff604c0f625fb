"""Pictures that are larger than the memory, rendered in bands of rows."""

from __future__ import annotations

from collections.abc import Iterator

from ..common.memory import available_bytes
from ..errors import RenderError
from ..formulas.registry import Node
from ..scene.view import View
from ..work import Work, chunks
from .crops import BYTES, MARGIN, Crop
from .progressive import Pass, Renderer
from .sequence import SampleRange

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
