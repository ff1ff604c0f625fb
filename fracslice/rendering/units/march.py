"""Sphere tracing along rays and cones, surface normals, and the functions of the scene that the linker
writes.
"""

from __future__ import annotations

from ...expr.loops import field, gather, intrinsic
from ...expr.vocabulary import absolute, any_of, exp, maximum, minimum, normalised, sqrt, where

__all__ = [
    "background",
    "blocker",
    "camera_ray",
    "field",
    "gather",
    "span_box",
    "step_cone",
    "step_ray",
    "surface",
    "traced",
    "traced_glass",
    "transparent",
]


@intrinsic
def blocker(x, y, z, P):
    """Evaluate the field of the opaque parts of the scene."""
    raise NotImplementedError


@intrinsic
def transparent(x, y, z, P):
    """Evaluate the field of the transparent parts of the scene.

    Returns f, r, g, b, kept green and blue per scene unit.
    """
    raise NotImplementedError


@intrinsic
def traced(x, y, z, P):
    """Evaluate the materials of the scene.

    Returns the field, the number of the material and the orbit trap.
    """
    raise NotImplementedError


@intrinsic
def traced_glass(x, y, z, P):
    """Evaluate the materials of the transparent parts of the scene; see `traced`."""
    raise NotImplementedError


@intrinsic
def camera_ray(px, py, lens_u, lens_v, P):
    """Return the ray through a point of the film and a point of the lens."""
    raise NotImplementedError


@intrinsic
def span_box(ox, oy, oz, dx, dy, dz, P):
    """Return the interval of a ray in the scene's box."""
    raise NotImplementedError


@intrinsic
def step_ray(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a ray: `march.advance` with the scene's parameters."""
    raise NotImplementedError


@intrinsic
def step_cone(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P):
    """Take one step along a cone: `march.widen` with the scene's parameters."""
    raise NotImplementedError


@intrinsic
def surface(x, y, z, dx, dy, dz, t, path, steps, side, last, q, u, P):
    """Shade a surface point.

    `q`: density of the direction of the ray; `u`: random numbers in [0, 1).
    """
    raise NotImplementedError


@intrinsic
def background(dx, dy, dz, q, P):
    """Return the light of a ray that misses the scene.

    `q`: density of the direction.
    """
    raise NotImplementedError


MOST = 1.8
"""Maximum over-relaxation factor; above 2, balls do not touch."""

TOUCHING = 0.9
"""Least radius of a ball that touches a surface, relative to its height."""
LOWER = 2
"""Lower heights that are tried for such a ball."""
FLATTEST = 0.05
"""Sine of the angle to a surface below which a ray starts above it."""


def span(ox, oy, oz, dx, dy, dz, lo, hi):
    """Return the interval of a ray in a box by the slab method (Kay and Kajiya 1986).

    Components of the direction are kept away from zero: 1e-9 bends a ray by less than any pixel.

    `lo`, `hi`: lower and upper corner of the box.
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


def advance(
    ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P, steepness, cone, least, rounding, glass
):  # fmt: skip
    """Take one step of safe, over-relaxed sphere tracing.

    Sphere tracing: Hart 1996, "Sphere Tracing". Over-relaxation: Keinert et al. 2014, "Enhanced Sphere
    Tracing". ``|f| / L`` is the radius of an empty ball. A longer step is kept if the next ball touches the
    previous one; otherwise the ray returns to the end of the previous ball. The factor is that of a plane at
    the slope of the last step (Balint and Valasek 2018, "Accelerating Sphere Tracing").

    The surface may be many times as far as the radius. The slope along the ray estimates its distance: a step
    passes behind a surface that is nearer than a quarter of a pixel by the estimate. A hit is a change of
    sign over less than two pixels, or within an empty ball, where only rounding causes it. The root is that
    of the secant.

    Inside the solid (side -1), the field of a fractal is no useful bound: steps are at least two pixels.
    Longer ones obey the same rule, so that no gap is passed; a step that leaves the solid by more is repeated
    up to the secant's root.

    `cone`, `least`, `rounding`: half width of a pixel at distance 1 and at distance 0.
    """
    f = field(ox + t * dx, oy + t * dy, oz + t * dz, P)
    if glass:
        f = side * f
    radius = f * steepness
    near = cone * (path + t) + least
    fall = maximum(before - radius, 1e-30)
    ahead = radius * stride / fall
    hit = (radius < rounding) & (stride <= maximum(before, 4.0 * near))
    kept = maximum(radius, 0.0) + before >= stride
    relax = maximum(MOST * stride / (stride + fall), 1.0)
    step = relax * radius
    step = where(ahead < 0.5 * near, maximum(step, 2.0 * ahead), step)
    if glass:
        inside = side < 0.0
        beyond = inside & (radius < 0.0)
        near_exit = beyond & (stride <= 4.0 * near)
        sure = (before + absolute(radius) >= stride) | (stride <= 4.0 * near)
        outside = side > 0.0
        kept = (outside & kept) | (inside & sure & ((radius >= 0.0) | near_exit))
        hit = near_exit | (hit & outside)
        step = where(inside, maximum(step, 4.0 * near), step)
        back = where(beyond & sure, maximum(stride + ahead - 2.0 * near, 0.5 * (stride + ahead)), before)
        after = where(kept, t + step, t - stride + back)
        after = where(hit, t + where(radius < 0.0, ahead, 0.0), after)
        return after, where(kept, radius, before), where(kept, step, back), where(hit, -1.0, 1.0)
    after = where(kept, t + step, t - stride + before)
    after = where(hit, t + where(radius < 0.0, ahead, 0.0), after)
    return after, where(kept, radius, before), where(kept, step, before), where(hit, -1.0, 1.0)


def hit_width(t, cone, least):
    """Return the hit tolerance at distance t.

    `cone`, `least`: half width of a pixel at distance 1 and at distance 0.
    """
    return cone * t + least


def sharp_width(h, rounding, sharper):
    """Return half the width over which a normal is taken where rays are bent, at least that of noise.

    `h`: half width of a pixel; `sharper`: its ratio to the width.
    """
    return minimum(h, maximum(h / sharper, 32.0 * rounding))


def touching(x, y, z, nx, ny, nz, lift, P, steepness):
    """Return height and radius of an empty ball above a surface that about touches it.

    A small body may be nearer than the first height: lower balls are tried. A rough surface is touched by
    none of them, and keeps the first height.

    `lift`: first height of the centre, scene units.
    """
    radius = field(x + lift * nx, y + lift * ny, z + lift * nz, P) * steepness
    height = lift
    lower = lift
    for _ in range(LOWER):
        apart = radius < TOUCHING * height
        if not any_of(apart):
            break
        lower = 0.25 * lower
        other = field(x + lower * nx, y + lower * ny, z + lower * nz, P) * steepness
        apart = apart & (other >= TOUCHING * lower)
        height = where(apart, lower, height)
        radius = where(apart, other, radius)
    return height, radius


def leave(x, y, z, nx, ny, nz, ex, ey, ez, lift, P, steepness):
    """Return the start of a ray that leaves a surface.

    A ball above the surface touches it there. The ray starts where it leaves the ball, and is that of the
    point. If it passes beside the ball, or almost along the surface, it starts at the ball's centre.

    `ex`, `ey`, `ez`: unit direction of the ray; `lift`: height of the ball's centre, scene units.
    """
    height, radius = touching(x, y, z, nx, ny, nz, lift, P, steepness)
    cosine = nx * ex + ny * ey + nz * ez
    along = height * cosine
    inside = radius * radius - height * height + along * along
    on = along + sqrt(maximum(inside, 0.0))
    met = (inside > 0.0) & (radius > 0.0) & (cosine > FLATTEST)
    return (
        x + where(met, on * ex, height * nx),
        y + where(met, on * ey, height * ny),
        z + where(met, on * ez, height * nz),
    )


def widen(ox, oy, oz, dx, dy, dz, t, before, stride, side, path, P, steepness):
    """Take one step of a cone, as far as the empty ball contains the whole cone."""
    radius = field(ox + t * dx, oy + t * dy, oz + t * dz, P) * steepness
    width = path * (t + maximum(radius, 0.0))
    gap = radius - 1.2 * width
    step = sqrt(maximum(radius * radius - width * width, 0.0))
    return where(gap < 0.0, t, t + step), before, stride, gap


def visible(x, y, z, dx, dy, dz, far, least, P, steepness, patience, glass, lo, hi):
    """Trace a shadow ray, up to where it leaves a box that holds all bodies.

    `x`, `y`, `z`: start of the ray; `dx`, `dy`, `dz`: unit direction to the light.
    """
    _, leave = span(x, y, z, dx, dy, dz, lo, hi)
    far = minimum(far, leave)
    t = 0.0 * x
    blocked = 0.0 * x
    going = t < far
    for _ in range(patience):
        if not any_of(going):
            break
        if glass:
            radius = field(x + t * dx, y + t * dy, z + t * dz, P) * steepness
        else:
            radius = blocker(x + t * dx, y + t * dy, z + t * dz, P) * steepness
        blocked = where(going & (radius < 0.0), 1.0, blocked)
        t = where(going, minimum(t + maximum(radius, least), far), t)
        going = going & (t < far) & (blocked < 0.5)
    return 1.0 - blocked


def tinted_shadow(x, y, z, dx, dy, dz, far, least, P, steepness, patience):
    """Return the light that transparent parts pass on to a point, as if they did not bend it.

    The arguments are those of `visible`.
    """
    t = 0.0 * x
    r = t + 1.0
    g = r
    b = r
    before = r
    going = t < far
    for _ in range(patience):
        if not any_of(going):
            break
        f, fr, fg, fb, kept = transparent(x + t * dx, y + t * dy, z + t * dz, P)
        step = maximum(absolute(f) * steepness, least)
        side = where(f < 0.0, -1.0, 1.0 + 0.0 * t)
        inside = going & (f < 0.0)
        edge = where(going & (side * before < 0.0), kept, 1.0)
        r = r * edge * where(inside, exp(-fr * step), 1.0)
        g = g * edge * where(inside, exp(-fg * step), 1.0)
        b = b * edge * where(inside, exp(-fb * step), 1.0)
        before = where(going, side, before)
        t = t + step
        going = going & (t < far)
    return r, g, b


def normal(x, y, z, h, P):
    """Return the unit normal from four field samples at the corners of a tetrahedron (Quilez 2015).

    `h`: half edge of the cube that contains the corners.
    """
    gx, gy, gz = 0.0 * x, 0.0 * x, 0.0 * x
    for k in range(4):
        sy = 1.0 if k > 1 else -1.0
        sz = 1.0 if k % 2 == 1 else -1.0
        sx = sy * sz
        f = field(x + sx * h, y + sy * h, z + sz * h, P)
        gx = gx + sx * f
        gy = gy + sy * f
        gz = gz + sz * f
    over = 1.0 / h
    return normalised(gx * over, gy * over, gz * over)
