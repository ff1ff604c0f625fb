"""The Lipschitz bound a scene states, against pairs of points and against the surface itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fracslice.fields.cpu import compile_scene
from fracslice.formulas import Node

from .places import points

CHUNK = 1 << 16
NEAREST = 1e-9
"""Relative. Nearer to a fractal, rounding along the orbit has the sign."""
SLACK = 1e-6
"""Relative. Differences of float64 values over short steps are not better."""

Field = Callable[..., np.ndarray]


@dataclass(frozen=True)
class Verdict:
    """points: how many were tried. violations: at how many the bound was exceeded. worst: the largest slope
    or quotient seen, in units of the bound: at most 1 if it holds. where: the point of the worst.
    """

    points: int = 0
    violations: int = 0
    worst: float = 0.0
    where: tuple[float, ...] = ()

    def __or__(self, other: Verdict) -> Verdict:
        larger = self if self.worst >= other.worst else other
        return replace(
            larger, points=self.points + other.points, violations=self.violations + other.violations
        )


def verdict(root: Node, count: int, seed: int = 0, bound: float | None = None) -> Verdict:
    """Tries `count` points against what space is skipped by: the guarded scene, and `bound`, or else its
    own. Raises `KernelError`.

    Slopes of pairs: along the gradient, and in random directions at all distances. Of a field with an
    escape-time fractal in it, which only promises a ball of radius f / L around an outside point: whether the
    ball is free, along the gradient towards the surface, near it, and anywhere.
    """
    conservative, rng = root.conservative(), np.random.default_rng(seed)
    field, is_conservative = (compile_scene(r, "float64").points for r in (root, conservative))
    bound, result = bound or conservative.bounds.lipschitz, Verdict()
    for start in range(0, count, CHUNK):
        p = points(root, min(CHUNK, count - start), rng)
        if root.bounds.exterior_only:
            result = result | _free_ball(field, is_conservative, p, bound, rng)
        else:
            result = result | _slopes(field, p, bound, rng)
    return result


def _slopes(field: Field, a: np.ndarray, bound: float, rng: np.random.Generator) -> Verdict:
    size = float(np.ptp(a, axis=1).max())
    step = size * 10 ** rng.uniform(-6, 0, a.shape[1])
    fa = field(*a)
    steepest = np.zeros(a.shape[1])
    for direction in (_unit(rng.normal(size=a.shape)), _gradient(field, a, fa, 1e-6 * size)):
        b = a + direction * step
        distance = np.linalg.norm(b - a, axis=0)
        rounding = 1e-13 * size / distance
        slope = np.abs(field(*b) - fa) / np.maximum(distance, 1e-300) - rounding
        steepest = np.maximum(steepest, np.where(distance > 0, slope, 0) / bound)
    return _judged(a, steepest)


def _free_ball(
    field: Field, is_conservative: Field, a: np.ndarray, bound: float, rng: np.random.Generator
) -> Verdict:
    fa = field(*a)
    a, fa = a[:, fa > 0], fa[fa > 0]
    free = is_conservative(*a) / bound
    free = np.where(free > NEAREST * np.abs(a).max(0), free, 0)
    outward = _gradient(field, a, fa, 1e-7)
    worst = np.zeros(a.shape[1])
    tilted = _unit(0.5 * _unit(rng.normal(size=a.shape)) - outward)
    for direction in (-outward, tilted, _unit(rng.normal(size=a.shape))):
        reach = free * 2 ** rng.uniform(-3, 1, a.shape[1])
        hit = field(*(a + direction * reach)) < 0
        worst = np.maximum(worst, np.where(hit, free / np.maximum(reach, 1e-300), 0))
    return _judged(a, worst)


def _judged(a: np.ndarray, quotient: np.ndarray) -> Verdict:
    k = int(np.argmax(quotient))
    return Verdict(a.shape[1], int((quotient > 1 + SLACK).sum()), float(quotient[k]), tuple(a[:, k].tolist()))


def _gradient(field: Field, a: np.ndarray, fa: np.ndarray, h: float) -> np.ndarray:
    """Unit vectors along one-sided differences; any direction where they vanish."""
    return _unit(np.stack([field(*(a + h * e[:, None])) - fa for e in np.eye(3)]))


def _unit(v: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(v, axis=0)
    return np.where(length > 0, v / np.where(length > 0, length, 1.0), np.array([[1.0], [0.0], [0.0]]))
