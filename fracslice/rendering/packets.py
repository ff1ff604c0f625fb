"""Ray packets: CPU loops around the render units on SIMD lanes, from pixels to sums of light.

Conventions:

- P holds the scene's parameters, Q the points of the sample sequence, S the distance at which the rays of
  each block of pixels start, A the sums of the picture. A block is 2^shift pixels wide.
- W is the workspace of a tile: one row per quantity in `Row`, m numbers each. The t of ray i is
  ``W[Row.t * m + i]``.
- L holds the packet under way: one row per quantity in `Lane`, WIDTH numbers each. `rays` holds the ray of
  each lane, -1 for none.
- `pixels` holds ``y << 16 | x``. `width` is that of the picture, pixels; `limit` the largest number of steps
  of a ray; `blocks` the number of blocks in a row of the picture; `frame` the linked frame.
"""

from __future__ import annotations

from ..kernel.intrinsics import WIDTH, load, store
from ..kernel.loops import Loop, loop
from .accumulator import CHANNELS, COUNT, GOAL
from .lanes import Row, follow, store_vector
from .linking import Frame
from .packet_light import clear, cover, gather, shade
from .units.intrinsics import camera_ray, span_box, step_cone, step_ray
from .units.random import centred, sample


def loops(frame: Frame) -> tuple[Loop, ...]:
    """Return the C loops of a frame: `tile`, and `cones` if rays start at the eye."""
    return tuple(made.fix(frame=frame) for made in ((tile, cones) if frame.sharp else (tile,)))


def workspace(frame: Frame, rays: int) -> int:
    """Return the size of a tile's workspace W."""
    return (Row.px + frame.samples) * rays


@loop("rirrriirnnnnn")
def tile(P, Q, S, W, L, rays, pixels, A, n, width, limit, shift, blocks, frame):
    """Add samples to each of n pixels up to their goals.

    Parameters
    ----------
    P, Q, S : pointer to float, pointer to int32, pointer to float
        Scene parameters, sample sequence, start distance of each block.
    W, L, rays : pointer to float, pointer to float, pointer to int32
        Workspace, lanes, ray of each lane.
    pixels : pointer to int32
        Pixels, ``y << 16 | x``, below their goals; overwritten.
    A : pointer to float
        Sums of the picture, `CHANNELS` per pixel.
    n : int
        Pixels.
    shift, blocks : int
        Binary logarithm of a block's side, and blocks per row of the picture.
    """
    left = n
    while left > 0:
        m = (left + WIDTH - 1) // WIDTH * WIDTH
        draw(W, Q, P, pixels, A, left, m, width, frame)
        begin(W, m, P, frame)
        for k in range(left):
            pixel = pixels[k]
            early = S[(pixel >> 16 + shift) * blocks + ((pixel & 65535) >> shift)]
            W[Row.start * m + k] = max(W[Row.start * m + k], early)
        for bounce in range(frame.bounces + 1):
            follow(W, L, rays, left, m, limit, P, step_ray)
            if bounce == 0:
                cover(W, m)
            last = 1.0 if bounce == frame.bounces else 0.0
            shade(W, m, Row.px + frame.camera_samples + bounce * frame.bounce_samples, last, P, frame)
            if frame.transparent and bounce == 0:
                clear(W, m)
        gather(W, pixels, A, left, m, width, frame)
        left = unfinished(pixels, A, left, width)


def unfinished(pixels, A, n, width):
    """Move the pixels below their goals to the front.

    Parameters
    ----------
    pixels : pointer to int32
        Pixels, changed in place.

    Returns
    -------
    int
        Their number.
    """
    kept = 0
    for k in range(n):
        pixel = pixels[k]
        a = CHANNELS * ((pixel >> 16) * width + (pixel & 65535))
        if A[a + COUNT] < A[a + GOAL]:
            pixels[kept] = pixel
            kept += 1
    return kept


@loop("rrrirrinnnnnnn")
def cones(P, S, C, ids, W, L, rays, n, m, shift, blocks, coarser, parents, limit, frame):
    """Cone prepass: compute the distance up to which all rays of each block of pixels are free.

    Parameters
    ----------
    P, S, C : pointer to float
        Scene parameters; start distance of each block, written; that of each coarser block.
    ids : pointer to int32
        Block numbers.
    W, L, rays : pointer to float, pointer to float, pointer to int32
        Workspace, lanes, ray of each lane.
    n, m : int
        Blocks, and numbers per row of W.
    shift, blocks : int
        Binary logarithm of a block's side, and blocks per row of the picture.
    coarser, parents : int
        The same for the coarser blocks, whose free distance is known; `coarser` is relative to `shift`.
    limit : int
        Steps per cone.
    """
    for k in range(m):
        block = ids[min(k, n - 1)]
        W[Row.px * m + k] = (block % blocks + 0.5) * (1 << shift) + P[frame.far + 1]
        W[Row.py * m + k] = (block // blocks + 0.5) * (1 << shift) + P[frame.far + 2]
    begin(W, m, P, frame)
    for k in range(n):
        block = ids[k]
        W[Row.start * m + k] = C[(block // blocks >> coarser) * parents + (block % blocks >> coarser)]
        W[Row.end * m + k] = P[frame.far]
        W[Row.path * m + k] = P[frame.far + 3] * (1 << shift)
    follow(W, L, rays, n, m, limit, P, step_cone)
    for k in range(n):
        S[ids[k]] = W[Row.t * m + k] if W[Row.status * m + k] != 2.0 else 1e30


def draw(W, Q, P, pixels, A, n, m, width, frame):
    """Draw all random numbers of the next sample of n pixels. Columns beyond n repeat the last pixel.

    A pixel has the same numbers in the film and in a part of it.

    Parameters
    ----------
    W : pointer to float
        Workspace; rows from `Row.px` on are written.
    Q, P, pixels, A : pointer
        Sample sequence, scene parameters, pixels, sums of the picture.
    """
    first = (int(P[frame.far + 2]) << 16) + int(P[frame.far + 1])
    for k in range(m):
        pixel = pixels[min(k, n - 1)]
        q = frame.samples * int(A[CHANNELS * ((pixel >> 16) * width + (pixel & 65535)) + COUNT])
        pixel += first
        W[Row.px * m + k] = (pixel & 65535) + centred(Q[q], pixel, 0)
        W[Row.py * m + k] = (pixel >> 16) + centred(Q[q + 1], pixel, 1)
        for d in range(2, frame.samples):
            W[(Row.px + d) * m + k] = sample(Q[q + d], pixel, d)


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
