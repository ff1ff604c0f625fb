"""Registry of formulas. The scene reader, the kernels, the schema, the docs and the tests follow from it.

A *shape* is a distance field ``f(x, y, z, ...)``: negative inside, zero exactly on the surface. A *CSG
operator* combines the values of several fields into one. A *domain operator* chooses the points where its
child is evaluated; it is a function whose first argument is the child. All three are plain functions in the
vocabulary of `fracslice.formulas.vocabulary`. A decorator turns one into a `Formula`, and calling a `Formula`
makes a `Node` of a scene tree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from inspect import Signature
from types import MappingProxyType
from typing import Any, Literal, TypeVar

from ..errors import SceneError
from . import signatures
from .catalogue import FORMULAS
from .fixed import Fixed as Fixed
from .hooks import Hook, Hooks
from .node import Node as Node
from .parameters import REQUIRED, Parameter
from .records import validated

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
    """

    name: str
    kind: Kind
    function: Callable[..., Any]
    parameters: Mapping[str, Parameter]
    children: tuple[int, int | None] = (0, 0)
    lipschitz: float = 1.0
    exterior_only: bool = False
    hooks: dict[str, Hook] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, value in (
            ("__name__", self.name),
            ("__qualname__", self.name),
            ("__module__", self.function.__module__),
            ("__doc__", signatures.docstring(self)),
        ):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name}{signatures.signature(self, Node)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return get, (self.name,)

    @cached_property
    def names(self) -> Mapping[str, str]:
        """Parameter names by their names in Python, in the order of positional arguments."""
        return MappingProxyType({signatures.python_name(name): name for name in signatures.ordered(self)})

    @property
    def __signature__(self) -> Signature:
        """Signature of the formula as a Python function."""
        return signatures.signature(self, Node)

    def __call__(self, *arguments: Any, place: str | None = None, **keywords: Any) -> Node:
        """Make a scene node.

        Parameters
        ----------
        *arguments
            Values of a shape in order; for other formulas, the elements inside.
        place : str, optional
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
        elements, values = signatures.bound(self, arguments, keywords)
        checked = {name: self._value(name, values.get(name)) for name in self.parameters}
        node = Node(self, MappingProxyType(checked), self._grouped(elements), place)
        if node.depth > DEEPEST:
            raise node.fail(TOO_DEEP)
        self.hooks.get("check", lambda _: None)(node)
        return node

    def _value(self, name: str, value: Any) -> Any:
        kind = self.parameters[name]
        if value is None:
            if kind.default is REQUIRED:
                raise SceneError(f"<{self.name}> needs {name}: expected {kind.expects}")
            return kind.default
        return validated(name, value, kind, lambda message: SceneError(f"<{self.name}> {message}"))

    def _grouped(self, children: tuple[Node, ...]) -> tuple[Node, ...]:
        least, most = self.children
        for child in children:
            if not isinstance(child, Node):
                raise SceneError(
                    f"<{self.name}> takes elements such as sphere() inside it, found {child!r:.60}"
                )
        if len(children) < least or (most == 0 and children):
            wanted = "no elements" if most == 0 else f"at least {least} element{'s' if least > 1 else ''}"
            raise SceneError(f"<{self.name}> takes {wanted} inside it, found {len(children)}")
        if most == 1 and len(children) > 1:
            return (get("union")(*children),)
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
    """Return a decorator that makes a formula of a function and registers it.

    Parameters
    ----------
    kind : {"shape", "csg", "domain"}
        Kind of the formula.
    children : (int, int or None)
        Minimum and maximum number of elements; None: any number.
    parameters : dict of str to Parameter
        Kinds of the parameters by name.
    made : type, optional
        Class of the formula.
    **known
        Other attributes of the formula.

    Raises
    ------
    SceneError
        If another formula has this name.
    """

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
