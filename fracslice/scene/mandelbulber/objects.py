"""What stands in a scene of Mandelbulber: one orbit, or several by boolean operators, and primitives."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import reduce

import numpy as np

from ...common.arrays import product, rotation
from ...errors import SceneError
from ...formulas import Node, get
from . import appearance
from .measures import solid_of
from .names import NAMES
from .sequences import Orbit, Slot, all_slots, hybrid_slots
from .settings import Settings, SettingsSection, Triple

OPERATORS = ("intersection", "union", "difference")
"""Boolean operators by their number."""

_PRIMITIVE = re.compile(r"primitive_([a-z]+)_(\d+)_enabled")

_NODE = re.compile(r"node_\d+_definition")
_MOVED_NODE = re.compile(r"node_\d+_(position|rotation|repeat)")

ORBITS = ("1", "10")
"""Kinds of the nodes of a tree that are a formula or a hybrid."""

MOST_PRIMITIVES = 100


def orbits(settings: Settings, leave_out: bool = False) -> list[Orbit]:
    """Orbits of a file: one, or with boolean operators one of each formula."""
    main = settings.main
    _refuse_trees(main)
    apart = main.flag("boolean_operators", "false")
    slots = all_slots(settings) if apart else hybrid_slots(settings)
    if not slots:
        raise SceneError(f"{settings.path}: expected at least one formula")
    missing = [_named(s) for s in slots if s.known is None]
    if missing and not leave_out:
        raise SceneError(f"{missing[0]}: not known here; --leave-out imports the rest")
    kept = [s for s in slots if s.known]
    if not kept:
        raise SceneError(f"{missing[0]}: not known here, and no other formula is left")
    made = [_orbit(settings, [s], apart) for s in kept] if apart else [_orbit(settings, kept, apart)]
    made[0].missing += missing
    return made


def _refuse_trees(main: SettingsSection) -> None:
    """Raise an error for a tree of objects, which files have from version 2.35 on, other than one orbit."""
    for name in list(main.values):
        match = _NODE.fullmatch(name)
        words = main.text(name).rpartition(" ")[2].split(",") if match else []
        if len(words) > 2 and words[2] not in ORBITS:
            raise main.fail(name, "one formula or a hybrid, not a tree of objects")
        if _MOVED_NODE.fullmatch(name) and any(main.vector(name)):
            raise main.fail(name, "an object in its place")


def _orbit(settings: Settings, slots: list[Slot], apart: bool) -> Orbit:
    """Orbit of some formulas; with boolean operators each has values of its own."""
    main, own = settings.main, f"_{slots[0].place}" if apart else ""
    julia = main.flag(f"julia_mode{own}", "false")
    hybrid = not apart and main.flag("hybrid_fractal_enable", "false")
    count = main.whole("N", "250")
    if apart and settings.version >= 2.29:
        count = main.whole(f"formula_maxiter{own}", "250")
    return Orbit(
        settings,
        slots,
        hybrid,
        max(count, 1),
        main.vector(f"julia_c{own}", "0 0 0") if julia else None,
        main.vector(f"fractal_constant_factor{own}", "1 1 1"),
    )


def _named(s: Slot) -> str:
    return f"{s.line}: formula_{s.place} {s.number} ({NAMES.get(s.number, 'no name')})"


def solid(settings: Settings, made: list[Orbit]) -> Node:
    """Element of everything in a file, with materials."""
    whole = [_placed_orbit(orbit, len(made) > 1) for orbit in made]
    result = whole[0]
    first = settings.main.text("boolean_operator_1", "1")
    for orbit, node in zip(made[1:], whole[1:], strict=True):
        name = f"boolean_operator_{orbit.slots[0].place - 1}"
        result = _joined(settings.main, name, first, result, node)
    for kind, number in _primitives(settings.main):
        prefix = f"primitive_{kind}_{number}_"
        found = _primitive(settings.main, kind, prefix)
        if found is None:
            place = settings.main.place(prefix + "enabled")
            made[0].notes.append(f"{place}: primitive_{kind}_{number}: left out")
            continue
        shown = appearance.material(found, settings, settings.main.whole(prefix + "material_id", "1"))
        result = _joined(settings.main, prefix + "boolean_operator", "1", result, shown)
    return result


def _joined(main: SettingsSection, name: str, default: str, first: Node, second: Node) -> Node:
    """Two elements by the operator of a name."""
    number = main.whole(name, default)
    if number >= len(OPERATORS):
        raise main.fail(name, "0, 1 or 2")
    return get(OPERATORS[number])(first, second)


def _placed_orbit(orbit: Orbit, apart: bool) -> Node:
    """Orbit in its place, with its material."""
    main, slot = orbit.settings.main, orbit.slots[0]
    node = solid_of(orbit, f"o{slot.place}" if apart else "")
    names = [(f"formula_{what}_{slot.place}", f"fractal_{what}") for what in ("position", "rotation")]
    where, angles = (
        main.vector(own if main.given(own) and not orbit.is_hybrid else whole, "0 0 0")
        for own, whole in names
    )
    factor = 1.0 if orbit.is_hybrid else main.number(f"formula_scale_{slot.place}", "1")
    for name in (f"formula_repeat_{slot.place}", "repeat"):
        if any(main.vector(name, "0 0 0")):
            orbit.notes.append(f"{main.place(name)}: {name}: copies are left out")
    number = main.whole(f"formula_material_id_{slot.place}", "1") if apart else 1
    shown = appearance.material(node, orbit.settings, number, slot.number)
    return placed(shown, where, angles, factor)


def placed(node: Node, where: Triple, angles: Triple, factor: float = 1.0) -> Node:
    """Element scaled, turned about z, then y, then x by the opposite of angles in degrees, and moved."""
    if not any(where) and not any(angles) and factor == 1:
        return node
    about = (rotation((*axis, -angle)) for axis, angle in zip(np.eye(3), angles, strict=True))
    turned = factor * reduce(product, about)
    rows = [round(float(v), 12) for row, moved in zip(turned, where, strict=True) for v in (*row, moved)]
    if not any(angles):
        return get("transform")(node, translate=where, scale=(factor,))
    return get("transform")(node, matrix=tuple(rows))


def _primitives(main: SettingsSection) -> list[tuple[str, int]]:
    """Kinds and numbers of the primitives that are on, in the order of their calculation."""
    found = [match for name in main.values if (match := _PRIMITIVE.fullmatch(name))]
    pairs = [(m[1], int(m[2])) for m in found if main.flag(m[0])]
    if len(pairs) > MOST_PRIMITIVES:
        raise SceneError(f"{main.path}: expected at most {MOST_PRIMITIVES} primitives")
    return sorted(pairs, key=lambda pair: main.whole(f"primitive_{pair[0]}_{pair[1]}_calculation_order", "0"))


def _primitive(main: SettingsSection, kind: str, prefix: str) -> Node | None:
    """One primitive in its place; None if it, or how it is, is not known here."""
    build = SHAPES.get(kind)
    switches = ("empty", "limits_enable")
    if build is None or any(main.flag(prefix + switch, "false") for switch in switches):
        return None
    if main.number(prefix + "wall_thickness", "0") or not main.flag(prefix + "caps", "true"):
        return None
    node = build(main, prefix)
    where, angles = main.vector(prefix + "position", "0 0 0"), main.vector(prefix + "rotation", "0 0 0")
    return placed(node, where, angles)


def _plane(main: SettingsSection, prefix: str) -> Node:
    return get("plane")()


def _sphere(main: SettingsSection, prefix: str) -> Node:
    return get("sphere")(radius=main.number(prefix + "radius", "1"))


def _box(main: SettingsSection, prefix: str) -> Node:
    round_ = max(main.number(prefix + "rounding", "0"), 0.0)
    round_ = round_ if round_ > 1e-9 else 0.0
    x, y, z = (side + 2 * round_ for side in main.vector(prefix + "size", "1 1 1"))
    return get("box")(size=(x, y, z), round=round_)


def _cylinder(main: SettingsSection, prefix: str) -> Node:
    radius, height = main.number(prefix + "radius", "1"), main.number(prefix + "height", "1")
    return get("cylinder")(radius=radius, height=height)


def _cone(main: SettingsSection, prefix: str) -> Node:
    radius, height = main.number(prefix + "radius", "1"), main.number(prefix + "height", "1")
    return get("transform")(get("cone")(radius=radius, height=height), translate=(0.0, 0.0, height / 2))


def _torus(main: SettingsSection, prefix: str) -> Node:
    for name in ("radius_lpow", "tube_radius_lpow"):
        if main.number(prefix + name, "1") != 1:
            raise main.fail(prefix + name, "1")
    return get("torus")(
        radius=main.number(prefix + "radius", "1"), tube=main.number(prefix + "tube_radius", "0.2")
    )


def _ellipsoid(main: SettingsSection, prefix: str) -> Node:
    return get("transform")(get("sphere")(), scale=main.vector(prefix + "size", "1 1 1"))


SHAPES: dict[str, Callable[[SettingsSection, str], Node]] = {
    "plane": _plane,
    "sphere": _sphere,
    "box": _box,
    "cylinder": _cylinder,
    "cone": _cone,
    "torus": _torus,
    "ellipsoid": _ellipsoid,
}
"""Primitives by their name in a file."""
