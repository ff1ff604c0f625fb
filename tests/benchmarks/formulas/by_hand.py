"""Fields of escape-time fractals as an expert writes them, without `@orbit`: the derivative by hand.

Each takes the radii that its step has in the package, so that both fields are of the same solid.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from types import MappingProxyType
from typing import Any

from fracslice.expr.vocabulary import absolute, any_of, maximum, minimum, ratio, sqrt, where
from fracslice.fields.maps import CORE, potential_distance
from fracslice.fields.orbits import orbit_arguments
from fracslice.formulas import Formula, Node

BRISTOR, LEAST = 2.985, 2 * CORE**0.5
"""Most that the Bristorbrot's step stretches, per |w|; least derivative of a disconnected Julia set."""


def mandelbox(x, y, z, scale, size, inner2, iterations, bailout, stop):  # type: ignore[no-untyped-def]
    a, b, c = x, y, z
    r2 = x * x + y * y + z * z
    dr = 0.0 * x + 1.0
    end_r2, slope = r2, dr
    alive = r2 < stop
    for _ in range(iterations):
        if not any_of(alive):
            break
        x = 2.0 * minimum(maximum(x, -1.0), 1.0) - x
        y = 2.0 * minimum(maximum(y, -1.0), 1.0) - y
        z = 2.0 * minimum(maximum(z, -1.0), 1.0) - z
        k = maximum(ratio(1.0, maximum(x * x + y * y + z * z, inner2)), 1.0)
        s = scale * k
        x, y, z = s * x + a, s * y + b, s * z + c
        dr = (size * k) * dr + 1.0
        r2 = x * x + y * y + z * z
        end_r2 = where(alive, r2, end_r2)
        slope = where(alive, maximum(dr, slope), slope)
        alive = alive & (r2 < stop)
    return (sqrt(minimum(end_r2, 1e30)) - bailout) / minimum(slope, 1e30)


def kifs(x, y, z, scale, cosine, sine, iterations, bailout, stop):  # type: ignore[no-untyped-def]
    r2 = x * x + y * y + z * z
    size = 0.0 * x + 1.0
    end_r2, slope = r2, size
    alive = r2 < stop
    for _ in range(iterations):
        if not any_of(alive):
            break
        s = minimum(x + y, 0.0)
        x, y = x - s, y - s
        s = minimum(x + z, 0.0)
        x, z = x - s, z - s
        s = minimum(y + z, 0.0)
        y, z = y - s, z - s
        s = minimum(y - x, 0.0)
        x, y = x + s, y - s
        s = minimum(z - x, 0.0)
        x, z = x + s, z - s
        along = (x + y + z) * ((1.0 - cosine) / 3.0)
        s = sine * 0.5773502691896258
        x, y, z = (
            x * cosine + (z - y) * s + along,
            y * cosine + (x - z) * s + along,
            z * cosine + (y - x) * s + along,
        )
        shift = (scale - 1.0) * 0.5773502691896258
        x, y, z = scale * x - shift, scale * y - shift, scale * z - shift
        size = size * scale
        r2 = x * x + y * y + z * z
        end_r2 = where(alive, r2, end_r2)
        slope = where(alive, size, slope)
        alive = alive & (r2 < stop)
    return (sqrt(minimum(end_r2, 1e30)) - bailout) / minimum(slope, 1e30)


def bristorbrot(x, y, z, iterations, levels, stop):  # type: ignore[no-untyped-def]
    a, b, c = x, y, z
    first_level, last_level, least = levels
    level = 0.0 * x + first_level
    r2 = x * x + y * y + z * z
    dr = 0.0 * x + 1.0
    end_r2, slope = r2, dr
    alive = r2 < stop
    for _ in range(iterations):
        if not any_of(alive):
            break
        dr = (BRISTOR * sqrt(r2)) * dr + 1.0
        x, y, z = x * x - y * y - z * z + a, y * (2.0 * x - z) + b, z * (2.0 * x + y) + c
        r2 = x * x + y * y + z * z
        end_r2 = where(alive, r2, end_r2)
        slope = where(alive, maximum(dr, slope), slope)
        level = where(alive, level + level, level)
        alive = alive & (r2 < stop)
    return potential_distance(end_r2, slope * slope, level, first_level, last_level, least)


def mandelbulb(x, y, z, calm, iterations, levels, stop):  # type: ignore[no-untyped-def]
    """Power 8, by complex multiplication."""
    a, b, c = x, y, z
    first_level, last_level, least = levels
    fade, fading = calm
    level = 0.0 * x + first_level
    rho2 = x * x + y * y
    r2 = rho2 + z * z
    dr = 0.0 * x + 1.0
    end_r2, slope = r2, dr
    alive = r2 < stop
    for _ in range(iterations):
        if not any_of(alive):
            break
        rho2 = maximum(rho2, 1e-30)
        rho, r4 = sqrt(rho2), r2 * r2
        re, im = 2.0 * z * z - r2, 2.0 * z
        re, im = 2.0 * re * re - r4, 2.0 * re * im
        re, im = 2.0 * re * re - r4 * r4, 2.0 * re * im
        over = ratio(y, rho2)
        u, v = 1.0 - 2.0 * y * over, 2.0 * x * over
        u, v = 1.0 - 2.0 * v * v, 2.0 * v * u
        u, v = 1.0 - 2.0 * v * v, 2.0 * v * u
        latitude = absolute(im) * minimum(1.0, fade - r2 * fading)
        dr = maximum(r4 * r2 * sqrt(r2), latitude) * (8.0 * dr) + 1.0
        s = im * rho
        x, y, z = s * u + a, s * v + b, re + c
        rho2 = x * x + y * y
        r2 = rho2 + z * z
        end_r2 = where(alive, r2, end_r2)
        slope = where(alive, maximum(dr, slope), slope)
        level = where(alive, 8.0 * level, level)
        alive = alive & (r2 < stop)
    return potential_distance(end_r2, slope * slope, level, first_level, last_level, least)


def julia(x, y, z, constant, iterations, levels, stop):  # type: ignore[no-untyped-def]
    a, b, c = constant
    first_level, last_level, least = levels
    level = 0.0 * x + first_level
    r2 = x * x + y * y + z * z
    dr = 0.0 * x + 1.0
    end_r2, slope = r2, dr
    alive = r2 < stop
    for _ in range(iterations):
        if not any_of(alive):
            break
        dr = maximum(2.0 * sqrt(r2), LEAST) * dr
        x, y, z = x * x - y * y - z * z + a, 2.0 * x * y + b, 2.0 * x * z + c
        r2 = x * x + y * y + z * z
        end_r2 = where(alive, r2, end_r2)
        slope = where(alive, maximum(dr, slope), slope)
        level = where(alive, level + level, level)
        alive = alive & (r2 < stop)
    return potential_distance(end_r2, slope * slope, level, first_level, last_level, least)


def made(function: Callable[..., Any], node: Node, **values: Any) -> Node:
    """Solid of a field by hand, with the radii of a node whose step is the same."""
    taken: dict[str, Any] = orbit_arguments(node)
    limits, ((others, *_),), ((stop, *_),) = taken["limits"], taken["given"], taken["numbers"]
    given = {"iterations": taken["iterations"], "stop": stop, "levels": limits[:3], "bailout": limits[0]}
    given |= {"calm": others[0] if others else (), **values}
    own = {name: given[name] for name in list(signature(function).parameters)[3:]}
    hooks = {"arguments": lambda _: own, "bounds": lambda _: node.bounds.box}
    known = {"lipschitz": 2.0, "exterior_only": True, "hooks": hooks}
    return Formula(function.__name__, "shape", function, MappingProxyType({}), **known)()
