"""Registry of formulas. The scene reader, the kernels, the schema, the docs and the tests follow from it.

A *shape* is a distance field ``f(x, y, z, ...)``: negative inside, zero exactly on the surface. A *CSG
operator* combines the values of several fields into one. A *domain operator* chooses the points where its
child is evaluated; it is a function whose first argument is the child. All three are plain functions in the
vocabulary of `fracslice.expr.vocabulary`. A decorator turns one into a `Formula`, and calling a `Formula`
makes a `Node` of a scene tree.
"""

from __future__ import annotations

import sys
import traceback
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.util import module_from_spec, spec_from_file_location
from inspect import Signature
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Triangles
from ..common.parameters import REQUIRED, Parameter, python_name, validate_value
from ..errors import FracsliceError, FracsliceWarning, SceneError
from ..expr.language import Fixed as Fixed
from .box import Box
from .node import FORMULAS, bind_arguments, docstring, ordered_parameters, signature
from .node import Node as Node

Hook = Callable[..., Any]


def always_keeps_sign(_: Node) -> bool:
    """Hook `keeps_sign` of operators that keep it for all parameters."""
    return True


class Hooks:
    """Decorators that set the hooks of a formula. Each takes the function and returns it.

    Attributes
    ----------
    hooks : dict of str to callable
        Functions of a `Node` by the name of their decorator.
    """

    hooks: dict[str, Hook]

    def bounds(self, hook: Callable[[Node], Box]) -> Callable[[Node], Box]:
        """Set the hook that returns a box enclosing the inside. Without it, the solid counts as unbounded."""
        return self._hook("bounds", hook)

    def slope(self, hook: Callable[[Node], float]) -> Callable[[Node], float]:
        """Set the hook that returns the Lipschitz bound, where it depends on parameters or children."""
        return self._hook("slope", hook)

    def proves_slope(self, hook: Callable[[Node], bool]) -> Callable[[Node], bool]:
        """Set the hook that returns True if the Lipschitz bound of an escape-time fractal is a theorem."""
        return self._hook("proves_slope", hook)

    def steepening(self, hook: Callable[[Node], float]) -> Callable[[Node], float]:
        """Set the hook that returns `Bounds.steepening`, where it is not the maximum of the children's."""
        return self._hook("steepening", hook)

    def potential(self, hook: Callable[[Node], bool]) -> Callable[[Node], bool]:
        """Set the hook that returns True if the field is that of a potential, where it depends on parameters.

        By default it is one for every escape-time fractal.
        """
        return self._hook("potential", hook)

    def arguments(self, hook: Callable[[Node], dict[str, Any]]) -> Callable[[Node], dict[str, Any]]:
        """Set the hook that returns the arguments after points or values, if they are not the parameters."""
        return self._hook("arguments", hook)

    def select(self, hook: Callable[[Node], Callable[..., Any]]) -> Callable[[Node], Callable[..., Any]]:
        """Set the hook that selects another function for a node that needs less or different code."""
        return self._hook("select", hook)

    def sign(self, hook: Callable[[Node], tuple[Callable[..., Any], dict[str, Any]] | None]) -> Hook:
        """Set the hook that returns a function with the sign of the field, which intervals enclose more
        tightly, and its arguments; or None.
        """
        return self._hook("sign", hook)

    def proved_bounds(self, hook: Callable[[Node], Box]) -> Callable[[Node], Box]:
        """Set the hook that returns a box proved to enclose the inside, if that of `bounds` is measured."""
        return self._hook("proved_bounds", hook)

    def keeps_sign(self, hook: Callable[[Node], bool]) -> Callable[[Node], bool]:
        """Set the hook that returns True if the sign of an operator's field depends on the signs of its
        elements' fields alone.
        """
        return self._hook("keeps_sign", hook)

    def identity(self, hook: Callable[[Node], bool]) -> Callable[[Node], bool]:
        """Set the hook that returns True if the node changes nothing and can be left out."""
        return self._hook("identity", hook)

    def unordered(self, hook: Callable[[Node], bool]) -> Callable[[Node], bool]:
        """Set the hook that returns True if all elements of a CSG operator but the first may be folded in any
        order, to the same bits.
        """
        return self._hook("unordered", hook)

    def step(self, hook: Callable[[Node], tuple[Any, ...]]) -> Callable[[Node], tuple[Any, ...]]:
        """Set the hook that returns the step of an escape-time fractal, see `orbits.Stepped`."""
        return self._hook("step", hook)

    def alone(self, hook: Callable[[Node], dict[str, Any]]) -> Callable[[Node], dict[str, Any]]:
        """Set the hook that returns the values of a step's parameters that differ outside of hybrids."""
        return self._hook("alone", hook)

    def growth(self, hook: Callable[[Node], dict[str, Any]]) -> Callable[[Node], dict[str, Any]]:
        """Set the hook that returns the attributes of `fields.growth.Growth`, where they are known."""
        return self._hook("growth", hook)

    def visible(self, hook: Callable[[Node, float], Node]) -> Callable[[Node, float], Node]:
        """Set the hook that returns the node without detail finer than a voxel size in its own units."""
        return self._hook("visible", hook)

    def triangles(self, hook: Callable[[Node], Triangles | None]) -> Callable[[Node], Triangles | None]:
        """Set the hook that returns the triangles that are the whole surface, in scene units, or None."""
        return self._hook("triangles", hook)

    def tips(self, hook: Callable[[Node], NDArray[np.float64] | None]) -> Hook:
        """Set the hook that returns the outermost points of a shape, as `Field.tips`, or None."""
        return self._hook("tips", hook)

    def completed(self, hook: Callable[[dict[str, Any]], dict[str, Any]]) -> Hook:
        """Set the hook that returns the values with those that they imply."""
        return self._hook("completed", hook)

    def check(self, hook: Callable[[Node], None]) -> Callable[[Node], None]:
        """Set the hook that raises `SceneError` for values that are valid alone but not together."""
        return self._hook("check", hook)

    def _hook(self, name: str, hook: Hook) -> Hook:
        self.hooks[name] = hook
        return hook


Kind = Literal["shape", "csg", "domain"]

DEEPEST = 100
"""Maximum nesting of elements: far above any use, far below Python's recursion limit."""

TOO_DEEP = f"is nested too deeply: expected at most {DEEPEST} elements inside each other"


@dataclass(frozen=True, eq=False, repr=False)
class Formula(Hooks):
    """A registered formula.

    Attributes
    ----------
    name : str
        Name of the element in a scene file.
    kind : {"shape", "csg", "domain"}
        Shape, CSG operator or domain operator.
    function : callable
        The function to compile.
    parameters : mapping of str to Parameter
        Kinds of the parameters by name.
    children : (int, int or None)
        Minimum and maximum number of elements inside; None: any number.
    lipschitz : float
        Lipschitz bound of a shape; of an operator, the minimum.
    exterior_only : bool
        True for an escape-time fractal, see `Bounds`.
    hooks : dict of str to callable
        Functions of a `Node` that supply its box, bounds and kernel arguments.
    steps : int
        Number of the first elements that are steps of an orbit, not fields.
    """

    name: str
    kind: Kind
    function: Callable[..., Any]
    parameters: Mapping[str, Parameter]
    children: tuple[int, int | None] = (0, 0)
    lipschitz: float = 1.0
    exterior_only: bool = False
    hooks: dict[str, Hook] = field(default_factory=dict)
    steps: int = 0

    def __post_init__(self) -> None:
        for name, value in (
            ("__name__", self.name),
            ("__qualname__", self.name),
            ("__module__", self.function.__module__),
            ("__doc__", docstring(self)),
        ):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name}{signature(self, Node)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return get, (self.name,)

    @cached_property
    def names(self) -> Mapping[str, str]:
        """Parameter names by their names in Python, in the order of positional arguments."""
        return MappingProxyType({python_name(name): name for name in ordered_parameters(self)})

    @property
    def __signature__(self) -> Signature:
        """Signature of the formula as a Python function."""
        return signature(self, Node)

    def __call__(self, *arguments: Any, source: str | None = None, **keywords: Any) -> Node:
        """Make a scene node.

        Parameters
        ----------
        *arguments
            Values of a shape in order; for other formulas, the elements inside.
        source : str, optional
            "file:line" of the element.
        **keywords
            Parameter values by name.

        Returns
        -------
        Node

        Raises
        ------
        SceneError
            For an invalid value, an unknown name or a wrong number of elements.
        """
        elements, values = bind_arguments(self, arguments, keywords)
        checked = {name: self._value(name, values.get(name)) for name in self.parameters}
        return self.of_checked(checked, elements, source)

    def of_checked(
        self, values: Mapping[str, Any], elements: Sequence[Node] = (), source: str | None = None
    ) -> Node:
        """Make a scene node of values that the kinds of its parameters have checked.

        Parameters
        ----------
        values : mapping of str to value
            Parameter values by name; defaults may be left out.
        elements : sequence of Node
            The elements inside.
        source : str, optional
            "file:line" of the element.

        Returns
        -------
        Node

        Raises
        ------
        SceneError
            For values that are invalid together, or a wrong number of elements.
        """
        whole = {**self._defaults, **values}
        if completed := self.hooks.get("completed"):
            whole = completed(whole)
        node = Node(self, MappingProxyType(whole), self._grouped(elements), source)
        if node.depth > DEEPEST:
            raise node.fail(TOO_DEEP)
        if check := self.hooks.get("check"):
            check(node)
        return node

    @cached_property
    def _defaults(self) -> Mapping[str, Any]:
        """Default values of the parameters by name."""
        return {name: kind.default for name, kind in self.parameters.items()}

    def _value(self, name: str, value: Any) -> Any:
        kind = self.parameters[name]
        if value is None:
            if kind.default is REQUIRED:
                raise SceneError(f"<{self.name}> needs {name}: expected {kind.expects}")
            return kind.default
        return validate_value(name, value, kind, lambda message: SceneError(f"<{self.name}> {message}"))

    def _grouped(self, children: Sequence[Node]) -> tuple[Node, ...]:
        least, most = self.children
        for child in children:
            if not isinstance(child, Node):
                raise SceneError(
                    f"<{self.name}> takes elements such as sphere() inside it, found {child!r:.60}"
                )
        if len(children) < least or (most == 0 and children):
            wanted = "no elements" if most == 0 else f"at least {least} element{'s' if least > 1 else ''}"
            raise SceneError(f"<{self.name}> takes {wanted} inside it, found {len(children)}")
        if most is not None and len(children) > most:
            return (*children[: most - 1], get("union")(*children[most - 1 :]))
        return tuple(children)

    @property
    def doc(self) -> str:
        """Docstring of the function."""
        return (self.function.__doc__ or "").strip()


def shape(
    lipschitz: float = 1.0, exterior_only: bool = False, **parameters: Parameter
) -> Callable[..., Formula]:
    """Register a shape ``f(x, y, z, ...)`` under the function's name.

    Parameters
    ----------
    lipschitz : float
        Lipschitz bound of the field.
    exterior_only : bool
        True for an escape-time fractal, see `Bounds`.
    **parameters : Parameter
        Kinds of the parameters by name.

    Returns
    -------
    callable
        Decorator that turns the function into a `Formula`.

    Raises
    ------
    SceneError
        If another formula has this name.
    """
    return register("shape", (0, 0), parameters, lipschitz=lipschitz, exterior_only=exterior_only)


def csg_operator(children: tuple[int, int | None], **parameters: Parameter) -> Callable[..., Formula]:
    """Register a CSG operator: ``f(a, ...)`` of one child's values, or ``f(a, b, ...)`` that folds several.

    Parameters
    ----------
    children : (int, int or None)
        Minimum and maximum number of elements; None: any number.
    **parameters : Parameter
        Kinds of the parameters by name.

    Returns
    -------
    callable
        Decorator that turns the function into a `Formula`.

    Raises
    ------
    SceneError
        If another formula has this name.
    """
    return register("csg", children, parameters)


def domain_operator(**parameters: Parameter) -> Callable[..., Formula]:
    """Register a domain operator ``f(child, x, y, z, ...)``, which calls ``child(x, y, z)``.

    Parameters
    ----------
    **parameters : Parameter
        Kinds of the parameters by name.

    Returns
    -------
    callable
        Decorator that turns the function into a `Formula`.

    Raises
    ------
    SceneError
        If another formula has this name.
    """
    return register("domain", (1, 1), parameters)


Made = TypeVar("Made", bound=Formula)


def register(
    kind: Kind,
    children: tuple[int, int | None],
    parameters: dict[str, Parameter],
    made: type[Made] = Formula,  # type: ignore[assignment]
    **known: Any,
) -> Callable[[Callable[..., Any]], Made]:
    """Return a decorator that makes a formula of a function and registers it."""

    def decorate(function: Callable[..., Any]) -> Made:
        name = function.__name__.rstrip("_")
        formula = made(name, kind, function, MappingProxyType(parameters), children, **known)
        if name in FORMULAS and not _is_run_again(FORMULAS[name].function, function):
            code = function.__code__
            raise SceneError(
                f"{code.co_filename}:{code.co_firstlineno}: formula {name!r}: expected another name, "
                f"there is one of this name already"
            )
        FORMULAS[name] = formula
        return formula

    return decorate


def _is_run_again(old: Callable[..., Any], new: Callable[..., Any]) -> bool:
    """True if both are from `__main__`: a notebook cell that was edited and run again."""
    return new.__module__ == old.__module__ == "__main__"


def get(name: str) -> Formula:
    """Look up a formula.

    Parameters
    ----------
    name : str
        Name of the formula.

    Returns
    -------
    Formula

    Raises
    ------
    KeyError
        If there is no formula of this name.
    """
    return FORMULAS[name]


def names() -> list[str]:
    """Names of all formulas, sorted; see `get`."""
    return sorted(FORMULAS)


GROUP = "fracslice.formulas"
"""Group of entry points: each names a module that registers formulas."""

_FILES: dict[str, Path] = {}


def run_file(path: str) -> list[Formula]:
    """Run a Python file that registers formulas, once."""
    file = Path(path).resolve()
    module = f"formulas of {file}"
    if module not in _FILES:
        spec = spec_from_file_location(module, file)
        if spec is None or spec.loader is None or not file.is_file():
            raise SceneError(f"{path}: expected a Python file of formulas")
        loaded = sys.modules[module] = module_from_spec(spec)
        try:
            spec.loader.exec_module(loaded)
        except FracsliceError:
            raise
        except Exception as error:
            lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__, None)]
            line = getattr(error, "lineno", None) or lines[-1]
            raise SceneError(f"{path}:{line}: {type(error).__name__}: {error}") from error
        _FILES[module] = file
    return [formula for formula in map(get, names()) if formula.function.__module__ == module]


@cache
def load_installed() -> None:
    """Load the formulas of installed packages; warn of a module that cannot be loaded."""
    from importlib.metadata import entry_points  # imports an e-mail parser

    for entry in entry_points(group=GROUP):
        try:
            entry.load()
        except Exception as error:
            message = f"formulas of {entry.value} are left out: {type(error).__name__}: {error}"
            warnings.warn(message, FracsliceWarning, stacklevel=2)


def origin(formula: Formula) -> str:
    """Place that a formula is from: a package, or a file of the user."""
    module = formula.function.__module__
    return str(_FILES.get(module, module.partition(".")[0]))
