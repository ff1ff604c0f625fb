"""
A bauble to print
=================

One Python expression becomes a file to print: ``python examples/build_and_mesh.py [FILE] [RESOLUTION]``.
"""

import json
import sys

from fracslice import MeshJob, Work, make_mesh, write
from fracslice.formulas import difference, mandelbulb, plane, shell, sphere, torus, transform, union
from fracslice.scene import Print, scene

target = sys.argv[1] if len(sys.argv) > 1 else "bauble.3mf"
resolution = float(sys.argv[2]) if len(sys.argv) > 2 else 256

# %%
# A hollow ball is cut open, a Mandelbulb looks out of it, and a ring is on top.

ball = difference(shell(sphere(radius=1.3), thickness=0.1), plane(normal=(0, 1, 0), offset=-0.3), smooth=0.05)
ring = transform(torus(radius=0.16, tube=0.06), translate=(0, 0.1, 1.42), rotate=(0, 1, 0, 90))
bauble = scene(
    union(ball, transform(mandelbulb(power=8), scale=1.05), ring, smooth=0.08), size="60mm", name="bauble"
)

# %%
# Of loose bodies only the largest stays. The report proves the mesh.


def show(stage: str, done: float) -> None:
    print(f"\r{stage:>10} {done:4.0%}", end="", file=sys.stderr)


result = make_mesh(
    bauble, MeshJob(resolution=resolution, printing=Print(keep="largest")), Work(progress=show)
)
write(result.mesh, target, {"Title": bauble.name})
print(json.dumps(result.report.as_dict(), indent=2))
