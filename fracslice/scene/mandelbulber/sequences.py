"""Hybrids of Mandelbulber: which formula is taken at which iteration, as an orbit of steps.

Formulas are taken in turn, each as often as its iterations say, and only between its start and its stop;
behind the last, one goes on with that of `repeat_from`. Much in a formula begins or ends at an iteration,
too. So each iteration is written as a text, and equal texts are one definition. Where the texts recur from
the first on, one period of them is the round of an `<orbit>`; else each iteration is an element of it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from ...common.parameters import AUTO, Number, Parameter, Vector
from ...errors import SceneError
from ...fields.definitions import Defined, Definition, formula
from ...fields.orbits import REPEAT
from ...formulas import Node, get
from .settings import FRACTALS, Settings, SettingsSection, Triple
from .step_text import (
    ADDED,
    FORMULAS,
    FOUR,
    JOS,
    KLEINIAN,
    LEFT_OUT,
    OWN,
    OWN_SOLID,
    RADIUS,
    SWAPPED,
    Element,
    FormulaStep,
    KnownFormula,
    MeasuredSolid,
    UnknownError,
)

NEVER = 250
"""Iterations of a file that does not limit them, and the last one of a formula that does not stop."""

DEEP = 24
"""Most iterations that stand in a scene as in the file; more are automatic."""

UNROLLED = 6
"""Most iterations of an orbit whose steps do not recur."""

TRANSFORMS = range(1000, 1600)
"""Numbers of formulas that are no fractals: they have no distance."""

PREFERRED, DISTANCES = 0, {3: KLEINIAN, 4: JOS, 5: OWN_SOLID}
"""The formula's choice of a distance, and the distances that are not of the last radius, by their number."""

LONGEST = 32
"""Most steps of a round."""


@dataclass(frozen=True)
class Slot:
    """One of the formulas of a file."""

    place: int  # from 1
    number: int  # of the formula
    values: SettingsSection  # its parameters
    known: KnownFormula | None
    iterations: int  # how often it is taken in turn
    start: int
    stop: int
    weight: float
    adds: bool  # True if the constant is added after it
    line: str = ""  # file and line of its number


@dataclass
class Orbit:
    """Everything that the steps of an orbit share."""

    settings: Settings
    slots: list[Slot]
    is_hybrid: bool
    iterations: int
    julia: Triple | None
    factor: Triple
    notes: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


Values = tuple[tuple[str, Any], ...]
"""Parameters with their values."""


class SolidText(NamedTuple):
    """Distance of a formula at an iteration; see `step_text.MeasuredSolid`."""

    text: str
    parameters: Values
    first: bool
    last: bool
    thin: bool
    slope: float


class Text(NamedTuple):
    """A step at an iteration."""

    text: str  # statements
    parameters: Values
    element: Element | None  # the element of ours that it is
    place: int  # of its formula
    solid: SolidText | None = None  # what it is measured with, if that is its own


def slot(settings: Settings, place: int, hybrid: bool) -> Slot | None:
    """Formula of a place, from 1; None for none."""
    main, own = settings.main, settings.fractals[place - 1]

    def where(name: str) -> tuple[SettingsSection, str]:
        return (own, name) if own.given(name) else (main, f"{name}_{place}")

    section, name = where("formula")
    number = section.whole(name, "2" if place == 1 else "0")
    if number == 0:
        return None
    known = FORMULAS.get(number)
    (a, stay), (b, often), (d, heavy) = (
        where("dont_add_c_constant"),
        where("formula_iterations"),
        where("formula_weight"),
    )
    (e, begin), (f, end) = where("formula_start_iteration"), where("formula_stop_iteration")
    switched = a.flag(stay, "false")
    constant = known.constant if known else ADDED
    adds = constant != OWN and switched == (constant == LEFT_OUT)
    return Slot(
        place,
        number,
        own,
        known,
        max(b.whole(often, "1"), 1) if hybrid else 1,
        e.whole(begin, "0") if hybrid else 0,
        f.whole(end, str(NEVER)) if hybrid else NEVER,
        d.number(heavy, "1") if hybrid else 1.0,
        adds,
        section.place(name),
    )


def hybrid_slots(settings: Settings) -> list[Slot]:
    """All formulas of a hybrid, or the first alone."""
    hybrid = settings.main.flag("hybrid_fractal_enable", "false")
    places = range(1, FRACTALS + 1) if hybrid else (1,)
    return [found for place in places if (found := slot(settings, place, hybrid))]


def all_slots(settings: Settings) -> list[Slot]:
    """All formulas of a file that is no hybrid."""
    places = range(1, FRACTALS + 1)
    return [found for place in places if (found := slot(settings, place, False))]


def order(slots: Sequence[Slot], repeat_from: int, count: int) -> list[Slot]:
    """Formula of each iteration; fewer than asked for where none is left."""
    taken: list[Slot] = []
    at = counter = 0
    first = min(max(repeat_from - 1, 0), len(slots) - 1)
    for i in range(count):
        counter += 1
        for _ in slots:
            if slots[at].start <= i <= slots[at].stop:
                break
            at = at + 1 if at + 1 < len(slots) else first
        else:
            break
        taken.append(slots[at])
        if counter >= slots[at].iterations:
            counter = 0
            at = at + 1 if at + 1 < len(slots) else first
    return taken


def texts(orbit: Orbit, taken: Sequence[Slot]) -> list[Text]:
    """Step of each iteration."""
    state: dict[str, float] = {}
    even = all(s.known and s.known.even and not s.adds and s.weight == 1 for s in taken)
    return [one(orbit, s, i, state, even) for i, s in enumerate(taken)]


def one(orbit: Orbit, slot: Slot, index: int, state: dict[str, float], even: bool) -> Text:
    """Step of one iteration."""
    assert slot.known is not None
    step = FormulaStep(slot.values, index, state, symmetric=even)
    foldings(step, orbit.settings.main)
    slot.known.write(step)
    if slot.weight <= 0:
        return Text("return w", (), None, slot.place)
    animated = any(f"fractal{slot.place - 1}_" in line for _, line in orbit.settings.keyframes[:1])
    element = (
        step.element
        if not animated and slot.weight >= 1 and slot.adds and orbit.factor == (1, 1, 1)
        else None
    )
    if step.element and element and orbit.settings.main.flag("box_folding", "false"):
        element = None
    if slot.known.distance == FOUR:
        return four_dimensional(step, orbit, slot)
    if slot.weight < 1:
        step.lines.insert(0, "start = w")
    if slot.adds:
        constant(step, orbit, slot.known.constant == SWAPPED)
    if slot.weight < 1:
        share = step.parameter("formula_weight", slot.weight)
        step.write(f"w = {share} * w + (1 - {share}) * start")
    step.write("return w")
    text, parameters = "\n".join(step.lines), tuple(step.parameters.items())
    return Text(text, parameters, element, slot.place, solid_text(step.solid))


def four_dimensional(step: FormulaStep, orbit: Orbit, slot: Slot) -> Text:
    """Step from p, q, r, s to u, v, w, t, whose stretches are g, and e by the start point; it is taken while
    the point is near.
    """
    if orbit.factor != (1, 1, 1) or slot.weight != 1:
        raise UnknownError(f"{slot.line}: a weight or a factor of a formula of four dimensions")
    if slot.adds and orbit.julia is not None:
        step.write(
            f"a, b, d = {step.parameter('julia_c', orbit.julia)}", "u, v, w, e = u + a, v + b, w + d, 0"
        )
    elif slot.adds:
        step.write("u, v, w, e = u + x, v + y, w + z, 1")
    moved = ", ".join(f"where(on, {new}, {old})" for new, old in zip("uvwt", "pqrs", strict=True))
    step.write("m = where(on, g * m + e, m)", f"p, q, r, s = {moved}")
    lines = ["n = p * p + q * q + r * r + s * s", "on = n < 1e6", *step.lines]
    return Text("\n".join(lines), tuple(step.parameters.items()), None, slot.place)


def solid_text(solid: MeasuredSolid | None) -> SolidText | None:
    """Text of a formula's own distance."""
    if solid is None:
        return None
    text, parameters = "\n".join(solid.step.lines), tuple(solid.step.parameters.items())
    return SolidText(text, parameters, solid.first, solid.last, solid.thin, solid.slope)


def constant(step: FormulaStep, orbit: Orbit, swapped: bool) -> None:
    """Add the constant of a Julia set, or the start point, times a factor; x and y may be swapped."""
    if orbit.julia is not None:
        x, y, z = (a * b for a, b in zip(orbit.julia, orbit.factor, strict=True))
        x, y = (y, x) if swapped else (x, y)
        step.write(f"w = w + {step.parameter('julia_c', (x, y, z))}")
    elif swapped:
        own = step.parameter("fractal_constant_factor", orbit.factor)
        step.write(f"fx, fy, fz = {own}", "cx, cy, cz = c", "w = w + (fx * cy, fy * cx, fz * cz)")
    elif orbit.factor == (1, 1, 1):
        step.write("w = w + c")
    else:
        own = step.parameter("fractal_constant_factor", orbit.factor)
        step.write(f"fx, fy, fz = {own}", "cx, cy, cz = c", "w = w + (fx * cx, fy * cy, fz * cz)")


def foldings(step: FormulaStep, main: SettingsSection) -> None:
    """Folds of the whole file before each formula."""
    if main.flag("box_folding", "false"):
        limit, value = main.number("box_folding_limit", "1"), main.number("box_folding_value", "2")
        step.fold_beyond("box_folding", limit, value)
    if main.flag("spherical_folding", "false"):
        inner, outer = (
            main.number("spherical_folding_inner", "0.5"),
            main.number("spherical_folding_outer", "1"),
        )
        step.ball(inner * inner, outer * outer)


def recurring(steps: Sequence[Text]) -> int:
    """Shortest period of steps from the first on; 0 if they do not recur twice."""
    for period in range(1, min(LONGEST, len(steps) // 2) + 1):
        if all(steps[k] == steps[k - period] for k in range(period, len(steps))):
            return period
    return 0


def steps_of(orbit: Orbit) -> list[Text]:
    """Step of each iteration of a file. Raises `UnknownError` for a variant that is not known here."""
    taken = order(orbit.slots, orbit.settings.main.whole("repeat_from", "1"), min(orbit.iterations, NEVER))
    if not taken:
        raise SceneError(f"{orbit.settings.path}: expected a formula that is taken at the first iteration")
    made = texts(orbit, taken)
    if distance_of(orbit) == OWN_SOLID and not any(step.solid for step in made):
        main = orbit.settings.main
        raise UnknownError(f"{main.place('delta_DE_function')}: a distance of the formulas that have none")
    return made


def distance_of(orbit: Orbit) -> str:
    """What the points of an orbit are measured with: where formulas differ, that of the most iterations."""
    number = orbit.settings.main.whole("delta_DE_function", "0")
    if any(slot.known and slot.known.distance == FOUR for slot in orbit.slots):
        return FOUR
    if number != PREFERRED:
        return DISTANCES.get(number, RADIUS)
    counts = Counter[str]()
    for slot in orbit.slots:
        if slot.known is not None and slot.number not in TRANSFORMS:
            counts[slot.known.distance] += slot.iterations
    if counts[OWN_SOLID] or not counts:
        return OWN_SOLID if counts else RADIUS
    return counts.most_common(1)[0][0]


def nodes(orbit: Orbit, name: str = "") -> Node:
    """Orbit of a file as an element of ours."""
    steps = steps_of(orbit)
    place = f"{orbit.settings.main.place('N')}: N {orbit.iterations}"
    period = recurring(steps)
    if period and (len(steps) > UNROLLED or len(steps) % period == 0):
        whole = -(-len(steps) // period)
        if len(steps) > DEEP and orbit.iterations < NEVER:
            orbit.notes.append(f"{place}: the number of iterations is automatic")
        elif len(steps) <= DEEP and len(steps) % period:
            orbit.notes.append(f"{place}: {whole * period} iterations, which are whole rounds")
        return assembled(orbit, steps[:period], AUTO if len(steps) > DEEP else whole, name)
    if len(steps) > UNROLLED:
        orbit.notes.append(f"{place}: {UNROLLED} of the iterations, for their steps do not recur")
    return assembled(orbit, steps[:UNROLLED], 1, name)


def assembled(orbit: Orbit, round_: list[Text], iterations: Any, name: str) -> Node:
    """Elements of a round; equal steps in a row are repeated."""
    made: dict[Text, tuple[str, Any]] = {}
    for step in dict.fromkeys(round_):
        made[step] = definition(orbit, step, name, len(made), len(set(round_)))
    runs = list(runs_of(round_))
    if len(runs) == 1 and (runs[0][1] == 1 or iterations != AUTO):
        step, count = runs[0]
        whole = iterations if iterations == AUTO else iterations * count
        return element(orbit, step, made[step], iterations=whole)
    children = [element(orbit, step, made[step], repeat=count) for step, count in runs]
    return get("orbit")(*children, iterations=iterations)


def runs_of(round_: Sequence[Text]) -> Iterator[tuple[Text, int]]:
    """Steps with the number of times that they stand in a row, up to that of `repeat`."""
    last, count = round_[0], 0
    for step in round_:
        if step != last or count == REPEAT.most:
            yield last, count
            last, count = step, 0
        count += 1
    yield last, count


def element(orbit: Orbit, step: Text, made: tuple[str, Any], **values: Any) -> Node:
    """Element of a step: ours, or that of its definition."""
    _, defined = made
    if step.element is not None:
        given: dict[str, Any] = {**dict(step.element.values), **values}
        if orbit.julia is not None:
            given["julia"] = orbit.julia
        return get(step.element.name)(**given)
    made_of: Node = defined(**values)
    return made_of


def definition(orbit: Orbit, step: Text, name: str, index: int, count: int) -> tuple[str, Any]:
    """Name and formula of a step."""
    text, parameters, replaced, place, _ = step
    if replaced is not None:
        return replaced.name, None
    known = next(s.known for s in orbit.slots if s.place == place)
    assert known is not None
    own = (
        f"{identifier(known.name)}_{name}{index + 1}"
        if count > 1
        else f"{identifier(known.name)}_{name}".rstrip("_")
    )
    own = own if own not in _taken() else f"{own}_m"
    return own, defined(own, text, parameters)


def defined(
    name: str, text: str, parameters: Values, kind: Literal["step", "distance"] = "step", **stated: Any
) -> Defined:
    """Formula of a text; `stated`: what else its definition states."""
    return formula(
        Definition(name, tuple((n, _kind(value)) for n, value in parameters), text, kind, **stated)
    )


def _taken() -> frozenset[str]:
    from ...fields.registry import names

    return frozenset(names())


def identifier(name: str) -> str:
    """Name of an element for that of a formula."""
    letters = "".join(letter if letter.isalnum() else "_" for letter in name.lower())
    return "_".join(filter(None, letters.split("_")))[:30]


def _kind(value: float | Triple) -> Parameter:
    return Vector(value, "") if isinstance(value, tuple) else Number(value, "")
