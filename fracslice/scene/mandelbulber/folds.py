"""Folds that formulas of several families have in common."""

from __future__ import annotations

from collections.abc import Sequence

from .step_text import FormulaStep

PI = "3.141592653589793"


def absolute(s: FormulaStep, *switches: str) -> None:
    """Absolute value of the coordinates whose switches are on."""
    absolute_of(s, [s.on(switch) for switch in switches])


def absolute_of(s: FormulaStep, on: Sequence[bool]) -> None:
    """Absolute value of some coordinates."""
    if all(on):
        s.write("w = positive(w)")
    elif any(on):
        parts = (f"absolute({axis})" if flag else axis for axis, flag in zip("xyz", on, strict=True))
        s.write("x, y, z = w", f"w = ({', '.join(parts)})")


def polygon(s: FormulaStep, axes: str, count: str) -> None:
    """Fold the angle in the plane of two axes into a sector of a polygon."""
    first, second = axes[0], axes[1]
    n = s.parameter(count, max(s.values.whole(count), 1))
    s.write(
        "x, y, z = w",
        f"k = {PI} / {n}",
        f"t = atan2({second}, {first}) + k",
        "t = t - 2 * k * where(t < 0, -floor(-t / (2 * k)), floor(t / (2 * k)))",
        "t = absolute(t - k)",
        f"r = sqrt(maximum({first} * {first} + {second} * {second}, 1e-30))",
        f"{first} = r * cos(t)",
        f"{second} = r * sin(t)",
        "w = (x, y, z)",
    )
