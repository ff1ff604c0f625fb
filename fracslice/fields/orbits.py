"""Escape-time fractals from their step: rounds of several steps, and hybrids."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..common.arrays import affine, inverse, product, stretches
from ..common.parameters import AUTO, Count, Parameter, Vector
from ..expr.graph import Function
from ..expr.language import Fixed
from .box import Box
from .growth import Growth, arguments, growth, proved_box, sign_arguments
from .orbit_code import Code, Given, Round, field, sign, stages
from .registry import Formula, Node, register, shape

Stepped = tuple[Callable[..., Any], dict[str, Any], tuple[float, ...] | None]
"""Step ``f(w, c, ...)``, the values of its other parameters, and its own constant or None."""

Affine = tuple[np.ndarray, np.ndarray]

REPEAT = Count(1, "times that the step is taken in each round of an <orbit>", least=1, most=8)
ITERATIONS = Count(
    AUTO,
    'steps of the orbit; "auto": until one more moves most by less than 1/512 of the size',
    least=1,
    words=(AUTO,),
)
JULIA = Vector(
    None, "adds this point in each step instead of the start point: a Julia set", least=-100, most=100
)
OWN = {"iterations": ITERATIONS, "julia": JULIA, "repeat": REPEAT}
"""Parameters of every orbit."""


def orbit_step(node: Node) -> Stepped:
    own = {name: value for name, value in node.values.items() if name not in OWN}
    values = {name: Fixed(v) if isinstance(v, (int, str)) else v for name, v in own.items()}
    return node.formula.function, values, node["julia"]


def steps_of_round(node: Node) -> Iterator[tuple[Node, Affine | None]]:
    """Steps of a round, and the maps of the transforms around them."""
    if not node.children:
        yield node, None
        return
    for child in node.children:
        inner, linear, offset = child, np.eye(3), np.zeros(3)
        while inner.formula.name == "transform" and len(inner.children) == 1:
            (a, b), inner = affine(inner.values), inner.children[0]
            linear, offset = product(linear, a), product(linear, b) + offset
        moved = (linear != np.eye(3)).any() or offset.any()
        for _ in range(inner.values.get("repeat", 1)):
            yield inner, (linear, offset) if moved else None


def _step(node: Node, alone: bool) -> Stepped:
    function, values, constant = node.formula.hooks["step"](node)
    only = node.formula.hooks.get("alone") if alone else None
    return function, {**values, **(only(node) if only else {})}, constant


def steps(node: Node, alone: bool = True) -> tuple[Round, tuple[Given, ...]]:
    """Return the steps of a round as code, and the values that they take."""
    codes, given = list[Code](), list[Given]()
    for step, moved in steps_of_round(node):
        function, own, constant = _step(step, alone and step is node)
        fixed = tuple((name, v.value) for name, v in own.items() if isinstance(v, Fixed))
        passed = {name: v for name, v in own.items() if not isinstance(v, Fixed)}
        sizes = tuple((name, len(v) if isinstance(v, tuple) else 1) for name, v in passed.items())
        maps: tuple[Any, ...] = ()
        if moved:
            linear, offset = moved
            undone, spread = inverse(linear), stretches(linear)
            back = (*undone.ravel().tolist(), *(-product(undone, offset)).tolist())
            forth = (*linear.ravel().tolist(), *offset.tolist())
            maps = back, forth, float(spread[0] / spread[-1]), float(spread[-1])
        if constant is None and node["julia"] is not None:
            point = np.array(node["julia"])
            constant = tuple((product(undone, point - offset) if moved else point).tolist())
        given.append((tuple(passed.values()), constant or (), maps))
        codes.append(Code(function, sizes, fixed, constant is not None, moved is not None))
    return tuple(codes), tuple(given)


LIPSCHITZ = 2.0
"""Lipschitz bound of orbits of one step."""


class _Orbit(Formula):
    """Formula of hybrids, and the decorator of steps."""

    def __call__(self, *steps: Any, source: str | None = None, **values: Any) -> Any:
        """Make a hybrid of some steps, or register the escape-time fractal of a step ``f(w, c, ...)``.

        A step returns the next point from the last one, w, and a constant c: the start point, or that of a
        Julia set. It is written with arithmetic on points, the verbs of `fracslice.fields.orbits`, and on
        their coordinates, ``x, y, z = w``, with the vocabulary. A second returned value is its stretch by w,
        if the one derived from the text is not good enough. Everything else follows from the step: its
        derivative, the radius of escape, the box, the field, and the kernels.
        """
        if steps or source or not all(isinstance(kind, Parameter) for kind in values.values()):
            return super().__call__(*steps, source=source, **values)
        return _registered(values)


def _registered(parameters: dict[str, Any]) -> Callable[[Callable[..., Any]], Formula]:
    def decorate(step: Callable[..., Any]) -> Formula:
        formula = shape(lipschitz=LIPSCHITZ, exterior_only=True, **{**parameters, **OWN, **parameters})(step)
        formula.hooks.update(HOOKS, step=orbit_step)
        return formula

    return decorate


def growth_of(node: Node) -> Growth:
    """Growth of a node's orbits."""
    if known := node.formula.hooks.get("growth"):
        return Growth(**known(node))
    bound = growth(*steps(node, alone=False), rounds(node))
    if bound is None:
        raise node.fail("has orbits that do not escape: expected parameters that enlarge more")
    if not bound.fits:
        raise node.fail("has orbits that grow too fast to compute: expected smaller powers")
    return bound


def rounds(node: Node) -> int:
    """Return the number of rounds, 1 where it is automatic."""
    return 1 if node["iterations"] == AUTO else int(node["iterations"])


def single(node: Node) -> None:
    """Check that a node is not repeated; called where it is a solid of its own."""
    if node["repeat"] != 1:
        raise node.fail(f"repeat={node['repeat']}: expected it inside an <orbit>")


def orbit_bounds(node: Node) -> Box:
    if node.formula is not orbit:
        single(node)
    return Box.centred(*growth_of(node).half)


def orbit_arguments(node: Node) -> dict[str, object]:
    return arguments(growth_of(node), steps(node)[1], node["iterations"])


def orbit_sign(node: Node) -> tuple[Function, dict[str, object]] | None:
    code, given = steps(node)
    grown = growth_of(node)
    own = sign_arguments(grown, given, node["iterations"])
    return (sign(code, grown.scaled), own) if own else None


def orbit_proved_bounds(node: Node) -> Box:
    if "growth" in node.formula.hooks:
        return orbit_bounds(node)
    return proved_box(*steps(node), growth_of(node), rounds(node))


def escape_sign(node: Node, radius: float, escape2: float) -> tuple[Function, dict[str, object]]:
    """Function with the sign of an escape-time fractal's field, and its arguments.

    `escape2`: square of the radius where its orbits stop.
    """
    code, given = steps(node)
    own = {"iterations": node["iterations"], "limits": (1.0, radius**2), "given": given}
    return sign(code, False), {**own, "stops": (escape2,)}


def orbit_select(node: Node) -> Function:
    code = steps(node)[0]
    return field(code, growth_of(node).form(code, node.is_conservative))


def orbit_slope(node: Node) -> float:
    """Lipschitz bound: that of a constant stretch if it is proved, else a measured one.

    Of a field that stays below twice the sure distance, that is 2.
    """
    bound = growth_of(node)
    sure = bound.form(steps(node)[0], True).sure
    return float(bound.lipschitz or (LIPSCHITZ if sure else node.formula.lipschitz))


def orbit_proves_slope(node: Node) -> bool:
    return growth_of(node).lipschitz is not None


def orbit_steepening(node: Node) -> float:
    return max(2.0, float(growth_of(node).power))


def orbit_potential(node: Node) -> bool:
    """True if the field is that of a potential, far from its bound inside."""
    return bool(growth_of(node).by_power)


def _default(node: Node, name: str) -> Any:
    kind = node.formula.parameters.get(name)
    return kind.default if kind else None


def orbit_check(node: Node) -> None:
    """Refuse steps that are not in the language, elements without a step, and values of the whole in them."""
    for step, _ in steps_of_round(node):
        if "step" not in step.formula.hooks:
            raise step.fail("has no step: expected an escape-time fractal inside <orbit>, or one transformed")
        for name in ("iterations", "bailout"):
            if node is not step and step.values.get(name) != _default(step, name):
                raise step.fail(f"{name}={step[name]}: expected none inside <orbit>")
    stages(steps(node)[0])


HOOKS: dict[str, Callable[..., Any]] = {
    "bounds": orbit_bounds,
    "arguments": orbit_arguments,
    "select": orbit_select,
    "sign": orbit_sign,
    "proved_bounds": orbit_proved_bounds,
    "slope": orbit_slope,
    "proves_slope": orbit_proves_slope,
    "steepening": orbit_steepening,
    "potential": orbit_potential,
    "check": orbit_check,
}


def _hybrid(w, c):  # type: ignore[no-untyped-def]
    """A hybrid: the steps of several escape-time fractals in turn (Marczak 2010, Mandelbulber).

    A round takes the step of every element, `repeat` times each. A `transform` around an element is that of
    its step's coordinates; `julia` of an element is the constant of its step, in these coordinates. With one
    element it is that fractal, transformed. L = 2 or 3 is measured.
    """
    return w


_hybrid.__name__ = "orbit"
orbit = register(
    "shape",
    (1, None),
    {
        "iterations": Count(
            AUTO,
            'rounds of the orbit; "auto": until one more moves most by less than 1/512 of the size',
            least=1,
            words=(AUTO,),
        ),
        "julia": JULIA,
    },
    made=_Orbit,
    lipschitz=3.0,
    exterior_only=True,
)(_hybrid)
orbit.hooks.update(HOOKS)
