"""Along a ray to the surface."""

from __future__ import annotations

from ...formulas.vocabulary import any_of, maximum, minimum, sqrt, where
from .intrinsics import field


def span(ox, oy, oz, dx, dy, dz, lo, hi):
    """Where a ray enters and leaves a box; it misses where the first is not smaller (Kay and Kajiya 1986,
    slabs).

    A direction's component is kept from zero: 1e-9 bends a ray by less than any pixel.
    """
    x0, y0, z0 = lo
    x1, y1, z1 = hi
    ix = 1.0 / where(dx * dx < 1e-18, 1e-9, dx)
    iy = 1.0 / where(dy * dy < 1e-18, 1e-9, dy)
    iz = 1.0 / where(dz * dz < 1e-18, 1e-9, dz)
    ax = (x0 - ox) * ix
    bx = (x1 - ox) * ix
    ay = (y0 - oy) * iy
    by = (y1 - oy) * iy
    az = (z0 - oz) * iz
    bz = (z1 - oz) * iz
    enter = maximum(maximum(minimum(ax, bx), minimum(ay, by)), minimum(az, bz))
    leave = minimum(minimum(maximum(ax, bx), maximum(ay, by)), maximum(az, bz))
    return maximum(enter, 0.0), leave


def advance(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P, steepness, relax, cone, least, glass):
    """One step of safe, over-relaxed sphere tracing: the new t, radius and stride, and the gap, negative at
    a hit.

    Hart 1996, "Sphere Tracing"; over-relaxation: Keinert et al. 2014, "Enhanced Sphere Tracing". ``|f| / L``
    is the radius of an empty ball. A step of `relax` times it is kept if the next ball touches the one
    before; if not, the ray goes back to the end of that ball. A hit is where the surface is nearer than half
    a pixel is wide. side: -1 inside, where the field of a fractal says little: there a hit is a change of
    sign, and steps are two pixels at least.
    """
    f = field(ox + t * dx, oy + t * dy, oz + t * dz, P)
    if glass:
        f = side * f
    radius = f * steepness
    near = cone * (path + t) + least
    kept = radius + before >= stride
    step = relax * radius
    margin = near
    if glass:
        inside = side < 0.0
        kept = kept | inside
        margin = where(inside, 0.0, near)
        step = where(inside, maximum(step, 4.0 * near), step)
    gap = where(kept, radius - margin, 1.0)
    after = where(kept, where(gap < 0.0, t, t + step), t - stride + before)
    return after, where(kept, radius, before), where(kept, step, 0.0), gap


def widen(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P, steepness, spread):
    """One step of a cone `spread` wide at distance 1: as far as the empty ball holds the whole cone.

    The gap is negative where the ball is hardly wider than the cone: up to there every ray in it is free.
    """
    radius = field(ox + t * dx, oy + t * dy, oz + t * dz, P) * steepness
    width = spread * (t + maximum(radius, 0.0))
    gap = radius - 1.5 * width
    step = sqrt(maximum(radius * radius - width * width, 0.0))
    return where(gap < 0.0, t, t + step), before, stride, gap


def visible(x, y, z, dx, dy, dz, far, least, P, steepness, patience):
    """1 where the light at distance `far` along a ray is seen, 0 where something is nearer than `least` to
    the ray."""
    t = 0.0 * x
    blocked = 0.0 * x
    going = t < far
    for _ in range(patience):
        if not any_of(going):
            break
        radius = field(x + t * dx, y + t * dy, z + t * dz, P) * steepness
        blocked = where(going & (radius < least), 1.0, blocked)
        t = t + maximum(radius, least)
        going = going & (t < far) & (blocked < 0.5)
    return 1.0 - blocked
