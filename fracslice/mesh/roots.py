"""Roots of a field on many segments at once: loops for lanes of a CPU and threads of a GPU.

P holds the parameters of the scene. X, Y and Z hold n points, scene units, or the starts of n segments; then
DX, DY and DZ hold the vectors to their ends. n is a multiple of WIDTH.

Entries of FRAME: 0: reciprocal of the voxel size. 1: |f| in voxels at which a root is accepted. 2: remaining
bracket, as a fraction of the segment, at which a root is accepted. 3: step of the finite differences, scene
units. 4: distance that counts as no clearance, scene units. 5: length of the last step, as a fraction of the
segment.

A segment is six rows: its start, and the vector to its end; a root is a fraction t of it. Each lane is
independent: its result does not depend on its neighbours or on the order of the segments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..expr.loops import WIDTH, field, load, loop, shares, store
from ..expr.runtime import constant
from ..expr.vocabulary import absolute, any_of, maximum, minimum, rsqrt, where
from ..fields.field import Device, Field, Precision
from ..work import Work, chunks

STEPS = 48
"""Largest number of steps to a root."""

APPROACH = 128
"""Largest number of steps from either end of a segment."""


@loop("rrrrrrrrrn")
def find(P, FRAME, X, Y, Z, DX, DY, DZ, T, n):
    """Find one root on each of n segments.

    Fields are steep on one side of their surface and flat on the other, so the secant goes through the last
    two points on one side. If it leaves the bracket, the bracket is halved; after many steps every other step
    halves it too.

    `T`: [n].
    """
    over, small, near, close = FRAME[0], FRAME[1], FRAME[2], FRAME[5]
    for i in shares(n, WIDTH):
        x, y, z = load(X, i), load(Y, i), load(Z, i)
        dx, dy, dz = load(DX, i), load(DY, i), load(DZ, i)
        fa = 0.0 * x
        fb = fa
        for end in range(2):
            fa = fb
            fb = over * field(x + end * dx, y + end * dy, z + end * dz, P)
        a = 0.0 * x
        b = a + 1.0
        t = where((fa < 0.0) & (fb < 0.0), where(fa > fb, a, b), where(fa < fb, a, b))
        open = ((fa < 0.0) & (fb >= 0.0)) | ((fa >= 0.0) & (fb < 0.0))
        u = fa / (fa - fb)
        for step in range(STEPS):
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
            u = fa * (c - a) / ((fa - fc) * (b - a))
            within = (u > 0.0) & (u < 1.0)
            last = a + u * (b - a)
            off = where(within, absolute(last - a), 1.0)
            t = where(open & (off <= close), last, t)
            open = open & (off > close) & (absolute(f) > small) & (absolute(b - a) > near)
            least = 0.5 * near / absolute(b - a)
            u = where(within, minimum(maximum(u, least), 1.0 - least), 0.5)
            if step > 8 and step % 2 > 0:
                u = 0.5 + 0.0 * x
        store(T, i, t)


@loop("rrrrrrrrrrrrrn")
def polish(P, FRAME, X, Y, Z, DX, DY, DZ, T, NX, NY, NZ, MISS, n):
    """Take one Newton step along each of n segments.

    `T`: [n]; `NX`, `NY`, `NZ`: [n] each; `MISS`: [n].
    """
    e = FRAME[3]
    for i in shares(n, WIDTH):
        dx, dy, dz, t = load(DX, i), load(DY, i), load(DZ, i), load(T, i)
        x = load(X, i) + t * dx
        y = load(Y, i) + t * dy
        z = load(Z, i) + t * dz
        f = field(x, y, z, P)
        gx = 0.0 * x
        gy = gx
        gz = gx
        for k in range(3):
            gx = gy
            gy = gz
            gz = field(x + e * (k == 0), y + e * (k == 1), z + e * (k == 2), P) - f
        over_length = rsqrt(maximum(gx * gx + gy * gy + gz * gz, 1e-200))
        store(NX, i, gx * over_length)
        store(NY, i, gy * over_length)
        store(NZ, i, gz * over_length)
        moved = minimum(maximum(t - e * f / (gx * dx + gy * dy + gz * dz), 0.0), 1.0)
        store(T, i, moved)
        store(MISS, i, absolute(moved - t))


@loop("rrrrrrrrrrn")
def aim(P, FRAME, X, Y, Z, DX, DY, DZ, T, MISS, n):
    """Take one Newton step along each of n segments if it comes nearer to zero.

    `T`: [n]; `MISS`: receives |f| at the new roots in voxels, [n].
    """
    over = FRAME[0]
    for i in shares(n, WIDTH):
        x, y, z = load(X, i), load(Y, i), load(Z, i)
        dx, dy, dz, t = load(DX, i), load(DY, i), load(DZ, i), load(T, i)
        e = FRAME[3] * rsqrt(maximum(dx * dx + dy * dy + dz * dz, 1e-200))
        f = field(x + t * dx, y + t * dy, z + t * dz, P)
        best = t
        least = f
        s = t + e
        for _ in range(2):
            there = field(x + s * dx, y + s * dy, z + s * dz, P)
            nearer = absolute(there) < absolute(least)
            best = where(nearer, s, best)
            least = where(nearer, there, least)
            s = minimum(maximum(t - e * f / (there - f), 0.0), 1.0)
        store(T, i, best)
        store(MISS, i, over * absolute(least))


@loop("rrrrrrrrrrrrrrrrrrrrn")
def lead(P, FRAME, X, Y, Z, LX, LY, LZ, HX, HY, HZ, OX, OY, OZ, MX, MY, MZ, DX, DY, DZ, n):
    """Compute the vector from each of n points towards the surface.

    The vector follows the gradient, by central differences so that neither side is preferred at an edge. Its
    length is four Newton steps, limited by the point's trust region. If it does not reach the surface (within
    rounding), the vector O replaces it, unless that is NaN. A coordinate without clearance is kept. Slopes
    below 0.1 count as 0.1, so that no step is longer than ten times |f|.

    If the slopes on both sides of a point differ little (by less than 25 degrees: their difference is then 2
    tan(12.5 deg) of their mean, its square 0.05 of theirs) the field is smooth there and no edge is near. The
    planes that met in the point then belong to a bend that is rounder, or folded finer, than they indicate.
    The vector is then M, if the surface lies between.

    `LX`, `LY`, `LZ`, `HX`, `HY`, `HZ`, `OX`, `OY`, `OZ`, `MX`, `MY`, `MZ`, `DX`, `DY`, `DZ`: [n] each, scene
    units.
    """
    e, tight = FRAME[3], FRAME[4]
    for i in shares(n, WIDTH):
        x, y, z = load(X, i), load(Y, i), load(Z, i)
        gx = 0.0 * x
        gy, gz, bx, by, bz, f = gx, gx, gx, gx, gx, gx
        for k in range(7):
            ex = (k == 0) - 1.0 * (k == 1)
            ey = (k == 2) - 1.0 * (k == 3)
            ez = (k == 4) - 1.0 * (k == 5)
            f = field(x + e * ex, y + e * ey, z + e * ez, P)
            gx = gx + ex * f
            gy = gy + ey * f
            gz = gz + ez * f
            bx = bx + absolute(ex) * f
            by = by + absolute(ey) * f
            bz = bz + absolute(ez) * f
        bx = bx - 2.0 * f
        by = by - 2.0 * f
        bz = bz - 2.0 * f
        smooth = bx * bx + by * by + bz * bz < 0.05 * (gx * gx + gy * gy + gz * gz)
        sign = where(f < 0.0, 1.0 + 0.0 * x, -1.0)
        lx = where(sign * gx > 0.0, load(HX, i), load(LX, i))
        ly = where(sign * gy > 0.0, load(HY, i), load(LY, i))
        lz = where(sign * gz > 0.0, load(HZ, i), load(LZ, i))
        gx = where(lx > tight, gx, 0.0)
        gy = where(ly > tight, gy, 0.0)
        gz = where(lz > tight, gz, 0.0)
        size = 8.0 * e * f / maximum(gx * gx + gy * gy + gz * gz, 0.04 * e * e)
        gx = -size * gx
        gy = -size * gy
        gz = -size * gz
        share = minimum(1.0, where(absolute(gx) > 0.0, lx / absolute(gx), 1.0))
        share = minimum(share, where(absolute(gy) > 0.0, ly / absolute(gy), 1.0))
        share = minimum(share, where(absolute(gz) > 0.0, lz / absolute(gz), 1.0))
        gx = share * gx
        gy = share * gy
        gz = share * gz
        there = field(x + gx, y + gy, z + gz, P)
        ox = load(OX, i)
        away = (sign * there < 0.0) & (absolute(there) > 2e-5 * absolute(f))
        away = away & (ox == ox)
        gx = where(away, ox, gx)
        gy = where(away, load(OY, i), gy)
        gz = where(away, load(OZ, i), gz)
        mx, my, mz = load(MX, i), load(MY, i), load(MZ, i)
        between = smooth & (mx == mx) & (sign * field(x + mx, y + my, z + mz, P) > 0.0)
        store(DX, i, where(between, mx, gx))
        store(DY, i, where(between, my, gy))
        store(DZ, i, where(between, mz, gz))


@loop("rrrrrrrrrrrrn")
def approach(P, FRAME, X, Y, Z, DX, DY, DZ, FA, FB, TA, TB, n):
    """Go along each of n segments from both ends until the field has not the sign of that end, or both meet.

    A step is as long as the field proves to have one sign, or as the finest step. FRAME: reciprocal of the
    Lipschitz constant; finest step, scene units.

    `FA`, `FB`: the field at the ends, [n]; `TA`, `TB`: receive where the sign has changed, as a fraction t of
    the segment, or -1 - t where they met without, [n].
    """
    free, finest = FRAME[0], FRAME[1]
    for i in shares(n, WIDTH):
        x, y, z = load(X, i), load(Y, i), load(Z, i)
        dx, dy, dz = load(DX, i), load(DY, i), load(DZ, i)
        over = rsqrt(maximum(dx * dx + dy * dy + dz * dz, 1e-200))
        least, reach = finest * over, free * over
        fa, fb = load(FA, i), load(FB, i)
        one, other = where(fa < 0.0, 0.0 * x - 1.0, 1.0), where(fb < 0.0, 0.0 * x - 1.0, 1.0)
        fa, fb = absolute(fa), absolute(fb)
        a = 0.0 * x
        b = a + 1.0
        going = least < 1.0
        before, behind = a < 1.0, a < 1.0
        for _ in range(APPROACH):
            if not any_of(going):
                break
            there = where(before, a + maximum(fa * reach, least), a)
            going = going & (there < b)
            a = where(going, there, a)
            fa = one * field(x + a * dx, y + a * dy, z + a * dz, P)
            before = before & ((fa >= 0.0) | (a <= 0.0))
            there = where(behind, b - maximum(fb * reach, least), b)
            going = going & (there > a)
            b = where(going, there, b)
            fb = other * field(x + b * dx, y + b * dy, z + b * dz, P)
            behind = behind & ((fb >= 0.0) | (b >= 1.0))
            going = going & (before | behind)
        store(TA, i, where(before, -1.0 - a, a))
        store(TB, i, where(behind, -1.0 - b, b))


@loop("hxxxxdfnn")
def lay(E, ox, oy, oz, h, R, S, stride, n):
    """Lay n grid edges out as segments, on a GPU.

    `E`: [n, 4]; `ox`, `oy`, `oz`, `h` in scene units; `R`, `S`: six rows of `stride` numbers.
    """
    for i in shares(n, 1):
        R[i] = ox + h * E[4 * i]
        R[stride + i] = oy + h * E[4 * i + 1]
        R[2 * stride + i] = oz + h * E[4 * i + 2]
        for k in range(3):
            R[(3 + k) * stride + i] = h if E[4 * i + 3] == k else 0.0
        for k in range(6):
            S[k * stride + i] = R[k * stride + i]


@loop("rdn")
def start(U, T, n):
    """Start `polish` from the roots of `find`, on a GPU.

    `U`: roots of `find`; `T`: receives them.
    """
    for i in shares(n, 1):
        T[i] = U[i]


@loop("rddfbxnn")
def collect(U, T, D, N, F, sure, stride, n):
    """Collect n results of `polish`, on a GPU; where a root is not exact, that of `find` stays.

    `U`: roots of `find`; `T`: roots of `polish`, modified in place; `D`, `N`: four and three rows of `stride`
    numbers; `F`: receives 1 for roots that are not exact, else 0.
    """
    for i in shares(n, 1):
        for k in range(3):
            N[k * stride + i] = D[k * stride + i]
        F[i] = 0
        if not D[3 * stride + i] <= sure:
            F[i] = 1
            T[i] = U[i]


SURE = 8e-5
"""Length of Newton's last step, as a fraction of a voxel, below which a root is exact: the error is of the
order of its square.
"""

FRAMES = {"float32": (1e-6, 1e-5, 5e-2, 1e-6, SURE), "float64": (1e-9, 1e-7, 1e-5, 1e-6, 1e-7)}
"""Entries of FRAME after the first, lengths in voxels. Ends of float32 at longer steps than `SURE` save fewer
steps than float64 then takes.
"""

LOOPS = {"float32": (find, lead), "float64": (find, polish, aim)}
"""Loops compiled for each precision."""


class Roots:
    """Root-finding loops of one scene's field. Thread-safe.

    Segments are float [6, n] of that precision; n is a multiple of `width`.

    `precision`: "float32" or "float64"; `voxel` in scene units.
    """

    def __init__(self, root: Field, precision: Precision, voxel: float, device: Device = "cpu") -> None:
        self.precision, self.dtype = precision, np.dtype(precision)
        small, near, reach, tight, close = FRAMES[precision]
        frame = np.array([1 / voxel, small, near, reach * voxel, tight * voxel, close])
        self.frame = constant(frame, self.dtype)
        loops = root.loops(LOOPS[precision], precision, device)
        self.width, self.batch, self.runs, self.on_gpu = loops.width, loops.batch, loops.runs, loops.on_gpu

    def native(self, name: str) -> tuple[Any, ...] | Callable[..., None]:
        """Return a loop for native code."""
        return self.runs[name].native(self.frame)


AT_ONCE = 1 << 10
"""Packets of segments per task."""


class Segments:
    """Loops over segments of a field in float64, by all threads.

    `voxel`, `finest` (the shortest step of `approach`) in scene units.
    """

    def __init__(self, root: Field, voxel: float, finest: float, work: Work) -> None:
        loops = root.loops((find, approach), "float64")
        self._width, self._work, self._runs = loops.width, work, loops.runs
        frames = {"find": [1 / voxel, *FRAMES["float64"]], "approach": [1 / root.bounds.lipschitz, finest]}
        self._frames = {
            name: constant(np.array(frame), np.dtype(np.float64)) for name, frame in frames.items()
        }

    def roots(self, starts: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Roots on segments, as fractions, [n].

        `starts`, `along`: float64 [3, n].
        """
        (roots,) = self._run("find", [*starts, *along], 1)
        return np.asarray(roots)

    def approach(self, starts: np.ndarray, along: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """See the loop, [2, n].

        `starts`, `along`: float64 [3, n]; `ends`: the field at both ends, [2, n].
        """
        return self._run("approach", [*starts, *along, *ends], 2)

    def _run(self, name: str, rows: list[np.ndarray], results: int) -> np.ndarray:
        """Run a loop on rows [n] by all threads; [results, n]."""
        n = len(rows[0])
        padded = np.zeros((len(rows), -(-max(n, 1) // self._width) * self._width))
        for row, own in zip(padded, rows, strict=True):
            row[:n] = own
        out = np.empty((results, padded.shape[1]))

        def task(part: slice) -> None:
            self._runs[name](self._frames[name], padded[:, part], out[:, part])

        self._work.map(task, chunks(padded.shape[1], AT_ONCE * self._width))
        return out[:, :n]
