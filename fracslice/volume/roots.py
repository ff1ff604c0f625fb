"""Where a field is zero on many segments at once: the loops that its compiled kernel runs, and their rounds.

A segment is six rows: where it starts, and from there to its end; a root is a share t of it. Every lane is
for itself: what it finds does not depend on its neighbours, nor on how the segments are dealt out.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import lru_cache

import numpy as np

from ..formulas import vocabulary
from ..formulas.registry import Node
from ..kernel import Compilable, compile_scene
from ..kernel.cpu import Precision, lane_count, load_functions
from ..kernel.linker import Linked, link
from ..kernel.loops import Loop

FIND = Loop(
    "find",
    "rrrrrrrrrn",
    """
def find(P, FRAME, X, Y, Z, DX, DY, DZ, T, n):
    over = FRAME[0]
    small = FRAME[1]
    near = FRAME[2]
    for i in range(0, n, WIDTH):
        x = load(X, i)
        y = load(Y, i)
        z = load(Z, i)
        dx = load(DX, i)
        dy = load(DY, i)
        dz = load(DZ, i)
        fa = over * field(x, y, z, P)
        fb = over * field(x + dx, y + dy, z + dz, P)
        a = 0.0 * x
        b = a + 1.0
        t = where((fa < 0.0) & (fb < 0.0), where(fa > fb, a, b), where(fa < fb, a, b))
        open = ((fa < 0.0) & (fb >= 0.0)) | ((fa >= 0.0) & (fb < 0.0))
        u = fa / (fa - fb)
        for step in range(40):
            if not any_of(open):
                break
            t = where(open, a + u * (b - a), t)
            f = over * field(x + t * dx, y + t * dy, z + t * dz, P)
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
            ab = fb - fa
            ac = fc - fa
            u = fa * (place * fc * ac + (1.0 - place) * fb * ab) / (place * ab * ac * (fb - fc))
            least = 0.5 * near / absolute(b - a)
            u = minimum(maximum(where(bent, u, 0.5), least), 1.0 - least)
            open = open & (absolute(f) > small) & (absolute(b - a) > near)
        store(T, i, t)
""",
)
"""The root T on each of n segments, from X, Y, Z to as much further as DX, DY, DZ say, as a share of it;
where the ends have one sign, the end nearer to zero. Inverse quadratic interpolation wherever it is safe,
else bisection (Chandrupatla 1997, "A new hybrid quadratic/bisection algorithm for finding the zero of a
nonlinear function without using derivatives"), from the secant's point on.

FRAME: what f is multiplied by, one over a voxel; a root is where |f| is below the second number, or known to
the third.
"""

POLISH = Loop(
    "polish",
    "rrrrrrrrrrrrrn",
    """
def polish(P, FRAME, X, Y, Z, DX, DY, DZ, T, NX, NY, NZ, MISS, n):
    over = FRAME[0]
    e = FRAME[3]
    for i in range(0, n, WIDTH):
        x0 = load(X, i)
        y0 = load(Y, i)
        z0 = load(Z, i)
        dx = load(DX, i)
        dy = load(DY, i)
        dz = load(DZ, i)
        t = load(T, i)
        x = x0 + t * dx
        y = y0 + t * dy
        z = z0 + t * dz
        f = field(x, y, z, P)
        gx = field(x + e, y, z, P) - f
        gy = field(x, y + e, z, P) - f
        gz = field(x, y, z + e, P) - f
        over_length = rsqrt(maximum(gx * gx + gy * gy + gz * gz, 1e-200))
        store(NX, i, gx * over_length)
        store(NY, i, gy * over_length)
        store(NZ, i, gz * over_length)
        moved = t - e * f / (gx * dx + gy * dy + gz * dz)
        moved = minimum(maximum(moved, 0.0), 1.0)
        there = field(x0 + moved * dx, y0 + moved * dy, z0 + moved * dz, P)
        nearer = absolute(there) < absolute(f)
        store(T, i, where(nearer, moved, t))
        store(MISS, i, over * absolute(where(nearer, there, f)))
""",
)
"""One of Newton's steps along the segment from T, kept if it comes nearer; the unit normal where it started,
by differences over FRAME[3]; and |f| where it ended, times FRAME[0].
"""

FINEST = {"float32": (1e-5, 1e-5), "float64": (1e-8, 1e-7)}
"""When a root is found: |f| in voxels, and what is left of the segment, where f jumps or nearly does."""

REACH = 1e-5
"""The differences' step, in voxels."""


class Roots:
    """The loops over one scene's field. Safe to call from many threads at once.

    precision: "float32" or "float64". voxel: scene units. Segments are float [6, n] of that precision, n a
    multiple of `width`. Where the root is not a scene tree its own kernel is called, on NumPy's arrays.
    """

    def __init__(self, root: Node | Compilable, precision: Precision, voxel: float) -> None:
        self.dtype = np.dtype(precision)
        self._frame = np.array([1 / voxel, *FINEST[precision], REACH * voxel], self.dtype)
        if isinstance(root, Node):
            linked = link(root)
            made = _compiled(linked.source, linked.parameters.tobytes(), precision)
        else:
            made = _on_arrays(root, precision)
        self.width, self._functions = made

    def padded(self, index: np.ndarray) -> np.ndarray:
        """The numbers of some segments, the last one repeated until they fill their lanes."""
        return np.concatenate([index, np.repeat(index[-1:], -len(index) % self.width)])

    def found(self, segments: np.ndarray) -> np.ndarray:
        """The roots, [n], as shares of the segments; where the ends have one sign, the end nearer to zero."""
        roots = np.empty((1, segments.shape[1]), self.dtype)
        self._functions["find"](self._frame, segments, roots)
        found: np.ndarray = roots[0]
        return found

    def polished(self, segments: np.ndarray, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Roots brought nearer, [n], the field's unit normals there, [3, n], and |f| in voxels, [n]."""
        out = np.empty((5, len(roots)), self.dtype)
        out[0] = roots
        self._functions["polish"](self._frame, segments, out)
        return out[0], out[1:4], out[4]


Run = Callable[[np.ndarray, np.ndarray, np.ndarray], None]
"""A loop on its frame, the rows that it reads and those that it writes, both C-contiguous."""


def _places(rows: np.ndarray) -> Iterable[int]:
    """The addresses of the rows of an array."""
    start, step = rows.ctypes.data, rows.strides[0]
    return range(start, start + len(rows) * step, step)


@lru_cache(maxsize=32)
def _compiled(source: str, numbers: bytes, precision: Precision) -> tuple[int, dict[str, Run]]:
    """How many lanes the compiled loops take at once, and these by name."""
    parameters = np.frombuffer(numbers).astype(precision)
    bits = parameters.dtype.itemsize * 8

    def runs(function: Callable[..., None]) -> Run:
        def run(frame: np.ndarray, segments: np.ndarray, out: np.ndarray) -> None:
            places = (*_places(segments), *_places(out))
            function(parameters.ctypes.data, frame.ctypes.data, *places, segments.shape[1])

        return run

    loops, width = (FIND,) if bits == 32 else (FIND, POLISH), lane_count(bits)
    functions = load_functions(Linked(source, parameters), bits, width, loops)
    return width, {name: runs(function) for name, function in functions.items()}


def _on_arrays(root: Compilable, precision: Precision) -> tuple[int, dict[str, Run]]:
    """The same texts run by NumPy, for a field that is not linked: all segments are one vector."""
    kernel = compile_scene(root, precision)
    words = {
        **vars(vocabulary),
        "WIDTH": sys.maxsize,
        "load": lambda row, _: row,
        "store": lambda row, _, values: np.copyto(row, values),
        "field": lambda x, y, z, _: kernel.points(x, y, z),
    }

    def runs(loop: Loop) -> Run:
        exec(loop.source, words)

        def run(frame: np.ndarray, segments: np.ndarray, out: np.ndarray) -> None:
            with np.errstate(all="ignore"):
                words[loop.name](None, frame, *segments, *out, segments.shape[1])

        return run

    return 1, {loop.name: runs(loop) for loop in (FIND, POLISH)}
