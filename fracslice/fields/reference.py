"""Reference back end: the linked scene on NumPy float64 arrays. Slow; the oracle of all other back ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..expr import vocabulary
from ..expr.functions import words
from ..expr.graph import ON_ARRAYS, Evaluator
from ..expr.intervals import ON_CELLS, Interval, enclosed
from .linker import FIELD, link

if TYPE_CHECKING:
    from .node import Node


def reference(root: Node) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Return the signed field of a scene tree.

    Parameters
    ----------
    root
        Scene with resolved depths.

    Returns
    -------
    Callable
        ``f(x, y, z)`` of float64 arrays of one shape, scene units.

    Raises
    ------
    KernelError
        If the scene cannot be linked.
    """
    function = _field(root, ON_ARRAYS)

    def evaluate(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return np.asarray(function(*(np.asarray(a, dtype=np.float64) for a in (x, y, z))))

    return evaluate


def enclosure(root: Node) -> Callable[[Interval, Interval, Interval], Interval]:
    """Return the field of a scene tree on cells.

    Returns a value in scene units.
    """
    return _field(root, ON_CELLS)


def _field(root: Node, operations: Mapping[str, Callable[..., Any]]) -> Callable[..., Any]:
    """Field of a tree with given functions of the vocabulary."""
    linked = link(root)
    memory = {words(memory.digest): memory for _, memory in linked.held}

    def asking(function: Callable[..., Any]) -> Callable[..., Any]:
        def asked(*given: Any) -> Any:
            *point, place = given
            shape = memory[tuple(place)]
            if isinstance(point[0], Interval):
                return enclosed(lambda *middle: function(*middle, shape), *point)
            return function(*point, shape)

        return asked

    asked = {name: asking(getattr(vocabulary, name)) for name in vocabulary.OF_FILES}
    named = linked.program.functions
    evaluator = Evaluator({**operations, **asked}, named)

    def evaluate(*points: Any) -> Any:
        with np.errstate(all="ignore"):
            return evaluator(named[FIELD], *points, linked.parameters)

    return evaluate
