"""Detection of a screen."""

from __future__ import annotations

import ctypes
import ctypes.util
import sys

from ..common.messages import lacking
from ..errors import RenderError


def need_screen() -> None:
    """Check that a window can be opened.

    Raises
    ------
    RenderError
        If pyvista or a screen is missing.
    """
    if reason := lacking("pyvista", "windows need"):
        raise RenderError(reason)
    if not has_screen():
        raise RenderError("there is no screen to open a window on; a picture can be made without one")


def has_screen() -> bool:
    """Return whether a window can be opened.

    On Linux, an X server must answer: VTK ends the process without one. Other systems always count as having
    a screen.
    """
    if not sys.platform.startswith("linux"):
        return True
    library = ctypes.util.find_library("X11")
    if library is None:
        return False
    x11 = ctypes.CDLL(library)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    # Keep the display open: a server that loses its only client may reset and refuse connections meanwhile.
    return bool(x11.XOpenDisplay(None))
