"""Where exactly the surface crosses the grid's edges, and its normals there.

A vertex moves along its own grid edge only, strictly between the edge's ends, so refining cannot fold or
pierce a mesh whose triangles stay in their cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..formulas.registry import Node
from ..kernel import Compilable, Kernel, compile_scene
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
    if not isinstance(root, Node):
        return _by_points(root, np.asarray(origin) + voxel * ijk, axis, voxel, work or Work())
    linked = link(root)
    width = lane_count(64)
    run = load_functions(linked, 64, width, (CROSSINGS,))["crossings"]
    n = len(ijk)
    t, normals = np.empty(n), np.empty((n, 3))
    frame = np.array([PRECISION * voxel, REACH * voxel, BRACKET])
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


def _by_points(root: Compilable, lower: np.ndarray, axis: np.ndarray, voxel: float, work: Work) -> Crossings:
    """The same for a field without a loop of its own. lower: float64 [n, 3], the edges' lower ends."""
    kernel = compile_scene(root, "float64")
    t, normals = np.empty(len(lower)), np.empty((len(lower), 3))

    def task(part: slice) -> None:
        start, along = lower[part].T, voxel * np.eye(3)[:, axis[part]]
        t[part] = _roots(kernel, start, along, PRECISION * voxel)
        at, e = start + t[part] * along, REACH * voxel
        corners = [kernel.points(*(at + e * np.array(way)[:, None])) for way in _TETRAHEDRON]
        slope = sum(np.multiply.outer(way, f) for way, f in zip(_TETRAHEDRON, corners, strict=True))
        normals[part] = (slope / np.maximum(np.linalg.norm(slope, axis=0), 1e-100)).T

    work.map(task, chunks(len(lower), 1 << 13))
    return Crossings(t, normals)


_TETRAHEDRON = ((1, -1, -1), (-1, -1, 1), (-1, 1, -1), (1, 1, 1))


def _roots(kernel: Kernel, start: np.ndarray, along: np.ndarray, small: float) -> np.ndarray:
    """Where the field changes its sign between start and start + along, [3, n], as a share."""
    a, b = np.zeros(start.shape[1]), np.ones(start.shape[1])
    fa, fb = kernel.points(*start), kernel.points(*(start + along))
    t = np.where((fa < 0) == (fa < fb), b, a)
    rows = np.flatnonzero((fa < 0) != (fb < 0))
    a, b, fa, fb = a[rows], b[rows], fa[rows], fb[rows]
    for step in range(40):
        if not len(rows):
            break
        u = (a + b) / 2 if step % 3 == 2 else np.clip((a * fb - b * fa) / (fb - fa), a, b)
        f = kernel.points(*(start[:, rows] + u * along[:, rows]))
        t[rows] = u
        left = (f < 0) == (fa < 0)
        a, b = np.where(left, u, a), np.where(left, b, u)
        fa, fb = np.where(left, f, fa / 2), np.where(left, fb / 2, f)
        open_ = (np.abs(f) > small) & (b - a > 1e-13)
        rows, a, b, fa, fb = rows[open_], a[open_], b[open_], fa[open_], fb[open_]
    return t
