"""Lines of an orbit's field that keep it below distances proved by majorants (`formulas.escape`).

The derivative bounds how far a point of the orbit moves only near the start point; the bend, a majorant of
the other terms, bounds it everywhere. So no point nearer than the sure distance moves into the solid, or
across a tear of a step.
"""

from __future__ import annotations

from collections.abc import Sequence

from .straight_line import Step


def known(steps: Sequence[Step]) -> bool:
    """Return True if all steps have a known majorant."""
    return all(step.majorant is not None for step in steps)


def torn(steps: Sequence[Step]) -> bool:
    """Return True if a step is known to tear space."""
    return any(step.majorant is not None and step.majorant[1] is not None for step in steps)


def before(sure: bool, torn: bool) -> list[str]:
    """Return the lines before the first step."""
    return [
        *(["bend = 0.0 * x", "steep = dr"] if sure or torn else []),
        *(["sure = sqrt(minimum(r2, 1e30)) - reach"] if sure else []),
        *(["tear = 0.0 * x + 1e30"] if torn else []),
    ]


def of_step(step: Step, torn: bool, shrink: str | None) -> list[str]:
    """Return the lines before the derivative of a step is taken; shrink: that of its own coordinates."""
    assert step.majorant is not None
    bend, tear = step.majorant
    if shrink:
        bend, tear = f"{bend} / {shrink}", tear and f"{shrink} * {tear}"
    beside = f"2.0 * sure_distance({tear}, steep, bend)"
    crossed = [f"tear = where(alive, minimum(tear, {beside}), tear)"] if tear and torn else []
    return [*step.bending, *crossed, f"bend = where(alive, bend + steep * {bend}, bend)"]


def after(sure: bool, torn: bool, surface: str) -> list[str]:
    """Return the lines after a step: an orbit in its middle must leave the whole solid, later the surface."""
    margin = f"where(level < 0.75 * last_level, radius - reach, radius - {surface})"
    left = "where(alive, maximum(sure, sure_distance(margin, steep, bend)), sure)"
    return [
        *(["steep = where(alive, maximum(dr, steep), steep)"] if sure or torn else []),
        *(["radius = sqrt(r2)", f"margin = {margin}", f"sure = {left}"] if sure else []),
    ]


def last(sure: bool, torn: bool) -> list[str]:
    """Return the lines that bound the field."""
    return [
        *(["f = minimum(2.0 * sure, f)"] if sure else []),
        *(["f = minimum(tear, maximum(-tear, f))"] if torn else []),
    ]
