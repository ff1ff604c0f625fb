"""The loops around the units on SIMD lanes: from pixels to sums of light.

A tile's rays lie in rows of a workspace W: ``$t + i`` is where ray i has its t. Rays are followed in packets
that are refilled: as soon as a lane is done, the next ray takes its place, so no lane idles while another is
on its way.
"""

from __future__ import annotations

from string import Template

from ..kernel.linker import Linked
from ..kernel.loops import Loop
from .linking import Frame

ROWS = (
    "ox", "oy", "oz", "dx", "dy", "dz", "start", "end", "side", "path", "t",
    "steps", "status", "r", "g", "b", "tr", "tg", "tb", "px", "py",
)  # fmt: skip
"""What is known of a ray. status: 1 hit, 2 missed, 3 out of steps. r, g, b: light gathered; tr, tg, tb: how
much of what is still to come counts. side: -1 inside. path: how long the way was before this ray. px, py:
where on the film."""
LANES = (
    "ox", "oy", "oz", "dx", "dy", "dz", "start", "end",
    "side", "path", "t", "steps", "done", "before", "stride",
)  # fmt: skip
"""What is known of a ray that is under way, WIDTH numbers each, behind the rows."""

CHANNELS = 6
"""Of a pixel: the sums of red, green, blue, shown brightness, its square, and the number of samples."""

FOLLOW = """
def follow_STEP(W, I, n, m, limit, P):
    for lane in range(WIDTH):
        I[lane] = -1
        W[@done + lane] = 1.0
    under_way = 0
    following = 0
    while True:
        for lane in range(WIDTH):
            if W[@done + lane] > 0.0:
                i = I[lane]
                if i >= 0:
                    W[$t + i] = W[@t + lane]
                    W[$steps + i] = W[@steps + lane]
                    W[$status + i] = W[@done + lane]
                    under_way -= 1
                while following < n and W[$start + following] >= W[$end + following]:
                    W[$status + following] = 2.0
                    W[$steps + following] = 0.0
                    W[$t + following] = 0.0
                    following += 1
                W[@before + lane] = 0.0
                W[@stride + lane] = 0.0
                W[@steps + lane] = 0.0
                if following < n:
                    for k in range(10):
                        W[@ox + k * WIDTH + lane] = W[k * m + following]
                    W[@t + lane] = W[$start + following]
                    I[lane] = following
                    following += 1
                    under_way += 1
                else:
                    for k in range(6):
                        W[@ox + k * WIDTH + lane] = 1e4
                    W[@end + lane] = 1e30
                    W[@side + lane] = 1.0
                    W[@path + lane] = 0.0
                    W[@t + lane] = 1.0
                    I[lane] = -1
        if under_way == 0:
            break
        ox = load(W, @ox)
        oy = load(W, @oy)
        oz = load(W, @oz)
        dx = load(W, @dx)
        dy = load(W, @dy)
        dz = load(W, @dz)
        end = load(W, @end)
        side = load(W, @side)
        path = load(W, @path)
        t = load(W, @t)
        steps = load(W, @steps)
        before = load(W, @before)
        stride = load(W, @stride)
        while True:
            t, before, stride, gap = STEP(ox, oy, oz, dx, dy, dz, t, before, stride, MORE P)
            steps = steps + 1.0
            free = where(stride > 0.0, t - stride + before, t)
            done = where(gap < 0.0, 1.0, where(free > end, 2.0, where(steps < limit, 0.0 * steps, 3.0)))
            if any_of(done > 0.0):
                break
        store(W, @t, t)
        store(W, @steps, steps)
        store(W, @before, before)
        store(W, @stride, stride)
        store(W, @done, done)
"""
"""Follows n rays until all have hit, left or used up their steps. A ray has left where it is known to be
free, not where an over-relaxed step took it. Lanes without a ray stand far away."""

BEGIN = """
def begin(W, m, P):
    for i in range(0, m, WIDTH):
        ox, oy, oz, dx, dy, dz = camera_ray(load(W, $px + i), load(W, $py + i), $lens, P)
        enter, leave = span_box(ox, oy, oz, dx, dy, dz, P)
        zero = 0.0 * dx
        store(W, $ox + i, ox)
        store(W, $oy + i, oy)
        store(W, $oz + i, oz)
        store(W, $dx + i, dx)
        store(W, $dy + i, dy)
        store(W, $dz + i, dz)
        store(W, $start + i, enter)
        store(W, $end + i, leave)
        store(W, $path + i, zero)
        store(W, $r + i, zero)
        store(W, $g + i, zero)
        store(W, $b + i, zero)
        store(W, $side + i, zero + 1.0)
        store(W, $tr + i, zero + 1.0)
        store(W, $tg + i, zero + 1.0)
        store(W, $tb + i, zero + 1.0)
"""
"""The rays through the points (px, py) of the film, from where they enter the scene's box."""

DRAW = """
def draw(W, Q, I, A, n, m, width):
    for k in range(m):
        pixel = I[WIDTH + min(k, n - 1)]
        q = $drawn * int(A[6 * ((pixel >> 16) * width + (pixel & 65535)) + 5])
        W[$px + k] = (pixel & 65535) + centred(Q[q], pixel, 0)
        W[$py + k] = (pixel >> 16) + centred(Q[q + 1], pixel, 1)
        for d in range(2, $drawn):
            W[($rows - 2 + d) * m + k] = sample(Q[q + d], pixel, d)
"""
"""All random numbers of the next sample of n pixels, ``y << 16 | x`` each; rows beyond n repeat the last
pixel."""

SHADE = """
def shade(W, m, first, P):
    for i in range(0, m, WIDTH):
        status = load(W, $status + i)
        dx = load(W, $dx + i)
        dy = load(W, $dy + i)
        dz = load(W, $dz + i)
        tr = load(W, $tr + i)
        tg = load(W, $tg + i)
        tb = load(W, $tb + i)
        missed = (status > 1.5) & (status < 2.5)
        hit = (status < 1.5) | (status > 2.5)
        r = 0.0 * dx
        g = r
        b = r
        if any_of(missed):
            r, g, b = background(dx, dy, dz, P)
        more = 0.0 * dx
        if any_of(hit):
            t = load(W, $t + i)
            path = load(W, $path + i)
            x = load(W, $ox + i) + t * dx
            y = load(W, $oy + i) + t * dy
            z = load(W, $oz + i) + t * dz
            $outs = surface(x, y, z, dx, dy, dz, t, path, load(W, $steps + i), load(W, $side + i), $numbers P)
            r = where(hit, hr, r)
            g = where(hit, hg, g)
            b = where(hit, hb, b)$onward
        store(W, $r + i, load(W, $r + i) + tr * r)
        store(W, $g + i, load(W, $g + i) + tg * g)
        store(W, $b + i, load(W, $b + i) + tb * b)
"""
"""Adds the light of every ray, and turns it into the one that goes on."""

ONWARD = """
            er = where(hit, tr * er, 0.0)
            eg = where(hit, tg * eg, 0.0)
            eb = where(hit, tb * eb, 0.0)
            more = er + eg + eb
            store(W, $tr + i, er)
            store(W, $tg + i, eg)
            store(W, $tb + i, eb)
            store(W, $path + i, path + t)
            store(W, $ox + i, nx)
            store(W, $oy + i, ny)
            store(W, $oz + i, nz)
            store(W, $dx + i, ex)
            store(W, $dy + i, ey)
            store(W, $dz + i, ez)
            store(W, $side + i, es)
            enter, leave = span_box(nx, ny, nz, ex, ey, ez, P)
            store(W, $end + i, where(more > 0.002, leave, 0.0))
            store(W, $start + i, enter)
        else:
            store(W, $tr + i, more)
            store(W, $tg + i, more)
            store(W, $tb + i, more)
        start = load(W, $start + i)
        store(W, $start + i, where(more > 0.002, start, 1e30))"""
"""A ray that is over starts behind its end, so that it is not followed: its numbers may be no numbers."""

GATHER = """
def gather(W, I, A, n, m, width):
    for k in range(n):
        pixel = I[WIDTH + k]
        a = 6 * ((pixel >> 16) * width + (pixel & 65535))
        r = W[$r + k]
        g = W[$g + k]
        b = W[$b + k]
        r = min(max(r, 0.0), 1e4) if r == r else 0.0
        g = min(max(g, 0.0), 1e4) if g == g else 0.0
        b = min(max(b, 0.0), 1e4) if b == b else 0.0
        bright = 0.2126 * r + 0.7152 * g + 0.0722 * b
        bright = bright / (1.0 + bright)
        A[a] += r
        A[a + 1] += g
        A[a + 2] += b
        A[a + 3] += bright
        A[a + 4] += bright * bright
        A[a + 5] += 1.0
"""
"""Adds one sample to n pixels; no NaN, no infinity, no negative light."""

TILE = """
def tile(P, Q, S, W, I, A, n, m, width, limit, blocks):
    draw(W, Q, I, A, n, m, width)
    begin(W, m, P)
    for k in range(n):
        pixel = I[WIDTH + k]
        early = S[(pixel >> 16 + $shift) * blocks + ((pixel & 65535) >> $shift)]
        W[$start + k] = max(W[$start + k], early)
    for bounce in range($bounces + 1):
        follow_step_ray(W, I, n, m, limit, P)
        shade(W, m, ($rows + $camera_samples - 2 + bounce * $bounce_samples) * m, P)
    gather(W, I, A, n, m, width)
"""

CONES = """
def cones(P, S, I, W, n, m, blocks, limit):
    for k in range(m):
        block = I[WIDTH + min(k, n - 1)]
        W[$px + k] = (block % blocks + 0.5) * $block
        W[$py + k] = (block // blocks + 0.5) * $block
    begin(W, m, P)
    for k in range(n):
        W[$start + k] = 0.0
        W[$end + k] = $far
    follow_step_cone(W, I, n, m, limit, P)
    for k in range(n):
        S[I[WIDTH + k]] = W[$t + k] if W[$status + k] != 2.0 else 1e30
"""


def loops(frame: Frame, block: int) -> tuple[Linked, tuple[Loop, ...]]:
    """The frame's source with the lanes' functions beside it, and the C functions to make of it."""
    words = _words(frame, block)
    parts = [FOLLOW.replace("STEP", "step_ray").replace("MORE", "side, path," if frame.inside else "path,")]
    parts += [BEGIN, DRAW, SHADE.replace("$onward", ONWARD if frame.bounces else ""), GATHER]
    entries = [Loop("tile", "rirrirnnnnn", _filled(TILE, words))]
    if frame.sharp:
        parts.append(FOLLOW.replace("STEP", "step_cone").replace("MORE", ""))
        entries.append(Loop("cones", "rrirnnnn", _filled(CONES, words)))
    source = frame.linked.source + "".join(_filled(part, words) for part in parts)
    return Linked(source, frame.linked.parameters), tuple(entries)


def workspace(frame: Frame, rays: int, width: int) -> int:
    """How many numbers the workspace of a tile holds."""
    return (len(ROWS) + frame.samples) * rays + len(LANES) * width


def _words(frame: Frame, block: int) -> dict[str, str]:
    """What stands for the $words of the loops."""
    rows = len(ROWS)
    return {name: f"{k} * m" for k, name in enumerate(ROWS)} | {
        "rows": str(rows),
        "block": str(block),
        "shift": str(block.bit_length() - 1),
        "bounces": str(frame.bounces),
        "camera_samples": str(frame.camera_samples),
        "bounce_samples": str(frame.bounce_samples),
        "drawn": str(frame.samples),
        "lens": "0.0, 0.0" if frame.sharp else f"load(W, {rows} * m + i), load(W, {rows + 1} * m + i)",
        "numbers": "".join(f"load(W, first + {k} * m + i), " for k in range(frame.bounce_samples)),
        "outs": "hr, hg, hb" + (", er, eg, eb, nx, ny, nz, ex, ey, ez, es" if frame.bounces else ""),
        "far": frame.far,
    }


def _filled(text: str, words: dict[str, str]) -> str:
    """The text with $names as rows and other words, @names as lanes' places behind the rows."""
    places = [
        (name, f"({words['rows']} + {words['drawn']}) * m + {k} * WIDTH") for k, name in enumerate(LANES)
    ]
    for name, place in sorted(places, key=lambda p: -len(p[0])):
        text = text.replace(f"@{name}", place)
    return Template(text).substitute(words)
