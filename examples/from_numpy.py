"""
An implant of a NumPy function
==============================

Numbers of a grid become a solid with graded pores: ``python examples/from_numpy.py [FILE] [RESOLUTION]``.
"""

import sys

import numpy as np

from fracslice import from_grid, gyroid, make_mesh

target = sys.argv[1] if len(sys.argv) > 1 else "implant.3mf"
resolution = float(sys.argv[2]) if len(sys.argv) > 2 else 192

# %%
# Densities on a grid, as of a scan: a wedge with a round head. What is denser than ``iso`` is inside.

STEP = 0.5  # mm
x, y, z = np.meshgrid(*(np.arange(-n, n + STEP, STEP) for n in (12, 9, 18)), indexing="ij")
shaft = 1 - (x / (7 + z / 6)) ** 4 - (y / 5) ** 4 - (z / 16) ** 8
head = 1.2 - ((x / 9) ** 2 + (y / 7) ** 2 + ((z - 11) / 5) ** 2)
bone = from_grid(np.maximum(shaft, head), STEP, iso=0.0, kind="density", origin=(-12, -9, -18))

# %%
# A wall above, and a gyroid whose walls get thinner downwards.

pores = bone & gyroid(period=4, thickness=0.7, grade=(0, 0, 0.02))
implant = bone.shell(0.8) & (bone + (0, 0, 12)) | pores

mesh = make_mesh(implant, resolution=resolution, keep="largest")
mesh.export(target)
print(mesh, f"{mesh.volume / make_mesh(bone, resolution=96).volume:.0%} of the solid", mesh.report.problems)
