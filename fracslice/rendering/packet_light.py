"""Light of a packet of rays, from the surface or the background to the sums of the picture.

The arrays are those of `packets`.
"""

from __future__ import annotations

from ..formulas.vocabulary import any_of, where
from ..kernel.intrinsics import WIDTH, load, store
from .accumulator import CHANNELS, COUNT, COVER
from .lanes import Row, load_vector, store_vector
from .units.intrinsics import background, span_box, surface
from .units.pixel import brightness, clamped


def shade(W, m, first, last, P, frame):
    """Add the light of every ray, and replace each ray by its continuation.

    Parameters
    ----------
    first : int
        Row of the bounce's first random number.
    last : float
        1 for the last bounce, else 0.
    """
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
            u = tuple(load(W, (first + k) * m + i) for k in range(frame.bounce_samples))
            light, onward = surface(x, y, z, dx, dy, dz, t, path, steps, side, last, u, P)
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
            store(W, Row.start * m + i, where(more > frame.faintest, load(W, Row.start * m + i), 1e30))
        sr, sg, sb = load_vector(W, Row.r, m, i)
        store_vector(W, Row.r, m, i, sr + tr * r, sg + tg * g, sb + tb * b)


def cover(W, m):
    """Mark the camera rays that hit.

    Parameters
    ----------
    W : pointer to float
        Workspace; `Row.cover` is written.
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


def gather(W, pixels, A, n, m, width, frame):
    """Add one sample to each of n pixels. NaN, infinite and negative light is removed.

    Parameters
    ----------
    A : pointer to float
        Sums of the picture, changed in place.
    """
    for i in range(0, m, WIDTH):
        r, g, b = load_vector(W, Row.r, m, i)
        cr, cg, cb = clamped(r), clamped(g), clamped(b)
        if frame.lit:
            store_vector(W, Row.r, m, i, cr, cg, cb)
        store(W, Row.t * m + i, brightness(cr, cg, cb))
    for k in range(n):
        pixel = pixels[k]
        a = CHANNELS * ((pixel >> 16) * width + (pixel & 65535))
        bright = W[Row.t * m + k]
        A[a] += W[Row.r * m + k]
        A[a + 1] += W[Row.g * m + k]
        A[a + 2] += W[Row.b * m + k]
        A[a + 3] += bright
        A[a + 4] += bright * bright
        A[a + COUNT] += 1.0
        A[a + COVER] += W[Row.cover * m + k]
