"""
A family of Mandelbulbs
=======================

One shape, several objects, each as a small STL: ``python examples/a_family.py [FOLDER] [RESOLUTION]
[LAST POWER]``.
"""

import sys
from pathlib import Path

from fracslice import make_mesh, mandelbulb

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
resolution = float(sys.argv[2]) if len(sys.argv) > 2 else 160
last = int(sys.argv[3]) if len(sys.argv) > 3 else 9

for power in range(2, last + 1):
    mesh = make_mesh(mandelbulb(power), size="3cm", resolution=resolution, keep="largest")
    mesh.export(folder / f"mandelbulb-{power}.stl")
    print(f"power {power}: {mesh.volume:.0f} mm3, {len(mesh.faces)} triangles")
