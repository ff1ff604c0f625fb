"""Linear algebra in three dimensions with a fixed order of operations, for the same results on all machines.

Linear algebra libraries choose the summation order and fused operations by processor. With them, a rotated
scene would have other parameters, and its mesh other last bits, on another machine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

SWEEPS = 60
SMALL = 2.0**-52


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Matrix product.

    `a`: matrix; `b`: matrix or vector.
    """
    terms = [np.multiply.outer(a[:, k], b[k]) for k in range(a.shape[1])]
    total: np.ndarray = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def dot(a: np.ndarray, b: np.ndarray) -> float:
    """Inner product of two vectors of equal length."""
    total = 0.0
    for x, y in zip(a.tolist(), b.tolist(), strict=True):
        total += x * y
    return total


def length(vector: np.ndarray) -> float:
    """Euclidean norm of a vector."""
    return math.sqrt(dot(vector, vector))


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse by Gauss-Jordan elimination with partial pivoting."""
    rows = np.hstack([np.asarray(matrix, float), np.eye(3)])
    for k in range(3):
        pivot = k + int(np.abs(rows[k:, k]).argmax())
        rows[[k, pivot]] = rows[[pivot, k]]
        rows[k] = rows[k] / rows[k, k]
        for other in {0, 1, 2} - {k}:
            rows[other] = rows[other] - rows[other, k] * rows[k]
    return rows[:, 3:]


def stretches(matrix: np.ndarray) -> np.ndarray:
    """Singular values, in descending order.

    One-sided Jacobi rotations make the columns orthogonal (Hestenes 1958, "Inversion of matrices by
    biorthogonalization and related results").
    """
    columns = np.array(matrix, float).T.copy()
    for _ in range(SWEEPS):
        turned = False
        for p, q in ((0, 1), (0, 2), (1, 2)):
            a, b = dot(columns[p], columns[p]), dot(columns[q], columns[q])
            both = dot(columns[p], columns[q])
            if abs(both) <= SMALL * math.sqrt(a * b):
                continue
            half = (b - a) / (2 * both)
            tangent = math.copysign(1 / (abs(half) + math.sqrt(1 + half * half)), half)
            cosine = 1 / math.sqrt(1 + tangent * tangent)
            sine = cosine * tangent
            one, other = columns[p], columns[q]
            columns[p], columns[q] = cosine * one - sine * other, sine * one + cosine * other
            turned = True
        if not turned:
            break
    return np.sort([length(column) for column in columns])[::-1]


def rotation(rotate: Sequence[float]) -> np.ndarray:
    """Rotation matrix of an axis and an angle in degrees, by Rodrigues' formula."""
    axis = np.array(rotate[:3]) / length(np.array(rotate[:3]))
    angle = math.radians(rotate[3])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn: np.ndarray = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * product(cross, cross)
    return turn


def affine(values: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Affine map of a `transform`: of its rotation, scale, translation and matrix.

    Returns float64.
    """
    linear = np.diag(np.broadcast_to(np.array(values["scale"]), 3))
    if values["rotate"]:
        linear = product(rotation(values["rotate"]), linear)
    offset = np.array(values["translate"])
    if values["matrix"]:
        given = np.array(values["matrix"][:12]).reshape(3, 4)
        offset = offset + product(linear, given[:, 3])
        linear = product(linear, given[:, :3])
    return linear, offset
