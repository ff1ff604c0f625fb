"""Radius of escape of an orbit, proved by intervals.

An orbit stops beyond a larger radius, so the shell between the two is all that has to be searched. In it, |w|
grows with every round: for all constants up to |w| if rounds grow by a power, as the Mandelbrot set's do for
|w| > 2, else for those up to the size of the solid. No orbit of such a constant comes back from there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..expr.graph import Function
from ..expr.intervals import ARRAYS, Interval, evaluate_on_cells
from .box import Corners, undecided_cells
from .orbit_code import R2, Round, function_of_text

MOST, LEVELS, MARGIN = 1 << 15, 12, 1e-9
"""Cells of a level, beyond which the radius is enlarged; levels of cells; least relative growth, more than
the errors of coefficients.
"""

BESIDE = 4e-290
"""End of an interval in place of 0. The steps of a cell that ends at a plane are those of its side of the
plane; on the plane itself they are limits of these.
"""

ADDED = [
    "reach = reach + size",
    "r = maximum(absolute(sqrt(r2) - size), minimum(sqrt(r2) + size, sqrt(x * x + y * y + z * z)))",
    "r2 = r * r",
]
"""Lines that add constants to the ball and to the squared distance from the origin."""

BOX, BALL = ("x", "y", "z"), ("mx", "my", "mz", "reach")
UNIT = Interval(np.full(1, -1.0), np.full(1, 1.0), ARRAYS)


def escape_radius(
    least: Callable[[Corners, Corners, np.ndarray], np.ndarray],
    radius: float,
    outer: float,
    end: float | None,
) -> float:
    """Enlarge a radius until no orbit comes back from beyond it.

    `outer`: radius where orbits stop.
    """

    given = radius

    def wanted(lo: Corners, hi: Corners) -> np.ndarray:
        nonlocal radius
        far = np.where(_nearest(lo, hi) < outer, _farthest(lo, hi), 0.0)
        if (far > radius).sum() > MOST:
            radius = float(np.partition(far, -MOST)[-MOST])
        beyond: np.ndarray = far > radius
        return beyond

    def proved(lo: Corners, hi: Corners) -> np.ndarray:
        far = _farthest(lo, hi)
        grown: np.ndarray = least(lo, hi, far) > (far if end is None else end) * (1 + MARGIN)
        return grown

    left = float(_farthest(*undecided_cells(wanted, proved, outer, MOST, LEVELS)).max(initial=0.0))
    return given if max(radius, left) == given else 1.02 * max(radius, left)


def least_size(
    steps: Round, first: int, values: Mapping[str, Any], size: float | None
) -> Callable[[Corners, Corners, np.ndarray], np.ndarray]:
    """Return a function of cells, and the size of their farthest points, that bounds the last |w| from below.

    `values`: those of the arguments of the steps, and squares of the radii where orbits stop.
    The bound is huge where all orbits stop.
    """
    function = _last_size(steps, first)
    given = [values[name] for name in function.parameters[9:]]

    def least(lo: Corners, hi: Corners, far: np.ndarray) -> np.ndarray:
        constants = Interval.at(far if size is None else np.full_like(far, size), ARRAYS)
        box = (
            Interval(np.where(a == 0, BESIDE, a), np.where(b == 0, -BESIDE, b), ARRAYS)
            for a, b in zip(lo, hi, strict=True)
        )
        middle = (Interval.at(m, ARRAYS).outward() for m in (lo + hi) / 2)
        reach = Interval.at(np.sqrt(((hi - lo) ** 2).sum(0)) / 2, ARRAYS).outward(4)
        with np.errstate(all="ignore"):
            bound = evaluate_on_cells(function, *box, *middle, reach, constants, UNIT, *given)
        return np.broadcast_to(bound.lo, far.shape)

    return least


def constant_stretch(steps: Round, first: int, values: Mapping[str, Any]) -> float | None:
    """Return a bound of the stretch of steps whose stretch is the same at all points."""
    product = 1.0
    for place, code in list(enumerate(steps))[first:]:
        step, names = code.traced(place), code.arguments(place)
        if not step.is_steady or not code.is_fixed(place):
            return None
        before = code.before(place, ("0.0",) * 3)
        body = [*before, *step.needed(step.stretch[0]), f"return {step.stretch[0]}"]
        spread = values[f"spread{place}"] if code.moved else 1.0
        product *= spread * float(function_of_text(steps, names, body)(*(values[name] for name in names)))
    return product * (1 + MARGIN)


def _last_size(steps: Round, first: int) -> Function:
    """Write the function of |w| at the end of a round, from a box and a ball around w.

    The box x, y, z is the image by intervals. The ball around mx, my, mz grows by the stretch over the box;
    if a step may tear space, the box takes its place. Constants that are added move w by their size.
    """
    given, body, added = [], ["alive = x == x", R2], False
    for place, code in list(enumerate(steps))[first:]:
        if place > first:
            given.append(f"stop{place - 1}")
            body += [f"{v} = {v} + size * unit" for v in "xyz" if added]
            body += [*ADDED] if added else []
            body += [f"alive = alive & (r2 < stop{place - 1})"]
        step = code.traced(place)
        added = step.is_added and not code.julia
        given += code.arguments(place)
        start = ("0.0" if added else "size * unit",) * 3
        spread = f"spread{place} * " if code.moved else ""
        body += code.before(place, start)
        if step.is_torn:
            body += [*code.boxed(place), "mx, my, mz, reach = x, y, z, 0.0 * reach"]
        else:
            body += ["bx, by, bz = x, y, z", "x, y, z = mx, my, mz", *code.image(place)]
            body += ["mx, my, mz = x, y, z", "x, y, z = bx, by, bz"]
            body += code.boxed(place, [f"reach = {spread}{step.stretch[0]} * reach"])
        body += [R2] if step.length is None else []
    ball, reach = "sqrt(mx * mx + my * my + mz * mz) - reach", " - size" if added else ""
    body.append(f"return where(alive, maximum(sqrt(r2), {ball}){reach}, 1e200)")
    return function_of_text(steps, [*BOX, *BALL, "size", "unit", *given], body)


def _farthest(lo: Corners, hi: Corners) -> np.ndarray:
    """Distances of the farthest points of cells from the origin."""
    size: np.ndarray = np.sqrt((np.maximum(-lo, hi) ** 2).sum(0))
    return size


def _nearest(lo: Corners, hi: Corners) -> np.ndarray:
    """Distances of the nearest points of cells from the origin."""
    size: np.ndarray = np.sqrt((np.maximum(np.maximum(lo, -hi), 0) ** 2).sum(0))
    return size
