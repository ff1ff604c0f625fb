"""The loops around the units on CUDA: one thread takes one ray from the film to the last bounce.

They do what the lanes' loops in `fracslice.rendering.waves` do, in the same words.
"""

from __future__ import annotations

from string import Template

from .linking import Frame

TILE = """
@kernel
def tile(P, Q, S, pixels, A, width, limit, blocks):
    k = cuda.grid(1)
    if k < pixels.size and pixels[k] >= 0:
        pixel = whole(pixels[k])
        column = pixel & 65535
        row = pixel >> 16
        q = whole(A[row * width + column, 5])
        px = real(column) + centred(whole(Q[q, 0]), pixel, 0)
        py = real(row) + centred(whole(Q[q, 1]), pixel, 1)
        ox, oy, oz, dx, dy, dz = camera_ray(px, py, $lens, P)
        start, end = span_box(ox, oy, oz, dx, dy, dz, P)
        start = maximum(start, S[(row >> $shift) * blocks + (column >> $shift)])
        r, g, b = real(0.0), real(0.0), real(0.0)
        tr, tg, tb = real(1.0), real(1.0), real(1.0)
        path, side = real(0.0), real(1.0)
        for bounce in range($bounces + 1):
            t, steps, before, stride = start, real(0.0), real(0.0), real(0.0)
            missed = start >= end
            while not missed:
                t, before, stride, gap = step_ray(ox, oy, oz, dx, dy, dz, t, before, stride, $side path, P)
                steps += real(1.0)
                if gap < real(0.0):
                    break
                missed = (t - stride + before if stride > real(0.0) else t) > end
                if steps >= limit:
                    break
            together()
            if missed:
                hr, hg, hb = background(dx, dy, dz, P)
                r, g, b = r + tr * hr, g + tg * hg, b + tb * hb
                break
            x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
            $outs = surface(x, y, z, dx, dy, dz, t, path, steps, side, $numbers P)
            r, g, b = r + tr * hr, g + tg * hg, b + tb * hb$onward
        gather(A, row * width + column, r, g, b)


@device
def gather(A, a, r, g, b):
    r = tamed(r)
    g = tamed(g)
    b = tamed(b)
    bright = real(0.2126) * r + real(0.7152) * g + real(0.0722) * b
    bright = divide(bright, real(1.0) + bright)
    A[a, 0] += r
    A[a, 1] += g
    A[a, 2] += b
    A[a, 3] += bright
    A[a, 4] += bright * bright
    A[a, 5] += real(1.0)


@device
def tamed(c):
    return minimum(maximum(c, real(0.0)), real(1e4)) if c == c else real(0.0)
"""
"""Adds to each pixel, those below zero left out, its next sample, the point of Q whose index is how many it
has; no NaN, no infinity, no negative light."""

ONWARD = """
            tr, tg, tb = tr * er, tg * eg, tb * eb
            path = path + t
            ox, oy, oz, dx, dy, dz, side = nx, ny, nz, ex, ey, ez, es
            start, end = span_box(ox, oy, oz, dx, dy, dz, P)
            if not tr + tg + tb > real(0.002):
                start = real(1e30)"""

CONES = """
@kernel
def cones(P, S, blocks, limit):
    k = cuda.grid(1)
    if k < S.size:
        px = (real(k % blocks) + real(0.5)) * real($block)
        py = (real(k // blocks) + real(0.5)) * real($block)
        ox, oy, oz, dx, dy, dz = camera_ray(px, py, real(0.0), real(0.0), P)
        t, steps, before, stride, gap = real(0.0), real(0.0), real(0.0), real(0.0), real(1.0)
        while not t > $far:
            t, before, stride, gap = step_cone(ox, oy, oz, dx, dy, dz, t, before, stride, P)
            steps += real(1.0)
            if gap < real(0.0) or steps >= limit:
                break
        S[k] = real(1e30) if gap >= real(0.0) and t > $far else t
"""
"""For every block of pixels, up to where all its rays are free."""


def loops(frame: Frame, block: int) -> str:
    """The kernels around a frame's source: `tile`, and `cones` where rays start at the eye."""
    first = f"{frame.camera_samples} + bounce * {frame.bounce_samples}"
    drawn = [f"sample(whole(Q[q, {first} + {k}]), pixel, {first} + {k})" for k in range(frame.bounce_samples)]
    lens = [f"sample(whole(Q[q, {d}]), pixel, {d})" for d in (2, 3)]
    words = {
        "block": block,
        "shift": block.bit_length() - 1,
        "bounces": frame.bounces,
        "far": frame.far,
        "lens": "real(0.0), real(0.0)" if frame.sharp else ", ".join(lens),
        "numbers": "".join(f"{d}, " for d in drawn),
        "onward": ONWARD if frame.bounces else "\n            break",
        "outs": "hr, hg, hb" + (", er, eg, eb, nx, ny, nz, ex, ey, ez, es" if frame.bounces else ""),
        "side": "side," if frame.inside else "",
    }
    return Template(TILE + (CONES if frame.sharp else "")).substitute(words)
