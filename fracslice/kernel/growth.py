"""Growth of orbits by sampling: power, radius of escape and box of the solid."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from itertools import product
from typing import Any

import numpy as np

from ..formulas.box import Box
from ..formulas.escape import CORE
from . import functions
from .cells import possible_cells
from .orbits import Round, field, written

DIRECTIONS, RADII, FARTHEST = 64, np.geomspace(1e-2, 1e4, 56).round(4), 1e6
"""Samples of the search for the radius of escape."""

LIPSCHITZ, CELLS = 3.0, 1 << 15
"""Lipschitz bound of the fields of hybrids, and the most cells of the search for the box."""

ROUNDS = 60
"""Rounds after which an orbit counts as bounded."""

FEW = 8
"""Rounds of a solid that has no thin tips."""

STOP = {False: 4.0, True: 300.0}
"""An orbit stops at this times R, or at the root of this if its next step grows by a power: there the value
depends little on the number of steps.
"""

POWER, LARGEST, FLAT = 1.2, 27.0, 0.2
"""Least growth that counts as a power; largest log |w| one step past the radius where an orbit stops; largest
logarithm of a factor that counts as 1, for it changes the potential of an escaped orbit by a thirtieth.
"""

Image = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Image of points [3, n] with constants [3, n]."""


@dataclass(frozen=True)
class Growth:
    """Growth of an orbit for given parameters.

    The solid is by definition what has not left for good after its rounds, so an error of the radius moves no
    surface by more than one step.

    Attributes
    ----------
    powers
        Of each step: |w| grows as this power far out, at least 1.
    factors
        Of each step: logarithm of the factor of this power.
    escapes
        Of each step: radius after it beyond which |w| grows with every round.
    half
        Half sizes of a box around the solid.
    """

    powers: tuple[float, ...]
    factors: tuple[float, ...]
    escapes: tuple[float, ...]
    half: tuple[float, float, float]

    @property
    def power(self) -> float:
        """Power by which a round grows."""
        return math.prod(self.powers)

    @property
    def by_power(self) -> bool:
        """True if rounds grow by a power greater than 1."""
        return self.power > POWER

    @property
    def escape(self) -> float:
        """Radius of escape at the end of a round."""
        return self.escapes[-1]

    @property
    def following(self) -> tuple[float, ...]:
        """Power of the step after each step."""
        return (*self.powers[1:], self.powers[0])

    @property
    def scales(self) -> tuple[float, ...]:
        """Factors s after each step for which ``log (s |w|)`` grows by the powers alone, far out."""
        power, last = 1.0, 0.0
        for p, factor in zip(reversed(self.powers), reversed(self.factors), strict=True):
            last += power * factor
            power *= p
        shift, scales = last / (power - 1), []
        for p, factor in zip(self.powers, self.factors, strict=True):
            shift = p * shift - factor
            scales.append(math.exp(shift))
        return tuple(scales)

    @property
    def scaled(self) -> bool:
        """True if factors are not 1."""
        return self.by_power and any(self.factors)

    @property
    def fits(self) -> bool:
        """True if every step can be computed from the radius where an orbit stops."""
        after = (*self.factors[1:], self.factors[0])
        return all(
            f + p * math.log(e) < LARGEST for e, p, f in zip(self.escapes, self.following, after, strict=True)
        )


@lru_cache(maxsize=256)
def growth(steps: Round, values: tuple[tuple[str, Any], ...], iterations: int) -> Growth | None:
    """Sample the growth of an orbit.

    Parameters
    ----------
    steps
        Steps of a round.
    values
        Values of the arguments of the steps.
    iterations
        Number of rounds of the solid.

    Returns
    -------
    Growth or None
        Powers, radii of escape and box of the solid; None if orbits do not escape.
    """
    known = dict(values)
    images = [image(steps, place, known) for place in range(len(steps))]
    whole = _composed(images)
    rays, origin = _rays(), np.zeros(3)
    if not _norm(whole(rays * 1e4, origin)).min() > 1.02e4:
        return None
    rates = [_power(step, rays, origin) for step in images]
    points = (rays[:, :, None] * RADII).reshape(3, -1)
    fixed = all(code.julia for code in steps)
    radius = bounded = _radius(whole, points, ROUNDS, FARTHEST)
    for _ in range(2):  # thin tips of the solid fall between samples; that of a few rounds has thicker ones
        radius = max(_escape(whole, points, 0.0 if fixed else bounded), 0.0 if fixed else bounded)
        bounded = max(bounded, _radius(whole, points, FEW, radius))
    size = 0.0 if fixed else bounded
    escapes = [_escape(_composed([*images[k:], *images[:k]]), points, size) for k in range(1, len(steps))]
    sampled = 1.5 * _radius(whole, points, iterations, radius)
    powers, factors = zip(*rates, strict=True)
    bound = Growth(powers, factors, (*escapes, radius), (sampled, sampled, sampled))
    return replace(bound, half=_half(steps, bound, known, iterations)) if bound.fits else bound


def _half(
    steps: Round, bound: Growth, values: Mapping[str, Any], iterations: int
) -> tuple[float, float, float]:
    """Half sizes of a box around the cells that the field does not prove to be empty; the search begins with
    one half more than the samples reach.
    """
    function = field(steps, bound.by_power, bound.scaled)
    own = {**arguments(steps, bound, iterations), **values}
    given = [own[name] for name in functions.parameters(function)[3:]]

    def evaluate(points: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.asarray(function(*points, *given))

    centres, _, size = possible_cells(evaluate, LIPSCHITZ, Box.centred(*bound.half), CELLS)
    x, y, z = (np.ceil((abs(centres).max(axis=1, initial=0) + size / 2) * 256) / 256).tolist()
    return x, y, z


def _power(step: Image, rays: np.ndarray, origin: np.ndarray) -> tuple[float, float]:
    """Power by which a step grows far out, and the logarithm of its factor."""
    near, far = (np.log(np.maximum(_norm(step(rays * r, origin)), 1e-300)) for r in (1e4, 1e5))
    rate = round(float(np.median(far - near)) / math.log(10), 3)
    rate = rate if rate > POWER else 1.0
    factor = float(np.median(near)) - rate * math.log(1e4)
    return rate, factor if abs(factor) > FLAT else 0.0


def _escape(whole: Image, points: np.ndarray, size: float) -> float:
    """Radius beyond which a round leads farther out, for constants of a given size that point against the
    image, against the point or along it.
    """
    grows, radii = np.ones(points.shape[1], bool), _norm(points)
    for against in (whole(points, np.zeros(3)), points, -points) if size else (points,):
        constant = against * (-size / np.maximum(_norm(against), 1e-300))
        grows &= _norm(whole(points, constant)) > 1.02 * radii
    stays = np.flatnonzero(~grows.reshape(-1, len(RADII)).all(axis=0))
    return float(RADII[min(stays.max(initial=0) + 1, len(RADII) - 1)])


def _radius(whole: Image, points: np.ndarray, rounds: int, radius: float) -> float:
    """Radius that encloses the points whose orbit is within a radius after some rounds."""
    w = start = points
    for _ in range(rounds):
        w = whole(w, start)
        kept = _norm(w) < max(radius, FARTHEST)
        w, start = w[:, kept], start[:, kept]
    inside = _norm(start[:, _norm(w) <= radius])
    return float(inside.max(initial=RADII[0]) * (RADII[1] / RADII[0]) * 1.02)


def _rays() -> np.ndarray:
    """Unit vectors [3, n]: to the corners, edges and faces of a cube, and at random."""
    lattice = np.array([v for v in product((-1, 0, 1), repeat=3) if any(v)], float).T
    rays = np.hstack([lattice, np.random.default_rng(0).normal(size=(3, DIRECTIONS))])
    unit: np.ndarray = rays / np.linalg.norm(rays, axis=0)
    return unit


def _norm(w: np.ndarray) -> np.ndarray:
    """Lengths of vectors [3, n], of any size."""
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
    lines, assigned = code.image(place)
    body = [*code.before(place, ("px", "py", "pz")), *lines, *assigned]
    function = written(steps, ["x", "y", "z", "px", "py", "pz", *names], [*body, "return x, y, z"])
    given = [values[name] for name in names]

    def taken(w: np.ndarray, c: np.ndarray) -> np.ndarray:
        constant = c if c.ndim == 2 else c[:, None]
        with np.errstate(all="ignore"):
            values = np.array(np.broadcast_arrays(*function(*w, *constant, *given), w[0])[:3])
        finite: np.ndarray = np.nan_to_num(values, nan=1e300, posinf=1e300, neginf=-1e300)
        return finite.clip(-1e170, 1e170)

    return taken


def _composed(images: Sequence[Image]) -> Image:
    """Steps one after the other."""
    return lambda w, c: reduce(lambda v, step: step(v, c), images, w)


def arguments(steps: Round, bound: Growth, iterations: int) -> dict[str, object]:
    """Return the arguments of an orbit's field, besides those of its steps.

    Parameters
    ----------
    steps
        Steps of a round.
    bound
        Growth of the orbit.
    iterations
        Number of rounds.

    Returns
    -------
    dict
        Values by name.
    """
    own: dict[str, object] = {"iterations": iterations}
    if not bound.by_power:
        stops = {f"stop{k}": (STOP[False] * max(e, bound.escape)) ** 2 for k, e in enumerate(bound.escapes)}
        return {**own, **stops, "bailout": bound.escape}
    counted = min(iterations, int(30 / math.log10(bound.power)))
    scales = bound.scales if bound.scaled else (1.0,) * len(steps)
    radius = max(bound.escape * scales[-1], 1.1)
    last = 2 * math.log(radius)
    least = radius**2 * math.exp(-max(0.2 / radius, 1e-4))
    own["levels"] = (last / bound.power**counted, last, least)
    escapes = (*bound.escapes[:-1], radius / scales[-1])
    for k, (escape, following, scale) in enumerate(zip(escapes, bound.following, scales, strict=True)):
        own[f"stop{k}"] = max(escape, STOP[True] ** (1 / following) / scale) ** 2
        own[f"rate{k}"] = power = bound.powers[k]
        if bound.scaled:
            own[f"scale{k}"] = scale
        if steps[k].julia:
            own[f"least{k}"] = power * CORE ** ((power - 1) / 2) if power > POWER else 0.0
    return own
