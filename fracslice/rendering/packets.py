"""Loops around the render units, from pixels to sums of light: of packets of rays on the lanes of a CPU, or
of one ray on a thread of a GPU.

Conventions:

- P holds the scene's parameters, Q the points of the sample sequence, S the distance at which the rays of
  each block of pixels start, A the sums of the picture. A block is 2^shift pixels wide.
- W is the workspace of a tile: one row per quantity in `Row`, m numbers each. The t of ray i is
  ``W[Row.t * m + i]``.
- L holds the packet under way: one row per quantity in `Lane`, WIDTH numbers each. `rays` holds the ray of
  each lane, -1 for none.
- `pixels` holds ``y << 16 | x``. `width` is that of the picture, pixels; `limit` the largest number of steps
  of a ray; `blocks` the number of blocks in a row of the picture; `frame` the linked frame.

Packets are refilled: a lane whose ray is done takes the next ray at once, so no lane idles while rays are
left. A thread has one ray, whose workspace is in its registers.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from enum import IntEnum

import numpy as np

from ..errors import Cancelled
from ..expr.loops import WIDTH, Loop, load, loop, shares, store, together
from ..expr.runtime import lane_count
from ..expr.vocabulary import any_of, where
from ..fields.cpu import load_functions, parameters
from ..work import Work, chunks
from .accumulator import CHANNELS, COUNT, COVER, GOAL, PassPlan, SampleRange
from .linking import Frame
from .units.camera import brightness, centred, clamped, sample
from .units.march import background, camera_ray, span_box, step_cone, step_ray, surface

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
- px, py: film position, the first two random numbers. The rows after them are the other random numbers of the
  camera ray, then those of the bounce under way.
"""
Lane = IntEnum("Lane", "ox oy oz dx dy dz start end side path t steps done before stride", start=0)
"""State of a ray in a packet. The first ten entries are those of `Row`."""


def load_vector(W, row, m, i):
    """Load three consecutive rows of rays.

    `W`: workspace or lanes; `m`: numbers per row; `i`: first ray.
    """
    return load(W, row * m + i), load(W, (row + 1) * m + i), load(W, (row + 2) * m + i)


def store_vector(W, row, m, i, a, b, c):
    """Store three consecutive rows of rays.

    `m`: numbers per row; `i`: first ray; `a`, `b`, `c`: WIDTH numbers of each row.
    """
    store(W, row * m + i, a)
    store(W, (row + 1) * m + i, b)
    store(W, (row + 2) * m + i, c)


def follow(W, L, rays, n, m, limit, P, step):
    """March n rays until each has hit, missed or run out of steps.

    A ray has missed once its free distance exceeds its end; an over-relaxed step beyond the end does not
    count.
    """
    if WIDTH == 1:
        follow_one(W, L, rays, limit, P, step)
    else:
        follow_packets(W, L, rays, n, m, limit, P, step)


def follow_one(W, L, rays, limit, P, step):
    """March the ray of a thread."""
    if W[Row.start] >= W[Row.end]:
        miss(W, 1, 0)
    else:
        take(W, L, rays, 1, 0, 0)
        march(L, limit, P, step)
        finish(W, L, 1, 0, 0)
    together()  # threads whose rays hit first would shade alone, and a frame take twice as long


def follow_packets(W, L, rays, n, m, limit, P, step):
    """March rays on lanes."""
    for lane in range(WIDTH):
        rays[lane] = -1
        L[Lane.done * WIDTH + lane] = 1.0
    under_way = 0
    following = 0
    while True:
        for lane in range(WIDTH):
            if L[Lane.done * WIDTH + lane] > 0.0:
                if rays[lane] >= 0:
                    finish(W, L, m, lane, rays[lane])
                    under_way -= 1
                following = skip_missed(W, m, n, following)
                if following < n:
                    take(W, L, rays, m, lane, following)
                    following += 1
                    under_way += 1
                else:
                    idle(L, rays, lane)
        if under_way == 0:
            break
        march(L, limit, P, step)


def finish(W, L, m, lane, i):
    """Write the result of a lane's ray i."""
    W[Row.t * m + i] = L[Lane.t * WIDTH + lane]
    W[Row.steps * m + i] = L[Lane.steps * WIDTH + lane]
    W[Row.status * m + i] = L[Lane.done * WIDTH + lane]


def skip_missed(W, m, n, i):
    """Mark rays with an empty interval as missed, from ray i on.

    `m`, `n`, `i`: numbers per row of W, rays, first ray.
    """
    while i < n and W[Row.start * m + i] >= W[Row.end * m + i]:
        miss(W, m, i)
        i += 1
    return i


def miss(W, m, i):
    """Mark ray i as missed."""
    W[Row.status * m + i] = 2.0
    W[Row.steps * m + i] = 0.0
    W[Row.t * m + i] = 0.0


def take(W, L, rays, m, lane, i):
    """Load a ray into a lane."""
    for k in range(Row.path + 1):
        L[k * WIDTH + lane] = W[k * m + i]
    L[Lane.t * WIDTH + lane] = W[Row.start * m + i]
    begin_steps(L, lane)
    rays[lane] = i


def begin_steps(L, lane):
    """Begin the steps of a lane's ray."""
    L[Lane.before * WIDTH + lane] = 0.0
    L[Lane.stride * WIDTH + lane] = 0.0
    L[Lane.steps * WIDTH + lane] = 0.0


def idle(L, rays, lane):
    """Park a lane without a ray far from the scene."""
    for k in range(Lane.dz + 1):
        L[k * WIDTH + lane] = 1e4
    L[Lane.end * WIDTH + lane] = 1e30
    L[Lane.side * WIDTH + lane] = 1.0
    L[Lane.path * WIDTH + lane] = 0.0
    L[Lane.t * WIDTH + lane] = 1.0
    begin_steps(L, lane)
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
        if any_of((gap < 0.0) | (free > end) | ~(steps < limit)):
            break
    done = where(gap < 0.0, 1.0, where(free > end, 2.0, where(steps < limit, 0.0 * steps, 3.0)))
    store(L, Lane.t * WIDTH, t)
    store(L, Lane.steps * WIDTH, steps)
    store(L, Lane.before * WIDTH, before)
    store(L, Lane.stride * WIDTH, stride)
    store(L, Lane.done * WIDTH, done)


def shade(W, m, last, P, frame):
    """Add the light of every ray, and replace each ray by its continuation; return True if there is one."""
    alive = False
    for i in range(0, m, WIDTH):
        status = load(W, Row.status * m + i)
        dx, dy, dz = load_vector(W, Row.dx, m, i)
        tr, tg, tb = load_vector(W, Row.tr, m, i)
        missed = (status > 1.5) & (status < 2.5)
        hit = (status < 1.5) | (status > 2.5)
        r = 0.0 * dx
        g = r
        b = r
        if any_of(missed):
            r, g, b = background(dx, dy, dz, load(W, Row.dense * m + i) if frame.weighted else 0.0, P)
        more = 0.0 * dx
        if any_of(hit):
            t = load(W, Row.t * m + i)
            path = load(W, Row.path * m + i)
            x = load(W, Row.ox * m + i) + t * dx
            y = load(W, Row.oy * m + i) + t * dy
            z = load(W, Row.oz * m + i) + t * dz
            steps, side = load(W, Row.steps * m + i), load(W, Row.side * m + i)
            u = tuple(
                load(W, (Row.px + frame.camera_samples + k) * m + i) for k in range(frame.bounce_samples)
            )
            q = load(W, Row.dense * m + i) if frame.weighted else 0.0
            light, onward = surface(x, y, z, dx, dy, dz, t, path, steps, side, last, q, u, P)
            hr, hg, hb = light
            r = where(hit, hr, r)
            g = where(hit, hg, g)
            b = where(hit, hb, b)
            if frame.bounces:
                er, eg, eb, ox, oy, oz, ex, ey, ez, es, dense = onward
                er = where(hit, tr * er, 0.0)
                eg = where(hit, tg * eg, 0.0)
                eb = where(hit, tb * eb, 0.0)
                more = er + eg + eb
                store_vector(W, Row.tr, m, i, er, eg, eb)
                store(W, Row.path * m + i, path + t)
                store_vector(W, Row.ox, m, i, ox, oy, oz)
                store_vector(W, Row.dx, m, i, ex, ey, ez)
                store(W, Row.side * m + i, es)
                if frame.weighted:
                    store(W, Row.dense * m + i, dense)
                enter, leave = span_box(ox, oy, oz, ex, ey, ez, P)
                store(W, Row.start * m + i, enter)
                store(W, Row.end * m + i, where(more > frame.faintest, leave, 0.0))
        elif frame.bounces:
            store_vector(W, Row.tr, m, i, more, more, more)
        if frame.bounces:  # start beyond end: terminated rays, whose values may be NaN, are not marched
            alive = alive | any_of(more > frame.faintest)
            store(W, Row.start * m + i, where(more > frame.faintest, load(W, Row.start * m + i), 1e30))
        sr, sg, sb = load_vector(W, Row.r, m, i)
        store_vector(W, Row.r, m, i, sr + tr * r, sg + tg * g, sb + tb * b)
    return alive


def cover(W, m):
    """Mark the camera rays that hit.

    `W`: workspace.
    """
    for i in range(0, m, WIDTH):
        status = load(W, Row.status * m + i)
        missed = (status > 1.5) & (status < 2.5)
        store(W, Row.cover * m + i, where(missed, 0.0, 1.0 + 0.0 * status))


def clear(W, m):
    """Remove the light of camera rays that missed."""
    for i in range(0, m, WIDTH):
        hit = load(W, Row.cover * m + i) > 0.5
        r, g, b = load_vector(W, Row.r, m, i)
        store_vector(W, Row.r, m, i, where(hit, r, 0.0), where(hit, g, 0.0), where(hit, b, 0.0))


def gather(W, pixels, A, first, n, m, width, frame):
    """Add one sample to each of n pixels, from the first one on. NaN, infinite and negative light is removed.

    `A`: sums of the picture, changed in place.
    """
    for i in range(0, m, WIDTH):
        r, g, b = load_vector(W, Row.r, m, i)
        cr, cg, cb = clamped(r), clamped(g), clamped(b)
        if frame.lit:
            store_vector(W, Row.r, m, i, cr, cg, cb)
        store(W, Row.t * m + i, brightness(cr, cg, cb))
    for k in range(n):
        a = place(pixels[first + k], width)
        bright = W[Row.t * m + k]
        A[a] += W[Row.r * m + k]
        A[a + 1] += W[Row.g * m + k]
        A[a + 2] += W[Row.b * m + k]
        A[a + 3] += bright
        A[a + 4] += bright * bright
        A[a + COUNT] += 1.0
        A[a + COVER] += W[Row.cover * m + k]


def place(pixel, width):
    """Return the index of a pixel's sums."""
    return CHANNELS * ((pixel >> 16) * width + (pixel & 65535))


def loops(frame: Frame) -> tuple[Loop, ...]:
    """Return the loops of a frame: `tile`, and `cones` if rays start at the eye."""
    made = (tile, cones) if frame.sharp else (tile,)
    return tuple(replace(one.fix(frame=frame), own=max(workspace(frame, 1), len(Lane))) for one in made)


def workspace(frame: Frame, rays: int) -> int:
    """Return the size of a tile's workspace W."""
    return (Row.px + frame.camera_samples + frame.bounce_samples) * rays


def padded(n):
    """Return the numbers in a row of n rays."""
    return (n + WIDTH - 1) // WIDTH * WIDTH


@loop("rirwwvirnnnnn")
def tile(P, Q, S, W, L, rays, pixels, A, n, width, limit, shift, blocks, frame):
    """Add samples to each of n pixels up to their goals; on a thread, one sample to one pixel.

    `P`, `Q`, `S`: scene parameters, sample sequence, start distance of each block; `A`: `CHANNELS` per
    pixel; `n` in pixels.
    """
    for first in shares(n, n):
        left = unfinished(pixels, A, first, n if WIDTH > 1 else 1, width)
        while left > 0:
            count = left if WIDTH > 1 else 1
            m = padded(count)
            draw(W, Q, P, pixels, A, first, count, m, width, frame)
            begin(W, m, P, frame)
            for k in range(count):
                pixel = pixels[first + k]
                early = S[(pixel >> 16 + shift) * blocks + ((pixel & 65535) >> shift)]
                W[Row.start * m + k] = max(W[Row.start * m + k], early)
            for bounce in range(frame.bounces + 1):
                follow(W, L, rays, count, m, limit, P, step_ray)
                if bounce == 0:
                    cover(W, m)
                draw_bounce(W, Q, P, pixels, A, first, count, m, width, bounce, frame)
                alive = shade(W, m, 1.0 if bounce == frame.bounces else 0.0, P, frame)
                if frame.transparent and bounce == 0:
                    clear(W, m)
                if not alive:
                    break
            gather(W, pixels, A, first, count, m, width, frame)
            if WIDTH == 1:
                break
            left = unfinished(pixels, A, first, left, width)


def unfinished(pixels, A, first, n, width):
    """Count the pixels below their goals of n from the first one on; on lanes, move them to the front."""
    kept = 0
    for k in range(n):
        pixel = pixels[first + k]
        a = place(pixel, width)
        if A[a + COUNT] < A[a + GOAL]:
            if WIDTH > 1:
                pixels[first + kept] = pixel
            kept += 1
    return kept


@loop("rrrwwvnnnnnnn")
def cones(P, S, C, W, L, rays, begun, n, shift, blocks, coarser, parents, limit, frame):
    """Cone prepass: compute the distance up to which all rays of each block of pixels are free.

    `P`, `S`, `C`: scene parameters, start distance of each block, written, and of each of coarser blocks;
    `begun`, `n`: first block and blocks.
    """
    for first in shares(n, n):
        own = begun + first
        count = n if WIDTH > 1 else 1
        m = padded(count)
        for k in range(m):
            block = own + min(k, count - 1)
            W[Row.px * m + k] = (block % blocks + 0.5) * (1 << shift) + P[frame.far + 1]
            W[Row.py * m + k] = (block // blocks + 0.5) * (1 << shift) + P[frame.far + 2]
        begin(W, m, P, frame)
        for k in range(count):
            block = own + k
            W[Row.start * m + k] = C[(block // blocks >> coarser) * parents + (block % blocks >> coarser)]
            W[Row.end * m + k] = P[frame.far]
            W[Row.path * m + k] = P[frame.far + 3] * (1 << shift)
        follow(W, L, rays, count, m, limit, P, step_cone)
        for k in range(count):
            S[own + k] = W[Row.t * m + k] if W[Row.status * m + k] != 2.0 else 1e30


def draw(W, Q, P, pixels, A, first, n, m, width, frame):
    """Draw the random numbers of the camera rays of n pixels. Columns beyond n repeat the last pixel.

    A pixel has the same numbers in the film and in a part of it.

    `W`: workspace, written from `Row.px` on; `Q`, `P`, `pixels`, `A`: sample sequence, scene parameters,
    pixels, sums of the picture.
    """
    for k in range(m):
        own = pixels[first + min(k, n - 1)]
        q = frame.samples * int(A[place(own, width) + COUNT])
        pixel = own + film_origin(P, frame)
        W[Row.px * m + k] = (pixel & 65535) + centred(Q[q], pixel, 0)
        W[Row.py * m + k] = (pixel >> 16) + centred(Q[q + 1], pixel, 1)
        for d in range(2, frame.camera_samples):
            W[(Row.px + d) * m + k] = sample(Q[q + d], pixel, d)


def draw_bounce(W, Q, P, pixels, A, first, n, m, width, bounce, frame):
    """Draw the random numbers of n pixels for the light of rays that hit; see `draw`."""
    begun = frame.camera_samples + bounce * frame.bounce_samples
    for k in range(n):
        if W[Row.status * m + k] != 2.0:
            own = pixels[first + k]
            q = frame.samples * int(A[place(own, width) + COUNT]) + begun
            pixel = own + film_origin(P, frame)
            for d in range(frame.bounce_samples):
                W[(Row.px + frame.camera_samples + d) * m + k] = sample(Q[q + d], pixel, begun + d)


def film_origin(P, frame):
    """Return the upper left pixel of the picture in the film."""
    return (int(P[frame.far + 2]) << 16) + int(P[frame.far + 1])


def begin(W, m, P, frame):
    """Create the camera rays of a tile.

    Each ray passes through its film point (px, py) and starts where it enters the scene's box.
    """
    for i in range(0, m, WIDTH):
        u, v = (0.0, 0.0) if frame.sharp else (load(W, (Row.px + 2) * m + i), load(W, (Row.px + 3) * m + i))
        px, py = load(W, Row.px * m + i), load(W, Row.py * m + i)
        ox, oy, oz, dx, dy, dz = camera_ray(px, py, u, v, P)
        enter, leave = span_box(ox, oy, oz, dx, dy, dz, P)
        zero = 0.0 * dx
        store_vector(W, Row.ox, m, i, ox, oy, oz)
        store_vector(W, Row.dx, m, i, dx, dy, dz)
        store(W, Row.start * m + i, enter)
        store(W, Row.end * m + i, leave)
        store(W, Row.path * m + i, zero)
        store_vector(W, Row.r, m, i, zero, zero, zero)
        store(W, Row.side * m + i, zero + 1.0)
        if frame.weighted:
            store(W, Row.dense * m + i, zero)
        store_vector(W, Row.tr, m, i, zero + 1.0, zero + 1.0, zero + 1.0)


TILE = 2048
"""Maximum rays per tile; their workspace stays in the cache."""
LEAST, TILES, RAYS = 128, 8, 1 << 14
"""Minimum pixels or cones per tile, tiles per thread for few of them, and maximum rays per tile."""
STEPS = {"float32": 1600, "float64": 10_000}
"""Maximum steps of a ray, which then hits. At the magnification that needs float64, one in ten takes more
than 1600; in float32 those that do creep along a surface, and a packet waits for them.
"""
BLOCK = 4
"""Side of a block of the first cone prepass, pixels. A frame takes 7 % less time with 4 than with 8."""
SHIFTS = (BLOCK.bit_length() - 1, 0)
"""Binary logarithms of the sides of the blocks of each prepass: of one pixel in the second one, which pays
where pixels get several samples.
"""
WHOLE = 16
"""Binary logarithm of the side of a block that contains any picture."""


class CpuTracer:
    """Tracer that adds samples to pixels, tile by tile, on all threads of the work.

    `dtype`: float32 or float64; `width`, `height` in pixels.
    """

    prepasses = len(SHIFTS)
    """Cone prepasses, coarse to fine."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self.dtype, self.width, self.height = dtype, width, height
        self.steps = STEPS[dtype.name]
        bits = dtype.itemsize * 8
        self.lanes = lane_count(bits)
        functions = load_functions(frame.linked.program, bits, self.lanes, loops(frame))
        self._tile, self._cones = functions["tile"], functions.get("cones")
        self._own = threading.local()
        self.samples, self._points = SampleRange(), np.empty((0, frame.samples), np.int32)
        self.aim(frame)

    def aim(self, frame: Frame) -> None:
        """Load the parameters of another frame of the same source, such as another camera or depth."""
        self.frame = frame
        self._parameters = parameters(frame.linked, self.dtype)
        self._shift, self._blocks, self._starts = WHOLE, 1, np.zeros(1, self.dtype)

    def look_ahead(self, work: Work) -> None:
        """Cone prepass: compute the distance up to which all rays of each block are free.

        The first prepass after `aim` is that of the coarsest blocks. Each later one starts where the one
        before ended.
        """
        cones = self._cones
        if cones is None:
            return
        shift = next(s for s in SHIFTS if s < self._shift)
        blocks, rows = (-(-pixels // (1 << shift)) for pixels in (self.width, self.height))
        starts, coarser = np.zeros(blocks * rows, self.dtype), (self._shift - shift, self._blocks)

        def task(part: slice) -> None:
            arrays = self._parameters, starts, self._starts, *self._workspace
            cones(*arrays, part.start, part.stop - part.start, shift, blocks, *coarser, self.steps)

        work.map(task, chunks(len(starts), _tile(len(starts), work.threads)))
        self._shift, self._blocks, self._starts = shift, blocks, starts

    def add(self, sums: np.ndarray, plan: PassPlan, work: Work) -> None:
        """Add samples to pixels up to their goals; a pixel with k samples takes point k of the sequence.

        Sums are valid at any time: those of a tile are added at once.

        `sums`: ndarray (height * width * CHANNELS,).
        """
        if len(self._points) < plan.last:
            self._points = self.samples.points(2 * plan.last, self.frame.samples)

        def task(part: slice) -> None:
            pixels = plan.pixels[part].copy()
            arrays = self._parameters, self._points, self._starts, *self._workspace, pixels, sums
            self._tile(*arrays, len(pixels), self.width, self.steps, self._shift, self._blocks)
            done.append(part)

        tile = min(_tile(len(plan.pixels), work.threads), max(RAYS // plan.last, LEAST))
        parts, done = chunks(len(plan.pixels), tile), list[slice]()
        try:
            work.map(task, parts)
        except Cancelled:
            if len(done) < len(parts):  # a whole pass counts, or the next one would choose other pixels
                raise

    @property
    def _workspace(self) -> tuple[np.ndarray, ...]:
        """This thread's arrays W, L and rays (see `packets`)."""
        if not hasattr(self._own, "space"):
            sizes = workspace(self.frame, TILE), len(Lane) * self.lanes
            rows, lanes = (np.zeros(size, self.dtype) for size in sizes)
            self._own.space = rows, lanes, np.zeros(self.lanes, np.int32)
        space: tuple[np.ndarray, ...] = self._own.space
        return space


def _tile(count: int, threads: int) -> int:
    """Pixels or cones per tile, of `count`."""
    share = -(-count // (TILES * threads)) if threads > 1 else TILE
    return min(max(share, LEAST), TILE)
