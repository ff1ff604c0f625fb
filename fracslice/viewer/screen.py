"""Whether a window can be opened here."""

from __future__ import annotations

import ctypes
import ctypes.util
import sys

from fracslice.errors import RenderError
from fracslice.extras import lacking


def need_screen() -> None:
    """Raises `RenderError` when there is no pyvista or no screen."""
    if reason := lacking("pyvista", "windows need"):
        raise RenderError(reason)
    if not has_screen():
        raise RenderError("there is no screen to open a window on; a picture can be made without one")


def has_screen() -> bool:
    """On Linux, whether an X server answers: VTK ends the process where none does. Elsewhere always."""
    if not sys.platform.startswith("linux"):
        return True
    library = ctypes.util.find_library("X11")
    if library is None:
        return False
    x11 = ctypes.CDLL(library)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    # Left open: a server that loses its only client may begin anew, and turn away who comes meanwhile.
    return bool(x11.XOpenDisplay(None))
