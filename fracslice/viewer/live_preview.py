"""Window that shows a picture while it is rendered."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait

from ..rendering import Pass
from .canvas import Canvas
from .screen import need_screen

LARGEST = (1280, 800)
"""Largest width and height of the window, pixels."""
TICK = 0.02
"""Interval between two looks at the events of the window, seconds."""


def previewed(passes: Iterator[Pass], title: str, size: tuple[int, int]) -> Iterator[Pass]:
    """Show every pass in a window until the last one, or until the window is closed.

    Passes are made in another thread, so that the window can be moved and resized meanwhile.

    Parameters
    ----------
    passes : iterator of Pass
        The passes.
    title : str
        Title of the window.
    size : tuple of int
        Width and height of the picture, pixels.

    Yields
    ------
    Pass
        The same passes.

    Raises
    ------
    RenderError
        If pyvista or a screen is missing.
    """
    need_screen()
    scale = min(1.0, *(most / n for most, n in zip(LARGEST, size, strict=True)))
    canvas = Canvas(title, (max(int(scale * size[0]), 1), max(int(scale * size[1]), 1)), "")
    canvas.show()
    try:
        with ThreadPoolExecutor(1) as pool:
            while done := _awaited(pool.submit(next, passes, None), canvas):
                text = f"{done.samples:.1f} samples a pixel, error {done.error:.2g}"
                canvas.draw(done.shown, text)
                yield done
    finally:
        canvas.hide()


def _awaited(made: Future[Pass | None], canvas: Canvas) -> Pass | None:
    """Result of a pass under way; events of the window are handled meanwhile."""
    while not wait([made], TICK).done:
        canvas.handle_events()
    return made.result()
