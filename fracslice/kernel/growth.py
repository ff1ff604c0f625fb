"""Growth of orbits: power, radius of escape and box of the solid, from samples and by proofs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ..formulas.box import Box
from ..formulas.escape import CORE, levels
from . import functions, majorants
from .cells import possible_cells
from .escape_radius import constant_stretch, escape_radius, least_size
from .orbit_samples import (
    FARTHEST,
    POWER,
    RADII,
    composed,
    directions,
    image,
    norm,
    sampled_escape,
    sampled_radius,
    step_power,
    widened_escapes,
)
from .orbits import Form, Round, field

LIPSCHITZ, CELLS = 3.0, 1 << 15
"""Lipschitz bound of the fields of hybrids, and the most cells of the search for the box."""

ROUNDS = 60
"""Rounds after which an orbit counts as bounded."""

FEW, THICK = 8, 3
"""Rounds of a solid that has no thin tips, and of one that is no dust: it holds those of more rounds."""

STOP, STOPPED = 4.0, 300.0
"""An orbit stops at this times R; if its next step grows by a power, where that step leads to a radius."""

LEAST, LARGEST = 1.1, 27.0
"""Least scaled radius of escape of an orbit that grows by a power; largest log |w| one step past the radius
where it stops.
"""

TRIES, LARGER = 3, 1.65
"""Radii that are tried to be proved, each that of the search before; most that the first is enlarged by."""


@dataclass(frozen=True)
class Growth:
    """Growth of an orbit for given parameters.

    The solid is by definition what has not left for good after its rounds, so a radius that is too large
    moves no surface by more than one step. One that is too small makes another solid of each number of
    rounds, for orbits come back.

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
    proved
        True if it is proved that no orbit comes back from beyond the radii (`escape_radius`).
    stretch
        Stretch of a round if it is the same at all points, else None.
    least
        Least scaled radius of the surface of an orbit that grows by a power.
    stopped
        |w| one step past the radius where an orbit that grows by a power stops: there the value depends
        little on the number of steps.
    connected
        True if no critical point is outside, False if one is, None if that is not known.
    reach
        Radius of a ball around the solids of all numbers of rounds.
    torn
        False if no orbit comes to the tears of the steps.
    """

    powers: tuple[float, ...]
    factors: tuple[float, ...]
    escapes: tuple[float, ...]
    half: tuple[float, float, float] = (math.inf,) * 3
    proved: bool = False
    stretch: float | None = None
    least: float = LEAST
    stopped: float = STOPPED
    connected: bool | None = None
    reach: float = math.inf
    torn: bool = True

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
    def surface(self) -> float:
        """The last |w| on the surface: the radius of escape, or more, for the potential of 1 is 0."""
        scale = self.scales[-1] if self.scaled else 1.0
        return max(self.escape, self.least / scale) if self.by_power else self.escape

    @property
    def lipschitz(self) -> float | None:
        """Proved Lipschitz bound outside of the solid, or None.

        With a constant stretch s, ``|w(p)| - |w(q)| <= s |p - q|`` for all points. An orbit that stops after
        a step, at `STOP` times the larger of its radius and R, must be out of its radius for all q as near
        as ``(|w(p)| - R) / (L s)``; L is 1 if no radius within a round exceeds R.
        """
        if not self.proved or self.stretch is None or self.by_power:
            return None
        largest = STOP * max(self.escapes) / self.escape
        return (largest - 1) / (largest * (1 - 1 / STOP))

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

    def form(self, steps: Round, conservative: bool) -> Form:
        """Form of the field; a conservative one stays below twice the distance to tears.

        That of a hybrid stays below twice the sure distance, too, for critical points may be outside. Without
        majorants, neither is known: outside of a hybrid with tears it is then 0.
        """
        made = [code.traced(place) for place, code in enumerate(steps)]
        bent = majorants.known(made)
        torn = self.torn and conservative and bent and majorants.torn(made)
        hybrid = len(steps) > 1 or steps[0].moved
        blind = conservative and hybrid and not bent and any(step.is_torn for step in made)
        sure = self.by_power and (self.connected is False or (hybrid and bent and conservative))
        return Form(self.by_power, self.scaled, not self.connected, sure, torn, blind)

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
        None if orbits do not escape.
    """
    known = dict(values)
    images = [image(steps, place, known) for place in range(len(steps))]
    whole = composed(images)
    rays, origin = directions(), np.zeros(3)
    if not norm(whole(rays * 1e4, origin)).min() > 1.02e4:
        return None
    rates = [step_power(step, rays, origin) for step in images]
    points = (rays[:, :, None] * RADII).reshape(3, -1)
    fixed = all(code.is_fixed(k) for k, code in enumerate(steps))
    radius = bounded = sampled_radius(whole, points, ROUNDS, FARTHEST)
    for _ in range(2):  # thin tips of the solid fall between samples; that of a few rounds has thicker ones
        radius = max(sampled_escape(whole, points, 0.0 if fixed else bounded), 0.0 if fixed else bounded)
        bounded = max(bounded, sampled_radius(whole, points, FEW, radius))
    size = 0.0 if fixed else bounded
    escapes = [
        sampled_escape(composed([*images[k:], *images[:k]]), points, size) for k in range(1, len(steps))
    ]
    powers, factors = zip(*rates, strict=True)
    bound = Growth(powers, factors, (*escapes, radius), stretch=constant_stretch(steps, 0, known))
    bound = _proved(steps, bound, known, size)
    if not bound.proved:
        bound = replace(bound, escapes=widened_escapes(images, bound.escapes, size))
        bound = _proved(steps, bound, known, size)
    reach, thick = (
        sampled_radius(whole, points, n, bound.escape) for n in (iterations, min(iterations, THICK))
    )
    reach = max(1.5 * reach, thick, 1.02 * bound.surface if bound.by_power else 0.0)
    bound = replace(bound, half=(reach, reach, reach))
    return replace(bound, half=_half(steps, bound, known, iterations)) if bound.fits else bound


def _proved(steps: Round, bound: Growth, values: Mapping[str, Any], size: float) -> Growth:
    """Growth with radii of escape that are proved; the same if they cannot be."""
    tried, constants = bound, None if size and bound.by_power else size
    for _ in range(TRIES if bound.fits else 0):
        own = {**values, **arguments(steps, tried, 1)}
        radii = [
            escape_radius(
                least_size(steps, first, own, constants),
                tried.escapes[first - 1],
                math.sqrt(own[f"stop{(first - 1) % len(steps)}"]),
                None if constants is None and first == 0 else tried.surface,
            )
            for first in range(len(steps))
        ]
        if (*radii[1:], radii[0]) == tried.escapes:
            return replace(tried, proved=True)
        tried = replace(tried, escapes=(*radii[1:], radii[0]))
        if any(new > LARGER * old for new, old in zip(tried.escapes, bound.escapes, strict=True)):
            break
    return bound


def _half(
    steps: Round, bound: Growth, values: Mapping[str, Any], iterations: int
) -> tuple[float, float, float]:
    """Half sizes of a box around the cells that the field does not prove to be empty; the search begins with
    one half more than the samples reach.
    """
    function = field(steps, Form(bound.by_power, bound.scaled))
    own = {**arguments(steps, bound, iterations), **values}
    given = [own[name] for name in functions.parameters(function)[3:]]

    def evaluate(points: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.asarray(function(*points, *given))

    centres, _, size = possible_cells(evaluate, LIPSCHITZ, Box.centred(*bound.half), CELLS)
    x, y, z = (np.ceil((abs(centres).max(axis=1, initial=0) + size / 2) * 256) / 256).tolist()
    return x, y, z


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
        stops = {f"stop{k}": (STOP * max(e, bound.escape)) ** 2 for k, e in enumerate(bound.escapes)}
        return {**own, **stops, "bailout": bound.escape}
    scales = bound.scales if bound.scaled else (1.0,) * len(steps)
    radius = bound.surface * scales[-1]
    own["levels"] = levels(bound.power, iterations, radius)
    own["reach"] = min(bound.reach, bound.surface)
    escapes = (*bound.escapes[:-1], bound.surface)
    for k, (escape, following, scale) in enumerate(zip(escapes, bound.following, scales, strict=True)):
        own[f"stop{k}"] = max(escape, bound.stopped ** (1 / following) / scale) ** 2
        own[f"surface{k}"] = escape
        own[f"rate{k}"] = power = bound.powers[k]
        if bound.scaled:
            own[f"scale{k}"] = scale
        if not bound.connected and steps[k].is_fixed(k):
            own[f"least{k}"] = power * CORE ** ((power - 1) / 2) if power > POWER else 0.0
    return own
