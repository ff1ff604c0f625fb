"""Signed distances of a shape at points."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.parameters import AUTO
from ..errors import SceneError
from ..formulas import Node
from ..volume import with_depths
from ..work import Work, chunks


def distance(shape: Node, points: ArrayLike) -> NDArray[np.floating]:
    """Signed distance field of a shape at points, as `Node.distance`.

    Parameters
    ----------
    shape : Node
        The shape.
    points : array of float32 or float64, [..., 3]
        Coordinates in scene units.

    Returns
    -------
    ndarray [...]
        Values in the precision of the points; float64 for other numeric types.

    Raises
    ------
    SceneError
        If the last axis of the points is not x, y, z, or an unbounded shape contains a fractal with
        automatic iterations.
    """
    array = _points(points)
    kernel = _with_depths(shape).kernel("cpu", "float32" if array.dtype == np.float32 else "float64")
    flat, values = array.reshape(-1, 3), np.empty(array.size // 3, array.dtype)

    def evaluate(part: slice) -> None:
        values[part] = kernel.points(*flat[part].T)

    Work().map(evaluate, chunks(len(flat), kernel.batch))
    return values.reshape(array.shape[:-1])


def _points(points: ArrayLike) -> NDArray[np.floating]:
    """Points as an array of float32 or float64, [..., 3]. Raises `SceneError` for any other shape or type."""
    try:
        array = np.asarray(points)
        array = array if array.dtype == np.float32 else array.astype(np.float64, casting="same_kind")
    except (TypeError, ValueError):
        raise SceneError("points: expected numbers, an array [..., 3]") from None
    if array.ndim == 0 or array.shape[-1] != 3:
        raise SceneError(f"points: expected an array [..., 3], found one of shape {list(array.shape)}")
    return array


@lru_cache(maxsize=32)
def _with_depths(shape: Node) -> Node:
    """The shape with automatic iterations replaced by numbers. Raises `SceneError` if it is unbounded."""
    known = with_depths(shape)
    for node in known.solids():
        if AUTO in (value for value in node.values.values() if isinstance(value, str)):
            raise node.fail("iterations: expected a number where the shape has no end")
    return known
