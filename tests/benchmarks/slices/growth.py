"""How the cost of slicing grows: ``python -m tests.benchmarks.slices.growth [FINEST]``.

Each scene at 256, 512, ... FINEST (1024) pixels and half as many layers, with pictures; prints the pixels
that contours cut, evaluations and processor time, and how many times more each doubling takes. The surface
grows four times, the volume eight times; a fractal's surface a little more than four.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from fracslice.export import png
from fracslice.formulas import Node, julia, mandelbulb, menger, torus
from fracslice.slicing import Layer, SliceJob, Slicer, plan_stack
from fracslice.slicing.raster import Screen

SCENES = {
    "torus": torus(),
    "menger 3": menger(level=3),
    "mandelbulb": mandelbulb(iterations=6),
    "julia": julia(iterations=12),
}


def cost(root: Node, pixels: int) -> tuple[float, float, float]:
    """Cut pixels, evaluations, and processor seconds."""
    stack = plan_stack(root, SliceJob(size=0.05 * pixels, layer=0.1, pixel=(0.05, 0.05)))
    screen = Screen(stack)

    def make(layer: Layer) -> tuple[float, float]:
        png.encode_layer(screen, layer)
        return layer.boundary, layer.evaluations

    list(Slicer(stack).map(make, range(8)))  # compiles
    begin = time.process_time()
    boundary, evaluations = np.sum(list(Slicer(stack).map(make)), axis=0)
    return boundary, evaluations, time.process_time() - begin


def main() -> None:
    finest = int(sys.argv[1]) if sys.argv[1:] else 1024
    for name, root in SCENES.items():
        last, pixels = None, 256
        while pixels <= finest:
            found = np.array(cost(root, pixels))
            line = f"{name:10} {pixels:5} cut {found[0]:8.0f}  evaluations {found[1]:9.0f}  {found[2]:6.2f} s"
            if last is not None:
                line += "  times " + " ".join(f"{t:.2f}" for t in found / last)
            print(line)
            last, pixels = found, 2 * pixels


if __name__ == "__main__":
    main()
