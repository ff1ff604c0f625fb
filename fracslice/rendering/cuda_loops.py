"""CUDA kernels around the render units: one thread follows one ray from the film to its last bounce.

They compute the same as the loops of `packets`, with the same names for arrays.
"""

from __future__ import annotations

from ..formulas.vocabulary import maximum
from ..kernel.cuda_stubs import device, kernel, real, thread, together, whole
from ..kernel.loops import Loop
from .accumulator import CHANNELS, COUNT, COVER, GOAL
from .linking import Frame
from .units.intrinsics import background, camera_ray, span_box, step_cone, step_ray, surface
from .units.pixel import brightness, clamped
from .units.random import centred, sample


def loops(frame: Frame) -> tuple[Loop, ...]:
    """Return the kernels of a frame: `tile`, and `cones` if rays start at the eye."""
    return tuple(made.fix(frame=frame) for made in ((tile, cones) if frame.sharp else (tile,)))


@kernel
def tile(P, Q, S, pixels, A, width, limit, blocks, frame):
    """Add the next sample to each pixel.

    Parameters
    ----------
    Q : array of int32, shape (points, samples)
        Sample sequence; a pixel with k samples takes point k.
    S : array of real
        Start distance of each block.
    pixels : array of int32
        Pixels, ``y << 16 | x``; those at their goals are skipped.
    A : array of real
        Sums of the picture, CHANNELS per pixel, changed in place.
    """
    k = thread()
    pixel = whole(pixels[min(k, pixels.size - 1)])
    column = pixel & 65535
    row = pixel >> 16
    a = (row * width + column) * CHANNELS
    if k < pixels.size and A[a + COUNT] < A[a + GOAL]:
        q = whole(A[a + COUNT])
        place = pixel + (whole(P[frame.far + 2]) << 16) + whole(P[frame.far + 1])
        px = real(place & 65535) + centred(whole(Q[q, 0]), place, 0)
        py = real(place >> 16) + centred(whole(Q[q, 1]), place, 1)
        u, v = (
            (real(0.0), real(0.0))
            if frame.sharp
            else (sample(whole(Q[q, 2]), place, 2), sample(whole(Q[q, 3]), place, 3))
        )
        ox, oy, oz, dx, dy, dz = camera_ray(px, py, u, v, P)
        start, end = span_box(ox, oy, oz, dx, dy, dz, P)
        start = maximum(start, S[(row >> frame.shift) * blocks + (column >> frame.shift)])
        r, g, b = real(0.0), real(0.0), real(0.0)
        tr, tg, tb = real(1.0), real(1.0), real(1.0)
        path, side, covered, dense = real(0.0), real(1.0), real(0.0), real(0.0)
        for bounce in range(frame.bounces + 1):
            t, steps, before, stride = start, real(0.0), real(0.0), real(0.0)
            missed = start >= end
            while not missed:
                t, before, stride, gap = step_ray(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P)
                steps += real(1.0)
                if gap < real(0.0):
                    break
                missed = (t - stride + before if stride > real(0.0) else t) > end
                if steps >= limit:
                    break
            together()
            if bounce == 0:
                covered = real(0.0) if missed else real(1.0)
            if missed:
                if frame.transparent and bounce == 0:
                    break
                hr, hg, hb = background(dx, dy, dz, dense, P)
                r, g, b = r + tr * hr, g + tg * hg, b + tb * hb
                break
            x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
            first = frame.camera_samples + bounce * frame.bounce_samples
            chance = tuple(
                sample(whole(Q[q, first + d]), place, first + d) for d in range(frame.bounce_samples)
            )
            last = real(1.0) if bounce == frame.bounces else real(0.0)
            light, onward = surface(x, y, z, dx, dy, dz, t, path, steps, side, last, chance, P)
            hr, hg, hb = light
            r, g, b = r + tr * hr, g + tg * hg, b + tb * hb
            if not frame.bounces:
                break
            er, eg, eb, ox, oy, oz, dx, dy, dz, side, dense = onward
            tr, tg, tb = tr * er, tg * eg, tb * eb
            path = path + t
            start, end = span_box(ox, oy, oz, dx, dy, dz, P)
            if not tr + tg + tb > real(frame.faintest):
                start = real(1e30)
        gather(A, a, r, g, b, covered, frame)


@kernel
def cones(P, S, blocks, limit, frame):
    """Cone prepass: compute the distance up to which all rays of each block of pixels are free.

    Parameters
    ----------
    S : array of real
        Start distance of each block, written.
    limit : real
        Steps per cone.
    """
    k = thread()
    if k < S.size:
        px = (real(k % blocks) + real(0.5)) * real(frame.block)
        py = (real(k // blocks) + real(0.5)) * real(frame.block)
        px, py = px + P[frame.far + 1], py + P[frame.far + 2]
        ox, oy, oz, dx, dy, dz = camera_ray(px, py, real(0.0), real(0.0), P)
        t, steps, before, stride, gap = real(0.0), real(0.0), real(0.0), real(0.0), real(1.0)
        spread = P[frame.far + 3] * real(frame.block)
        while not t > P[frame.far]:
            t, before, stride, gap = step_cone(
                ox, oy, oz, dx, dy, dz, t, before, stride, real(1.0), spread, P
            )
            steps += real(1.0)
            if gap < real(0.0) or steps >= limit:
                break
        S[k] = real(1e30) if gap >= real(0.0) and t > P[frame.far] else t


@device
def gather(A, a, r, g, b, covered, frame):
    """Add one sample to a pixel. NaN, infinite and negative light is removed.

    Parameters
    ----------
    A : array of real
        Sums of the picture, changed in place.
    a : int
        Index of the pixel's first sum.
    covered : real
        1 if the camera ray hit.
    """
    bright = brightness(clamped(r), clamped(g), clamped(b))
    if frame.lit:
        r = clamped(r)
        g = clamped(g)
        b = clamped(b)
    A[a] += r
    A[a + 1] += g
    A[a + 2] += b
    A[a + 3] += bright
    A[a + 4] += bright * bright
    A[a + COUNT] += real(1.0)
    A[a + COVER] += covered
