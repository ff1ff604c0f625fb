"""Continuation of rays at surfaces, in a render kernel."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..expr import vectors
from ..fields.linker import Linker
from . import glow
from .glow import Drawn
from .materials import Look
from .setup import ray_bound
from .units import glossy, march, shade, weights

CHANNELS = "rgb"
MIDPOINTS = 24
"""Points along each side of the unit square of random numbers."""


@lru_cache(maxsize=1)
def reflected_shares() -> np.ndarray:
    """Return the table of `glossy.lost`, by the midpoint rule over the directions that `glossy.glossy` takes.

    It is rounded, so that it is the same on any machine.
    """
    grid = np.linspace(0, 1, int(glossy.CELLS) + 1)
    points = (np.arange(MIDPOINTS) + 0.5) / MIDPOINTS
    rough, root, u, v = np.meshgrid(grid, grid, points, points, indexing="ij", sparse=True)
    z = np.maximum(root * root, 1e-4)
    none = 0.0 * z
    ray, normal = (np.sqrt(1 - z * z), none, -z), (none, none, 1 + none)
    *_, weight, _ = glossy.glossy(*ray, *normal, rough, u, v)  # type: ignore[no-untyped-call]
    return np.asarray(weight.mean((2, 3)).round(5))


def division_lines(linker: Linker, look: Look) -> list[str]:
    """Return the lines that divide a colour into what the surface reflects and what it scatters."""
    for function in (shade.fresnel, glossy.tinted):
        linker.share(function)
    lines = ["facing = -(dx * nx + dy * ny + dz * nz)", *(f"e{c} = c{c}" for c in CHANNELS)]
    lines += [f"k{c} = reflect + metallic * (c{c} - reflect)" for c in CHANNELS]
    if look.rough:
        linker.bind("lost_", glossy.lost, {"table": reflected_shares()})
        lines.append("lost = lost_(facing, roughness, P)")
        lines += [
            f"again{c} = 1.0 + (k{c} + (1.0 - k{c}) / 21.0) * lost" for c in CHANNELS
        ]  # mean of Schlick's
    lines += [f"c{c} = c{c} * (1.0 - metallic) * (1.0 - tinted(facing, k{c}))" for c in CHANNELS]
    if look.paths:
        lines += [
            "mirrors = tinted(facing, maximum(maximum(kr, kg), kb))",
            "scatters = maximum(maximum(cr, cg), cb)",
            "share = mirrors / maximum(mirrors + scatters, 1e-6)",
        ]
    if look.bodies:
        lines += glow.bind(linker, look.bodies)
    return lines


def onward(linker: Linker, drawn: Drawn, look: Look, weighted: bool) -> list[str]:
    """Return the lines for the ray that continues."""
    for function in (
        shade.mirrored,
        shade.fresnel,
        shade.dielectric,
        shade.bent,
        shade.goes_on,
        shade.reflects,
    ):
        linker.share(function)
    (u,) = drawn.names(1) if look.inside else ("t",)
    lines, out = ["eq = 0.0 * t"], ""
    if look.glossy:
        lines += _reflection_lines(linker, drawn, look)
    elif not look.inside:
        lines.append("tr, ex, ey, ez = reflects(dx, dy, dz, nx, ny, nz, reflect)")
        lines += ["tg, tb, es = tr, tr, side", *(f"{c} = {c} * (1.0 - t{c})" for c in CHANNELS)]
    if look.paths:
        lines += _scatter_choice_lines(linker, drawn, look)
    if weighted and not look.bodies:
        linker.share(weights.density_onward)
        lines.append("eq = density_onward(chosen, nx, ny, nz, dx, dy, dz, ex, ey, ez, roughness, share)")
    if look.coated:
        lines += _lacquer_choice_lines(linker, drawn)
    if look.inside:
        out = "out * "
        lines += _refraction_lines(u, look.glossy)
        lines += ["eq = where(pane, 0.0, eq)"] * weighted
    lines += [f"o{a} = {a} + 3.0 * h * {out}n{a}" for a in "xyz"]
    return [*lines, *_start_lines(linker, look)] if look.bodies else lines


def _start_lines(linker: Linker, look: Look) -> list[str]:
    """Lines for the start of a ray that may meet a body that glows: the ray is that of its point."""
    linker.bind("leave_", march.leave, {"steepness": 1 / ray_bound(look.root)})
    lines = ["fx, fy, fz = leave_(x, y, z, nx, ny, nz, ex, ey, ez, 3.0 * h, P)"]
    kept = "where(pane, o{0}, f{0})" if look.inside else "f{0}"
    return [*lines, *(f"o{a} = {kept.format(a)}" for a in "xyz")]


def _reflection_lines(linker: Linker, drawn: Drawn, look: Look) -> list[str]:
    """Lines for reflection by microfacets."""
    for function in (glossy.width, glossy.hidden, vectors.frame, glossy.glossy):
        linker.share(function)
    u, v = drawn.names(2)
    lines = [f"ex, ey, ez, weight, half = glossy(dx, dy, dz, nx, ny, nz, roughness, {u}, {v})", "es = side"]
    return lines + [f"t{c} = weight * {look.facets.format(c)}" for c in CHANNELS]


def lacquer_lines(linker: Linker, colour: list[str]) -> list[str]:
    """Return the lines for the reflection of a light in a lacquer."""
    for function in (shade.dielectric, shade.lacquer):
        linker.share(function)
    lines = [f"spark, slope = highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, {glossy.LACQUER})"]
    return lines + [
        f"glaze{c} = glaze{c} + power * {s} * spark * lacquer(slope, coat)"
        for c, s in zip(CHANNELS, colour, strict=True)
    ]


def _lacquer_choice_lines(linker: Linker, drawn: Drawn) -> list[str]:
    """Lines that choose between the reflection of a lacquer and the ray of the material under it."""
    for function in (shade.dielectric, shade.lacquer):
        linker.share(function)
    (u,) = drawn.names(1)
    lines = [
        "lacquer_ = lacquer(facing, coat)",
        f"glazed = {u} < lacquer_",
        "gx, gy, gz = mirrored(dx, dy, dz, nx, ny, nz)",
        *(f"e{a} = where(glazed, g{a}, e{a})" for a in "xyz"),
        "eq = where(glazed, 0.0, eq)",
    ]
    lines += [f"t{c} = where(glazed, 1.0, t{c})" for c in CHANNELS]
    return lines + [f"{c} = {c} * (1.0 - lacquer_)" for c in CHANNELS]


def _scatter_choice_lines(linker: Linker, drawn: Drawn, look: Look) -> list[str]:
    """Lines that choose between the reflected ray and a scattered one, and end some rays.

    One sample of both (Veach 1997), and Russian roulette with the probability of the throughput (Arvo and
    Kirk 1990).
    """
    for function in (vectors.disc, vectors.upward):
        linker.share(function)
    u, v, choice, life = drawn.names(4)
    lines = [f"wx, wy, wz = upward(nx, ny, nz, {u}, {v})"]
    if look.bodies:
        lines += glow.scatter_lines(linker, drawn, u, v, choice, look.facets)
    else:
        lines += [
            f"chosen = {choice} < share",
            *(f"e{a} = where(chosen, e{a}, w{a})" for a in "xyz"),
            *(
                f"t{c} = where(chosen, t{c} / maximum(share, 1e-6), c{c} / maximum(1.0 - share, 1e-6))"
                for c in CHANNELS
            ),
            "alive = minimum(maximum(maximum(tr, tg), tb), 1.0)",
        ]
    return lines + [f"t{c} = where({life} < alive, t{c} / maximum(alive, 1e-6), 0.0)" for c in CHANNELS]


def _refraction_lines(u: str, opaque: bool) -> list[str]:
    """Lines for transparent materials; opaque ones keep their ray if they have one."""
    ray = f"goes_on(dx, dy, dz, nx, ny, nz, side, reflect, clear, index, {u})"
    if not opaque:
        return [
            f"share, ex, ey, ez, out = {ray}",
            "es = side * out",
            *(f"t{c} = share * where(side < 0.0, exp(-absorb{c} * t), 1.0 + 0.0 * t)" for c in CHANNELS),
            *(f"{c} = {c} * where(side < 0.0, 0.0, 1.0 - share)" for c in CHANNELS),
        ]
    return [
        f"part, gx, gy, gz, out = {ray}",
        "pane = (clear > 0.0) | (side < 0.0)",
        "out = where(pane, out, 1.0)",
        "es = side * out",
        *(f"e{a} = where(pane, g{a}, e{a})" for a in "xyz"),
        *(f"t{c} = where(pane, part * where(side < 0.0, exp(-absorb{c} * t), 1.0), t{c})" for c in CHANNELS),
        *(f"{c} = {c} * where(pane, where(side < 0.0, 0.0, 1.0 - part), 1.0)" for c in CHANNELS),
    ]
