"""CUDA kernels around the render units and of the accumulator: one thread follows one ray, or one pixel.

They compute the same as the loops of `packets`, with the same names for arrays.

A holds the sums of the picture, CHANNELS per pixel. T holds partial sums, one row per thread; thread b
handles every pixel whose index is b modulo the number of rows, so that the sums are deterministic.
"""

from __future__ import annotations

from ..expr.loops import Loop, device, divide, kernel, real, thread, together, whole
from ..expr.vocabulary import maximum, minimum
from .accumulator import CHANNELS, COUNT, COVER, GOAL
from .linking import Frame
from .units.intrinsics import background, camera_ray, span_box, step_cone, step_ray, surface
from .units.pixel import UNKNOWN, brightness, clamped, encoded, filmic, reinhard, squared_error
from .units.random import centred, sample


def loops(frame: Frame) -> tuple[Loop, ...]:
    """Return the kernels of a frame: `tile`, and `cones` if rays start at the eye."""
    return tuple(made.fix(frame=frame) for made in ((tile, cones) if frame.sharp else (tile,)))


@kernel
def tile(P, Q, S, pixels, A, width, limit, blocks, frame):
    """Add the next sample to each pixel.

    `Q`: int32 (points, samples); `S`: start distance of each block; `A`: CHANNELS per pixel.
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
            light, onward = surface(x, y, z, dx, dy, dz, t, path, steps, side, last, dense, chance, P)
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

    `S`: start distance of each block, written.
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

    `A`: sums of the picture, changed in place; `a`: index of the pixel's first sum.
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


@kernel
def clear(A):
    """Set the sums of all pixels to zero.

    `A`: sums of the picture, written.
    """
    k = thread()
    if k < A.size:
        A[k] = real(0)


@kernel
def grid(A, T, width, step):
    """Set the goals of a grid of pixels to one sample.

    `A`: sums of the picture; `T`: real (threads, 3); `width`, `step` in pixels.
    """
    b = thread()
    if b < T.shape[0]:
        left, last = real(0), real(0)
        k = b
        while k * CHANNELS < A.size:
            row = k // width
            column = k - row * width
            a = k * CHANNELS
            if row % step == 0 and column % step == 0:
                A[a + GOAL] = maximum(A[a + GOAL], real(1))
            left += A[a + GOAL] - A[a + COUNT]
            last = maximum(last, A[a + GOAL])
            k += T.shape[0]
        T[b, 0] = left
        T[b, 1] = last


@kernel
def measure(A, E, T):
    """Compute the squared standard error of each pixel.

    `A`: sums of the picture; `E`: real (pixels,); `T`: real (threads, 3), pixels with a known error.
    """
    b = thread()
    if b < T.shape[0]:
        total, known, samples = real(0), real(0), real(0)
        k = b
        while k < E.size:
            a = k * CHANNELS
            n = A[a + COUNT]
            E[k] = squared_error(A[a + 3], A[a + 4], n)
            samples += n
            if n >= real(2):
                total += E[k]
                known += real(1)
            k += T.shape[0]
        T[b, 0] = total
        T[b, 1] = known
        T[b, 2] = samples


@kernel
def judge(A, E, G, T, width, trusted, most, tolerance):
    """Compute the gain of one more sample in each pixel.

    `A`: sums of the picture; `E`: real (pixels,); `G`: real (pixels,), written: -1 for a finished pixel;
    `T`: real (threads, 3), written: largest gain of an unfinished pixel; `width` in pixels; `most`: maximum
    samples per pixel; `tolerance`: squared error at which a pixel has converged.
    """
    b = thread()
    if b < T.shape[0]:
        largest = real(0)
        height = E.size // width
        k = b
        while k < E.size:
            row = k // width
            column = k - row * width
            worst, gain = real(0), real(0)
            for y in range(max(row - 1, 0), min(row + 2, height)):
                for x in range(max(column - 1, 0), min(column + 2, width)):
                    near = y * width + x
                    n = A[near * CHANNELS + COUNT]
                    square = E[near] if n >= trusted else real(UNKNOWN)
                    worst = maximum(worst, square)
                    gain = maximum(gain, divide(square, n))
            G[k] = real(-1)
            if A[k * CHANNELS + COUNT] < most and worst > tolerance:
                largest = maximum(largest, gain)
                G[k] = gain
            k += T.shape[0]
        T[b, 0] = largest


@kernel
def choose(A, G, T, most, least):
    """Set the goals of the pixels whose gain is at least `least`.

    `A`: sums of the picture; `G`: real (pixels,); `T`: real (threads, 3); `most`: maximum samples per pixel.
    """
    b = thread()
    if b < T.shape[0]:
        left, last = real(0), real(0)
        k = b
        while k < G.size:
            a = k * CHANNELS
            n = A[a + COUNT]
            goal = n
            if G[k] >= least:
                goal = real(1)
                while goal <= n:
                    goal = goal + goal
                goal = minimum(goal, most)
            A[a + GOAL] = goal
            left += goal - n
            last = maximum(last, goal)
            k += T.shape[0]
        T[b, 0] = left
        T[b, 1] = last


@kernel
def show(A, out, width, coarse, exposure, red, green, blue, tone):
    """Develop the picture as `film.develop` does, without bloom.

    Parameters
    ----------
    A : array of real
        Sums of the picture.
    out : array of uint8, shape (pixels, 3)
        sRGB, written.
    width : int
        Picture width, pixels.
    coarse : int
        Grid spacing of the sampled pixels; each is repeated over its cell.
    exposure : real
        Factor on the light.
    red, green, blue : real
        Display colour behind the picture, linear.
    tone : int
        Tone curve: 0 none, 1 filmic, 2 Reinhard.
    """
    k = thread()
    if k < out.shape[0]:
        row = k // width
        column = k - row * width
        a = CHANNELS * ((row - row % coarse) * width + column - column % coarse)
        n = maximum(A[a + COUNT], real(1))
        clear = real(1) - divide(A[a + COVER], n)
        r = exposure * maximum(divide(A[a], n) - clear * red, real(0))
        g = exposure * maximum(divide(A[a + 1], n) - clear * green, real(0))
        b = exposure * maximum(divide(A[a + 2], n) - clear * blue, real(0))
        if tone == 2:
            dim = reinhard(r, g, b)
            r, g, b = r * dim, g * dim, b * dim
        if tone == 1:
            r, g, b = filmic(r), filmic(g), filmic(b)
        out[k, 0] = level(encoded(r + clear * red))
        out[k, 1] = level(encoded(g + clear * green))
        out[k, 2] = level(encoded(b + clear * blue))


@device
def level(c):
    """Quantise to 8 bits.

    `c`: clipped to [0, 1].
    """
    return whole(minimum(maximum(c, real(0)), real(1)) * real(255) + real(0.5))


LOOPS = clear, grid, measure, judge, choose, show
