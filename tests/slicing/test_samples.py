"""Lists of samples on machines with and without wide vectors: the same layers."""

from __future__ import annotations

import os
import subprocess
import sys

SCRIPT = """
import zlib
from fracslice.formulas import box, difference, mandelbulb, sphere
from fracslice.slicing import SliceJob, Slicer, plan_stack
for root in (mandelbulb(), difference(box(), sphere(radius=0.6))):
    stack = plan_stack(root, SliceJob(size=20, layer=1.5, pixel=(0.1, 0.1)))
    for coverage, spent in Slicer(stack).map(lambda layer: (layer.coverage.tobytes(), layer.evaluations)):
        print(zlib.crc32(coverage), spent)
"""


def layers(**environment: str) -> str:
    run = [sys.executable, "-c", SCRIPT]
    return subprocess.run(
        run, env=os.environ | environment, capture_output=True, text=True, check=True
    ).stdout


def test_the_portable_way_gives_the_same_layers() -> None:
    found = layers()
    assert len(found.splitlines()) > 20
    assert layers(FRACSLICE_PORTABLE="1") == found
