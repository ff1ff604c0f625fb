"""Where exactly the surface crosses the grid's edges, and its normals there.

A vertex moves along its own grid edge only, strictly between the edge's ends, so refining cannot fold or
pierce a mesh whose triangles stay in their cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..formulas.registry import Node
from ..kernel.cpu import lane_count, load_functions
from ..kernel.linker import link
from ..kernel.loops import Loop
from ..work import Work, chunks

CROSSINGS = Loop(
    "crossings",
    "rrrrrrrrrrrrn",
    """
def crossings(P, FRAME, X, Y, Z, DX, DY, DZ, T, NX, NY, NZ, n):
    small = FRAME[0]
    reach = FRAME[1]
    for i in range(0, n, WIDTH):
        x = load(X, i)
        y = load(Y, i)
        z = load(Z, i)
        dx = load(DX, i)
        dy = load(DY, i)
        dz = load(DZ, i)
        fa = field(x, y, z, P)
        fb = field(x + dx, y + dy, z + dz, P)
        a = 0.0 * x
        b = a + 1.0
        t = where((fa < 0.0) & (fb < 0.0), where(fa > fb, a, b), where(fa < fb, a, b))
        open = ((fa < 0.0) & (fb >= 0.0)) | ((fa >= 0.0) & (fb < 0.0))
        for step in range(40):
            if not any_of(open):
                break
            mid = 0.5 * (a + b)
            u = mid
            if step % 3 != 2:
                u = minimum(maximum((a * fb - b * fa) / (fb - fa), a), b)
            f = field(x + u * dx, y + u * dy, z + u * dz, P)
            left = ((f < 0.0) & (fa < 0.0)) | ((f >= 0.0) & (fa >= 0.0))
            t = where(open, u, t)
            a = where(left, u, a)
            fb = where(left, 0.5 * fb, f)
            b = where(left, b, u)
            fa = where(left, f, 0.5 * fa)
            open = open & (absolute(f) > small) & (b - a > 1e-13)
        store(T, i, t)
        x = x + t * dx
        y = y + t * dy
        z = z + t * dz
        e = reach
        p = field(x + e, y - e, z - e, P)
        q = field(x - e, y - e, z + e, P)
        r = field(x - e, y + e, z - e, P)
        s = field(x + e, y + e, z + e, P)
        gx = (p + s) - (q + r)
        gy = (r + s) - (p + q)
        gz = (q + s) - (p + r)
        over = rsqrt(maximum(gx * gx + gy * gy + gz * gz, 1e-200))
        store(NX, i, gx * over)
        store(NY, i, gy * over)
        store(NZ, i, gz * over)
""",
)
"""Illinois' false position (Dowell and Jarratt 1971), each third step a bisection; normals by tetrahedral
differences.
"""

PRECISION = 1e-8
"""A root is where |f| is this part of a voxel."""

REACH = 1e-4
"""The differences' step, in voxels."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """t: float64 [n], where along each grid edge the surface crosses it. normals: float64 [n, 3], outward,
    unit.
    """

    t: np.ndarray
    normals: np.ndarray


def refine_crossings(
    root: Node,
    origin: tuple[float, float, float],
    voxel: float,
    ijk: np.ndarray,
    axis: np.ndarray,
    work: Work | None = None,
) -> Crossings:
    """The exact crossings of grid edges whose ends have opposite signs, by the float64 kernel.

    ijk: int32 [n, 3], the lower grid point of each edge; axis: uint8 [n]. Where the float64 field does not
    change its sign (it is smaller than float32 can tell at one end) t is that end.
    """
    linked = link(root)
    width = lane_count(64)
    run = load_functions(linked, 64, width, (CROSSINGS,))["crossings"]
    n = len(ijk)
    t, normals = np.empty(n), np.empty((n, 3))
    frame = np.array([PRECISION * voxel, REACH * voxel])
    parameters = np.ascontiguousarray(linked.parameters)
    start = np.asarray(origin)[:, None]

    def task(part: slice) -> None:
        count = part.stop - part.start
        rows = np.zeros((10, -(-count // width) * width))
        rows[:3, :count] = start + voxel * ijk[part].T
        rows[3 + axis[part], np.arange(count)] = voxel
        run(parameters.ctypes.data, frame.ctypes.data, *(row.ctypes.data for row in rows), rows.shape[1])
        t[part], normals[part] = rows[6, :count], rows[7:, :count].T

    (work or Work()).map(task, chunks(n, 1 << 13))
    return Crossings(t, normals)
