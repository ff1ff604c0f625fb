"""Named palettes of eight stops.

Values of the colour maps by Smith and van der Walt 2015 (viridis, plasma, inferno, magma), Nunez, Anderton
and Renslow 2018 (cividis) and Breusch 2018 (twilight), all in the public domain (CC0). A palette is run
through in a circle, so maps that do not end as they begin go there and back.
"""

from __future__ import annotations

OWN = "colours"
"""The stops are the material's own colours."""

_STOPS = {
    "viridis": "440154 3b528b 21918c 5ec962 fde725 5ec962 21918c 3b528b",
    "plasma": "0d0887 7e03a8 cc4778 f89540 f0f921 f89540 cc4778 7e03a8",
    "inferno": "000004 57106e bc3754 f98e09 fcffa4 f98e09 bc3754 57106e",
    "magma": "000004 51127c b73779 fc8961 fcfdbf fc8961 b73779 51127c",
    "cividis": "00224e 434e6c 7d7c78 bcae6c fee838 bcae6c 7d7c78 434e6c",
    "twilight": "e2d9e2 95b5c7 6276ba 592a8f 2f1436 741e4f b25652 cca389",
}

PALETTES = {
    name: tuple(int(stop[k : k + 2], 16) / 255 for stop in text.split() for k in (0, 2, 4))
    for name, text in _STOPS.items()
}
"""sRGB components of the stops, in [0, 1], by name."""
