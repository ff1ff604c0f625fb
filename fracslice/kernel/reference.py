"""Reference back end: the linked scene on NumPy float64 arrays. Slow; the oracle of all other back ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..formulas import vocabulary
from ..formulas.registry import Node
from .linker import CALLED, FIELD, link


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
    linked = link(root)
    scope = {name: getattr(vocabulary, name) for name in vocabulary.NAMES}
    scope[CALLED] = lambda function: function
    exec(compile(linked.source, "<linked scene>", "exec"), scope)
    function = scope[FIELD]

    def evaluate(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            points = [np.asarray(a, dtype=np.float64) for a in (x, y, z)]
            return np.asarray(function(*points, linked.parameters))

    return evaluate
