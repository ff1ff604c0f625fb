"""Window with one picture, which keeps its proportions, and text over it.

It is VTK's own window: pyvista's installs an interactor style with keys and gestures of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

COLOUR = (0.96, 0.96, 0.96)
FONT = 15
"""Height of the text, pixels."""


class Canvas:
    """Window without an interactor style: it does what its handlers do, and nothing else.

    Parameters
    ----------
    title : str
        Title of the window.
    size : tuple of int
        Width and height, pixels.
    help_text : str
        Text at the lower edge.
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
        """Call a function at every event of a name.

        Parameters
        ----------
        event : str
            Name of a VTK event.
        act : callable
            Handler.
        """
        self.interactor.AddObserver(event, lambda *_: act())

    def open(self, tick: int) -> None:
        """Show the window until `close`, with a timer event every `tick` milliseconds.

        Parameters
        ----------
        tick : int
            Interval, milliseconds.
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

        Parameters
        ----------
        pixels : ndarray of uint8, shape (height, width, 3)
            sRGB.
        text : str
            Text at the upper edge.
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
