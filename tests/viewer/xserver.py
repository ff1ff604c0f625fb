"""An X server without a screen (Xvfb), real keys and pointer events (the XTEST extension), and its pixels."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import shutil
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 800, 600
AVAILABLE = shutil.which("Xvfb") and ctypes.util.find_library("Xtst")


class XServer:
    """Connection that presses keys and moves the pointer.

    Parameters
    ----------
    display : str
        Name of the display.
    frame : Path
        File that holds the server's pixels, in XWD format.
    """

    def __init__(self, display: str, frame: Path) -> None:
        self.display, self.frame = display, frame
        self.x11 = ctypes.CDLL(ctypes.util.find_library("X11"))
        self.test = ctypes.CDLL(ctypes.util.find_library("Xtst"))
        self.x11.XOpenDisplay.restype = ctypes.c_void_p
        self.x11.XStringToKeysym.restype = ctypes.c_ulong
        self.x11.XDefaultRootWindow.restype = ctypes.c_ulong
        self.connection = ctypes.c_void_p(self.x11.XOpenDisplay(display.encode()))

    def key(self, name: str, seconds: float = 0.0) -> None:
        """Press a key, hold it, and release it."""
        symbol = ctypes.c_ulong(self.x11.XStringToKeysym(name.encode()))
        code = self.x11.XKeysymToKeycode(self.connection, symbol)
        self._send("Key", code, 1)
        time.sleep(seconds)
        self._send("Key", code, 0)

    def button(self, number: int, pressed: bool) -> None:
        """Press or release a button of the mouse."""
        self._send("Button", number, int(pressed))

    def point(self, x: int, y: int) -> None:
        """Move the pointer, pixels from the upper left."""
        self._send("Motion", -1, x, y)

    def _send(self, event: str, *arguments: int) -> None:
        getattr(self.test, f"XTestFake{event}Event")(self.connection, *arguments, ctypes.c_ulong(0))
        self.x11.XSync(self.connection, 0)
        time.sleep(0.02)

    def windows(self) -> list[int]:
        """Windows at the top level."""
        root, parent, count = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_uint()
        children = ctypes.POINTER(ctypes.c_ulong)()
        top = ctypes.c_ulong(self.x11.XDefaultRootWindow(self.connection))
        results = (ctypes.byref(item) for item in (root, parent, children, count))
        self.x11.XQueryTree(self.connection, top, *results)
        return [children[k] for k in range(count.value)]

    def resize(self, width: int, height: int) -> None:
        """Resize the only window."""
        (window,) = self.windows()
        self.x11.XResizeWindow(self.connection, ctypes.c_ulong(window), width, height)
        self.x11.XSync(self.connection, 0)

    def pixels(self) -> np.ndarray:
        """Pixels of the screen, uint8, shape (height, width, 3)."""
        data = self.frame.read_bytes()
        header = struct.unpack(">25I", data[:100])
        start = header[0] + 12 * header[19]
        rows = np.frombuffer(data, np.uint8, header[12] * header[5], start).reshape(header[5], header[12])
        return rows.reshape(header[5], -1, 4)[:, : header[4], 2::-1]


@contextmanager
def xserver(folder: Path) -> Iterator[XServer]:
    """A server of its own, on a free display."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{WIDTH}x{HEIGHT}x24"]
    server = subprocess.Popen(
        [*command, "-fbdir", str(folder)], pass_fds=[writing], stderr=subprocess.DEVNULL
    )
    os.close(writing)
    try:
        with open(reading) as pipe:
            display = f":{pipe.readline().strip()}"
        yield XServer(display, folder / "Xvfb_screen0")
    finally:
        server.terminate()
        server.wait()
