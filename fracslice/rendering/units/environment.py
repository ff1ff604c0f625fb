"""Light from a picture of the surroundings, longitude across and latitude down, and textures.

The table of light holds red, green and blue of each pixel. The tables of probability hold the distribution
function of the rows, then that of the columns of each row, every one from 0 to 1 (Pharr, Jakob and Humphreys
2016, "Physically Based Rendering", 13.6.7 and 14.2.4).
"""

from __future__ import annotations

from ...expr.vectors import TURN
from ...expr.vocabulary import atan2, cos, floor, maximum, minimum, sin, sqrt, where
from .intrinsics import gather

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
