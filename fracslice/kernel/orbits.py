"""Fields of orbits, written from their steps.

The solid of N steps is ``{p : |w_N(p)| <= R}`` for the radius R beyond which no orbit comes back. The field
is ``(|w| - R) / |w'|`` where the orbit stops if steps grow linearly, and that of the potential
(`formulas.escape`) if they grow by a power. The derivative is bounded by the stretch of each step:
``dr -> s dr + t``, where t is the stretch by the constant.
"""

from __future__ import annotations

import linecache
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from ..formulas import vocabulary
from ..formulas.box import Box
from ..formulas.escape import CORE, potential_distance
from . import functions
from .cells import possible_cells
from .steps import Step, traced

DIRECTIONS, RADII, FARTHEST = 64, np.geomspace(1e-2, 1e4, 56).round(4), 1e6
"""Samples of the search for the radius of escape."""

LIPSCHITZ, CELLS = 2.0, 1 << 15
"""Lipschitz bound of the fields of orbits, and the most cells of the search for the box."""

STEPS = 60
"""Steps after which an orbit counts as bounded."""

FEW = 8
"""Steps of a solid that has no thin tips."""

STOP = {False: 4.0, True: 300.0}
"""An orbit stops at this times R, or at the root of this if steps grow by a power: there the value depends
little on the number of steps.
"""


@dataclass(frozen=True)
class Code:
    """A step with the parameters that its code depends on.

    Attributes
    ----------
    step
        Function ``f(w, c, ...)``.
    sizes
        Numbers of components of its other parameters.
    fixed
        Values of the parameters that the code depends on.
    """

    step: Callable[..., Any]
    sizes: tuple[tuple[str, int], ...]
    fixed: tuple[tuple[str, Any], ...] = ()

    def traced(self) -> Step:
        """Straight-line code of the step."""
        return _traced(self, functions.fingerprint(self.step))

    @property
    def arguments(self) -> str:
        """Parameters as arguments of a function."""
        return "".join(f", v_{name}" for name, _ in self.sizes)

    @property
    def unpacked(self) -> list[str]:
        """Lines that take vectors apart."""
        return [
            f"{', '.join(f'v_{name}_{k}' for k in range(size))} = v_{name}"
            for name, size in self.sizes
            if size > 1
        ]


@lru_cache(maxsize=256)
def _traced(code: Code, _: object) -> Step:
    return traced(code.step, dict(code.sizes), dict(code.fixed))


def field(code: Code, by_power: bool, julia: bool) -> Callable[..., Any]:
    """Write the function of an orbit's field.

    Parameters
    ----------
    code
        Step.
    by_power
        True if its steps grow by a power.
    julia
        True if the constant of the steps is the same at all points.

    Returns
    -------
    Callable
        Function in the language of formulas.

    Raises
    ------
    KernelError
        If the step is not in the language.
    """
    return _field(code, by_power, julia, functions.fingerprint(code.step))


@lru_cache(maxsize=256)
def _field(code: Code, by_power: bool, julia: bool, _: object) -> Callable[..., Any]:
    step = code.traced()
    by_w, by_c = step.stretch
    if julia and by_power:  # preimages of critical points outside the set, see `escape.CORE`
        by_w = f"maximum({by_w}, least_stretch)"
    grown = f"{by_w} * dr" if julia or by_c == "0.0" else f"{by_w} * dr + {by_c}"
    loop = [
        "if not any_of(alive):",
        "    break",
        *step.lines,
        f"dr = {grown}",
        f"x, y, z = {', '.join(step.point)}",
        "r2 = x * x + y * y + z * z",
        "orbit(r2, alive, x, y, z)",
        "end_r2 = where(alive, r2, end_r2)",
        "slope = where(alive, maximum(dr, slope), slope)",
        *(["reached = reached * growth", "level = where(alive, reached, level)"] if by_power else []),
        "alive = alive & (r2 < escape2)",
    ]
    levels = "growth, first_level, last_level, least_r2, least_stretch"
    body = [
        f"cx, cy, cz = {'julia' if julia else 'x, y, z'}",
        *code.unpacked,
        *(
            [f"{levels} = levels", "reached = first_level", "level = 0.0 * x + first_level"]
            if by_power
            else []
        ),
        "r2 = x * x + y * y + z * z",
        "end_r2 = r2",
        "dr = 0.0 * x + 1.0",
        "slope = dr",
        "alive = r2 < escape2",
        "for _ in range(iterations):",
        *(f"    {line}" for line in loop),
        "return potential_distance(end_r2, slope * slope, level, first_level, last_level, least_r2)"
        if by_power
        else "return (sqrt(minimum(end_r2, 1e30)) - bailout) / minimum(slope, 1e30)",
    ]
    own = ("levels" if by_power else "bailout") + (", julia" if julia else "")
    return _function(code, f"x, y, z, iterations, escape2, {own}", body)


def _function(code: Code, arguments: str, body: list[str]) -> Callable[..., Any]:
    """Function of written text, which tracebacks and the linker can read."""
    name = code.step.__name__.rstrip("_")
    text = "\n    ".join([f"def {name}({arguments}{code.arguments}):", *body]) + "\n"
    file = f"<orbit {name} {abs(hash((code, arguments))):x}>"
    scope: dict[str, Any] = {n: getattr(vocabulary, n) for n in (*vocabulary.NAMES, "orbit")}
    scope["potential_distance"] = potential_distance
    exec(compile(text, file, "exec"), scope)
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    function: Callable[..., Any] = scope[name]
    return function


@dataclass(frozen=True)
class Growth:
    """Growth of an orbit for given parameters, found by sampling.

    The solid is by definition what has not left for good after its steps, so an error of the radius moves no
    surface by more than one step.

    Attributes
    ----------
    power
        |w'| grows as this power of |w| far out, at least 1.
    escape
        Radius beyond which |w| grows with every step.
    half
        Half sizes of a box around the solid.
    """

    power: float
    escape: float
    half: tuple[float, float, float]

    @property
    def by_power(self) -> bool:
        """True if steps grow by a power greater than 1."""
        return self.power > 1.2


@lru_cache(maxsize=256)
def growth(
    code: Code, values: tuple[tuple[str, Any], ...], julia: tuple[float, ...] | None, iterations: int
) -> Growth | None:
    """Sample the growth of an orbit.

    Parameters
    ----------
    code
        Step.
    values
        Values of the other parameters.
    julia
        Constant of the steps; None if it is the start point.
    iterations
        Number of steps of the solid.

    Returns
    -------
    Growth or None
        Power, radius of escape and radius of the solid; None if orbits do not escape.
    """
    step = _numpy(code, dict(values))
    rays = _rays()
    points = (rays[:, :, None] * RADII).reshape(3, -1)
    origin = np.zeros(3) if julia is None else np.array(julia)
    ends = [np.linalg.norm(step(rays * r, origin), axis=0) for r in (1e4, 1e5)]
    if not ends[1].min() > 1.02e5:
        return None
    rate = round(float(np.median(np.log10(ends[1] / ends[0]))), 3)
    bounded = escape = _radius(step, points, julia, STEPS, FARTHEST)
    for _ in range(2):  # thin tips of the solid fall between samples; that of a few steps has thicker ones
        escape = max(_escape(step, points, origin, 0.0 if julia else bounded), 0.0 if julia else bounded)
        bounded = max(bounded, _radius(step, points, julia, FEW, escape))
    sampled = 1.5 * _radius(step, points, julia, iterations, escape)
    found = Growth(max(rate, 1.0), escape, (sampled, sampled, sampled))
    return replace(found, half=_half(code, found, values, iterations, julia))


def _half(code: Code, found: Growth, values: Any, iterations: int, julia: Any) -> tuple[float, float, float]:
    """Half sizes of a box around the cells that the field does not prove to be empty; the search begins with
    one half more than the samples reach.
    """
    function = field(code, found.by_power, julia is not None)
    own = arguments(found, iterations, julia) | {f"v_{name}": value for name, value in values}
    given = [own[name] for name in functions.parameters(function)[3:]]

    def evaluate(points: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.asarray(function(*points, *given))

    centres, _, size = possible_cells(evaluate, LIPSCHITZ, Box.centred(*found.half), CELLS)
    x, y, z = (np.ceil((abs(centres).max(axis=1, initial=0) + size / 2) * 256) / 256).tolist()
    return x, y, z


def _escape(step: Any, points: np.ndarray, origin: np.ndarray, against: float) -> float:
    """Radius beyond which steps lead farther out; a constant of a given size points against them."""
    image = step(points, origin)
    if against:
        image = step(points, image * (-against / np.maximum(np.linalg.norm(image, axis=0), 1e-300)))
    grows = np.linalg.norm(image, axis=0) > 1.02 * np.linalg.norm(points, axis=0)
    stays = np.flatnonzero(~grows.reshape(-1, len(RADII)).all(axis=0))
    return float(RADII[min(stays.max(initial=0) + 1, len(RADII) - 1)])


def _inside(step: Any, points: np.ndarray, julia: Any, steps: int, radius: float) -> np.ndarray:
    """Points whose orbit is within a radius after some steps."""
    w, c, start = points, points if julia is None else np.array(julia), points
    for _ in range(steps):
        w = step(w, c)
        kept = np.linalg.norm(w, axis=0) < max(radius, FARTHEST)
        w, c, start = w[:, kept], c[:, kept] if julia is None else c, start[:, kept]
    return start[:, np.linalg.norm(w, axis=0) <= radius]


def _radius(step: Any, points: np.ndarray, julia: Any, steps: int, radius: float) -> float:
    """Radius that encloses the points whose orbit is within a radius after some steps."""
    inside = np.linalg.norm(_inside(step, points, julia, steps, radius), axis=0)
    return float(inside.max(initial=RADII[0]) * (RADII[1] / RADII[0]) * 1.02)


def _rays() -> np.ndarray:
    """Unit vectors [3, n]: to the corners, edges and faces of a cube, and at random."""
    lattice = np.array([v for v in product((-1, 0, 1), repeat=3) if any(v)], float).T
    rays = np.hstack([lattice, np.random.default_rng(0).normal(size=(3, DIRECTIONS))])
    unit: np.ndarray = rays / np.linalg.norm(rays, axis=0)
    return unit


def _numpy(code: Code, values: Mapping[str, Any]) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Step on arrays [3, n]."""
    step = code.traced()
    body = [*code.unpacked, *step.lines, f"return {', '.join(step.point)}"]
    function = _function(code, "x, y, z, cx, cy, cz", body)
    given = [values[name] for name, _ in code.sizes]

    def image(w: np.ndarray, c: np.ndarray) -> np.ndarray:
        constant = c if c.ndim == 2 else c[:, None]
        with np.errstate(all="ignore"):
            found = np.array(np.broadcast_arrays(*function(*w, *constant, *given), w[0])[:3])
        finite: np.ndarray = np.nan_to_num(found, nan=1e300, posinf=1e300, neginf=-1e300)
        return finite.clip(-1e100, 1e100)

    return image


def arguments(found: Growth, iterations: int, julia: Any) -> dict[str, object]:
    """Return the arguments of an orbit's field, besides those of its step.

    Parameters
    ----------
    found
        Growth of the orbit.
    iterations
        Number of steps.
    julia
        Constant of the steps, or None.

    Returns
    -------
    dict
        Values by name.
    """
    own: dict[str, object] = {"iterations": iterations} | ({"julia": julia} if julia is not None else {})
    power, radius = found.power, found.escape
    if not found.by_power:
        return {**own, "escape2": (STOP[False] * radius) ** 2, "bailout": radius}
    steps = min(iterations, int(30 / math.log10(power)))
    last = 2 * math.log(max(radius, 1.1))
    radius = math.exp(last / 2)
    least = radius**2 * math.exp(-max(0.2 / radius, 1e-4))
    flattest = power * CORE ** ((power - 1) / 2)
    stop = max(radius, STOP[True] ** (1 / power))
    levels = (power, last / power**steps, last, least, flattest)
    return {**own, "escape2": stop**2, "levels": levels}
