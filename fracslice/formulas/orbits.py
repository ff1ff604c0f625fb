"""Escape-time fractals from their step, and hybrids: rounds of several steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..providers import provider
from .box import Box
from .parameters import AUTO, Count, Parameter
from .registry import Formula, Node, register, shape
from .rounds import JULIA, OWN, orbit_step, steps, taken

Growth = Any
"""`kernel.growth.Growth`, a layer above."""

LIPSCHITZ = 2.0
"""Lipschitz bound of orbits of one step."""


class _Orbit(Formula):
    """Formula of hybrids, and the decorator of steps."""

    def __call__(self, *steps: Any, place: str | None = None, **values: Any) -> Any:
        """Make a hybrid of some steps, or register the escape-time fractal of a step ``f(w, c, ...)``.

        A step returns the next point from the last one, w, and a constant c: the start point, or that of a
        Julia set. It is written with arithmetic on points, the verbs of `fracslice.formulas.verbs`, and on
        their coordinates, ``x, y, z = w``, with the vocabulary. A second returned value is its stretch by w,
        if the one derived from the text is not good enough. Everything else follows from the step: its
        derivative, the radius of escape, the box, the field, and the kernels.

        Parameters
        ----------
        *steps : Node
            Escape-time fractals whose steps are taken in turn; none for the decorator.
        place : str, optional
            "file:line" of the element.
        **values
            Of a hybrid: its parameters. Of the decorator: kinds of the step's parameters by name; `Count` and
            `Choice` are compiled into the kernel.

        Returns
        -------
        Node or callable
            Hybrid, or the decorator that turns a step into a `Formula`.

        Raises
        ------
        SceneError
            If an element has no step, a value is invalid, or another formula has this name.
        """
        if steps or place or not all(isinstance(kind, Parameter) for kind in values.values()):
            return super().__call__(*steps, place=place, **values)
        return _registered(values)


def _registered(parameters: dict[str, Any]) -> Callable[[Callable[..., Any]], Formula]:
    def decorate(step: Callable[..., Any]) -> Formula:
        formula = shape(lipschitz=LIPSCHITZ, exterior_only=True, **{**parameters, **OWN, **parameters})(step)
        formula.hooks.update(HOOKS, step=orbit_step)
        return formula

    return decorate


def grown(node: Node) -> Growth:
    """`kernel.growth.Growth` of a node's orbits.

    Raises
    ------
    SceneError
        If they do not escape, or grow too fast to compute.
    """
    if known := node.formula.hooks.get("growth"):
        return provider("growth").Growth(**known(node))
    made, values = steps(node, alone=False)
    bound = provider("growth").growth(made, tuple(values.items()), rounds(node))
    if bound is None:
        raise node.fail("has orbits that do not escape: expected parameters that enlarge more")
    if not bound.fits:
        raise node.fail("has orbits that grow too fast to compute: expected smaller powers")
    return bound


def rounds(node: Node) -> int:
    """Return the number of rounds, 1 where it is automatic.

    Parameters
    ----------
    node : Node
        Orbit.
    """
    return 1 if node["iterations"] == AUTO else int(node["iterations"])


def single(node: Node) -> None:
    """Check that a node is not repeated; called where it is a solid of its own.

    Parameters
    ----------
    node : Node
        Escape-time fractal.

    Raises
    ------
    SceneError
        If `repeat` is not 1.
    """
    if node["repeat"] != 1:
        raise node.fail(f"repeat={node['repeat']}: expected it inside an <orbit>")


def orbit_bounds(node: Node) -> Box:
    if node.formula is not orbit:
        single(node)
    return Box.centred(*grown(node).half)


def orbit_arguments(node: Node) -> dict[str, object]:
    made, values = steps(node)
    own = {**provider("growth").arguments(made, grown(node), node["iterations"]), **values}
    code = orbit_select(node).__code__
    return {name: own[name] for name in code.co_varnames[3 : code.co_argcount]}


def orbit_sign(node: Node) -> tuple[Callable[..., Any], dict[str, object]] | None:
    code, values = steps(node)
    grown_by = grown(node)
    own = provider("orbit_signs").sign_arguments(code, grown_by, node["iterations"])
    return (provider("orbit_signs").sign(code, grown_by.scaled), {**own, **values}) if own else None


def orbit_proved_bounds(node: Node) -> Box:
    if "growth" in node.formula.hooks:
        return orbit_bounds(node)
    code, values = steps(node)
    box: Box = provider("orbit_signs").proved_box(code, tuple(values.items()), grown(node), rounds(node))
    return box


def escape_sign(node: Node, radius: float, escape2: float) -> tuple[Callable[..., Any], dict[str, object]]:
    """Function with the sign of an escape-time fractal's field, and its arguments.

    Parameters
    ----------
    node : Node
        Escape-time fractal with a step.
    radius : float
        Bailout radius.
    escape2 : float
        Square of the radius where its orbits stop, which is not smaller.

    Returns
    -------
    (callable, dict)
    """
    code, values = steps(node)
    own = {"iterations": node["iterations"], "radius2": radius**2, "stop0": escape2}
    return provider("orbit_signs").sign(code, False), {**own, **values}


def orbit_select(node: Node) -> Callable[..., Any]:
    code = steps(node)[0]
    function: Callable[..., Any] = provider("orbits").field(
        code, grown(node).form(code, node.is_conservative)
    )
    return function


def orbit_slope(node: Node) -> float:
    """Lipschitz bound: that of a constant stretch if it is proved, else a measured one.

    Of a field that stays below twice the sure distance, that is 2.
    """
    bound = grown(node)
    sure = bound.form(steps(node)[0], True).sure
    return float(bound.lipschitz or (LIPSCHITZ if sure else node.formula.lipschitz))


def orbit_proves_slope(node: Node) -> bool:
    return grown(node).lipschitz is not None


def orbit_steepening(node: Node) -> float:
    return max(2.0, float(grown(node).power))


def orbit_potential(node: Node) -> bool:
    """True if the field is that of a potential, far from its bound inside."""
    return bool(grown(node).by_power)


def _default(node: Node, name: str) -> Any:
    kind = node.formula.parameters.get(name)
    return kind.default if kind else None


def orbit_check(node: Node) -> None:
    """Refuse steps that are not in the language, elements without a step, and values of the whole in them."""
    for step, _ in taken(node):
        if "step" not in step.formula.hooks:
            raise step.fail("has no step: expected an escape-time fractal inside <orbit>, or one transformed")
        for name in ("iterations", "bailout"):
            if node is not step and step.values.get(name) != _default(step, name):
                raise step.fail(f"{name}={step[name]}: expected none inside <orbit>")
    for place, code in enumerate(steps(node)[0]):
        code.traced(place)


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
