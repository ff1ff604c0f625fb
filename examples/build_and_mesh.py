"""
A bauble to print
=================

One Python expression becomes a file to print: ``python examples/build_and_mesh.py [FILE] [RESOLUTION]``.
"""

import json
import sys

from fracslice import make_mesh, mandelbulb, plane, sphere, torus

target = sys.argv[1] if len(sys.argv) > 1 else "bauble.3mf"
resolution = float(sys.argv[2]) if len(sys.argv) > 2 else 256

# %%
# A hollow ball is cut open, a Mandelbulb looks out of it, and a ring is on top.

ball = sphere(1.3).shell(0.1).difference(plane(normal=(0, 1, 0), offset=-0.3), smooth=0.05)
ring = torus(0.16, 0.06).rotate(90, "y") + (0, 0.1, 1.42)
bauble = ball.union(mandelbulb(8).scale(1.05), ring, smooth=0.08)

# %%
# Of the connected components only the largest stays. The report proves the mesh.


def show(stage: str, done: float) -> None:
    print(f"\r{stage:>10} {done:4.0%}", end="", file=sys.stderr)


mesh = make_mesh(bauble, size="60mm", resolution=resolution, keep="largest", progress=show)
mesh.export(target, {"Title": "bauble"})
print(json.dumps(mesh.report.as_dict(), indent=2))
