"""Solids that the steps of an orbit lead to: Kleinian groups, and distances inside iterations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..common.parameters import AUTO, Choice
from ..expr.frontend import own_formula
from ..expr.graph import Function
from ..expr.vocabulary import any_of, maximum, minimum, orbit, where
from ..fields.box import Box, possible_cells
from ..fields.cpu import compile_scene
from ..fields.growth import constant_stretch
from ..fields.orbit_code import affine_image, constant_of, stages
from ..fields.orbits import LIPSCHITZ, orbit_check, rounds, steps
from ..fields.registry import Fixed, Formula, Node, register

EMPTY = 1e30
"""Value far from all solids."""

FARTHEST2 = 1e12
"""Square of the size at which an orbit stops."""

REACH, CELLS = 64.0, 1 << 15
"""Half size of the cube in which the box of the solid is searched, and the most cells of the search."""

LAST, EVERY = "last", "every"


@register(
    "domain",
    (2, 2),
    {"of": Choice(LAST, "points of an orbit that count: the last, or one after every round", (LAST, EVERY))},
    made=Formula,
    steps=1,
    lipschitz=LIPSCHITZ,
    exterior_only=True,
)
def preimage(child, x, y, z, iterations, given, every, stages, order):  # type: ignore[no-untyped-def]
    """The points that the orbit of a fractal leads into a solid (Knighty 2012, fractalforums.com).

    The first element is an escape-time fractal or an `orbit`, of which the steps alone count; the others are
    the solid. The value is that of the solid at the orbit's last point, divided by the stretch of its steps,
    or the least of all rounds. A stretch below 1 counts as 1, for an inversion shrinks what is far alone.
    L = the solid's if the steps stretch alike everywhere; else twice that, which is measured, once for one
    inside another. Where a step tears space, the value jumps.
    """
    start = (x, y, z)
    constants = tuple(constant_of(start, given[k], stages[k]) for k in order)
    ready = tuple(stages[k].step.prepared(constants[k], given[k][0]) for k in order)
    r2, dr = x * x + y * y + z * z, 0.0 * x + 1.0
    f = 0.0 * x + EMPTY
    alive = r2 < FARTHEST2
    for _ in range(iterations):
        if not any_of(alive):
            break
        a, b, c = x, y, z
        for k in order:
            v, moved = given[k][0], given[k][2]
            w = (a, b, c)
            if stages[k].moved:
                back, forth, spread, _ = moved
                w = affine_image(back, w)
            w, by_w, by_c = stages[k].step.taken(w, constants[k], v, ready[k])
            slope = by_w * dr
            if not (stages[k].julia or stages[k].step.ignores_constant):
                slope = slope + by_c
            if stages[k].moved:
                slope = spread * slope
                w = affine_image(forth, w)
            dr = where(alive, minimum(slope, 1e30), dr)
            a, b, c = w
        x, y, z = where(alive, a, x), where(alive, b, y), where(alive, c, z)
        r2 = x * x + y * y + z * z
        orbit(r2, alive, x, y, z)
        if every:
            f = where(alive, minimum(f, child(x, y, z) / maximum(dr, 1.0)), f)
        alive = alive & (r2 < FARTHEST2)
    if not every:
        f = child(x, y, z) / maximum(dr, 1.0)
    return f


_READ = own_formula(preimage.function, ())
"""The function, in which records of steps may stand."""


@preimage.select
def preimage_select(_: Node) -> Function:
    return _READ


@preimage.check
def preimage_check(node: Node) -> None:
    """Refuse what has no steps, and a number of iterations that is open."""
    stepped = node.children[0]
    if "iterations" not in stepped.values or not ("step" in stepped.formula.hooks or stepped.children):
        raise node.fail("expected an escape-time fractal or <orbit> as the first element")
    if stepped["iterations"] == AUTO:
        raise node.fail(f"expected a number of iterations of its <{stepped.formula.name}>, not auto")
    orbit_check(stepped)


@preimage.arguments
def preimage_arguments(node: Node) -> dict[str, object]:
    code, given = steps(node.children[0], alone=False)
    return {
        "iterations": rounds(node.children[0]),
        "given": tuple(given),
        "every": Fixed(node["of"] == EVERY),
        "stages": Fixed(stages(code)),
        "order": Fixed(tuple(range(len(code)))),
    }


@preimage.slope
def preimage_slope(node: Node) -> float:
    known = node.fields[0].bounds
    counted = preimage.name in known.measured or preimage_proves_slope(node)
    return known.lipschitz * (1.0 if counted else LIPSCHITZ)


@preimage.proves_slope
def preimage_proves_slope(node: Node) -> bool:
    return constant_stretch(*steps(node.children[0], alone=False)) is not None


@preimage.bounds
def preimage_bounds(node: Node) -> Box:
    """Box around the cells that may hold the solid; endless where they reach the end of the search."""
    hooks = {name: hook for name, hook in node.formula.hooks.items() if name != "bounds"}
    kernel = compile_scene(replace(node, formula=replace(node.formula, hooks=hooks)), "float64")
    whole = Box.centred(REACH)
    centres, _, size = possible_cells(lambda p: kernel.points(*p), preimage_slope(node), whole, CELLS)
    if not centres.shape[1]:
        return Box.centred(1e-6)
    low, high = centres.min(axis=1) - size / 2, centres.max(axis=1) + size / 2
    ends = abs(np.array([low, high])) > REACH * (1 - 1e-9)
    low, high = np.where(ends[0], -math.inf, low), np.where(ends[1], math.inf, high)
    return Box((low[0], low[1], low[2]), (high[0], high[1], high[2]))
