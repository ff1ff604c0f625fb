"""Fields of orbits, written from their steps.

A round of an orbit takes its steps one after the other. The solid of N rounds is ``{p : |w_N(p)| <= R}`` for
the radius R beyond which no orbit comes back. The field is ``(|w| - R) / |w'|`` where the orbit stops if
rounds grow linearly, and that of the potential (`formulas.escape`) if they grow by a power. The derivative is
bounded by the stretch of each step: ``dr -> s dr + t``, where t is the stretch by the constant.
"""

from __future__ import annotations

import linecache
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ..formulas import vocabulary
from ..formulas.escape import potential_distance
from . import functions
from .steps import traced
from .straight_line import Step


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
    julia
        True if its constant is the same at all points.
    moved
        True if it is taken in coordinates of its own.
    """

    step: Callable[..., Any]
    sizes: tuple[tuple[str, int], ...]
    fixed: tuple[tuple[str, Any], ...] = ()
    julia: bool = False
    moved: bool = False

    def traced(self, place: int) -> Step:
        """Straight-line code of the step at a place in the round."""
        return _traced(self, place, functions.fingerprint(self.step))

    def is_fixed(self, place: int) -> bool:
        """True if the step is the same map for all start points, as in a Julia set."""
        return self.julia or not self.traced(place).constants

    def arguments(self, place: int) -> list[str]:
        """Names of the values that the step needs at a place in the round."""
        names = [f"v{place}_{name}" for name, _ in self.sizes]
        return [*names, *self._flagged(place, julia=["c"], moved=["back", "forth", "spread"])]

    def before(self, place: int, start: Sequence[str]) -> list[str]:
        """Lines before the first round: those that take vectors apart, set the constant of the step, from the
        start point if it has none of its own, and do not depend on the last point.
        """
        lines = [
            f"{', '.join(f'v{place}_{name}_{k}' for k in range(size))} = v{place}_{name}"
            for name, size in self.sizes
            if size > 1
        ]
        matrices = self._flagged(place, moved=["back", "forth"])
        lines += [f"{', '.join(f'{name}_{k}' for k in range(12))} = {name}" for name in matrices]
        given = ", ".join(_mapped(f"back{place}", start) if self.moved else start)
        constant = f"cx{place}, cy{place}, cz{place} = {f'c{place}' if self.julia else given}"
        return [*lines, constant, *self.traced(place).before]

    def image(self, place: int) -> list[str]:
        """Lines that take the point x, y, z to its image."""
        lines, assigned = self.around(place, self.traced(place).image)
        return [*lines, *assigned]

    def around(self, place: int, lines: Sequence[str]) -> tuple[list[str], list[str]]:
        """Lines of the step's calculation in its own coordinates, and those that assign its image."""
        xyz, assigned = ("x", "y", "z"), [f"x, y, z = {', '.join(self.traced(place).point)}"]
        if not self.moved:
            return [*lines], assigned
        there, back = (f"x, y, z = {', '.join(_mapped(f'{name}{place}', xyz))}" for name in ("back", "forth"))
        return [there, *lines], [*assigned, back]

    def _flagged(self, place: int, **names: list[str]) -> list[str]:
        return [f"{name}{place}" for flag, own in names.items() if getattr(self, flag) for name in own]


Round = tuple[Code, ...]
"""Steps of a round, in order."""


def _mapped(matrix: str, point: Sequence[str]) -> list[str]:
    """Image of a point under an affine map: nine entries row by row, then three of the translation."""
    rows = [[f"{matrix}_{3 * k + i} * {p}" for i, p in enumerate(point)] for k in range(3)]
    return [" + ".join([*row, f"{matrix}_{9 + k}"]) for k, row in enumerate(rows)]


@lru_cache(maxsize=256)
def _traced(code: Code, place: int, _: object) -> Step:
    return traced(code.step, dict(code.sizes), dict(code.fixed), place)


def field(steps: Round, by_power: bool, scaled: bool) -> Callable[..., Any]:
    """Write the function of an orbit's field.

    Parameters
    ----------
    steps
        Steps of a round.
    by_power
        True if rounds grow by a power.
    scaled
        True if the potential is that of ``scale |w|`` after each step.

    Returns
    -------
    Callable
        Function in the language of formulas.

    Raises
    ------
    KernelError
        If a step is not in the language.
    """
    return _field(steps, by_power, scaled, tuple(functions.fingerprint(code.step) for code in steps))


@lru_cache(maxsize=256)
def _field(steps: Round, by_power: bool, scaled: bool, _: object) -> Callable[..., Any]:
    given, setup, loop = [], [], []
    for place, code in enumerate(steps):
        given += [*code.arguments(place), f"stop{place}", *([f"scale{place}"] if scaled else [])]
        given += [f"rate{place}"] if by_power else []
        given += [f"least{place}"] if by_power and code.is_fixed(place) else []
        setup += code.before(place, ("x", "y", "z"))
        loop += _taken(code, place, by_power, f"scale{place}" if scaled else "")
    last = len(steps) - 1
    body = [
        *setup,
        *(["first_level, last_level, least_r2 = levels"] if by_power else []),
        *(["reached = first_level", "level = 0.0 * x + first_level"] if by_power else []),
        "r2 = x * x + y * y + z * z",
        "dr = 0.0 * x + 1.0",
        *([f"end_r2 = scale{last} * scale{last} * r2", f"slope = scale{last} * dr"] if scaled else []),
        *([] if scaled else ["end_r2 = r2", "slope = dr"]),
        f"alive = r2 < stop{last}",
        "for _ in range(iterations):",
        *_indented(["if not any_of(alive):", "    break", *loop]),
        "return potential_distance(end_r2, slope * slope, level, first_level, last_level, least_r2)"
        if by_power
        else "return (sqrt(minimum(end_r2, 1e30)) - bailout) / minimum(slope, 1e30)",
    ]
    own = "levels" if by_power else "bailout"
    return written(steps, ["x", "y", "z", "iterations", own, *given], body)


def sign(steps: Round, scaled: bool) -> Callable[..., Any]:
    """Write the function of ``|w_N|^2 - R^2`` where an orbit does not stop before, else of 1.

    Parameters
    ----------
    steps
        Steps of a round.
    scaled
        True if R is that of ``scale |w|``.

    Returns
    -------
    Callable
        Function in the language of formulas.

    Raises
    ------
    KernelError
        If a step is not in the language.
    """
    return _sign(steps, scaled, tuple(functions.fingerprint(code.step) for code in steps))


@lru_cache(maxsize=256)
def _sign(steps: Round, scaled: bool, _: object) -> Callable[..., Any]:
    given, setup, loop = [], [], []
    for place, code in enumerate(steps):
        given += [*code.arguments(place), f"stop{place}"]
        setup += code.before(place, ("x", "y", "z"))
        loop += [*code.image(place), "r2 = x * x + y * y + z * z"]
        loop += [f"alive = alive & (r2 < stop{place})"]
    body = [
        *setup,
        "r2 = x * x + y * y + z * z",
        f"alive = r2 < stop{len(steps) - 1}",
        "for _ in range(iterations):",
        *_indented(["if not any_of(alive):", "    break", *loop]),
        f"return where(alive, {'scale * scale * ' if scaled else ''}r2 - radius2, 1.0 + 0.0 * r2)",
    ]
    own = ["scale", "radius2"] if scaled else ["radius2"]
    return written(steps, ["x", "y", "z", "iterations", *own, *given], body)


def _taken(code: Code, place: int, by_power: bool, scale: str) -> list[str]:
    """Lines of the loop that take a step."""
    by_w, by_c = code.traced(place).stretch
    if code.is_fixed(place) and by_power:  # preimages of critical points outside the set, see `escape.CORE`
        by_w = f"maximum({by_w}, least{place})"
    grown = f"{by_w} * dr" if code.julia or by_c == "0.0" else f"{by_w} * dr + {by_c}"
    lines, assigned = code.around(place, code.traced(place).lines)
    return [
        *lines,
        f"dr = spread{place} * ({grown})" if code.moved else f"dr = {grown}",
        *assigned,
        "r2 = x * x + y * y + z * z",
        "orbit(r2, alive, x, y, z)",
        f"end_r2 = where(alive, {f'{scale} * {scale} * r2' if scale else 'r2'}, end_r2)",
        f"slope = where(alive, maximum({f'{scale} * dr' if scale else 'dr'}, slope), slope)",
        *([f"reached = reached * rate{place}", "level = where(alive, reached, level)"] if by_power else []),
        f"alive = alive & (r2 < stop{place})",
    ]


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def written(steps: Round, arguments: Sequence[str], body: Sequence[str]) -> Callable[..., Any]:
    """Make a function of written text, which tracebacks and the linker can read.

    Parameters
    ----------
    steps
        Steps that the text is written from.
    arguments
        Names of the function's arguments.
    body
        Lines of the function.

    Returns
    -------
    Callable
        Function in the language of formulas.
    """
    name = "_".join(code.step.__name__.strip("_") for code in steps)[:60]
    text = "\n    ".join([f"def {name}({', '.join(arguments)}):", *body]) + "\n"
    file = f"<orbit {name} {abs(hash((steps, text))):x}>"
    scope: dict[str, Any] = {n: getattr(vocabulary, n) for n in (*vocabulary.NAMES, "orbit")}
    scope["potential_distance"] = potential_distance
    exec(compile(text, file, "exec"), scope)
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    function: Callable[..., Any] = scope[name]
    return function
