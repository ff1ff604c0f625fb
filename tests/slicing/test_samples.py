"""Samples and pictures on machines with and without wide vectors: the same layers."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.once

SCRIPT = """
import zlib
from fracslice._slices import Encoding
from fracslice.formulas import box, difference, mandelbulb, sphere
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.slicing.printers import printer
from fracslice.slicing.raster import Screen
for root in (mandelbulb(), difference(box(), sphere(radius=0.6))):
    stack = plan_stack(root, SliceJob(size=20, layer=1.5, pixel=(0.1, 0.1)))
    screen = Screen(stack, printer=printer("sl1"), gamma=1.5)
    def made(layer):
        picture = screen.encoded(layer, Encoding.PNG)
        return zlib.crc32(layer.coverage.tobytes()), zlib.crc32(picture), layer.evaluations
    for numbers in Slicer(stack).map(made):
        print(*numbers)
"""


def layers(**environment: str) -> str:
    run = [sys.executable, "-c", SCRIPT]
    return subprocess.run(
        run, env=os.environ | environment, capture_output=True, text=True, check=True
    ).stdout


def test_the_portable_way_gives_the_same_layers() -> None:
    result = layers()
    assert len(result.splitlines()) > 20
    assert layers(FRACSLICE_PORTABLE="1") == result
