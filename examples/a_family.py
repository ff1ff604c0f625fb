"""
A family of Mandelbulbs
=======================

One scene, several objects, each as a small STL: ``python examples/a_family.py [FOLDER] [RESOLUTION]``.
"""

import sys
from pathlib import Path

from fracslice import MeshJob, make_mesh, read, write
from fracslice.scene import Print, library

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
resolution = float(sys.argv[2]) if len(sys.argv) > 2 else 160

# %%
# ``with_values`` changes a scene as ``--set`` does.

bulb = read(library.path("mandelbulb"))
for power in range(2, 10):
    member = bulb.with_values([f"mandelbulb.power={power}", "solid.size=3cm"])
    result = make_mesh(member, MeshJob(resolution=resolution, printing=Print(keep="largest")))
    write(result.mesh, folder / f"mandelbulb-{power}.stl")
    volume = result.report.mesh.volume_mm3
    print(f"power {power}: {volume:.0f} mm3, {result.report.mesh.triangles} triangles")
