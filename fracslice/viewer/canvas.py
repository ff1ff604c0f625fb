"""Window with one picture, which keeps its proportions, and text over it.

It is VTK's own window: pyvista's installs an interactor style with keys and gestures of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from importlib import import_module
from typing import Any

import numpy as np

from ..rendering import Pass
from .window import need_screen

COLOUR = (0.96, 0.96, 0.96)
FONT = 15
"""Height of the text, pixels."""


class Canvas:
    """Window without an interactor style: it does what its handlers do, and nothing else.

    `size` in pixels.
    """

    def __init__(self, title: str, size: tuple[int, int], help_text: str) -> None:
        for module in (
            "UI",
            "OpenGL2",
            "FreeType",
        ):  # register the platform's interactor and window, and text
            import_module(f"vtkmodules.vtkRendering{module}")
        from vtkmodules.vtkCommonDataModel import vtkImageData
        from vtkmodules.vtkRenderingCore import (
            vtkImageActor,
            vtkRenderer,
            vtkRenderWindow,
            vtkRenderWindowInteractor,
        )

        self.image, self._renderer, self.window = vtkImageData(), vtkRenderer(), vtkRenderWindow()
        actor = vtkImageActor()
        actor.SetInputData(self.image)
        self._renderer.AddActor(actor)
        self._upper, lower = _text(over=True), _text(over=False)
        for text in (self._upper, lower):
            self._renderer.AddViewProp(text)
        lower.SetInput(help_text)
        self.window.SetWindowName(title)
        self.window.SetSize(*size)
        self.window.AddRenderer(self._renderer)
        interactor: Any = vtkRenderWindowInteractor
        self.interactor = interactor()
        self.interactor.SetRenderWindow(self.window)
        self.interactor.SetInteractorStyle(None)
        self.hidden = False

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the window, pixels."""
        width, height = self.window.GetSize()
        return max(width, 1), max(height, 1)

    def on(self, event: str, act: Callable[[], None]) -> None:
        """Call a function at every event of a name."""
        self.interactor.AddObserver(event, lambda *_: act())

    def open(self, tick: int) -> None:
        """Show the window until `close`, with a timer event every `tick` milliseconds.

        `tick`: milliseconds.
        """
        self.interactor.Initialize()
        self.interactor.CreateRepeatingTimer(tick)
        self.interactor.Start()
        self.window.Finalize()

    def show(self) -> None:
        """Show the window and return; `handle_events` must be called from time to time, `hide` at the end."""
        self.on("ExitEvent", self.hide)
        self.interactor.Initialize()

    def handle_events(self) -> None:
        """Handle the events of the window, without waiting for any."""
        if not self.hidden:
            self.interactor.ProcessEvents()

    def hide(self) -> None:
        """Close the window of `show`; nothing is drawn from then on."""
        if not self.hidden:
            self.hidden = True
            self.window.Finalize()

    def close(self) -> None:
        """End `open`."""
        self.interactor.TerminateApp()

    def draw(self, pixels: np.ndarray, text: str) -> None:
        """Draw a picture as large as the window allows without stretching it.

        `pixels`: uint8 (height, width, 3).
        """
        if self.hidden:
            return
        from vtkmodules.util import numpy_support

        to_vtk: Any = numpy_support.numpy_to_vtk
        rows, columns, _ = pixels.shape
        flipped = np.ascontiguousarray(pixels[::-1]).reshape(-1, 3)
        self.image.SetDimensions(columns, rows, 1)
        self.image.GetPointData().SetScalars(to_vtk(flipped, deep=True))
        self._upper.SetInput(text)
        width, height = self.size
        x, y = (columns - 1) / 2, (rows - 1) / 2
        camera = self._renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(x, y, 0)
        camera.SetPosition(x, y, 1)
        camera.SetParallelScale(max(rows, columns * height / width) / 2)
        camera.SetClippingRange(0.5, 1.5)
        self.window.Render()


def _text(over: bool) -> Any:
    """Text actor at the upper or lower left of the window."""
    from vtkmodules.vtkRenderingCore import vtkTextActor

    actor = vtkTextActor()
    style = actor.GetTextProperty()
    style.SetFontSize(FONT)
    style.SetColor(*COLOUR)
    style.ShadowOn()
    if over:
        style.SetVerticalJustificationToTop()
    place = actor.GetPositionCoordinate()
    place.SetCoordinateSystemToNormalizedViewport()
    place.SetValue(0.01, 0.985 if over else 0.015)
    return actor


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
            while done := _await_pass(pool.submit(next, passes, None), canvas):
                text = f"{done.samples:.1f} samples a pixel, error {done.error:.2g}"
                canvas.draw(done.shown, text)
                yield done
    finally:
        canvas.hide()


def _await_pass(made: Future[Pass | None], canvas: Canvas) -> Pass | None:
    """Result of a pass under way; events of the window are handled meanwhile."""
    while not wait([made], TICK).done:
        canvas.handle_events()
    return made.result()
