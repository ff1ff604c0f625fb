"""Every parameter at the ends of its declared range, and points from denormals to the largest floats."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from fracslice.common.parameters import (
    LARGEST,
    SMALLEST,
    Axis,
    Choice,
    Count,
    Digest,
    File,
    Label,
    Number,
    Parameter,
    Points,
    Vector,
)
from fracslice.errors import SceneError
from fracslice.formulas import Node


def ends(kind: Parameter) -> list[object]:
    """The values at both ends of a parameter's range, and next to zero where it has both signs."""
    if isinstance(kind, (Axis, Choice, Digest, File, Label, Points)):
        return []
    if isinstance(kind, Count):
        return [kind.least, min(kind.most, 1000)]
    low = SMALLEST if kind.above == 0 else max(np.nextafter(kind.above, np.inf), kind.least, -LARGEST)
    high = min(np.nextafter(kind.below, -np.inf), kind.most, LARGEST)
    numbers = [float(low), float(high)]
    numbers += [v for v in (-SMALLEST, 5e-324, SMALLEST) if low < v < high]
    if isinstance(kind, Number):
        return list(numbers)
    return [_vector(kind, first, rest) for first in numbers for rest in (first, 1.0)]


def _vector(kind: Vector, first: float, rest: float) -> tuple[float, ...]:
    values = (first,) + (rest,) * (kind.sizes[0] - 1)
    return tuple(int(v) for v in values) if kind.whole else values


def extreme_versions(root: Node) -> Iterator[tuple[str, Node]]:
    """The scene with one parameter of its top element at an end; what the formula refuses is left out."""
    for name, kind in root.formula.parameters.items():
        for value in ends(kind):
            try:
                node = root.changed(**{name: value})
                _ = node.bounds, node.arguments
            except (SceneError, ZeroDivisionError):
                continue
            yield f"{name}={value}", node


def hostile_points(largest: float) -> np.ndarray:
    """Points [3, n] of all sizes from 1e-45 to `largest`, mixed in one point too, and on axes and planes."""
    rng = np.random.default_rng(7)
    top = np.log10(largest)
    spread = rng.normal(size=(3, 300)) * 10 ** rng.uniform(-45, top - 1, 300)
    mixed = rng.choice([-1, 1], (3, 300)) * 10 ** rng.uniform(-45, top, (3, 300))
    corners = list(product((-largest, -1e20, -1.0, 0.0, 1e-40, 0.5, 1e20, largest), repeat=3))
    return np.concatenate([spread, mixed, rng.uniform(-2, 2, (3, 300)), np.array(corners).T], axis=1)
