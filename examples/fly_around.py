"""
A flight around the Mandelbulb
==============================

One picture a step, ready for a film: ``python examples/fly_around.py [FOLDER] [STEPS] [WIDTHxHEIGHT]``.
"""

import sys
from pathlib import Path

from PIL import Image

from fracslice import read, render
from fracslice.scene import library
from fracslice.scene.view import Camera

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else 24
width, height = map(int, (sys.argv[3] if len(sys.argv) > 3 else "480x300").split("x"))

# %%
# The camera starts where the whole object is in view.

scene = read(library.path("mandelbulb"))
start = Camera.around(scene.root.bounds.box)
for step in range(steps):
    camera = start.orbited(360 * step / steps)
    picture = render(scene, size=(width, height), samples=16, camera=camera)
    Image.fromarray(picture).save(folder / f"step{step:03}.png")
