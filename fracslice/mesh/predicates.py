# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""On which side does a point lie: answered exactly, and fast where the answer is clear.

Method: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates"
(1997), in two stages. A plain float64 determinant decides when it exceeds its error bound; otherwise the
determinant is summed without rounding as a floating-point expansion. Exact as long as products of three
coordinates neither overflow nor underflow. Importing this module imports Numba.
"""

from __future__ import annotations

import numpy as np
from numba import njit

EPSILON = 2.0**-53
BOUND_2D = (3 + 16 * EPSILON) * EPSILON
BOUND_3D = (7 + 56 * EPSILON) * EPSILON
SPLITTER = 2.0**27 + 1


@njit(cache=True, nogil=True)
def _add(terms, count, value):
    """Add one number to the expansion in terms[:count], without rounding; the new count."""
    if value == 0.0:
        return count
    kept = 0
    for i in range(count):
        total = value + terms[i]
        virtual = total - value
        rest = (value - (total - virtual)) + (terms[i] - virtual)
        value = total
        if rest != 0.0:
            terms[kept] = rest
            kept += 1
    if value != 0.0:
        terms[kept] = value
        kept += 1
    return kept


@njit(cache=True, nogil=True)
def _error_of_product(a, b, product):
    """What the rounded product lacks: a * b - product, exactly (Dekker, Veltkamp)."""
    t = SPLITTER * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = SPLITTER * b
    b_high = t - (t - b)
    b_low = b - b_high
    return a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


@njit(cache=True, nogil=True)
def _add_product(terms, count, a, b):
    product = a * b
    count = _add(terms, count, _error_of_product(a, b, product))
    return _add(terms, count, product)


@njit(cache=True, nogil=True)
def _sign_of_sum(terms, count):
    """An expansion has the sign of its last, largest term."""
    if count == 0:
        return 0
    return 1 if terms[count - 1] > 0.0 else -1


@njit(cache=True, nogil=True)
def _exact_differences(a, b):
    """Whether a - b is free of rounding, as for most neighbours with float32 coordinates; it saves terms."""
    exact = True
    for k in range(len(a)):
        difference = a[k] - b[k]
        back = a[k] - difference
        exact &= (a[k] - (difference + back)) + (back - b[k]) == 0.0
    return exact


@njit(cache=True, nogil=True)
def side_of_line(ax, ay, bx, by, cx, cy):
    """1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on one line. Exact."""
    left = (ax - cx) * (by - cy)
    right = (ay - cy) * (bx - cx)
    det = left - right
    bound = BOUND_2D * (abs(left) + abs(right))
    if det > bound:
        return 1
    if -det > bound:
        return -1
    if bound == 0.0:
        return 0
    terms = np.empty(16)
    if _exact_differences((ax, ay), (cx, cy)) and _exact_differences((bx, by), (cx, cy)):
        n = _add_product(terms, 0, ax - cx, by - cy)
        return _sign_of_sum(terms, _add_product(terms, n, cy - ay, bx - cx))
    n = _add_product(terms, 0, ax, by)
    n = _add_product(terms, n, -ay, bx)
    n = _add_product(terms, n, bx, cy)
    n = _add_product(terms, n, -by, cx)
    n = _add_product(terms, n, cx, ay)
    n = _add_product(terms, n, -cy, ax)
    return _sign_of_sum(terms, n)


@njit(cache=True, nogil=True)
def _add_volume(terms, count, a, b, c, sign):
    """Add sign * det(a, b, c), six products of three coordinates, to an expansion."""
    for k in range(3):
        x = sign * a[k]
        i, j = (k + 1) % 3, (k + 2) % 3
        for y, z in ((b[i], c[j]), (-b[j], c[i])):
            product = x * y
            count = _add_product(terms, count, _error_of_product(x, y, product), z)
            count = _add_product(terms, count, product, z)
    return count


@njit(cache=True, nogil=True)
def side_of_plane(a, b, c, d):
    """1 if d lies below the plane of a, b, c (they turn clockwise as d sees them), -1 above, 0 on it. Exact.

    Points are three floats each; it is the sign of det(a - d, b - d, c - d).
    """
    adx, ady, adz = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bdx, bdy, bdz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cdx, cdy, cdz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    bc, cb = bdx * cdy, cdx * bdy
    ca, ac = cdx * ady, adx * cdy
    ab, ba = adx * bdy, bdx * ady
    det = adz * (bc - cb) + bdz * (ca - ac) + cdz * (ab - ba)
    bound = BOUND_3D * (
        (abs(bc) + abs(cb)) * abs(adz) + (abs(ca) + abs(ac)) * abs(bdz) + (abs(ab) + abs(ba)) * abs(cdz)
    )
    if det > bound:
        return 1
    if -det > bound:
        return -1
    if bound == 0.0:
        return 0
    terms = np.empty(128)
    if _exact_differences(a, d) and _exact_differences(b, d) and _exact_differences(c, d):
        n = _add_volume(terms, 0, (adx, ady, adz), (bdx, bdy, bdz), (cdx, cdy, cdz), 1.0)
        return _sign_of_sum(terms, n)
    n = _add_volume(terms, 0, a, b, c, 1.0)
    n = _add_volume(terms, n, b, c, d, -1.0)
    n = _add_volume(terms, n, c, d, a, 1.0)
    n = _add_volume(terms, n, d, a, b, -1.0)
    return _sign_of_sum(terms, n)
