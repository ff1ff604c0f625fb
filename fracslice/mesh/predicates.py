"""Exact orientation predicates.

Method: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates"
(1997), in two stages. A float64 determinant decides if it exceeds its error bound; otherwise the determinant
is summed without rounding as a floating-point expansion. Exact as long as products of three coordinates
neither overflow nor underflow.
"""

from __future__ import annotations

from fracslice._native import side_of_line as _side_of_line
from fracslice._native import side_of_plane as _side_of_plane

Point = tuple[float, float, float]


def side_of_line(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Exact orientation of three points in the plane.

    Parameters
    ----------
    ax, ay, bx, by, cx, cy : float
        Coordinates of a, b and c.

    Returns
    -------
    int
        1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they are collinear.
    """
    return _side_of_line(ax, ay, bx, by, cx, cy)


def side_of_plane(a: Point, b: Point, c: Point, d: Point) -> int:
    """Exact side of a plane on which a point lies: the sign of det(a - d, b - d, c - d).

    Parameters
    ----------
    a, b, c : tuple of float
        Points of the plane.
    d : tuple of float
        Point to classify.

    Returns
    -------
    int
        1 if d lies below the plane (a, b, c turn clockwise seen from d), -1 above, 0 on it.
    """
    return _side_of_plane(a, b, c, d)
