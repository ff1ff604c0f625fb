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

SAMPLES, OCTAVES = 1 << 13, (12.0, 1.0, 0.5, 0.5)
"""Samples of each search of `widened_escapes`, and the octaves beyond the radius that they lie in."""

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
        grows &= norm(whole(points, _against(against, size))) > 1.02 * radii
    stays = np.flatnonzero(~grows.reshape(-1, len(RADII)).all(axis=0))
    return float(RADII[min(stays.max(initial=0) + 1, len(RADII) - 1)])


def widened_escapes(images: Sequence[Image], escapes: Sequence[float], size: float) -> tuple[float, ...]:
    """Return radii of escape, enlarged until no orbit of dense random samples comes back from beyond them.

    Parameters
    ----------
    images
        Steps of a round.
    escapes
        Radius of escape after each step.
    size
        Size of the constants.

    Returns
    -------
    tuple of float
        Radius after each step; the given one where no orbit comes back.
    """
    rng, radii, last = np.random.default_rng(0), list(escapes), len(images) - 1
    for octaves in OCTAVES:
        for place in range(len(images)):
            rest = composed(images[place + 1 :] or images)
            w = _random(rng, radii[place] * 2.0 ** rng.uniform(0, octaves, SAMPLES))
            limit = norm(w) if place == last else radii[-1]
            back = np.zeros(SAMPLES, bool)
            for against in (0.0 * w, rest(w, np.zeros(3)), w, -w, _random(rng, norm(w))):
                back |= norm(rest(w, _against(against, size))) <= limit
            radii[place] = max(radii[place], 1.02 * float(norm(w[:, back]).max(initial=0.0)))
    return tuple(radii)


def _random(rng: np.random.Generator, radius: np.ndarray) -> np.ndarray:
    """Return points of given radii in random directions."""
    w = rng.normal(size=(3, SAMPLES))
    w *= radius / norm(w)
    return w


def _against(vectors: np.ndarray, size: float) -> np.ndarray:
    """Return constants against vectors: as long as they are, at most of a size."""
    length = norm(vectors)
    against: np.ndarray = vectors * (-np.minimum(size, length) / np.maximum(length, 1e-300))
    return against


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


def stays(steps: Round, values: Mapping[str, Any], rounds: int, radius: float, outer: float) -> bool:
    """Return True if the orbit that starts at the origin is within a radius after some rounds.

    Parameters
    ----------
    steps
        Steps of a round.
    values
        Values of the arguments of the steps.
    rounds
        Number of rounds.
    radius
        Radius.
    outer
        Radius from which no orbit comes back.
    """
    step, start = composed([image(steps, k, values) for k in range(len(steps))]), np.zeros((3, 1))
    w = start
    for _ in range(rounds):
        w = step(w, start)
        if float(norm(w)[0]) >= outer:
            return False
    return float(norm(w)[0]) <= radius


def composed(images: Sequence[Image]) -> Image:
    """Return steps one after the other."""
    return lambda w, c: reduce(lambda v, step: step(v, c), images, w)
