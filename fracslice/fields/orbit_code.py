"""Fields of orbits, written from their steps, with majorants of their distance.

A round of an orbit takes its steps one after the other. The solid of N rounds is ``{p : |w_N(p)| <= R}`` for
the radius R beyond which no orbit comes back. The field is ``(|w| - R) / |w'|`` where the orbit stops if
rounds grow linearly, and that of the potential (`fields.maps`) if they grow by a power. The derivative is
bounded by the stretch of each step: ``dr -> s dr + t``, where t is the stretch by the constant.

The derivative bounds how far a point of the orbit moves only near the start point; the bend, a majorant of
the other terms, bounds it everywhere. So no point nearer than the sure distance moves into the solid, or
across a tear of a step.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from functools import lru_cache
from typing import Any

from ..expr import language
from ..expr.frontend import formula, text_function
from ..expr.graph import Function
from ..expr.language import identity, parse_expression
from ..expr.runtime import kept_text
from .maps import MAJORANTS, RIGID, potential_distance, sure_distance
from .steps import Step, trace


def has_majorants(steps: Sequence[Step]) -> bool:
    """Return True if all steps have a known majorant."""
    return all(step.majorant is not None for step in steps)


def is_torn(steps: Sequence[Step]) -> bool:
    """Return True if a step is known to tear space."""
    return any(step.majorant is not None and step.majorant[1] is not None for step in steps)


def majorants_before(sure: bool, torn: bool) -> list[str]:
    """Return the lines before the first step."""
    return [
        *(["bend = 0.0 * x", "steep = dr"] if sure or torn else []),
        *(["sure = sqrt(minimum(r2, 1e30)) - reach"] if sure else []),
        *(["tear = 0.0 * x + 1e30"] if torn else []),
    ]


def majorants_of_step(step: Step, torn: bool, shrink: str | None) -> list[str]:
    """Return the lines before the derivative of a step is taken; shrink: that of its own coordinates."""
    assert step.majorant is not None
    bend, tear = step.majorant
    if shrink:
        bend, tear = f"{bend} / {shrink}", tear and f"{shrink} * {tear}"
    beside = f"2.0 * sure_distance({tear}, steep, bend)"
    crossed = [f"tear = where(alive, minimum(tear, {beside}), tear)"] if tear and torn else []
    return [*step.bending, *crossed, f"bend = where(alive, bend + steep * {bend}, bend)"]


def majorants_after(sure: bool, torn: bool, surface: str) -> list[str]:
    """Return the lines after a step: an orbit in its middle must leave the whole solid, later the surface."""
    margin = f"where(level < 0.75 * last_level, radius - reach, radius - {surface})"
    left = "where(alive, maximum(sure, sure_distance(margin, steep, bend)), sure)"
    return [
        *(["steep = where(alive, maximum(dr, steep), steep)"] if sure or torn else []),
        *(["radius = sqrt(r2)", f"margin = {margin}", f"sure = {left}"] if sure else []),
    ]


def majorants_last(sure: bool, torn: bool) -> list[str]:
    """Return the lines that bound the field."""
    return [
        *(["f = minimum(2.0 * sure, f)"] if sure else []),
        *(["f = minimum(tear, maximum(-tear, f))"] if torn else []),
    ]


@dataclass(frozen=True)
class Code:
    """A step with the parameters that its code depends on."""

    step: Callable[..., Any]  # function ``f(w, c, ...)``
    sizes: tuple[tuple[str, int], ...]  # numbers of components of its other parameters
    fixed: tuple[tuple[str, Any], ...] = ()  # values of the parameters that the code depends on
    julia: bool = False  # true if its constant is the same at all points
    moved: bool = False  # true if it is taken in coordinates of its own

    def traced(self, place: int) -> Step:
        """Straight-line code of the step at a place in the round."""
        return _trace_step(self, place, language.fingerprint(self.step))

    def is_fixed(self, place: int) -> bool:
        """True if the step is the same map for all start points, as in a Julia set."""
        return self.julia or not self.traced(place).constants

    def arguments(self, place: int) -> list[str]:
        """Names of the values that the step needs at a place in the round."""
        names = [f"v{place}_{name}" for name, _ in self.sizes]
        return [*names, *self._flagged(place, julia=["c"], moved=["back", "forth", "spread", "shrink"])]

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
        given = ", ".join(mapped(f"back{place}", start) if self.moved else start)
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
        there, back = (f"x, y, z = {', '.join(mapped(f'{name}{place}', xyz))}" for name in ("back", "forth"))
        return [there, *lines], [*assigned, back]

    def boxed(self, place: int, between: Sequence[str] = ()) -> list[str]:
        """Lines that take a box around x, y, z to its image.

        Where the length of the image follows from that of the point, sqrt(r2), the image lies in a shell, and
        r2 is that of the image.
        """
        step = self.traced(place)
        lines, (assigned, *back) = self.around(place, step.lines)
        if step.length is None:
            return [*lines, *between, assigned, *back]
        return [
            *[*lines, *between],
            f"rw{place} = sqrt({'x * x + y * y + z * z' if self.moved else 'r2'})",
            f"rc{place} = sqrt(cx{place} * cx{place} + cy{place} * cy{place} + cz{place} * cz{place})",
            *[*step.measuring, f"shell = {step.length}", assigned],
            *(f"{v} = maximum(minimum({v}, shell), -shell)" for v in "xyz"),
            *([*back, *self._moved_shell(place)] if self.moved else []),
            "r2 = shell * shell",
        ]

    def _moved_shell(self, place: int) -> list[str]:
        """Lines that map the shell as the point: around the image of the origin, then around the origin."""
        offset = [f"forth{place}_{9 + k}" for k in range(3)]
        own = " + ".join(f"({v} - {o}) * ({v} - {o})" for v, o in zip("xyz", offset, strict=True))
        return [
            f"shell = shrink{place} * shell",
            f"shell = maximum(shell, minimum(spread{place} * shell, sqrt({own})))",
            f"away = sqrt({' + '.join(f'{o} * {o}' for o in offset)})",
            "shell = maximum(absolute(shell - away), minimum(shell + away, sqrt(x * x + y * y + z * z)))",
        ]

    def _flagged(self, place: int, **names: list[str]) -> list[str]:
        return [f"{name}{place}" for flag, own in names.items() if getattr(self, flag) for name in own]


R2 = "r2 = x * x + y * y + z * z"

Round = tuple[Code, ...]
"""Steps of a round, in order."""


def mapped(matrix: str, point: Sequence[str]) -> list[str]:
    """Image of a point under an affine map: nine entries row by row, then three of the translation."""
    rows = [[f"{matrix}_{3 * k + i} * {p}" for i, p in enumerate(point)] for k in range(3)]
    return [" + ".join([*row, f"{matrix}_{9 + k}"]) for k, row in enumerate(rows)]


@lru_cache(maxsize=256)
def _trace_step(code: Code, place: int, _: object) -> Step:
    """Straight-line code of a step, cached: following its text takes a twentieth of a small picture."""
    rigid = sorted(RIGID, key=lambda verb: verb.__name__)
    verbs = identity(code.step, *(value for _, value in code.fixed), *MAJORANTS, *MAJORANTS.values(), *rigid)

    def text() -> str:
        return repr(astuple(trace(code.step, dict(code.sizes), dict(code.fixed), place)))

    made_of = verbs, code.sizes, code.fixed, place
    return Step(*ast.literal_eval(parse_expression(kept_text("traced", made_of, text))))


@dataclass(frozen=True)
class Form:
    """What the code of a field depends on besides the steps."""

    by_power: bool  # true if rounds grow by a power
    scaled: bool = False  # true if the potential is that of ``scale |w|`` after each step
    # true if critical points may be outside, for constants that are the same at all points
    critical: bool = True
    # true if the field stays below twice the sure distance (`fields.maps.sure_distance`)
    sure: bool = False
    torn: bool = False  # true if it stays below twice the sure distance to the tears of the steps
    blind: bool = False  # true if it is at most 0

    def least(self, code: Code) -> bool:
        """True if the derivative of a step has a minimum: preimages of critical points, see `escape.CORE`."""
        return self.by_power and self.critical and code.is_fixed(0)


def field(steps: Round, form: Form) -> Function:
    """Write the function of an orbit's field."""
    return _field(steps, form, tuple(language.fingerprint(code.step) for code in steps))


@lru_cache(maxsize=256)
def _field(steps: Round, form: Form, _: object) -> Function:
    given, setup, loop = [], [], []
    by_power, scaled = form.by_power, form.scaled
    for place, code in enumerate(steps):
        given += [*code.arguments(place), f"stop{place}", *([f"scale{place}"] if scaled else [])]
        given += [f"rate{place}"] if by_power else []
        given += [f"least{place}"] if form.least(code) else []
        given += [f"surface{place}"] if form.sure else []
        setup += code.before(place, ("x", "y", "z"))
        loop += _step_lines(code, place, form)
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
        *majorants_before(form.sure, form.torn),
        "for _ in range(iterations):",
        *indent_lines(["if not any_of(alive):", "    break", *loop]),
        "f = potential_distance(end_r2, slope * slope, level, first_level, last_level, least_r2)"
        if by_power
        else "f = (sqrt(minimum(end_r2, 1e30)) - bailout) / minimum(slope, 1e30)",
        *majorants_last(form.sure, form.torn),
        *(["f = minimum(f, 0.0)"] if form.blind else []),
        "return f",
    ]
    own = ["levels" if by_power else "bailout", *(["reach"] if form.sure else [])]
    return function_of_text(steps, ["x", "y", "z", "iterations", *own, *given], body)


def _step_lines(code: Code, place: int, form: Form) -> list[str]:
    """Lines of the loop that take a step."""
    scale, step = f"scale{place}" if form.scaled else "", code.traced(place)
    by_w, by_c = step.stretch
    if form.least(code):
        by_w = f"maximum({by_w}, least{place})"
    grown = f"{by_w} * dr" if code.julia or by_c == "0.0" else f"{by_w} * dr + {by_c}"
    shrink = f"shrink{place}" if code.moved else None
    bent = majorants_of_step(step, form.torn, shrink) if form.sure or form.torn else []
    lines, assigned = code.around(place, step.lines)
    reached = [f"reached = reached * rate{place}", "level = where(alive, reached, level)"]
    return [
        *lines,
        *bent,
        f"dr = spread{place} * ({grown})" if code.moved else f"dr = {grown}",
        *assigned,
        "r2 = x * x + y * y + z * z",
        "orbit(r2, alive, x, y, z)",
        f"end_r2 = where(alive, {f'{scale} * {scale} * r2' if scale else 'r2'}, end_r2)",
        f"slope = where(alive, maximum({f'{scale} * dr' if scale else 'dr'}, slope), slope)",
        *(reached if form.by_power else []),
        *majorants_after(form.sure, form.torn, f"surface{place}"),
        f"alive = alive & (r2 < stop{place})",
    ]


def indent_lines(lines: Sequence[str]) -> list[str]:
    """Return lines of a block."""
    return [f"    {line}" for line in lines]


def function_of_text(steps: Round, arguments: Sequence[str], body: Sequence[str]) -> Function:
    """Return the function of written lines."""
    name = "_".join(code.step.__name__.strip("_") for code in steps)[:60]
    called = {function.__name__: formula(function) for function in (potential_distance, sure_distance)}
    return text_function(name, arguments, body, called)
