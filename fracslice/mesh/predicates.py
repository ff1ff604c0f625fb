"""On which side does a point lie: answered exactly, and fast where the answer is clear.

Method: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates"
(1997), in two stages. A plain float64 determinant decides when it exceeds its error bound; otherwise the
determinant is summed without rounding as a floating-point expansion. Exact as long as products of three
coordinates neither overflow nor underflow.
"""

from __future__ import annotations

from fracslice._native import side_of_line as _side_of_line
from fracslice._native import side_of_plane as _side_of_plane

Point = tuple[float, float, float]


def side_of_line(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on one line. Exact."""
    return _side_of_line(ax, ay, bx, by, cx, cy)


def side_of_plane(a: Point, b: Point, c: Point, d: Point) -> int:
    """1 if d lies below the plane of a, b, c (they turn clockwise as d sees them), -1 above, 0 on it. Exact.

    It is the sign of det(a - d, b - d, c - d).
    """
    return _side_of_plane(a, b, c, d)
