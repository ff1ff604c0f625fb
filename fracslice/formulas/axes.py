"""Axes and triples of numbers as operators take them."""

from __future__ import annotations

from typing import Any, Literal

Axis = Literal["x", "y", "z"]
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def direction(axis: Any) -> tuple[Any, ...]:
    """Direction of an axis that is given by a letter or by three numbers."""
    if isinstance(axis, str):
        return AXES.get(axis, (axis,))
    return tuple(axis) if hasattr(axis, "__len__") else (axis,)


def three(value: Any) -> Any:
    """One value for each axis."""
    return value if hasattr(value, "__len__") else (value,) * 3
