"""Fields of orbits, from their steps, with majorants of their distance; boxes and balls around orbits.

A round of an orbit takes its steps one after the other. The solid of N rounds is ``{p : |w_N(p)| <= R}`` for
the radius R beyond which no orbit comes back. The field is ``(|w| - R) / |w'|`` where the orbit stops if
rounds grow linearly, and that of the potential (`fields.maps`) if they grow by a power. The derivative is
bounded by the stretch of each step: ``dr -> s dr + t``, where t is the stretch by the constant.

The derivative bounds how far a point of the orbit moves only near the start point; the bend, a majorant of
the other terms, bounds it everywhere. So no point nearer than the sure distance moves into the solid, or
across a tear of a step.

The functions of points and cells are in the language of formulas; `stages`, `form` and `order` are known
where they are read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

from ..expr import language
from ..expr.frontend import Fixed, own_formula
from ..expr.graph import Function
from ..expr.language import identity
from ..expr.runtime import kept_text
from ..expr.vocabulary import (
    absolute,
    any_of,
    cell_extent,
    cell_middle,
    maximum,
    minimum,
    orbit,
    sqrt,
    where,
)
from .maps import MAJORANTS, RIGID, potential_distance, sure_distance
from .steps import Step, trace


@dataclass(frozen=True)
class Stage:
    """A step of a round, as the functions of its orbit use it."""

    step: Step
    julia: bool = False  # true if its constant is the same at all points
    moved: bool = False  # true if it is taken in coordinates of its own

    @cached_property
    def is_fixed(self) -> bool:
        """True if the step is the same map for all start points, as in a Julia set."""
        return self.julia or not self.step.constants

    @cached_property
    def is_sum(self) -> bool:
        """True if the start point is added, and nothing else depends on it."""
        return self.step.is_added and not self.julia

    @cached_property
    def in_ball(self) -> bool:
        """True if a ball around a point bounds the image of a ball by the stretch."""
        return not self.step.is_torn and (self.step.is_added or self.is_fixed)


@dataclass(frozen=True)
class Code:
    """A step with the parameters that its code depends on."""

    step: Callable[..., Any]  # function ``f(w, c, ...)``
    sizes: tuple[tuple[str, int], ...]  # numbers of components of its other parameters
    fixed: tuple[tuple[str, Any], ...] = ()  # values of the parameters that the code depends on
    julia: bool = False  # see `Stage`
    moved: bool = False  # see `Stage`

    @property
    def stage(self) -> Stage:
        """The step, traced."""
        step = _trace_step(self.step, self.sizes, self.fixed, language.fingerprint(self.step))
        return Stage(step, self.julia, self.moved)


Round = tuple[Code, ...]
"""Steps of a round, in order."""

Given = tuple[tuple[Any, ...], tuple[float, ...], tuple[Any, ...]]
"""Values that a step takes: its other arguments; its own constant, or none; if it is moved, the maps into its
coordinates and back, affine: nine entries row by row and three of the translation, then by how much more one
direction is stretched than another, and the least stretch.
"""


@lru_cache(maxsize=256)
def _trace_step(
    function: Callable[..., Any],
    sizes: tuple[tuple[str, int], ...],
    fixed: tuple[tuple[str, Any], ...],
    _: object,
) -> Step:
    """Code of a step, cached: following its graph takes a twentieth of a small picture."""
    rigid = sorted(RIGID, key=lambda verb: verb.__name__)
    verbs = identity(function, *(value for _, value in fixed), *MAJORANTS, *MAJORANTS.values(), *rigid)
    text = kept_text("traced", (verbs, sizes, fixed), lambda: trace(function, dict(sizes), dict(fixed)).text)
    return Step.read(text)


def stages(steps: Round) -> tuple[Stage, ...]:
    """Return the steps of a round, traced."""
    return tuple(code.stage for code in steps)


@dataclass(frozen=True)
class Form:
    """What the code of a field depends on besides the steps."""

    by_power: bool  # true if rounds grow by a power
    scaled: bool = False  # true if the potential is that of ``scale |w|`` after each step
    # true if critical points may be outside, for constants that are the same at all points
    critical: bool = True
    # true if the field stays below twice the sure distance (`fields.maps.sure_distance`)
    sure: bool = False
    torn: bool = False  # true if it stays below twice the sure distance to the tears of the steps
    blind: bool = False  # true if it is at most 0


def field(steps: Round, form: Form) -> Function:
    """Return the function of an orbit's field, of points and `iterations`, `limits`, `given`, `numbers`.

    `limits`: if rounds grow by a power, the levels (`fields.maps.levels`) and the radius of a ball around all
    solids, else the radius of escape. `given`: `Given` of each step. `numbers` of each step: the square of
    the radius where orbits stop, the scale, the power, the least derivative, the radius of the surface.
    """
    return _field(stages(steps), form)


@lru_cache(maxsize=256)
def _field(stages: tuple[Stage, ...], form: Form) -> Function:
    fixed = (("stages", stages), ("form", form), ("order", tuple(range(len(stages)))))
    return own_formula(orbit_field, fixed)


def affine_image(matrix, w):  # type: ignore[no-untyped-def]
    """Image of a point under an affine map; see `Given`."""
    x, y, z = w
    return (
        matrix[0] * x + matrix[1] * y + matrix[2] * z + matrix[9],
        matrix[3] * x + matrix[4] * y + matrix[5] * z + matrix[10],
        matrix[6] * x + matrix[7] * y + matrix[8] * z + matrix[11],
    )


def constant_of(start, given, stage):  # type: ignore[no-untyped-def]
    """Constant of a step: its own, or the start point in its coordinates."""
    _, constant, moved = given
    if stage.julia:
        return constant
    if stage.moved:
        back, _, _, _ = moved
        return affine_image(back, start)
    return start


def stage_image(w, constant, given, ready, stage):  # type: ignore[no-untyped-def]
    """Image of a point under a step."""
    v, _, moved = given
    if stage.moved:
        back, forth, _, _ = moved
        return affine_image(forth, stage.step.image(affine_image(back, w), constant, v, ready))
    return stage.step.image(w, constant, v, ready)


def orbit_field(x, y, z, iterations, limits, given, numbers, stages, form, order):  # type: ignore[no-untyped-def]
    """See `field`."""
    start = (x, y, z)
    constants = tuple(constant_of(start, given[k], stages[k]) for k in order)
    ready = tuple(stages[k].step.prepared(constants[k], given[k][0]) for k in order)
    if form.by_power:
        first_level, last_level, least_r2, reach = limits
        reached, level = first_level, 0.0 * x + first_level
    else:
        bailout = limits[0]
    r2, dr = x * x + y * y + z * z, 0.0 * x + 1.0
    stop, scale = numbers[order[-1]][0], numbers[order[-1]][1]
    end_r2, slope = r2, dr
    if form.scaled:
        end_r2, slope = scale * scale * r2, scale * dr
    alive = r2 < stop
    if form.sure or form.torn:
        bend, steep = 0.0 * x, dr
    if form.sure:
        sure = sqrt(minimum(r2, 1e30)) - reach
    if form.torn:
        tear = 0.0 * x + 1e30
    for _ in range(iterations):
        if not any_of(alive):
            break
        for k in order:
            v, moved = given[k][0], given[k][2]
            stop, scale, rate, least, surface = numbers[k]
            w = (x, y, z)
            if stages[k].moved:
                back, forth, spread, shrink = moved
                w = affine_image(back, w)
            if form.sure or form.torn:
                w, by_w, by_c, own_bend, own_tear = stages[k].step.bent(w, constants[k], v, ready[k])
                if stages[k].moved:
                    own_bend, own_tear = own_bend / shrink, shrink * own_tear
                if form.torn and stages[k].step.has_tear:
                    beside = 2.0 * sure_distance(own_tear, steep, bend)
                    tear = where(alive, minimum(tear, beside), tear)
                bend = where(alive, bend + steep * own_bend, bend)
            else:
                w, by_w, by_c = stages[k].step.taken(w, constants[k], v, ready[k])
            if form.by_power and form.critical and stages[k].is_fixed:
                by_w = maximum(by_w, least)
            dr = by_w * dr
            if not (stages[k].julia or stages[k].step.ignores_constant):
                dr = dr + by_c
            if stages[k].moved:
                dr = spread * dr
                w = affine_image(forth, w)
            x, y, z = w
            r2 = x * x + y * y + z * z
            orbit(r2, alive, x, y, z)
            if form.scaled:
                end_r2 = where(alive, scale * scale * r2, end_r2)
                slope = where(alive, maximum(scale * dr, slope), slope)
            else:
                end_r2 = where(alive, r2, end_r2)
                slope = where(alive, maximum(dr, slope), slope)
            if form.by_power:
                reached = reached * rate
                level = where(alive, reached, level)
            if form.sure or form.torn:
                steep = where(alive, maximum(dr, steep), steep)
            if form.sure:  # an orbit in its middle must leave the whole solid, later the surface
                radius = sqrt(r2)
                margin = where(level < 0.75 * last_level, radius - reach, radius - surface)
                sure = where(alive, maximum(sure, sure_distance(margin, steep, bend)), sure)
            alive = alive & (r2 < stop)
    if form.by_power:
        f = potential_distance(end_r2, slope * slope, level, first_level, last_level, least_r2)
    else:
        f = (sqrt(minimum(end_r2, 1e30)) - bailout) / minimum(slope, 1e30)
    if form.sure:
        f = minimum(2.0 * sure, f)
    if form.torn:
        f = minimum(tear, maximum(-tear, f))
    if form.blind:
        f = minimum(f, 0.0)
    return f


def box_image(w, r2, constant, given, ready, stage):  # type: ignore[no-untyped-def]
    """Image of a box, bounds of its |w|^2, and the stretches over the box.

    Where the length of the image follows from that of the point, sqrt(r2), the image lies in a shell, whose
    |w|^2 is returned; else `r2` itself.
    """
    v, _, moved = given
    if stage.moved:
        back, forth, spread, shrink = moved
        w = affine_image(back, w)
    if not stage.step.is_measured:
        w, by_w, by_c = stage.step.taken(w, constant, v, ready)
        if stage.moved:
            w = affine_image(forth, w)
        return w, r2, by_w, by_c
    x, y, z = w
    own_r2 = r2
    if stage.moved:
        own_r2 = x * x + y * y + z * z
    a, b, c = constant
    (x, y, z), by_w, by_c, shell = stage.step.sized(
        w, constant, v, ready, sqrt(own_r2), sqrt(a * a + b * b + c * c)
    )
    x, y, z = (
        maximum(minimum(x, shell), -shell),
        maximum(minimum(y, shell), -shell),
        maximum(minimum(z, shell), -shell),
    )
    if stage.moved:  # the shell around the image of the origin, then around the origin
        x, y, z = affine_image(forth, (x, y, z))
        a, b, c = x - forth[9], y - forth[10], z - forth[11]
        shell = shrink * shell
        shell = maximum(shell, minimum(spread * shell, sqrt(a * a + b * b + c * c)))
        away = sqrt(forth[9] * forth[9] + forth[10] * forth[10] + forth[11] * forth[11])
        shell = maximum(absolute(shell - away), minimum(shell + away, sqrt(x * x + y * y + z * z)))
    return (x, y, z), shell * shell, by_w, by_c


def last_size(x, y, z, mx, my, mz, reach, size, unit, given, stops, stages, order):  # type: ignore[no-untyped-def]
    """Bound of |w| at the end of a round from below, from a box and a ball around w; huge if orbits stop.

    The box x, y, z is the image by intervals. The ball around mx, my, mz grows by the stretch over the box;
    if a step may tear space, the box takes its place. Constants that are added move w by their `size`.
    """
    alive = x == x
    r2 = x * x + y * y + z * z
    for k in order:
        if k > order[0]:
            if stages[k - 1].is_sum:
                x, y, z = x + size * unit, y + size * unit, z + size * unit
                reach = reach + size
                r = sqrt(r2)
                far = minimum(r + size, sqrt(x * x + y * y + z * z))
                r = maximum(absolute(r - size), far)
                r2 = r * r
            alive = alive & (r2 < stops[k - 1])
        own = 0.0 if stages[k].is_sum else size * unit
        start = (own, own, own)
        constant = constant_of(start, given[k], stages[k])
        ready = stages[k].step.prepared(constant, given[k][0])
        box, box_r2, by_w, _ = box_image((x, y, z), r2, constant, given[k], ready, stages[k])
        if stages[k].step.is_torn:
            mx, my, mz = box
            reach = 0.0 * reach
        else:
            mx, my, mz = stage_image((mx, my, mz), constant, given[k], ready, stages[k])
            if stages[k].moved:
                by_w = given[k][2][2] * by_w
            reach = by_w * reach
        x, y, z = box
        r2 = box_r2 if stages[k].step.is_measured else x * x + y * y + z * z
    least = maximum(sqrt(r2), sqrt(mx * mx + my * my + mz * mz) - reach)
    if stages[order[-1]].is_sum:
        least = least - size
    return where(alive, least, 1e200)


FARTHEST_BOX = 1e15
"""Radius from which a ball is not used: intervals do not hold the squares of its points (`intervals`)."""


def orbit_sign(x, y, z, iterations, limits, given, stops, stages, order, scaled):  # type: ignore[no-untyped-def]
    """``scale^2 |w_N|^2 - R^2`` where an orbit does not stop before, else 1; `limits`: the scale and R^2.

    Of a cell, it follows a box and a ball around the image of its middle; each holds the images of all
    points. The ball grows by the stretch over the box, where intervals of folds and turns grow with each sum.
    Steps that may tear space, or hold the start point in another place than a sum, begin with the ball around
    the box again.
    """
    scale, radius2 = limits
    start = (x, y, z)
    constants = tuple(constant_of(start, given[k], stages[k]) for k in order)
    ready = tuple(stages[k].step.prepared(constants[k], given[k][0]) for k in order)
    mx, my, mz, reach = ball_around(x, y, z)
    middle, size = (mx, my, mz), reach
    held = reach < FARTHEST_BOX
    r2 = x * x + y * y + z * z
    alive = r2 < stops[order[-1]]
    for _ in range(iterations):
        if not any_of(alive):
            break
        for k in order:
            box, box_r2, by_w, by_c = box_image((x, y, z), r2, constants[k], given[k], ready[k], stages[k])
            x, y, z = box
            if stages[k].in_ball:
                constant = constants[k]
                if not stages[k].is_fixed:
                    constant = constant_of(middle, given[k], stages[k])
                mx, my, mz = stage_image((mx, my, mz), constant, given[k], ready[k], stages[k])
                reach = by_w * reach
                if not stages[k].is_fixed:
                    reach = reach + by_c * size
                if stages[k].moved:
                    reach = given[k][2][2] * reach
                held = held & (reach < FARTHEST_BOX)
                x = where(held, maximum(minimum(x, mx + reach), mx - reach), x)
                y = where(held, maximum(minimum(y, my + reach), my - reach), y)
                z = where(held, maximum(minimum(z, mz + reach), mz - reach), z)
            else:
                mx, my, mz, reach = ball_around(x, y, z)
            r2 = box_r2 if stages[k].step.is_measured else x * x + y * y + z * z
            size2 = mx * mx + my * my + mz * mz
            near, far = maximum(sqrt(size2) - reach, 0.0), sqrt(size2) + reach
            r2 = where(held, maximum(minimum(r2, far * far), near * near), r2)
            alive = alive & (r2 < stops[k])
    end_r2 = scale * scale * r2 if scaled else r2
    return where(alive, end_r2 - radius2, 1.0 + 0.0 * r2)


def ball_around(x, y, z):  # type: ignore[no-untyped-def]
    """Middle and radius of the ball around a box."""
    a, b, c = cell_extent(x), cell_extent(y), cell_extent(z)
    return cell_middle(x), cell_middle(y), cell_middle(z), sqrt(a * a + b * b + c * c)


def sign(steps: Round, scaled: bool) -> Function:
    """Return the function `orbit_sign` of a round; `scaled`: see `Form`."""
    return _of_cells(orbit_sign, stages(steps), 0, (("scaled", scaled),))


def size(steps: Round, first: int) -> Function:
    """Return the function `last_size` of the steps of a round from one on."""
    return _of_cells(last_size, stages(steps), first, ())


@lru_cache(maxsize=256)
def _of_cells(function: Callable[..., Any], stages: tuple[Stage, ...], first: int, known: Fixed) -> Function:
    order = tuple(range(first, len(stages)))
    return own_formula(function, (("stages", stages), ("order", order), *known))
