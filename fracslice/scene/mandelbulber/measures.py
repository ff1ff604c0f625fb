"""Orbits that are measured with a distance of their own: Kleinian groups, and solids inside iterations.

The solid is what an orbit leads into another, simple solid (`preimage`): after its last step, or after any.
Where a formula measures in the middle of a round, the solids of a round are united first, each through the
steps before it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...fields.box import Box, possible_cells
from ...formulas import Node, get
from .sequences import (
    Orbit,
    Text,
    Values,
    assembled,
    defined,
    distance_of,
    identifier,
    nodes,
    recurring,
    runs_of,
    steps_of,
)
from .step_text import FOUR, JOS, KLEINIAN, OWN_SOLID, RADIUS, UnknownError

ROUNDS, UNROLLED = 12, 12
"""Most iterations of an orbit that is measured, and of one whose steps do not recur."""

FAR = 4.0
"""Radius beyond which no orbit of the formulas of four dimensions comes back."""

CELLS = 1 << 15
"""Most cells of the search for the part of a box that a solid is in."""

WALL = 0.01
"""Thickness on each side of what is a surface without an inside."""

DISC = (
    "s = sqrt(maximum(x * x + y * y, 1e-30))\nreturn maximum(s - {0}, s * absolute(z) / sqrt(s * s + z * z))"
)
PLANE, PLANES = "return minimum(y, {0})", "return minimum(minimum(y, {1} - y), {0})"
"""Distances of a pseudo-Kleinian set (Knighty 2011, fractalforums.com), a disc and its axis; and of a
Kleinian group between planes (Leys and Knighty 2017, fractalforums.org).
"""


def solid_of(orbit: Orbit, name: str) -> Node:
    """Solid of an orbit, with an end."""
    kind = distance_of(orbit)
    return nodes(orbit, name) if kind == RADIUS else confined(orbit, measured_solid(orbit, kind, name))


def measured_solid(orbit: Orbit, kind: str, name: str) -> Node:
    """Solid of an orbit with a distance of its own."""
    steps = steps_of(orbit)
    if kind == FOUR:
        return four_measured(orbit, steps, name)
    if kind != OWN_SOLID:
        return last_measured(orbit, steps, surface(orbit, kind, name), name, kind == KLEINIAN)
    lasting = [step.solid for step in steps if step.solid and step.solid.last]
    if lasting:
        return last_measured(
            orbit, steps, own_solid(orbit, steps, len(steps) - 1, name), name, lasting[0].thin
        )
    return measured(orbit, steps, name)


def four_measured(orbit: Orbit, steps: Sequence[Text], name: str) -> Node:
    """Points whose orbit in four dimensions stays near, by the potential (Douady and Hubbard 1982)."""
    if len({slot.number for slot in orbit.slots}) > 1:
        raise UnknownError(f"{orbit.slots[0].line}: a formula of four dimensions in a hybrid")
    made, rounds = few(orbit, steps)
    runs = list(runs_of(made * rounds))
    values = orbit.slots[0].values
    start = (
        values.number("initial_waxis")
        if values.given("initial_waxis")
        else orbit.settings.main.number("initial_waxis_1", "0")
    )
    lines = [f"p, q, r, s = x, y, z, {start:g} + 0 * x", "m = 1 + 0 * x"]
    for step, count in runs:
        lines += [f"for k in range({count}):", *("  " + line for line in step.text.split("\n"))]
    lines.append("n = sqrt(maximum(p * p + q * q + r * r + s * s, 1e-18))")
    lines.append(f"return 0.5 * log(n / {FAR:g}) * n / m")
    parameters = {n: value for step, _ in runs for n, value in step.parameters}
    known = orbit.slots[0].known
    assert known is not None
    own = f"{identifier(known.name)}_{name}".rstrip("_")
    stated = {"lipschitz": 2.0, "half": (FAR, FAR, FAR)}
    made_of: Node = defined(own, "\n".join(lines), tuple(parameters.items()), "distance", **stated)()
    return made_of


def surface(orbit: Orbit, kind: str, name: str) -> Node:
    """What the last point is measured with in a Kleinian group."""
    values = orbit.slots[0].values
    names, text = ["analyticDE_scale_1"], DISC
    if kind == JOS:
        names, text = ["analyticDE_tweak_005"], PLANE
        if values.flag("transf_spheres_enabled"):
            names, text = [*names, "transf_folding_value"], PLANES
    parameters = tuple((n.lower(), values.number(n)) for n in names)
    return named(f"surface_{name}".rstrip("_"), text.format(*dict(parameters)), parameters)


def named(name: str, text: str, parameters: Values, slope: float = 1.0) -> Node:
    """Element of the text of a distance."""
    made: Node = defined(name, text, parameters, "distance", lipschitz=slope)()
    return made


def own_solid(orbit: Orbit, steps: Sequence[Text], index: int, name: str) -> Node:
    """What a formula measures with at an iteration."""
    step = next(s for s in reversed(steps[: index + 1]) if s.solid)
    assert step.solid is not None
    known = next(s.known for s in orbit.slots if s.place == step.place)
    assert known is not None
    number = list(dict.fromkeys(s.solid for s in steps if s.solid)).index(step.solid) + 1
    own = f"{identifier(known.name)}_{name}solid{number}"
    return named(own, step.solid.text, step.solid.parameters, step.solid.slope)


def few(orbit: Orbit, steps: Sequence[Text]) -> tuple[list[Text], int]:
    """Round and number of rounds of steps, of which the first are taken where they are many."""
    period = recurring(steps)
    most = min(len(steps), ROUNDS if period else UNROLLED)
    if most < len(steps):
        place = f"{orbit.settings.main.place('N')}: N {orbit.iterations}"
        orbit.notes.append(f"{place}: {most} of the iterations, for a distance of its own")
    whole = -(-most // period) if period else 1
    return list(steps[: period or most]), whole


def last_measured(orbit: Orbit, steps: Sequence[Text], inner: Node, name: str, thin: bool) -> Node:
    """Solid that the last point of an orbit is in."""
    made, rounds = few(orbit, steps)
    return thick(orbit, get("preimage")(assembled(orbit, made, rounds, name), inner), thin)


def measured(orbit: Orbit, steps: Sequence[Text], name: str) -> Node:
    """Solids that any point of an orbit is in."""
    made, rounds = few(orbit, steps)
    places = [k for k, step in enumerate(made) if step.solid]
    if not places:
        raise UnknownError(f"{orbit.slots[0].line}: a distance that begins after {UNROLLED} iterations")
    thin = any(step.solid.thin for step in made if step.solid)
    whole = assembled(orbit, made, rounds, name)
    last = made[-1].solid
    if len(places) == 1 and last and not last.first:
        return thick(
            orbit, get("preimage")(whole, own_solid(orbit, made, len(made) - 1, name), of="every"), thin
        )
    solid = chain(orbit, made, name)
    if rounds == 1:
        return thick(orbit, solid, thin)
    rest = assembled(orbit, made, rounds - 1, name)
    return thick(orbit, get("union")(solid, get("preimage")(rest, solid, of="every")), thin)


def chain(orbit: Orbit, made: Sequence[Text], name: str) -> Node:
    """Solids of the steps of a round, each behind the steps before it."""
    node: Node | None = None
    for k in reversed(range(len(made))):
        step = made[k]
        own = [own_solid(orbit, made, k, name)] if step.solid else []
        after = [*([] if step.solid and step.solid.first else own), *([node] if node else [])]
        if after:
            taken = assembled(orbit, [step], 1, f"{name}at{list(made).index(step) + 1}_")
            node = get("preimage")(taken, *after)
        if step.solid and step.solid.first:
            node = get("union")(*own, *([node] if node else []))
    assert node is not None
    return node


def thick(orbit: Orbit, node: Node, thin: bool) -> Node:
    """A surface with walls, so thin that the camera is not inside."""
    if not thin:
        return node
    main = orbit.settings.main
    free = float(node.distance([main.vector("camera", "3 -6 2")])[0])
    wall = float(f"{min(WALL, max(free / 8, 1e-9)):.3g}") if math.isfinite(free) else WALL
    orbit.notes.append(f"{main.path}: a surface without an inside, {2 * wall:g} thick here (<offset>)")
    return get("offset")(confined(orbit, node), distance=wall)


def confined(orbit: Orbit, node: Node) -> Node:
    """The part of an endless solid around what the camera looks at."""
    if node.bounds.box.finite:
        return node
    main = orbit.settings.main
    eye, target = main.vector("camera", "3 -6 2"), main.vector("target", "0 0 0")
    half = max(1.5 * math.dist(eye, target), 2.0)
    low, high = (np.array(target) + s * half for s in (-1, 1))
    if not orbit.settings.keyframes:
        low, high = occupied(node, low, high)
    orbit.notes.append(f"{main.path}: the solid is endless: cut around what the camera looks at (<bounds>)")
    first, last = (tuple(float(f"{v:.6g}") for v in corner) for corner in (low, high))
    return get("bounds")(node, min=first, max=last)


def occupied(node: Node, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the part of a box where a solid may be, with a cell around it; all of it for none."""
    box = Box(tuple(low.tolist()), tuple(high.tolist()))
    centres, _, step = possible_cells(lambda p: node.distance(p.T), node.bounds.lipschitz, box, CELLS)
    if not centres.size:
        return low, high
    first, last = centres.min(axis=1) - 1.5 * step, centres.max(axis=1) + 1.5 * step
    return np.maximum(low, first), np.minimum(high, last)
