"""Samples of orbits on NumPy arrays: growth of steps far out, and radii of escape."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from itertools import product
from typing import Any

import numpy as np

from .orbits import Round, written

DIRECTIONS, RADII, FARTHEST = 64, np.geomspace(1e-2, 1e4, 56).round(4), 1e6
"""Samples of the search for the radius of escape."""

POWER, FLAT = 1.2, 0.2
"""Least growth that counts as a power; largest logarithm of a factor that counts as 1, for it changes the
potential of an escaped orbit by a thirtieth.
"""

Image = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Image of points [3, n] with constants [3, n]."""


def step_power(step: Image, rays: np.ndarray, origin: np.ndarray) -> tuple[float, float]:
    """Return the power by which a step grows far out, and the logarithm of its factor."""
    near, far = (np.log(np.maximum(norm(step(rays * r, origin)), 1e-300)) for r in (1e4, 1e5))
    rate = round(float(np.median(far - near)) / math.log(10), 3)
    rate = rate if rate > POWER else 1.0
    factor = float(np.median(near)) - rate * math.log(1e4)
    return rate, factor if abs(factor) > FLAT else 0.0


def sampled_escape(whole: Image, points: np.ndarray, size: float) -> float:
    """Return a radius beyond which a round leads farther out, for constants of a given size.

    Constants against the image, against the point and along it are tried.
    """
    grows, radii = np.ones(points.shape[1], bool), norm(points)
    for against in (whole(points, np.zeros(3)), points, -points) if size else (points,):
        constant = against * (-size / np.maximum(norm(against), 1e-300))
        grows &= norm(whole(points, constant)) > 1.02 * radii
    stays = np.flatnonzero(~grows.reshape(-1, len(RADII)).all(axis=0))
    return float(RADII[min(stays.max(initial=0) + 1, len(RADII) - 1)])


def sampled_radius(whole: Image, points: np.ndarray, rounds: int, radius: float) -> float:
    """Return a radius that encloses the points whose orbit is within a radius after some rounds."""
    w = start = points
    for _ in range(rounds):
        w = whole(w, start)
        kept = norm(w) < max(radius, FARTHEST)
        w, start = w[:, kept], start[:, kept]
    inside = norm(start[:, norm(w) <= radius])
    return float(inside.max(initial=RADII[0]) * (RADII[1] / RADII[0]) * 1.02)


def directions() -> np.ndarray:
    """Return unit vectors [3, n]: to the corners, edges and faces of a cube, and at random."""
    lattice = np.array([v for v in product((-1, 0, 1), repeat=3) if any(v)], float).T
    rays = np.hstack([lattice, np.random.default_rng(0).normal(size=(3, DIRECTIONS))])
    unit: np.ndarray = rays / np.linalg.norm(rays, axis=0)
    return unit


def norm(w: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors [3, n], of any size."""
    length: np.ndarray = np.hypot(np.hypot(w[0], w[1]), w[2])
    return length


def image(steps: Round, place: int, values: Mapping[str, Any]) -> Image:
    """Return a step on arrays.

    Parameters
    ----------
    steps
        Steps of a round.
    place
        Place of the step in the round.
    values
        Values of the arguments of the steps.

    Returns
    -------
    callable
        Function of points [3, n] and constants, [3, n] or [3], that returns their images [3, n].
    """
    code = steps[place]
    names = code.arguments(place)
    body = [*code.before(place, ("px", "py", "pz")), *code.image(place)]
    function = written(steps, ["x", "y", "z", "px", "py", "pz", *names], [*body, "return x, y, z"])
    given = [values[name] for name in names]

    def taken(w: np.ndarray, c: np.ndarray) -> np.ndarray:
        constant = c if c.ndim == 2 else c[:, None]
        with np.errstate(all="ignore"):
            values = np.array(np.broadcast_arrays(*function(*w, *constant, *given), w[0])[:3])
        finite: np.ndarray = np.nan_to_num(values, nan=1e300, posinf=1e300, neginf=-1e300)
        return finite.clip(-1e170, 1e170)

    return taken


def composed(images: Sequence[Image]) -> Image:
    """Return steps one after the other."""
    return lambda w, c: reduce(lambda v, step: step(v, c), images, w)
