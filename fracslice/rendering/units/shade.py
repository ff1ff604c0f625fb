"""Light at a surface: reflection, refraction, microfacets, palettes and textures, light from a picture
of the surroundings and from bodies that glow, and transmittance of fog.

The table of light holds red, green and blue of each pixel. The tables of probability hold the distribution
function of the rows, then that of the columns of each row, every one from 0 to 1 (Pharr, Jakob and Humphreys
2016, "Physically Based Rendering", 13.6.7 and 14.2.4).

Microfacets are those of Trowbridge and Reitz 1975 (GGX of Walter et al. 2007), with Smith's height-correlated
shadowing and masking.

Samples of lights and of surfaces are weighted by the power heuristic of Veach and Guibas 1995, "Optimally
Combining Sampling Techniques for Monte Carlo Rendering". Each ray carries the density with which the surface
took its direction; 0 for a ray of the camera, a mirror or glass, for which no light is sampled.

A ray is sent to a body, or as the surface reflects and scatters. Its light is divided by the density of all
together: the balance heuristic of Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte
Carlo Rendering", with one sample. The ray itself finds what it meets, so that boxes need not fit.
"""

from __future__ import annotations

from ...expr.vocabulary import (
    TURN,
    absolute,
    atan2,
    cos,
    exp,
    floor,
    frame,
    log,
    maximum,
    minimum,
    normalised,
    rsqrt,
    sin,
    sqrt,
    where,
)
from .march import field, gather, span


def phong(nx, ny, nz, dx, dy, dz, lx, ly, lz, specular, shininess):
    """Return the diffuse and specular factors of one light (Phong 1975, with Blinn's 1977 half vector)."""
    diffuse = maximum(nx * lx + ny * ly + nz * lz, 0.0)
    hx, hy, hz = normalised(lx - dx, ly - dy, lz - dz)
    cosine = maximum(nx * hx + ny * hy + nz * hz, 1e-6)
    return diffuse, where(diffuse > 0.0, specular * exp(shininess * log(cosine)), 0.0)


def occlusion(x, y, z, nx, ny, nz, P, strength, reach):
    """Estimate ambient occlusion from five field samples along the normal (Evans 2006).

    `reach` in scene units.
    """
    closed = 0.0 * x
    weight = 0.5
    for i in range(5):
        h = reach * (i + 1.0) * 0.2
        f = field(x + h * nx, y + h * ny, z + h * nz, P)
        closed = closed + weight * maximum(1.0 - maximum(f, 0.0) / h, 0.0)
        weight = 0.5 * weight
    return maximum(1.0 - strength * closed, 0.0)


def palette(tone, P, stops, count):
    """Interpolate a cyclic palette; tone 0 and tone 1 are both the first stop.

    `tone`: position in [0, 1].
    """
    r = 0.0 * tone
    g = 0.0 * tone
    b = 0.0 * tone
    place = tone * count
    for k in range(count):
        near = absolute(place - k)
        weight = maximum(1.0 - minimum(near, count - near), 0.0)
        r = r + weight * stops[3 * k]
        g = g + weight * stops[3 * k + 1]
        b = b + weight * stops[3 * k + 2]
    return r, g, b


def varied(rough, vary, turn):
    """Return the roughness at a position in a palette."""
    middle = 1.0 - absolute(2.0 * (turn - floor(turn)) - 1.0)
    return minimum(maximum(rough + vary * middle, 0.0), 1.0)


def lacquer(facing, coat):
    """Return the reflectance of a lacquer of refractive index 1.5."""
    cosine = minimum(maximum(facing, 0.0), 1.0)
    return coat * dielectric(cosine, 1.0 - (1.0 - cosine * cosine) / 2.25, 1.0 / 1.5)


def mirrored(dx, dy, dz, nx, ny, nz):
    """Return the direction of reflection."""
    twice = 2.0 * (dx * nx + dy * ny + dz * nz)
    return dx - twice * nx, dy - twice * ny, dz - twice * nz


def fresnel(cosine, least):
    """Reflectance at an angle of incidence (Schlick 1994)."""
    a = 1.0 - minimum(maximum(cosine, 0.0), 1.0)
    a2 = a * a
    return least + (1.0 - least) * a2 * a2 * a


def dielectric(cosine, left, ratio):
    """Reflectance of a transparent surface for unpolarised light (Fresnel 1823)."""
    on = sqrt(maximum(left, 0.0))
    across = (ratio * cosine - on) / maximum(ratio * cosine + on, 1e-9)
    along = (cosine - ratio * on) / maximum(cosine + ratio * on, 1e-9)
    return where(left > 0.0, 0.5 * (across * across + along * along), 1.0)


def bent(dx, dy, dz, nx, ny, nz, cosine, ratio):
    """Return the direction of refraction (Snell's law)."""
    left = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    k = ratio * cosine - sqrt(maximum(left, 0.0))
    return ratio * dx + k * nx, ratio * dy + k * ny, ratio * dz + k * nz, left


def reflects(dx, dy, dz, nx, ny, nz, reflect):
    """Return the reflectance of a mirror and the direction of reflection."""
    cosine = -(dx * nx + dy * ny + dz * nz)
    part = where(reflect > 0.0, fresnel(cosine, reflect), 0.0)
    rx, ry, rz = mirrored(dx, dy, dz, nx, ny, nz)
    return part, rx, ry, rz


def goes_on(dx, dy, dz, nx, ny, nz, side, reflect, clear, index, chance):
    """Return the continuation of a ray at a transparent or mirroring surface.

    A random number chooses between reflection and refraction with Fresnel weights. The normal points to the
    side of the incoming ray.
    """
    cosine = -(dx * nx + dy * ny + dz * nz)
    mirror = where(reflect > 0.0, fresnel(cosine, reflect), 0.0)
    ratio = where(side < 0.0, index + 0.0 * cosine, 1.0 / (index + 0.0 * cosine))
    bx, by, bz, left = bent(dx, dy, dz, nx, ny, nz, cosine, ratio)
    back = maximum(dielectric(maximum(cosine, 0.0), left, ratio), mirror)
    through = (clear > 0.0) & (chance > back)
    rx, ry, rz = mirrored(dx, dy, dz, nx, ny, nz)
    share = where(clear > 0.0, clear + 0.0 * cosine, mirror)
    ex = where(through, bx, rx)
    ey = where(through, by, ry)
    ez = where(through, bz, rz)
    return share, ex, ey, ez, where(through, -1.0, 1.0 + 0.0 * cosine)


def fog(t, density):
    """Transmittance of fog (Beer-Lambert law).

    `t` in scene units; `density`: extinction per scene unit.
    """
    return exp(-density * t)


def thickness(z, density, level, height):
    """Extinction of fog that thins with the height.

    `z`: height; `density`: extinction per scene unit at `level`; it thins to 1/e over `height`.
    """
    return density * exp(minimum((level - z) / height, 40.0))


def height_fog(t, z, dz, density, level, height):
    """Transmittance of fog that thins with the height: the integral of its extinction along a ray.

    `t` in scene units; `z`, `dz`: height of the ray's end, and vertical component of its direction.
    """
    drop = minimum(maximum(t * dz / height, -40.0), 40.0)
    curved = absolute(drop) > 1e-3
    mean = where(curved, (exp(drop) - 1.0) / where(curved, drop, 1.0), 1.0 + 0.5 * drop)
    return exp(-minimum(t * mean * thickness(z, density, level, height), 80.0))


HALF_TURN = 3.141592653589793


def bounded(i, count):
    """Return a whole index limited to a range.

    `i`: index.
    """
    return minimum(where(i > 0.0, i, 0.0), count - 1.0)


def seen_at(dx, dy, dz, turn):
    """Return the point of the picture in a direction.

    Returns u, v coordinates in [0, 1].
    """
    u = 0.5 + atan2(dx, dy) / TURN + turn
    return u - floor(u), atan2(sqrt(dx * dx + dy * dy), dz) / HALF_TURN


def between(light, width, left, right, across, upper, lower, down, P):
    """Interpolate four pixels bilinearly.

    `left`, `right`, `upper`, `lower`: columns and rows of the four pixels.
    """
    a = light + 3.0 * (upper * width + left)
    b = light + 3.0 * (upper * width + right)
    c = light + 3.0 * (lower * width + left)
    d = light + 3.0 * (lower * width + right)
    wa = (1.0 - across) * (1.0 - down)
    wb = across * (1.0 - down)
    wc = (1.0 - across) * down
    wd = across * down
    return (
        wa * gather(a, P) + wb * gather(b, P) + wc * gather(c, P) + wd * gather(d, P),
        wa * gather(a + 1.0, P) + wb * gather(b + 1.0, P) + wc * gather(c + 1.0, P) + wd * gather(d + 1.0, P),
        wa * gather(a + 2.0, P) + wb * gather(b + 2.0, P) + wc * gather(c + 2.0, P) + wd * gather(d + 2.0, P),
    )


def surroundings(dx, dy, dz, light, width, height, turn, tint, P):
    """Return the light from a direction."""
    tr, tg, tb = tint
    u, v = seen_at(dx, dy, dz, turn)
    column = floor(u * width - 0.5)
    row = floor(v * height - 0.5)
    left = bounded(where(column < 0.0, width - 1.0, column), width)
    right = where(left > width - 1.5, 0.0, left + 1.0)
    upper = bounded(row, height)
    lower = bounded(row + 1.0, height)
    across = u * width - 0.5 - column
    down = v * height - 0.5 - row
    r, g, b = between(light, width, left, right, across, upper, lower, down, P)
    return tr * r, tg * g, tb * b


def interval(value, first, count, steps, half, P):
    """Find the interval of a distribution function that contains a value, by bisection."""
    i = 0.0 * value
    step = i + half
    for _ in range(steps):
        next_ = minimum(i + step, count - 1.0)
        i = where(gather(first + next_, P) <= value, next_, i)
        step = 0.5 * step
    low = gather(first + i, P)
    size = gather(first + i + 1.0, P) - low
    return i, minimum((value - low) / maximum(size, 1e-30), 1.0), size * count


def towards(u, v, rows, columns, size, steps, halves, turn, P):
    """Sample a direction with a density in proportion to the light."""
    width, height = size
    across, down = steps
    half_across, half_down = halves
    row, part, dense = interval(v, rows, height, down, half_down, P)
    latitude = HALF_TURN * (row + part) / height
    column, part, denser = interval(u, columns + row * (width + 1.0), width, across, half_across, P)
    longitude = TURN * ((column + part) / width - 0.5 - turn)
    sine = sin(latitude)
    density = dense * denser / (2.0 * HALF_TURN * HALF_TURN * maximum(sine, 1e-6))
    return sine * sin(longitude), sine * cos(longitude), cos(latitude), density


def likelihood(dx, dy, dz, rows, columns, size, turn, P):
    """Return the density with which `towards` takes a direction."""
    width, height = size
    u, v = seen_at(dx, dy, dz, turn)
    row = bounded(floor(v * height), height)
    place = columns + row * (width + 1.0) + bounded(floor(u * width), width)
    dense = height * (gather(rows + row + 1.0, P) - gather(rows + row, P))
    denser = width * (gather(place + 1.0, P) - gather(place, P))
    sine = sqrt(dx * dx + dy * dy)
    return dense * denser / (2.0 * HALF_TURN * HALF_TURN * maximum(sine, 1e-6))


def irradiance(nx, ny, nz, harmonics):
    """Return the light that a white surface scatters under a sky without shadows.

    Nine spherical harmonics (Ramamoorthi and Hanrahan 2001, "An Efficient Representation for Irradiance
    Environment Maps").
    """
    hr, hg, hb = harmonics
    return harmonic(nx, ny, nz, hr), harmonic(nx, ny, nz, hg), harmonic(nx, ny, nz, hb)


def harmonic(x, y, z, h):
    """Return one channel of `irradiance`.

    `x`, `y`, `z`: unit normal; `h`: nine factors.
    """
    a, b, c, d, e, f, g, i, j = h
    linear = a + b * y + c * z + d * x
    square = e * x * y + f * y * z + g * (3.0 * z * z - 1.0) + i * x * z + j * (x * x - y * y)
    return maximum(linear + square, 0.0)


def repeated(u, v, light, width, height, P):
    """Return a picture that is repeated across and down.

    `u`, `v`: coordinates, pictures.
    """
    a = width * (u - floor(u)) - 0.5
    b = height * (v - floor(v)) - 0.5
    column = floor(a)
    row = floor(b)
    left = bounded(where(column < 0.0, width - 1.0, column), width)
    upper = bounded(where(row < 0.0, height - 1.0, row), height)
    right = where(left > width - 1.5, 0.0, left + 1.0)
    lower = where(upper > height - 1.5, 0.0, upper + 1.0)
    return between(light, width, left, right, a - column, upper, lower, b - row, P)


def triplanar(x, y, z, nx, ny, nz, light, width, height, tile, P):
    """Return a picture seen along the three axes, weighted by the fourth power of the normal.

    Geiss 2007, "Generating Complex Procedural Terrains Using the GPU", in GPU Gems 3.

    `tile` in scene units.
    """
    across = 1.0 / tile
    down = -across * width / height
    ar, ag, ab = repeated(across * y, down * z, light, width, height, P)
    br, bg, bb = repeated(across * x, down * z, light, width, height, P)
    cr, cg, cb = repeated(across * x, down * y, light, width, height, P)
    a = nx * nx * nx * nx
    b = ny * ny * ny * ny
    c = nz * nz * nz * nz
    over = 1.0 / (a + b + c)
    return (
        over * (a * ar + b * br + c * cr),
        over * (a * ag + b * bg + c * cg),
        over * (a * ab + b * bb + c * cb),
    )


SMOOTHEST = 1e-3
"""Smallest square of the roughness."""
CELLS = 15.0
"""Cells along each side of the table of `lost`."""
WIDE = 2.0
"""Density of a direction below which a ray was scattered widely."""
DULL = 0.5
"""Least roughness of surfaces that such a ray meets."""
LACQUER = 0.1
"""Roughness with which a lacquer reflects a light; what it mirrors is sharp."""


def width(rough):
    """Return the parameter of the distribution: the square of the roughness (Burley 2012)."""
    return maximum(rough * rough, SMOOTHEST)


def hidden(cosine, a):
    """Smith's Lambda: the area of microfacets hidden in a direction, relative to the visible one.

    `a`: width of the distribution.
    """
    c2 = maximum(cosine * cosine, 1e-8)
    return 0.5 * (sqrt(1.0 + a * a * maximum(1.0 - c2, 0.0) / c2) - 1.0)


def tinted(cosine, least):
    """Reflectance at an angle of incidence; 0 for a surface that does not reflect."""
    return where(least > 0.0, fresnel(cosine, least), 0.0)


def highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough):
    """Return the reflection of a light, but for Fresnel's factor."""
    a = width(rough)
    hx, hy, hz = normalised(lx - dx, ly - dy, lz - dz)
    nl = nx * lx + ny * ly + nz * lz
    nv = maximum(-(nx * dx + ny * dy + nz * dz), 1e-4)
    nh = nx * hx + ny * hy + nz * hz
    spread = nh * nh * (a * a - 1.0) + 1.0
    facets = a * a / maximum(spread * spread, 1e-12)
    seen = 1.0 / (1.0 + hidden(nv, a) + hidden(nl, a))
    return where(nl > 0.0, 0.25 * facets * seen / nv, 0.0), lx * hx + ly * hy + lz * hz


def glossy(dx, dy, dz, nx, ny, nz, rough, u, v):
    """Sample a reflected ray by the visible microfacets (Heitz 2018)."""
    a = width(rough)
    ax, ay, az, bx, by, bz = frame(nx, ny, nz)
    vx, vy = -(ax * dx + ay * dy + az * dz), -(bx * dx + by * dy + bz * dz)
    vz = maximum(-(nx * dx + ny * dy + nz * dz), 1e-4)
    px, py, pz = normalised(a * vx, a * vy, vz)
    across = px * px + py * py
    over = where(across > 1e-12, rsqrt(maximum(across, 1e-12)), 0.0)
    tx, ty = where(across > 1e-12, -py * over, 1.0), px * over
    sx, sy, sz = -pz * ty, pz * tx, px * ty - py * tx
    r = sqrt(u)
    p, q = r * cos(TURN * v), r * sin(TURN * v)
    s = 0.5 * (1.0 + pz)
    q = (1.0 - s) * sqrt(maximum(1.0 - p * p, 0.0)) + s * q
    w = sqrt(maximum(1.0 - p * p - q * q, 0.0))
    mx, my, mz = p * tx + q * sx + w * px, p * ty + q * sy + w * py, q * sz + w * pz
    mx, my, mz = normalised(a * mx, a * my, maximum(mz, 1e-6))
    hx = mx * ax + my * bx + mz * nx
    hy = mx * ay + my * by + mz * ny
    hz = mx * az + my * bz + mz * nz
    ex, ey, ez = mirrored(dx, dy, dz, hx, hy, hz)
    nl = nx * ex + ny * ey + nz * ez
    seen = 1.0 + hidden(vz, a)
    weight = where(nl > 0.0, seen / (seen + hidden(nl, a)), 0.0)
    return ex, ey, ez, weight, -(dx * hx + dy * hy + dz * hz)


def dulled(rough, q):
    """Return the roughness of a surface to a ray.

    A ray that was scattered widely hardly ever meets a light in a sharp reflection, and is far too bright
    then: the reflection is widened (Kaplanyan and Dachsbacher 2013, "Path Space Regularization").

    `q`: density of the ray's direction.
    """
    wide = (q > 0.0) & (q < WIDE) & (rough > 0.0)
    return where(wide, maximum(rough, DULL), rough)


def lost(cosine, rough, table, P):
    """Return the light that one reflection by microfacets loses to others, relative to what it reflects.

    Others reflect it again, as the first one does (Turquin 2019, "Practical Multiple Scattering Compensation
    for Microfacet Models").

    `table`: share that is reflected at each roughness and root of the cosine, both from 0 to 1.
    """
    a = CELLS * rough
    b = CELLS * sqrt(maximum(cosine, 0.0))
    i = bounded(floor(a), CELLS)
    j = bounded(floor(b), CELLS)
    place = table + (CELLS + 1.0) * i + j
    a = a - i
    b = b - j
    low = (1.0 - b) * gather(place, P) + b * gather(place + 1.0, P)
    place = place + CELLS + 1.0
    high = (1.0 - b) * gather(place, P) + b * gather(place + 1.0, P)
    return where(rough > 0.0, 1.0 / ((1.0 - a) * low + a * high) - 1.0, 0.0)


def heuristic(taken, other):
    """Return the weight of a sample."""
    ratio = other / maximum(taken, 1e-12)
    return where(taken > 0.0, 1.0 / (1.0 + ratio * ratio), 0.0)


def facet_density(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough):
    """Return the density with which `shade.glossy` takes a direction.

    `lx`, `ly`, `lz`: unit direction of reflection.
    """
    a = width(rough)
    value, _ = highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough)
    there = hidden(nx * lx + ny * ly + nz * lz, a)
    back = hidden(maximum(-(nx * dx + ny * dy + nz * dz), 1e-4), a)
    return value * (1.0 + there + back) / ((1.0 + back) * HALF_TURN)


def weights(dense, diffuse, nx, ny, nz, dx, dy, dz, lx, ly, lz, rough, share, free):
    """Return the weights of a light's sample for scattered and for reflected light."""
    facets = share * facet_density(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough)
    scattered = heuristic(dense, (1.0 - share) * diffuse / HALF_TURN)
    reflected = where(rough > 0.0, heuristic(dense, facets), 1.0)
    return where(free > 0.5, 1.0, scattered), where(free > 0.5, 1.0, reflected)


def mixed_weights(dense, likely, rough, free):
    """Return the weights of a light's sample where all rays that continue have one density."""
    weight = where(free > 0.5, 1.0, heuristic(dense, likely))
    return weight, where(rough > 0.0, weight, 1.0)


def density_onward(chosen, nx, ny, nz, dx, dy, dz, ex, ey, ez, rough, share):
    """Return the density of a continued ray.

    `nx`, `ny`, `nz`, `dx`, `dy`, `dz`, `ex`, `ey`, `ez`: unit normal, direction of the ray, direction of the
    continued ray.
    """
    facets = share * facet_density(nx, ny, nz, dx, dy, dz, ex, ey, ez, rough)
    cosine = maximum(nx * ex + ny * ey + nz * ez, 0.0)
    mirror = where(rough > 0.0, facets, 0.0)
    return where(chosen, mirror, (1.0 - share) * cosine / HALF_TURN)


def sun_density(dx, dy, dz, towards, spread):
    """Return the density with which `scene.lights.sun` takes a direction."""
    lx, ly, lz = towards
    cosine = dx * lx + dy * ly + dz * lz
    s2 = spread * spread
    inside = cosine * sqrt(1.0 + s2) > 1.0
    return where(inside, 1.0 / (HALF_TURN * s2 * maximum(cosine * cosine * cosine, 1e-6)), 0.0)


def behind(q, dense):
    """Return the weight of a picture of the surroundings for a ray that misses the scene.

    `q`: density of the ray.
    """
    return where(q > 0.0, heuristic(q, dense), 1.0)


def sunshine(q, dense):
    """Return the light of a sun for a ray that misses the scene.

    `q`: density of the ray.
    """
    return where(q > 0.0, HALF_TURN * dense * heuristic(q, dense), 0.0)


SENT = 0.5
"""Largest share of the rays that are sent to bodies, where one is above the horizon."""


def prominence(x, y, z, nx, ny, nz, body):
    """Return the weight with which a body is chosen."""
    cx, cy, cz, hx, hy, hz, power = body
    px, py, pz = cx - x, cy - y, cz - z
    height = px * nx + py * ny + pz * nz + hx * absolute(nx) + hy * absolute(ny) + hz * absolute(nz)
    outside = maximum(maximum(absolute(px) - hx, absolute(py) - hy), absolute(pz) - hz)
    squared = px * px + py * py + pz * pz + hx * hx + hy * hy + hz * hz
    return where((height > 0.0) & (outside > 0.0), power / squared, 0.0)


def smallness(x, y, z, body):
    """Return the part of `SENT` for a body: rays of the surface meet a large one anyhow."""
    cx, cy, cz, hx, hy, hz, power = body
    px, py, pz = cx - x, cy - y, cz - z
    ratio = (hx * hx + hy * hy + hz * hz) / (px * px + py * py + pz * pz)
    return 1.0 / (1.0 + ratio * ratio)


def sent_share(x, y, z, nx, ny, nz, P, bodies, count):
    """Return the share of the rays that are sent to bodies."""
    total = 0.0 * x
    small = 0.0 * x
    for k in range(count):
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        total = total + weight
        small = small + weight * smallness(x, y, z, bodies[k])
    return where(total > 0.0, SENT * small / maximum(total, 1e-30), 0.0)


def towards_body(x, y, z, nx, ny, nz, u, v, w, choice, P, bodies, count):
    """Return the direction to a point of a body's box."""
    total = 0.0 * x
    px, py, pz = nx, ny, nz
    for k in range(count):
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        total = total + weight
    goal = choice * total
    before = 0.0 * x
    for k in range(count):
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        taken = (weight > 0.0) & (before <= goal)
        before = before + weight
        cx, cy, cz, hx, hy, hz, power = bodies[k]
        px = where(taken, cx + (2.0 * u - 1.0) * hx - x, px)
        py = where(taken, cy + (2.0 * v - 1.0) * hy - y, py)
        pz = where(taken, cz + (2.0 * w - 1.0) * hz - z, pz)
    return normalised(px, py, pz)


def body_density(x, y, z, nx, ny, nz, dx, dy, dz, P, bodies, count):
    """Return the density with which `towards_body` takes a direction."""
    total = 0.0 * x
    density = 0.0 * x
    for k in range(count):
        cx, cy, cz, hx, hy, hz, power = bodies[k]
        weight = prominence(x, y, z, nx, ny, nz, bodies[k])
        a, b = span(x, y, z, dx, dy, dz, (cx - hx, cy - hy, cz - hz), (cx + hx, cy + hy, cz + hz))
        solid = maximum(b - a, 0.0) * (a * a + a * b + b * b) / (24.0 * hx * hy * hz)
        total = total + weight
        density = density + weight * solid
    return density / maximum(total, 1e-30)


def mixed_density(sent, beside, nx, ny, nz, dx, dy, dz, lx, ly, lz, rough, share):
    """Return the density of a ray from a rough or a scattering surface.

    `nx`, `ny`, `nz`, `dx`, `dy`, `dz`, `lx`, `ly`, `lz`: unit normal, direction of the ray that arrives,
    direction of the one that continues.
    """
    facets = where(rough > 0.0, facet_density(nx, ny, nz, dx, dy, dz, lx, ly, lz, rough), 0.0)
    cosine = maximum(nx * lx + ny * ly + nz * lz, 0.0)
    return sent * beside + (1.0 - sent) * (share * facets + (1.0 - share) * cosine / HALF_TURN)
