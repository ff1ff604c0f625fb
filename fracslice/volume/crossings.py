"""Where exactly the surface crosses the grid's edges, and its normals there.

A vertex moves along its own grid edge only, strictly between the edge's ends, so refining cannot fold or
pierce a mesh whose triangles stay in their cells.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..formulas import vocabulary
from ..formulas.registry import Node
from ..kernel import Compilable, compile_scene
from ..kernel.cpu import lane_count, load_functions
from ..kernel.linker import link
from ..kernel.loops import Loop
from ..work import Work, chunks

Run = Callable[[np.ndarray, np.ndarray], None]
"""Fills rows 6 to 9 from rows 0 to 5, float64 [10, n]."""

CROSSINGS = Loop(
    "crossings",
    "rrrrrrrrrrrrn",
    """
def crossings(P, FRAME, X, Y, Z, DX, DY, DZ, T, NX, NY, NZ, n):
    small = FRAME[0]
    reach = FRAME[1]
    near = FRAME[2]
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
        u = fa / (fa - fb)
        for step in range(40):
            if not any_of(open):
                break
            t = where(open, a + u * (b - a), t)
            f = field(x + t * dx, y + t * dy, z + t * dz, P)
            same = ((f < 0.0) & (fa < 0.0)) | ((f >= 0.0) & (fa >= 0.0))
            c = where(same, a, b)
            fc = where(same, fa, fb)
            b = where(same, b, a)
            fb = where(same, fb, fa)
            a = t
            fa = f
            place = (a - b) / (c - b)
            share = (fa - fb) / (fc - fb)
            bent = (share * share < place) & ((1.0 - share) * (1.0 - share) < 1.0 - place)
            u = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            least = 0.5 * near / absolute(b - a)
            u = minimum(maximum(where(bent, u, 0.5), least), 1.0 - least)
            open = open & (absolute(f) > small) & (absolute(b - a) > near)
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
"""Inverse quadratic interpolation wherever it is safe, else bisection (Chandrupatla 1997, "A new hybrid
quadratic/bisection algorithm for finding the zero of a nonlinear function without using derivatives"), from
the secant's point on; normals by tetrahedral differences.
"""

PRECISION = 1e-8
"""A root is where |f| is this part of a voxel ..."""

BRACKET = 1e-7
"""... or known to this part of an edge, where the field jumps or nearly does."""

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
    root: Node | Compilable,
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
    run, width = _compiled(root) if isinstance(root, Node) else _on_arrays(root)
    n = len(ijk)
    t, normals = np.empty(n), np.empty((n, 3))
    frame = np.array([PRECISION * voxel, REACH * voxel, BRACKET])
    start = np.asarray(origin)[:, None]

    def task(part: slice) -> None:
        count = part.stop - part.start
        rows = np.zeros((10, -(-count // width) * width))
        rows[:3, :count] = start + voxel * ijk[part].T
        rows[3 + axis[part], np.arange(count)] = voxel
        run(frame, rows)
        t[part], normals[part] = rows[6, :count], rows[7:, :count].T

    (work or Work()).map(task, chunks(n, 1 << 13))
    return Crossings(t, normals)


def _compiled(root: Node) -> tuple[Run, int]:
    """The loop over a scene's field, and how many lanes it takes at once."""
    linked, width = link(root), lane_count(64)
    run = load_functions(linked, 64, width, (CROSSINGS,))["crossings"]
    parameters = np.ascontiguousarray(linked.parameters)

    def call(frame: np.ndarray, rows: np.ndarray) -> None:
        places = (row.ctypes.data for row in rows)
        run(parameters.ctypes.data, frame.ctypes.data, *places, rows.shape[1])

    return call, width


def _on_arrays(root: Compilable) -> tuple[Run, int]:
    """The same text run by NumPy, for a field that is not linked: all edges are one vector."""
    kernel = compile_scene(root, "float64")
    words = {
        **vars(vocabulary),
        "WIDTH": sys.maxsize,
        "load": lambda row, _: row,
        "store": lambda row, _, values: np.copyto(row, values),
        "field": lambda x, y, z, _: kernel.points(x, y, z),
    }
    exec(CROSSINGS.source, words)

    def call(frame: np.ndarray, rows: np.ndarray) -> None:
        with np.errstate(all="ignore"):
            words["crossings"](None, frame, *rows, rows.shape[1])

    return call, 1
