"""One formula, one registration: the scene reader, the kernels, the schema, the docs and the tests follow
from it.

A *shape* is a distance field ``f(x, y, z, ...)``: negative inside, zero exactly on the surface. A *blend*
makes one field of the values of others. A *warp* decides at which points its child is evaluated; it is
written as a function whose first argument is the child. All three are plain functions in the words of
`fracslice.formulas.vocabulary`; decorating one makes it a `Formula`, and calling a `Formula` makes a `Node`
of a scene tree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from inspect import Signature
from types import MappingProxyType
from typing import Any, Literal

from ..errors import SceneError
from . import signatures
from .box import Box
from .node import Node as Node
from .parameters import REQUIRED, Parameter, validated

Kind = Literal["shape", "csg", "domain"]

DEEPEST = 100
"""How deep elements may be nested: far above any use, far below Python's limit on recursion."""

TOO_DEEP = f"is nested too deeply: expected at most {DEEPEST} elements inside each other"


@dataclass(frozen=True)
class Fixed:
    """An argument that is compiled into the kernel instead of being passed to it: it changes which code is
    needed.
    """

    value: Any


Hook = Callable[..., Any]


@dataclass(frozen=True, eq=False, repr=False)
class Formula:
    """A registered formula. Its hooks take a `Node` and tell what the kernel and the sampler need to know."""

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
        return f"<{self.kind} {self.name}{signatures.signature(self)}>"

    @cached_property
    def names(self) -> Mapping[str, str]:
        """The parameters by their names in Python, in the order of positional arguments."""
        return MappingProxyType({signatures.python_name(name): name for name in signatures.ordered(self)})

    @property
    def __signature__(self) -> Signature:
        return signatures.signature(self)

    def __call__(self, *arguments: Any, place: str | None = None, **keywords: Any) -> Node:
        """A scene node. Raises `SceneError` if a value or the number of elements is not possible.

        arguments: the elements inside it, or a shape's values in order.
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

    # The hooks, set by decorating a function with them.
    def bounds(self, hook: Callable[[Node], Box]) -> Callable[[Node], Box]:
        """The box that encloses the inside; without one nothing is known of it, and it has no end."""
        return self._hook("bounds", hook)

    def slope(self, hook: Callable[[Node], float]) -> Callable[[Node], float]:
        """The Lipschitz bound, where it depends on parameters or children."""
        return self._hook("slope", hook)

    def steepening(self, hook: Callable[[Node], float]) -> Callable[[Node], float]:
        """`Bounds.steepening`, where it is not the largest of the children's."""
        return self._hook("steepening", hook)

    def arguments(self, hook: Callable[[Node], dict[str, Any]]) -> Callable[[Node], dict[str, Any]]:
        """The function's arguments after points or values, where they are not the parameters themselves."""
        return self._hook("arguments", hook)

    def select(self, hook: Callable[[Node], Callable[..., Any]]) -> Callable[[Node], Callable[..., Any]]:
        """Another function for these parameters, when they need less or different code."""
        return self._hook("select", hook)

    def identity(self, hook: Callable[[Node], bool]) -> Callable[[Node], bool]:
        """True if the node changes nothing and can be left out."""
        return self._hook("identity", hook)

    def unordered(self, hook: Callable[[Node], bool]) -> Callable[[Node], bool]:
        """True if the elements of a blend but the first may be folded in any order, to the same bits."""
        return self._hook("unordered", hook)

    def visible(self, hook: Callable[[Node, float], Node]) -> Callable[[Node, float], Node]:
        """The node with no more detail than voxels of a size in its own units can show."""
        return self._hook("visible", hook)

    def check(self, hook: Callable[[Node], None]) -> Callable[[Node], None]:
        """Raises `SceneError` for values that are possible alone but not together."""
        return self._hook("check", hook)

    def _hook(self, name: str, hook: Hook) -> Hook:
        self.hooks[name] = hook
        return hook

    @property
    def doc(self) -> str:
        return (self.function.__doc__ or "").strip()


_REGISTRY: dict[str, Formula] = {}


def shape(
    lipschitz: float = 1.0, exterior_only: bool = False, **parameters: Parameter
) -> Callable[..., Formula]:
    """Registers ``f(x, y, z, ...)`` under the function's name."""
    return _register("shape", (0, 0), parameters, lipschitz=lipschitz, exterior_only=exterior_only)


def csg_operator(children: tuple[int, int | None], **parameters: Parameter) -> Callable[..., Formula]:
    """Registers ``f(a, ...)`` of one child's values, or ``f(a, b, ...)`` that folds the values of several."""
    return _register("csg", children, parameters)


def domain_operator(**parameters: Parameter) -> Callable[..., Formula]:
    """Registers ``f(child, x, y, z, ...)``, which calls ``child(x, y, z)``."""
    return _register("domain", (1, 1), parameters)


def _register(
    kind: Kind, children: tuple[int, int | None], parameters: dict[str, Parameter], **known: Any
) -> Callable[..., Formula]:
    def decorate(function: Callable[..., Any]) -> Formula:
        name = function.__name__.rstrip("_")
        formula = Formula(name, kind, function, MappingProxyType(parameters), children, **known)
        if name in _REGISTRY and not _is_run_again(_REGISTRY[name].function, function):
            code = function.__code__
            raise SceneError(
                f"{code.co_filename}:{code.co_firstlineno}: formula {name!r}: expected another name, "
                f"there is one of this name already"
            )
        _REGISTRY[name] = formula
        return formula

    return decorate


def _is_run_again(old: Callable[..., Any], new: Callable[..., Any]) -> bool:
    """Whether it is a cell of a notebook, edited and run once more."""
    return new.__module__ == old.__module__ == "__main__"


def get(name: str) -> Formula:
    """The formula called `name`; `KeyError` if there is none."""
    return _REGISTRY[name]


def names() -> list[str]:
    """The names of all formulas, sorted."""
    return sorted(_REGISTRY)
