"""Growth of orbits: power, radius of escape, box of the solid and the sign of an orbit's field, from
samples and by proofs.

An orbit stops beyond a larger radius, so the shell between the two is all that has to be searched. In it, |w|
grows with every round: for all constants up to |w| if rounds grow by a power, as the Mandelbrot set's do for
|w| > 2, else for those up to the size of the solid. No orbit of such a constant comes back from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, reduce
from itertools import accumulate, islice, product
from operator import mul
from typing import Any, cast

import numpy as np

from ..expr.intervals import ARRAYS, Interval, evaluate_on_cells
from ..expr.runtime import kept_text
from .box import Box, Corners, possible_cells, proved_half, undecided_cells
from .maps import CORE, levels
from .orbit_code import Form, Given, Round, constant_of, field, sign, size, stage_image, stages

MOST, LEVELS, MARGIN = 1 << 15, 12, 1e-9
"""Cells of a level, beyond which the radius is enlarged; levels of cells; least relative growth, more than
the errors of coefficients.
"""

BESIDE = 4e-290
"""End of an interval in place of 0. The steps of a cell that ends at a plane are those of its side of the
plane; on the plane itself they are limits of these.
"""

UNIT = Interval(np.full(1, -1.0), np.full(1, 1.0), ARRAYS)


def escape_radius(
    least: Callable[[Corners, Corners, np.ndarray], np.ndarray],
    radius: float,
    outer: float,
    end: float | None,
    most: float = math.inf,
) -> float:
    """Enlarge a radius until no orbit comes back from beyond it, or it is larger than `most`.

    `outer`: radius where orbits stop.
    """

    given = radius

    def wanted(lo: Corners, hi: Corners) -> np.ndarray:
        nonlocal radius
        far = np.where(_nearest(lo, hi) < outer, _farthest(lo, hi), 0.0)
        if (far > radius).sum() > MOST:
            radius = float(np.partition(far, -MOST)[-MOST])
        beyond: np.ndarray = far > (radius if radius <= most else math.inf)
        return beyond

    def proved(lo: Corners, hi: Corners) -> np.ndarray:
        far = _farthest(lo, hi)
        grown: np.ndarray = least(lo, hi, far) > (far if end is None else end) * (1 + MARGIN)
        return grown

    left = float(_farthest(*undecided_cells(wanted, proved, outer, MOST, LEVELS)).max(initial=0.0))
    return given if max(radius, left) == given else 1.02 * max(radius, left)


def least_size(
    steps: Round, first: int, given: Sequence[Given], stops: Sequence[float], constants: float | None
) -> Callable[[Corners, Corners, np.ndarray], np.ndarray]:
    """Return a function of cells, and the size of their farthest points, that bounds the last |w| from below.

    `stops`: squares of the radii where orbits stop; `constants`: size of the constants, or None for that of
    the points. The bound is huge where all orbits stop.
    """
    function = size(steps, first)

    def least(lo: Corners, hi: Corners, far: np.ndarray) -> np.ndarray:
        sizes = Interval.at(far if constants is None else np.full_like(far, constants), ARRAYS)
        box = (
            Interval(np.where(a == 0, BESIDE, a), np.where(b == 0, -BESIDE, b), ARRAYS)
            for a, b in zip(lo, hi, strict=True)
        )
        middle = (Interval.at(m, ARRAYS).outward() for m in (lo + hi) / 2)
        reach = Interval.at(np.sqrt(((hi - lo) ** 2).sum(0)) / 2, ARRAYS).outward(4)
        with np.errstate(all="ignore"):
            bound = evaluate_on_cells(function, *box, *middle, reach, sizes, UNIT, given, stops)
        return np.broadcast_to(bound.lo, far.shape)

    return least


def constant_stretch(steps: Round, given: Sequence[Given]) -> float | None:
    """Return a bound of the stretch of steps whose stretch is the same at all points."""
    product, origin = 1.0, (0.0, 0.0, 0.0)
    for stage, own in zip(stages(steps), given, strict=True):
        if not stage.step.is_steady or not stage.is_fixed:
            return None
        constant = constant_of(origin, own, stage)
        with np.errstate(all="ignore"):
            ready = stage.step.prepared(constant, own[0])
            _, by_w, _ = stage.step.taken(origin, constant, own[0], ready)
        product *= (own[2][2] if stage.moved else 1.0) * float(by_w)
    return product * (1 + MARGIN)


def _farthest(lo: Corners, hi: Corners) -> np.ndarray:
    """Distances of the farthest points of cells from the origin."""
    size: np.ndarray = np.sqrt((np.maximum(-lo, hi) ** 2).sum(0))
    return size


def _nearest(lo: Corners, hi: Corners) -> np.ndarray:
    """Distances of the nearest points of cells from the origin."""
    size: np.ndarray = np.sqrt((np.maximum(np.maximum(lo, -hi), 0) ** 2).sum(0))
    return size


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
    """Return radii of escape, enlarged until no orbit of dense random samples comes back from beyond
    them.
    """
    rng, radii, last = np.random.default_rng(0), list(escapes), len(images) - 1
    for octaves in OCTAVES:
        for place in range(len(images)):
            rest = compose_steps(images[place + 1 :] or images)
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


def image(steps: Round, place: int, given: Sequence[Given]) -> Image:
    """Return a step on arrays.

    Returns function of points [3, n] and constants, [3, n] or [3], that returns their images [3, n].
    """
    stage, own = steps[place].stage, given[place]

    def taken(w: np.ndarray, c: np.ndarray) -> np.ndarray:
        start = tuple(c if c.ndim == 2 else c[:, None])
        with np.errstate(all="ignore"):
            constant = constant_of(start, own, stage)
            ready = stage.step.prepared(constant, own[0])
            moved = stage_image(tuple(w), constant, own, ready, stage)
            values = np.array(np.broadcast_arrays(*moved, w[0])[:3])
        finite: np.ndarray = np.nan_to_num(values, nan=1e300, posinf=1e300, neginf=-1e300)
        return finite.clip(-1e170, 1e170)

    return taken


def stays(steps: Round, given: Sequence[Given], rounds: int, radius: float, outer: float) -> bool:
    """Return True if the orbit that starts at the origin is within a radius after some rounds."""
    step, start = compose_steps([image(steps, k, given) for k in range(len(steps))]), np.zeros((3, 1))
    w = start
    for _ in range(rounds):
        w = step(w, start)
        if float(norm(w)[0]) >= outer:
            return False
    return float(norm(w)[0]) <= radius


def compose_steps(images: Sequence[Image]) -> Image:
    """Return steps one after the other."""
    return lambda w, c: reduce(lambda v, step: step(v, c), images, w)


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
    """

    powers: tuple[float, ...]  # of each step: |w| grows as this power far out, at least 1
    factors: tuple[float, ...]  # of each step: logarithm of the factor of this power
    escapes: tuple[float, ...]  # of each step: radius after it beyond which |w| grows with every round
    half: tuple[float, float, float] = (math.inf,) * 3  # half sizes of a box around the solid
    # true if it is proved that no orbit comes back from beyond the radii (`escape_radius`)
    proved: bool = False
    stretch: float | None = None  # stretch of a round if it is the same at all points, else None
    least: float = LEAST  # least scaled radius of the surface of an orbit that grows by a power
    # |w| one step past the radius where an orbit that grows by a power stops: there the value depends little
    # on the number of steps
    stopped: float = STOPPED
    # true if no critical point is outside, False if one is, None if that is not known
    connected: bool | None = None
    reach: float = math.inf  # radius of a ball around the solids of all numbers of rounds
    torn: bool = True  # false if no orbit comes to the tears of the steps

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
        made = [stage.step for stage in stages(steps)]
        bent = all(step.majorant is not None for step in made)
        torn = self.torn and conservative and bent and any(step.has_tear for step in made)
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


SEARCHES = "growth"
"""Kind of the texts of cached searches."""


@lru_cache(maxsize=256)
def growth(steps: Round, given: tuple[Given, ...], iterations: int) -> Growth | None:
    """Sample the growth of an orbit; that of several steps, which takes seconds to minutes, is cached.

    Returns None if orbits do not escape.
    """
    if len(steps) == 1:
        return _search(steps, given, iterations)
    codes = tuple((stage.step.text, stage.julia, stage.moved) for stage in stages(steps))
    made_of = np.__version__, repr(codes), repr(given), iterations
    return _read(kept_text(SEARCHES, made_of, lambda: _written(_search(steps, given, iterations))))


def _written(bound: Growth | None) -> str:
    """Text of a growth."""
    import json  # hybrids alone need it

    return json.dumps(bound and asdict(bound))


def _read(text: str) -> Growth | None:
    """Growth of a text."""
    import json

    values = json.loads(text)
    if values is None:
        return None
    known: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
    return Growth(**known)


def _search(steps: Round, given: tuple[Given, ...], iterations: int) -> Growth | None:
    """Growth of an orbit by samples, proved where it can be."""
    bound = escapes(steps, given)
    if bound is None:
        return None
    whole, points = compose_steps(images(steps, given)), ray_points()
    reach, thick = (
        sampled_radius(whole, points, n, bound.escape) for n in (iterations, min(iterations, THICK))
    )
    reach = max(1.5 * reach, thick, 1.02 * bound.surface if bound.by_power else 0.0)
    bound = replace(bound, half=(reach, reach, reach))
    return replace(bound, half=_half(steps, bound, given, iterations)) if bound.fits else bound


def images(steps: Round, given: Sequence[Given]) -> list[Image]:
    """Steps on arrays; see `image`."""
    return [image(steps, place, given) for place in range(len(steps))]


def ray_points() -> np.ndarray:
    """Points along rays, [3, n]."""
    return np.asarray((directions()[:, :, None] * RADII).reshape(3, -1))


@lru_cache(maxsize=64)
def escapes(steps: Round, given: tuple[Given, ...]) -> Growth | None:
    """Growth of all numbers of rounds, without a box; None if orbits do not escape."""
    own = images(steps, given)
    whole, points = compose_steps(own), ray_points()
    rays, origin = directions(), np.zeros(3)
    if not norm(whole(rays * 1e4, origin)).min() > 1.02e4:
        return None
    rates = [step_power(step, rays, origin) for step in own]
    fixed = all(stage.is_fixed for stage in stages(steps))
    radius = bounded = sampled_radius(whole, points, ROUNDS, FARTHEST)
    for _ in range(2):  # thin tips of the solid fall between samples; that of a few rounds has thicker ones
        radius = max(sampled_escape(whole, points, 0.0 if fixed else bounded), 0.0 if fixed else bounded)
        bounded = max(bounded, sampled_radius(whole, points, FEW, radius))
    size = 0.0 if fixed else bounded
    radii = [sampled_escape(compose_steps([*own[k:], *own[:k]]), points, size) for k in range(1, len(steps))]
    powers, factors = zip(*rates, strict=True)
    bound = Growth(powers, factors, (*radii, radius), stretch=constant_stretch(steps, given))
    bound = _prove_growth(steps, bound, given, size)
    if not bound.proved and (wider := widened_escapes(own, bound.escapes, size)) != bound.escapes:
        bound = _prove_growth(steps, replace(bound, escapes=wider), given, size)
    return bound


def _prove_growth(steps: Round, bound: Growth, given: Sequence[Given], size: float) -> Growth:
    """Growth with radii of escape that are proved; the same if they cannot be."""
    tried, constants = bound, None if size and bound.by_power else size
    for left in reversed(range(TRIES if bound.fits else 0)):
        stops = [own[0] for own in numbers(tried)]
        radii: list[float] = []
        for first in range(len(steps)):
            least = least_size(steps, first, given, stops, constants)
            outer = math.sqrt(stops[first - 1])
            end = None if constants is None and first == 0 else tried.surface
            most = LARGER * bound.escapes[first - 1] if left else tried.escapes[first - 1]
            radii.append(escape_radius(least, tried.escapes[first - 1], outer, end, most))
            if radii[-1] > most:
                return bound
        if (*radii[1:], radii[0]) == tried.escapes:
            return replace(tried, proved=True)
        tried = replace(tried, escapes=(*radii[1:], radii[0]))
    return bound


def _half(steps: Round, bound: Growth, given: Sequence[Given], iterations: int) -> tuple[float, float, float]:
    """Half sizes of a box around the cells that the field does not prove to be empty; the search begins with
    one half more than the samples reach.
    """
    function = field(steps, Form(bound.by_power, bound.scaled))
    own = arguments(bound, given, iterations).values()

    def evaluate(points: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.asarray(function(*points, *own))

    centres, _, size = possible_cells(evaluate, LIPSCHITZ, Box.centred(*bound.half), CELLS)
    x, y, z = (np.ceil((abs(centres).max(axis=1, initial=0) + size / 2) * 256) / 256).tolist()
    return x, y, z


def arguments(bound: Growth, given: Sequence[Given], iterations: int) -> dict[str, object]:
    """Return the arguments of an orbit's field, in their order; see `orbit_code.field`."""
    limits: tuple[float, ...] = (bound.escape,)
    if bound.by_power:
        scale = bound.scales[-1] if bound.scaled else 1.0
        limits = *levels(bound.power, iterations, bound.surface * scale), min(bound.reach, bound.surface)
    own = {"iterations": iterations, "limits": limits, "given": tuple(given)}
    return {**own, "numbers": numbers(bound)}


def numbers(bound: Growth) -> tuple[tuple[float, ...], ...]:
    """Return the numbers of each step that its field takes; see `orbit_code.field`."""
    if not bound.by_power:
        return tuple(((STOP * max(e, bound.escape)) ** 2, 1.0, 1.0, 0.0, e) for e in bound.escapes)
    scales = bound.scales if bound.scaled else (1.0,) * len(bound.powers)
    rows = zip((*bound.escapes[:-1], bound.surface), bound.following, scales, bound.powers, strict=True)
    return tuple(
        (
            max(escape, bound.stopped ** (1 / following) / scale) ** 2,
            scale,
            power,
            power * CORE ** ((power - 1) / 2) if power > POWER else 0.0,
            escape,
        )
        for escape, following, scale, power in rows
    )


def sign_arguments(grown: Growth, given: Sequence[Given], iterations: int) -> dict[str, object] | None:
    """Return the arguments of `orbit_code.orbit_sign`; None where the sign is not that of the field."""
    stops = tuple(own[0] for own in numbers(grown))
    scales = grown.scales if grown.scaled else (1.0,) * len(grown.powers)
    outside = _outside(grown, iterations)
    sizes = (scale**2 * stop for scale, stop in zip(scales, stops, strict=True))
    if any(size < least for size, least in zip(sizes, outside, strict=True)):
        return None
    limits = scales[-1], (grown.surface * scales[-1]) ** 2
    return {"iterations": iterations, "limits": limits, "given": tuple(given), "stops": stops}


def _outside(grown: Growth, iterations: int) -> list[float]:
    """Return the square of the scaled |w| after each step of the last round beyond which the field is
    positive: ``log |w|^2`` is compared with the level, which grows by the power of each step.
    """
    radius = grown.surface * (grown.scales[-1] if grown.scaled else 1.0)
    if not grown.by_power:
        return [radius**2] * len(grown.powers)
    first, last, _ = levels(grown.power, iterations, radius)
    rounds = min(iterations - 1, int(30 / math.log10(grown.power)))
    reached = accumulate(grown.powers, mul, initial=first * grown.power**rounds)
    return [math.exp(min(level, last)) for level in islice(reached, 1, None)]


@lru_cache(maxsize=64)
def proved_box(steps: Round, given: tuple[Given, ...], grown: Growth, iterations: int) -> Box:
    """Return a box that is proved to hold the inside of an orbit's field."""
    radius = math.sqrt(numbers(grown)[-1][0])
    if grown.proved and grown.by_power:  # for constants as long as the start point, too
        radius = min(radius, grown.surface)
    own = sign_arguments(grown, given, iterations)
    if own is None:
        return Box.centred(radius)
    function, known = sign(steps, grown.scaled), tuple(own.values())

    def outside(*cells: Interval) -> Interval:
        with np.errstate(all="ignore"):
            return cast("Interval", evaluate_on_cells(function, *cells, *known))

    return Box.centred(*proved_half(outside, radius, grown.half))
