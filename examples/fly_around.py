"""
A flight around the Mandelbulb
==============================

One picture a step, ready for a film: ``python examples/fly_around.py [FOLDER] [STEPS] [WIDTHxHEIGHT]``.
"""

import sys
from dataclasses import replace
from pathlib import Path

from fracslice import read
from fracslice.export.images import write_image
from fracslice.rendering import Renderer, develop
from fracslice.scene import library
from fracslice.scene.view import Camera

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else 24
width, height = map(int, (sys.argv[3] if len(sys.argv) > 3 else "480x300").split("x"))

# %%
# The camera starts where the whole object is in view. ``passes`` yields better and better pictures; the last is kept.

scene = read(library.path("mandelbulb"))
start = Camera.around(scene.root.bounds.box)
for step in range(steps):
    view = replace(scene.view, camera=start.orbited(360 * step / steps))
    *_, picture = Renderer(scene.root, view, (width, height)).passes(samples=16)
    write_image(folder / f"step{step:03}.png", develop(picture.image, view.film), picture.image)
    print(f"step {step}: {picture.samples:.1f} samples a pixel, error {picture.error:.3f}")
