"""Rays on SIMD lanes: the rows of their state, and the march of a packet of them.

Packets are refilled: a lane whose ray is done takes the next ray at once, so no lane idles while rays are
left. The arrays are those of `packets`.
"""

from __future__ import annotations

from enum import IntEnum

from ..formulas.vocabulary import any_of, where
from ..kernel.intrinsics import WIDTH, load, store

Row = IntEnum(
    "Row", "ox oy oz dx dy dz start end side path t steps status r g b tr tg tb cover dense px py", start=0
)
"""State of a ray.

- ox, oy, oz, dx, dy, dz: origin and unit direction.
- start, end: interval of t to march.
- side: -1 inside the solid.
- path: length of the path before this ray; of a cone its half width at distance 1.
- status: 1 hit, 2 missed, 3 out of steps.
- r, g, b: light gathered.
- tr, tg, tb: throughput, the factor on light still to come.
- cover: 1 if the camera ray hit.
- dense: density of the direction, for frames whose lights are weighted.
- px, py: film position, the first two random numbers. The other random numbers are in the rows after them.
"""
Lane = IntEnum("Lane", "ox oy oz dx dy dz start end side path t steps done before stride", start=0)
"""State of a ray in a packet. The first ten entries are those of `Row`."""


def load_vector(W, row, m, i):
    """Load three consecutive rows of rays.

    Parameters
    ----------
    W : pointer to float
        Workspace or lanes.
    row : int
        First row.
    m : int
        Numbers per row.
    i : int
        First ray.

    Returns
    -------
    tuple of lanes
        WIDTH numbers of each row.
    """
    return load(W, row * m + i), load(W, (row + 1) * m + i), load(W, (row + 2) * m + i)


def store_vector(W, row, m, i, a, b, c):
    """Store three consecutive rows of rays.

    Parameters
    ----------
    row : int
        First row.
    m : int
        Numbers per row.
    i : int
        First ray.
    a, b, c : lanes
        WIDTH numbers of each row.
    """
    store(W, row * m + i, a)
    store(W, (row + 1) * m + i, b)
    store(W, (row + 2) * m + i, c)


def follow(W, L, rays, n, m, limit, P, step):
    """March n rays until each has hit, missed or run out of steps.

    A ray has missed once its free distance exceeds its end; an over-relaxed step beyond the end does not
    count.
    """
    for lane in range(WIDTH):
        rays[lane] = -1
        L[Lane.done * WIDTH + lane] = 1.0
    under_way = 0
    following = 0
    while True:
        for lane in range(WIDTH):
            if L[Lane.done * WIDTH + lane] > 0.0:
                under_way -= finish(W, L, rays, m, lane)
                following = skip_missed(W, m, n, following)
                L[Lane.before * WIDTH + lane] = 0.0
                L[Lane.stride * WIDTH + lane] = 0.0
                L[Lane.steps * WIDTH + lane] = 0.0
                if following < n:
                    take(W, L, rays, m, lane, following)
                    following += 1
                    under_way += 1
                else:
                    idle(L, rays, lane)
        if under_way == 0:
            break
        march(L, limit, P, step)


def finish(W, L, rays, m, lane):
    """Write the result of a lane's ray.

    Returns
    -------
    int
        1 if the lane held a ray, else 0.
    """
    i = rays[lane]
    if i < 0:
        return 0
    W[Row.t * m + i] = L[Lane.t * WIDTH + lane]
    W[Row.steps * m + i] = L[Lane.steps * WIDTH + lane]
    W[Row.status * m + i] = L[Lane.done * WIDTH + lane]
    return 1


def skip_missed(W, m, n, i):
    """Mark rays with an empty interval as missed, from ray i on.

    Parameters
    ----------
    m, n, i : int
        Numbers per row of W, rays, first ray.

    Returns
    -------
    int
        Index of the first ray to march, or n.
    """
    while i < n and W[Row.start * m + i] >= W[Row.end * m + i]:
        W[Row.status * m + i] = 2.0
        W[Row.steps * m + i] = 0.0
        W[Row.t * m + i] = 0.0
        i += 1
    return i


def take(W, L, rays, m, lane, i):
    """Load a ray into a lane.

    Parameters
    ----------
    m, lane, i : int
        Numbers per row of W, the lane, the ray.
    """
    for k in range(Row.path + 1):
        L[k * WIDTH + lane] = W[k * m + i]
    L[Lane.t * WIDTH + lane] = W[Row.start * m + i]
    rays[lane] = i


def idle(L, rays, lane):
    """Park a lane without a ray far from the scene."""
    for k in range(Lane.dz + 1):
        L[k * WIDTH + lane] = 1e4
    L[Lane.end * WIDTH + lane] = 1e30
    L[Lane.side * WIDTH + lane] = 1.0
    L[Lane.path * WIDTH + lane] = 0.0
    L[Lane.t * WIDTH + lane] = 1.0
    rays[lane] = -1


def march(L, limit, P, step):
    """Step all lanes until at least one is done."""
    ox, oy, oz = load_vector(L, Lane.ox, WIDTH, 0)
    dx, dy, dz = load_vector(L, Lane.dx, WIDTH, 0)
    end = load(L, Lane.end * WIDTH)
    side = load(L, Lane.side * WIDTH)
    path = load(L, Lane.path * WIDTH)
    t = load(L, Lane.t * WIDTH)
    steps = load(L, Lane.steps * WIDTH)
    before = load(L, Lane.before * WIDTH)
    stride = load(L, Lane.stride * WIDTH)
    while True:
        t, before, stride, gap = step(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P)
        steps = steps + 1.0
        free = where(stride > 0.0, t - stride + before, t)
        done = where(gap < 0.0, 1.0, where(free > end, 2.0, where(steps < limit, 0.0 * steps, 3.0)))
        if any_of(done > 0.0):
            break
    store(L, Lane.t * WIDTH, t)
    store(L, Lane.steps * WIDTH, steps)
    store(L, Lane.before * WIDTH, before)
    store(L, Lane.stride * WIDTH, stride)
    store(L, Lane.done * WIDTH, done)
