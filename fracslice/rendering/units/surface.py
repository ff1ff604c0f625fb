"""Surfaces and what is behind them: material, lights, the ray that continues, fog, background.

What a scene uses is known when these functions are read: `look`, `lighting`, `fog` and `behind` are the
records of `rendering.materials` and `rendering.lighting`. Effects that a scene does not use are not in its
kernel. A record holds units with their parameters, the numbers that are read from P, and the places of random
numbers in `u`. Inline functions share the names of the module:

==================== ==================================================================================
``p, n, d, to, e``   point, normal, directions of the ray, to the light and of the ray that continues
``c, k``             colour that is scattered, reflectance head on
``hit``              p, n, d, t, h, side; the normal is on the side of the ray
``finish``           properties of the material, as `finished` returns them
``parts``            parts of the light that the surface reflects and scatters, as `divided` returns them
``lit``              light of the surface, and of its lacquer
``start, free``      start of shadow rays, and whether a sample of a light stands alone
==================== ==================================================================================
"""

from __future__ import annotations

from ...expr.loops import inline
from ...expr.vocabulary import exp, floor, maximum, minimum, upward, where
from .march import background, normal, traced, traced_glass
from .shade import (
    HALF_TURN,
    LACQUER,
    density_onward,
    dulled,
    glossy,
    goes_on,
    highlight,
    lacquer,
    mirrored,
    mixed_density,
    mixed_weights,
    phong,
    reflects,
    sunshine,
    tinted,
    varied,
    weights,
)
from .shade import behind as unsampled


def lit_surface(x, y, z, dx, dy, dz, t, path, steps, side, last, q, u, P, look, lighting, fog):
    """Shade a surface point; see `march.surface`."""
    p, d = (x, y, z), (dx, dy, dz)
    h = lighting.width(path + t, P)
    nx, ny, nz = normal(x, y, z, lighting.sharp_width(h, P) if look.clear else h, P)
    finish = finished(p, (nx, ny, nz), t, q, P, look, lighting)
    n = scaled(side, (nx, ny, nz)) if look.clear else (nx, ny, nz)
    hit = p, n, d, t, h, side
    parts = divided(hit, finish, P, look)
    lit = own_light(hit, finish, parts, P, look, lighting)
    start, free = along(p, 3.0 * h, n), alone(finish, side, last, look)
    for source in lighting.lights:
        if source.kind == "sky":
            lit = add_sky(lit, hit, start, finish, parts, u, P, look, lighting, source)
        elif source.kind == "surroundings":
            lit = add_surroundings(lit, hit, start, free, finish, parts, u, P, look, lighting, source)
        else:
            lit = add_lamp(lit, hit, start, free, finish, parts, u, P, look, lighting, source)
    light, glaze = lit
    if lighting.onward:
        light, through, ray = onward(light, hit, finish, parts, u, P, look, lighting, lighting.onward)
    if look.coat:
        light = plus(light, glaze)
    if fog:
        light, air = fogged(light, hit, u, P, look, lighting, fog)
        if lighting.onward:
            through = scaled(air, through)
    return light, (*through, *ray) if lighting.onward else ()


def shown_surface(x, y, z, dx, dy, dz, t, path, steps, side, last, q, u, P, look, width, mode, forward):
    """Show a value of a surface point; see `march.surface`."""
    nx, ny, nz = 0.0, 0.0, 0.0
    if mode == "normal" or look.is_textured:
        nx, ny, nz = normal(x, y, z, width(path + t, P), P)
    if mode == "normal":
        return (nx, ny, nz), ()
    if mode == "position":
        return (x, y, z), ()
    if mode == "albedo":
        _, paint, tone = traced(x, y, z, P) if look.is_traced else (0.0, 0.0, 0.0)
        return coloured((x, y, z), (nx, ny, nz), t, paint, tone, P, look), ()
    if mode == "trap":
        _, _, tone = traced(x, y, z, P)
        return (tone, tone, tone), ()
    value = steps if mode == "steps" else t
    if mode == "depth":
        value = forward[0] * t * dx + forward[1] * t * dy + forward[2] * t * dz
    grey = value + 0.0 * t
    return (grey, grey, grey), ()


# --- vectors and colours ---
@inline
def dot(a, b):
    """Product of two vectors, a number."""
    ax, ay, az = a
    bx, by, bz = b
    return ax * bx + ay * by + az * bz


@inline
def along(p, distance, d):
    """Return a point in a direction."""
    return tuple(p[i] + distance * d[i] for i in range(3))


@inline
def scaled(factor, c):
    """Return a vector or a colour times a number."""
    return tuple(factor * c[i] for i in range(3))


@inline
def times(a, b):
    """Return the product of two colours."""
    return tuple(a[i] * b[i] for i in range(3))


@inline
def plus(a, b):
    """Return the sum of two colours."""
    return tuple(a[i] + b[i] for i in range(3))


@inline
def either(mask, a, b):
    """Return one of two vectors or colours."""
    return tuple(where(mask, a[i], b[i]) for i in range(3))


@inline
def largest(c):
    """Return the largest component of a colour."""
    return maximum(maximum(c[0], c[1]), c[2])


# --- material ---
@inline
def chosen(paint, t, P, choice):
    """Return a number of the material that is met."""
    value = choice.first + 0.0 * t
    for least, other in choice.others:
        value = where(paint > least, other, value)
    return value


@inline
def chosen_colour(paint, t, P, choice):
    """Return three numbers of the material that is met."""
    value = tuple(choice.first[i] + 0.0 * t for i in range(3))
    for least, other in choice.others:
        value = either(paint > least, other, value)
    return value


@inline
def coloured(p, n, t, paint, tone, P, look):
    """Return the colour of the material that is met."""
    value = colour_of(p, n, tone, P, look.colours.first)
    value = tuple(value[i] + 0.0 * t for i in range(3))
    for least, other in look.colours.others:
        value = either(paint > least, colour_of(p, n, tone, P, other), value)
    return value


@inline
def colour_of(p, n, tone, P, colour):
    """Return the colour of a material."""
    if colour.palette:
        turns = turned(tone, P, colour.turns)
        r, g, b = colour.palette(turns - floor(turns), P)
    else:
        r, g, b = colour.plain
    if colour.texture:
        sr, sg, sb = colour.texture(*p, *n, P)
        return r * sr, g * sg, b * sb
    return r, g, b


@inline
def turned(tone, P, turns):
    """Return the position in a palette, before its whole part is removed."""
    repeats, shift = turns
    return tone * repeats + shift


@inline
def varying(roughness, paint, tone, t, P, look):
    """Return the roughness, which varies along the palette."""
    turn = turned(tone, P, look.turns.first) + 0.0 * t
    for least, other in look.turns.others:
        turn = where(paint > least, turned(tone, P, other), turn)
    return varied(roughness, chosen(paint, t, P, look.vary), turn)


@inline
def finished(p, n, t, q, P, look, lighting):
    """Return the properties of the material that is met, 0 if the scene does not use them."""
    _, paint, tone = traced(*p, P) if look.is_traced else (0.0, 0.0, 0.0)
    c = coloured(p, n, t, paint, tone, P, look)
    specular, shininess = chosen(paint, t, P, look.specular), chosen(paint, t, P, look.shininess)
    glow = chosen(paint, t, P, look.glow) if look.glow else 0.0
    reflect = chosen(paint, t, P, look.reflect) if look.reflect else 0.0
    clear = chosen(paint, t, P, look.clear) if look.clear else 0.0
    index = chosen(paint, t, P, look.refraction) if look.clear else 0.0
    roughness = chosen(paint, t, P, look.roughness) if look.roughness else 0.0
    metallic = chosen(paint, t, P, look.metallic) if look.roughness else 0.0
    coat = chosen(paint, t, P, look.coat) if look.coat else 0.0
    if look.vary:
        roughness = varying(roughness, paint, tone, t, P, look)
    absorb = chosen_colour(paint, t, P, look.absorb) if look.clear else (0.0, 0.0, 0.0)
    if look.lost and lighting.is_weighted:
        roughness = dulled(roughness, q)
    return c, specular, shininess, glow, reflect, clear, index, roughness, metallic, coat, absorb


@inline
def divided(hit, finish, P, look):
    """Divide the colour of a surface into what it reflects and what it scatters.

    Returns c, k, the gain of reflections by several microfacets, the cosine of the ray, and of paths:
    reflectance, largest component of c, share of rays that are reflected; start of a ray to a body, share of
    these rays.
    """
    p, n, d, t, h, side = hit
    c, _, _, _, reflect, _, _, roughness, metallic, _, _ = finish
    k, again, v = c, c, p
    facing, mirrors, scatters, share, sent = 0.0, 0.0, 0.0, 0.0, 0.0
    if look.roughness:
        facing = -dot(d, n)
        k = tuple(reflect + metallic * (c[i] - reflect) for i in range(3))
        if look.lost:
            lost = look.lost(facing, roughness, P)
            again = tuple(1.0 + (k[i] + (1.0 - k[i]) / 21.0) * lost for i in range(3))  # mean of Schlick's
        c = tuple(c[i] * (1.0 - metallic) * (1.0 - tinted(facing, k[i])) for i in range(3))
        if look.is_path:
            mirrors, scatters = tinted(facing, largest(k)), largest(c)
            share = mirrors / maximum(mirrors + scatters, 1e-6)
    if look.bodies:
        v = along(p, 0.1 * h, n)  # above bodies that end at the surface
        sent = look.bodies.share(*v, *n, P)
    return c, k, again, facing, mirrors, scatters, share, v, sent


@inline
def reflected(amount, half, k, again, look):
    """Return what microfacets reflect.

    `half`: cosine at their normal.
    """
    if look.lost:
        return tuple(amount * again[i] * tinted(half, k[i]) for i in range(3))
    return tuple(amount * tinted(half, k[i]) for i in range(3))


# --- light ---
@inline
def own_light(hit, finish, parts, P, look, lighting):
    """Return ambient light and the light that the surface emits."""
    p, n, d, t, h, side = hit
    own, glow, c = finish[0], finish[3], parts[0]
    ambient = 0.0 * t
    if lighting.ambient:
        ambient = ambient + lighting.ambient
        if lighting.openness:
            ambient = ambient * lighting.openness(*p, *n, P)
    glaze = scaled(0.0, (t, t, t))
    if not look.glow:
        return scaled(ambient, c), glaze
    if look.roughness:
        return plus(scaled(ambient, c), scaled(glow, own)), glaze
    return scaled(ambient + glow, c), glaze


@inline
def alone(finish, side, last, look):
    """Return whether a sample of a light stands alone: no ray that continues meets the light."""
    clear = finish[5]
    return where((clear > 0.0) | (side < 0.0), 1.0, last) if look.clear else last


@inline
def add_lamp(lit, hit, start, free, finish, parts, u, P, look, lighting, lamp):
    """Add the light of a sun, a lamp or a light at the camera."""
    light, glaze = lit
    p, n, d, t, h, side = hit
    c, k, again, _, _, _, _, _, _ = parts
    _, specular, shininess, _, _, _, _, roughness, _, coat, _ = finish
    a, b = (u[lamp.chance], u[lamp.chance + 1]) if lamp.is_soft else (t, t)
    tx, ty, tz, far, power = lamp.emission(*p, a, b, P)
    to = tx, ty, tz
    diffuse, gloss = phong(*n, *d, *to, specular, shininess)
    if lamp.is_blocked:
        power = power * lighting.visible(*start, *to, where(diffuse > 0.0, far, 0.0), h, P)
    arriving = scaled(power, lamp.colour)
    if look.coat:
        spark, slope = highlight(*n, *d, *to, LACQUER)
        glint = lacquer(slope, coat)
        glaze = tuple(glaze[i] + arriving[i] * spark * glint for i in range(3))
    if lamp.is_blocked:
        arriving = passed(arriving, start, to, where(diffuse > 0.0, far, 0.0), h, P, look, lighting)
    shine = gloss, gloss, gloss
    if look.roughness:
        spot, half = highlight(*n, *d, *to, roughness)
        shine = either(roughness > 0.0, reflected(spot, half, k, again, look), shine)
    sent = plus(scaled(diffuse, c), shine)
    if lamp.density:
        dense = lamp.density(*to, P)
        most, least = sample_weights(dense, diffuse, hit, to, free, finish, parts, P, look)
        sent = plus(scaled(most * diffuse, c), scaled(least, shine))
    return plus(light, times(arriving, sent)), glaze


@inline
def add_surroundings(lit, hit, start, free, finish, parts, u, P, look, lighting, picture):
    """Add light from a picture of the surroundings, sampled in proportion to its light.

    Rays that are bent carry this light through glass, which then blocks straight ones.
    """
    light, glaze = lit
    p, n, d, t, h, side = hit
    c, k, again, _, _, _, _, _, _ = parts
    roughness = finish[7]
    tx, ty, tz, dense = picture.towards(u[picture.chance], u[picture.chance + 1], P)
    to = tx, ty, tz
    r, g, b = picture.light(*to, P)
    diffuse = maximum(dot(n, to), 0.0)
    far = where(diffuse > 0.0, picture.far, 0.0)
    if look.clear and look.is_path:
        power = lighting.unobstructed(*start, *to, far, h, P)
    else:
        power = lighting.visible(*start, *to, far, h, P)
    arriving = scaled(power / maximum(HALF_TURN * dense, 1e-30), (r, g, b))
    if look.is_path:
        spot, half = highlight(*n, *d, *to, roughness)
        most, least = sample_weights(dense, diffuse, hit, to, free, finish, parts, P, look)
        shine = either(roughness > 0.0, reflected(least * spot, half, k, again, look), (0.0, 0.0, 0.0))
        sent = plus(scaled(most * diffuse, c), shine)
        return plus(light, times(arriving, sent)), glaze
    arriving = passed(arriving, start, to, far, h, P, look, lighting)
    return plus(light, times(scaled(diffuse, arriving), c)), glaze


@inline
def add_sky(lit, hit, start, finish, parts, u, P, look, lighting, sky):
    """Add light from the sky: from one direction per sample, or along the normal without shadows."""
    light, glaze = lit
    p, n, d, t, h, side = hit
    c = parts[0]
    if not sky.is_blocked:
        r, g, b = sky.light(*n, P)
        return plus(light, times((r, g, b), c)), glaze
    tx, ty, tz = upward(*n, u[sky.chance], u[sky.chance + 1])
    to, far = (tx, ty, tz), sky.far + 0.0 * t
    r, g, b = sky.light(*to, P)
    power = lighting.visible(*start, *to, far, h, P)
    arriving = passed((r, g, b), start, to, far, h, P, look, lighting)
    return plus(light, times(scaled(power, arriving), c)), glaze


@inline
def passed(light, start, to, far, h, P, look, lighting):
    """Return the light of a source that transparent parts pass on."""
    if not look.clear:
        return light
    r, g, b = lighting.tinted_shadow(*start, *to, far, h, P)
    return times(light, (r, g, b))


@inline
def sample_weights(dense, diffuse, hit, to, free, finish, parts, P, look):
    """Return the weights of a light's sample for scattered and for reflected light."""
    p, n, d, t, h, side = hit
    roughness, share = finish[7], parts[6]
    if look.bodies:
        return mixed_weights(dense, density(hit, to, finish, parts, P, look), roughness, free)
    return weights(dense, diffuse, *n, *d, *to, roughness, share, free)


@inline
def density(hit, e, finish, parts, P, look):
    """Return the density of rays that continue in a direction, where some are sent to bodies."""
    p, n, d, t, h, side = hit
    c, k, again, facing, mirrors, scatters, share, v, sent = parts
    beside = look.bodies.density(*v, *n, *e, P)
    return mixed_density(sent, beside, *n, *d, *e, finish[7], share)


# --- rays that continue ---
@inline
def onward(light, hit, finish, parts, u, P, look, lighting, draws):
    """Continue the ray.

    Returns the light, less what the ray replaces; the factor on the light of the ray; its start, direction,
    side and density.
    """
    p, n, d, t, h, side = hit
    reflect, roughness = finish[4], finish[7]
    c, k, again, _, _, _, _, _, _ = parts
    eq = 0.0 * t
    e, es, through, out, is_glass = d, side, c, 1.0, 0.0
    if look.roughness:
        ex, ey, ez, weight, half = glossy(*d, *n, roughness, u[draws.facet], u[draws.facet + 1])
        e, through = (ex, ey, ez), reflected(weight, half, k, again, look)
    elif not look.clear:
        part, ex, ey, ez = reflects(*d, *n, reflect)
        e, through = (ex, ey, ez), (part, part, part)
        light = scaled(1.0 - part, light)
    if look.is_path:
        e, eq, through = scattered(e, eq, through, hit, finish, parts, u, P, look, lighting, draws)
    if look.coat:
        light, through, e, eq = glazed(light, through, e, eq, hit, finish, parts, u, draws)
    if look.clear:
        light, through, e, es, out, is_glass = refracted(light, through, e, hit, finish, u, look, draws)
        if lighting.is_weighted:
            eq = where(is_glass, 0.0, eq)
    o = along(p, 3.0 * h * out, n) if look.clear else along(p, 3.0 * h, n)
    if look.bodies:
        o = left(o, e, hit, is_glass, P, look, draws)
    return light, through, (*o, *e, es, eq)


@inline
def left(o, e, hit, is_glass, P, look, draws):
    """Return the start of a ray that may meet a body that glows: the ray is that of its point."""
    p, n, d, t, h, side = hit
    fx, fy, fz = draws.leave(*p, *n, *e, 3.0 * h, P)
    return either(is_glass, o, (fx, fy, fz)) if look.clear else (fx, fy, fz)


@inline
def scattered(e, eq, through, hit, finish, parts, u, P, look, lighting, draws):
    """Choose between the reflected ray and a scattered one, and end some rays.

    One sample of both (Veach 1997), and Russian roulette with the probability of the throughput (Arvo and
    Kirk 1990). Returns direction, density, factor.
    """
    p, n, d, t, h, side = hit
    c, k, again, facing, mirrors, scatters, share, v, sent = parts
    choice = u[draws.scatter + 2]
    wx, wy, wz = upward(*n, u[draws.scatter], u[draws.scatter + 1])
    if look.bodies:
        e, eq, through, alive = sent_onward(e, (wx, wy, wz), through, hit, finish, parts, u, P, look, draws)
    else:
        is_mirrored = choice < share
        e = either(is_mirrored, e, (wx, wy, wz))
        mirrored_part, rest = maximum(share, 1e-6), maximum(1.0 - share, 1e-6)
        through = tuple(where(is_mirrored, through[i] / mirrored_part, c[i] / rest) for i in range(3))
        alive = minimum(largest(through), 1.0)
        if lighting.is_weighted:
            eq = density_onward(is_mirrored, *n, *d, *e, finish[7], share)
    goes = u[draws.scatter + 3] < alive
    return e, eq, tuple(where(goes, through[i] / maximum(alive, 1e-6), 0.0) for i in range(3))


@inline
def sent_onward(e, w, through, hit, finish, parts, u, P, look, draws):
    """Choose between a reflected ray, a scattered one and one to a body.

    `w`: direction of the scattered ray. Returns direction, density, factor, probability to go on.
    """
    p, n, d, t, h, side = hit
    c, k, again, facing, mirrors, scatters, share, v, sent = parts
    roughness, choice = finish[7], u[draws.scatter + 2]
    is_sent = choice < sent
    is_mirrored = (choice - sent) / (1.0 - sent) < share
    picked = choice / maximum(sent, 1e-6)
    a, b = u[draws.scatter], u[draws.scatter + 1]
    bx, by, bz = look.bodies.towards(*v, *n, a, b, u[draws.body], picked, P)
    e = either(is_sent, (bx, by, bz), either(is_mirrored, e, w))
    is_sharp = where(is_sent, 0.0, where(is_mirrored & (roughness <= 0.0), 1.0, 0.0)) > 0.5
    eq = density(hit, e, finish, parts, P, look)
    spot, half = highlight(*n, *d, *e, roughness)
    cosine = maximum(dot(n, e), 0.0)
    shine = either(roughness > 0.0, reflected(spot, half, k, again, look), (0.0, 0.0, 0.0))
    sharp, other = maximum(share * (1.0 - sent), 1e-6), HALF_TURN * maximum(eq, 1e-9)
    through = tuple(where(is_sharp, through[i] / sharp, (c[i] * cosine + shine[i]) / other) for i in range(3))
    alive = where(is_sent, 1.0, minimum(mirrors + scatters, 1.0))
    return e, where(is_sharp, 0.0, eq), through, alive


@inline
def glazed(light, through, e, eq, hit, finish, parts, u, draws):
    """Choose between the reflection of a lacquer and the ray of the material under it."""
    p, n, d, t, h, side = hit
    facing, coat = parts[3], finish[9]
    part = lacquer(facing, coat)
    is_mirrored = u[draws.lacquer] < part
    gx, gy, gz = mirrored(*d, *n)
    e, eq = either(is_mirrored, (gx, gy, gz), e), where(is_mirrored, 0.0, eq)
    through = either(is_mirrored, (1.0, 1.0, 1.0), through)
    return scaled(1.0 - part, light), through, e, eq


@inline
def refracted(light, through, e, hit, finish, u, look, draws):
    """Continue the ray through glass; at an opaque material it keeps the ray that it has.

    Returns light, factor, direction, side, whether the ray is on its side of the surface as 1 or -1, and
    whether it meets glass.
    """
    p, n, d, t, h, side = hit
    _, _, _, _, reflect, clear, index, _, _, _, absorb = finish
    part, gx, gy, gz, out = goes_on(*d, *n, side, reflect, clear, index, u[draws.glass])
    if not look.roughness:
        through = tuple(part * where(side < 0.0, exp(-absorb[i] * t), 1.0 + 0.0 * t) for i in range(3))
        light = scaled(where(side < 0.0, 0.0, 1.0 - part), light)
        return light, through, (gx, gy, gz), side * out, out, 0.0
    is_glass = (clear > 0.0) | (side < 0.0)
    out = where(is_glass, out, 1.0)
    through = tuple(
        where(is_glass, part * where(side < 0.0, exp(-absorb[i] * t), 1.0), through[i]) for i in range(3)
    )
    light = scaled(where(is_glass, where(side < 0.0, 0.0, 1.0 - part), 1.0), light)
    return light, through, either(is_glass, (gx, gy, gz), e), side * out, out, is_glass


# --- fog ---
@inline
def fogged(light, hit, u, P, look, lighting, fog):
    """Cover a surface with fog; without a colour of its own, surfaces fade into what is behind them.

    Returns the light, and the part that passes.
    """
    p, n, d, t, h, side = hit
    air = clearness(t, p, d, P, fog)
    if look.clear:
        air = where(side < 0.0, 1.0 + 0.0 * t, air)
    fr, fg, fb = fog.colour if fog.colour else background(*d, 0.0, P)
    own = fr, fg, fb
    light = tuple(own[i] + air * (light[i] - own[i]) for i in range(3))
    return inscattered(light, hit, u, P, look, lighting, fog) if fog.scatter else light, air


@inline
def clearness(t, p, d, P, fog):
    """Return the part of light that passes through fog up to a point."""
    return fog.clearness(t, p[2], d[2], P) if fog.thickness else fog.clearness(t, P)


@inline
def inscattered(light, hit, u, P, look, lighting, fog):
    """Add light that fog scatters to the eye, the same in all directions.

    One point of the ray, uniform by its length, sees each sun and lamp.
    """
    p, n, d, t, h, side = hit
    distance = u[fog.chance] * t
    p = tuple(p[i] - (t - distance) * d[i] for i in range(3))
    thickness = fog.thickness(p[2], P) if fog.thickness else fog.density
    haze = t * clearness(distance, p, d, P, fog) * thickness
    if look.clear:
        haze = where(side < 0.0, 0.0, haze)
    for lamp in fog.lamps:
        a, b = (u[lamp.chance], u[lamp.chance + 1]) if lamp.is_soft else (t, t)
        tx, ty, tz, far, power = lamp.emission(*p, a, b, P)
        if lamp.is_blocked:
            power = power * lighting.visible(*p, tx, ty, tz, far, h, P)
        light = plus(light, scaled(fog.scatter * haze * power, lamp.colour))
    return light


# --- what is behind surfaces, and functions of their own ---
def lit_background(dx, dy, dz, q, P, behind):
    """Return the light of a ray that misses the scene; see `march.background`."""
    if behind.light:
        r, g, b = behind.light(dx, dy, dz, P)
    else:
        r, g, b = plus(behind.colour, scaled(0.0, (dx, dx, dx)))
    light = r, g, b
    if behind.likelihood:
        light = scaled(unsampled(q, behind.likelihood(dx, dy, dz, P)), light)
    for sun in behind.suns:
        part = sunshine(q, sun.density(dx, dy, dz, P))
        light = plus(light, scaled(part, sun.colour))
    return light


def nothing(x, y, z, P):
    """Field of no solid."""
    return 0.0 * x + 1.0


def glass(x, y, z, P, look):
    """Return field, fading and reflectance of the transparent parts; see `march.transparent`."""
    f, paint, _ = traced_glass(x, y, z, P)
    t = 0.0 * x
    r, g, b = chosen_colour(paint, t, P, look.absorb)
    return f, r, g, b, chosen(paint, t, P, look.passed)


def painted(x, y, z, P, look):
    """Return the colour of a point, the number of its material, and the orbit's trap."""
    _, paint, tone = traced(x, y, z, P)
    r, g, b = coloured((x, y, z), (x, y, z), 0.0 * x, paint, tone, P, look)
    return r, g, b, paint, tone
