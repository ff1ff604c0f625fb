"""Resin printers and their screens, as published. Sources of the figures: docs/reference/printers.md."""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from ..errors import SliceError


@dataclass(frozen=True)
class Printer:
    """A masked resin printer.

    Attributes
    ----------
    name, title : str
        Name in commands, and name in messages.
    pixels : tuple of int
        Pixels of the screen along x and y of the bed.
    screen : tuple of float
        Size of the screen, mm.
    height : float
        Maximum height of a print, mm.
    mirror : bool
        The picture is mirrored along x.
    portrait : bool
        Rows of the picture run along x of the bed.
    """

    name: str
    title: str
    pixels: tuple[int, int]
    screen: tuple[float, float]
    height: float
    mirror: bool = True
    portrait: bool = False

    @property
    def pixel(self) -> tuple[float, float]:
        """Width and height of a pixel, mm."""
        return self.screen[0] / self.pixels[0], self.screen[1] / self.pixels[1]

    @property
    def build_volume(self) -> tuple[float, float, float]:
        """Build volume (x, y, z), mm."""
        return *self.screen, self.height


PRINTERS = {
    p.name: p
    for p in (
        Printer("sl1", "Original Prusa SL1", (2560, 1440), (120.96, 68.04), 150, portrait=True),
        Printer("sl1s", "Original Prusa SL1S Speed", (2560, 1620), (128, 81), 150, portrait=True),
        Printer("photon-mono-4k", "Anycubic Photon Mono 4K", (3840, 2400), (134.4, 84), 165),
        Printer("photon-mono-4", "Anycubic Photon Mono 4", (9024, 5120), (153.408, 87.04), 165),
        Printer("photon-mono-m7-pro", "Anycubic Photon Mono M7 Pro", (13312, 5120), (223.642, 126.976), 230),
        Printer("mars-5-ultra", "Elegoo Mars 5 Ultra", (8520, 4320), (153.36, 77.76), 165),
        Printer("saturn-4-ultra", "Elegoo Saturn 4 Ultra 12K", (11520, 5120), (218.88, 122.88), 220),
        Printer("saturn-4-ultra-16k", "Elegoo Saturn 4 Ultra 16K", (15120, 6230), (211.68, 118.37), 220),
        Printer("halot-mage-pro", "Creality Halot Mage Pro", (7680, 4320), (228.096, 128.304), 230),
        Printer("sonic-mini-8k-s", "Phrozen Sonic Mini 8K S", (7536, 3240), (165.792, 71.28), 170),
    )
}


def printer(name: str) -> Printer:
    """Look up a printer.

    Parameters
    ----------
    name : str
        A key of `PRINTERS`.

    Returns
    -------
    Printer
        The printer.

    Raises
    ------
    SliceError
        For an unknown name; the message has the nearest known one.
    """
    if name in PRINTERS:
        return PRINTERS[name]
    near = difflib.get_close_matches(name.lower().replace(" ", "-"), PRINTERS, 1, 0.4)
    raise SliceError(
        f"printer {name!r}: unknown; "
        + (f"did you mean {near[0]}?" if near else f"known: {', '.join(PRINTERS)}")
    )
