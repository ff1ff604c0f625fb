"""One formula, one registration: the scene reader, the kernels, the schema, the docs and the tests follow
from it.

A *shape* is a distance field ``f(x, y, z, ...)``: negative inside, zero exactly on the surface. A *blend*
makes one field of the values of others. A *warp* decides at which points its child is evaluated; it is
written as a function whose first argument is the child. All three are plain functions in the words of
`fracslice.formulas.vocabulary`; decorating one makes it a `Formula`, and calling a `Formula` makes a `Node`
of a scene tree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal

from ..errors import SceneError
from .box import Box
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


@dataclass(frozen=True)
class Bounds:
    """What is known of a field without evaluating it.

    box: encloses all points where the field is negative, in the node's own coordinates.
    lipschitz: L such that ``|f(p) - f(q)| <= L |p - q|``. With `exterior_only`: a point outside is at
    least ``f(p) / L`` away from the surface.
    exterior_only: an escape-time fractal is part of the field. Its inside values bound no distance: the
    inside cannot be recognised from afar.
    steepening: of such a field, the highest power n in it. Along circles of latitude the derivative changes
    n times within 2/n of the poles; so level sets other than the surface are steeper: how much is measured
    (`docs/accuracy.md`).
    boxless: the names of the formulas in it that state no box.
    """

    box: Box
    lipschitz: float
    exterior_only: bool
    steepening: float = 0.0
    boxless: tuple[str, ...] = ()


Hook = Callable[..., Any]


@dataclass(eq=False)
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

    def __call__(self, *children: Node, place: str | None = None, **values: Any) -> Node:
        """A scene node. Raises `SceneError` if a value or the number of children is not possible."""
        unknown = sorted(set(values) - set(self.parameters))
        if unknown:
            raise SceneError(f"<{self.name}> has no attribute {unknown[0]!r}")
        checked = {name: self._value(name, values.get(name)) for name in self.parameters}
        node = Node(self, MappingProxyType(checked), self._grouped(children), place)
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


@dataclass(frozen=True)
class Node:
    """A formula with its parameters and children: one element of a scene. `place` is "file:line";
    `is_conservative` is set by `conservative`; `depth` counts nested elements, this one included.
    """

    formula: Formula
    values: Mapping[str, Any]
    children: tuple[Node, ...] = ()
    place: str | None = field(default=None, compare=False)
    is_conservative: bool = False
    depth: int = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth", 1 + max((child.depth for child in self.children), default=0))

    def __getitem__(self, parameter: str) -> Any:
        return self.values[parameter]

    def __repr__(self) -> str:
        changed = [f"{k}={v!r}" for k, v in self.values.items() if v != self.formula.parameters[k].default]
        return f"{self.formula.name}({', '.join([*map(repr, self.children), *changed])})"

    def __hash__(self) -> int:
        return hash((self.formula.name, tuple(self.values.items()), self.children))

    def walk(self) -> Iterator[Node]:
        """This node and all below it, parents first."""
        left = [self]
        while left:
            node = left.pop()
            yield node
            left += reversed(node.children)

    def changed(self, children: tuple[Node, ...] | None = None, **values: Any) -> Node:
        """A copy with other values or children."""
        kept = self.children if children is None else children
        return self.formula(*kept, place=self.place, **{**_given(self), **values})

    def conservative(self) -> Node:
        """The scene by whose field space may be skipped, where its own exceeds its bound: beside the tears of
        powers that are not whole, and at seams with an escape-time fractal. Only its positive values say
        something: as much, divided by its own Lipschitz bound, is the distance from the surface at least.
        """
        return replace(
            self, is_conservative=True, children=tuple(child.conservative() for child in self.children)
        )

    def fail(self, message: str) -> SceneError:
        """The error to raise about this node: file, line and element, then `message`."""
        return SceneError(f"{self.place + ': ' if self.place else ''}<{self.formula.name}> {message}")

    @cached_property
    def bounds(self) -> Bounds:
        """Box, Lipschitz bound and weakness of this field."""
        hooks, below = self.formula.hooks, [child.bounds for child in self.children]
        box = hooks["bounds"](self) if "bounds" in hooks else Box.everywhere()
        slope = (
            hooks["slope"](self)
            if "slope" in hooks
            else max([self.formula.lipschitz, *(b.lipschitz for b in below)])
        )
        steepening = (
            hooks["steepening"](self)
            if "steepening" in hooks
            else max((b.steepening for b in below), default=0.0)
        )
        names = [*(n for b in below for n in b.boxless), *([] if "bounds" in hooks else [self.formula.name])]
        exterior_only = self.formula.exterior_only or any(b.exterior_only for b in below)
        return Bounds(box, slope, exterior_only, steepening, tuple(dict.fromkeys(names)))

    @property
    def arguments(self) -> dict[str, Any]:
        """What the kernel's function is called with: numbers, tuples of numbers, or `Fixed`."""
        hook = self.formula.hooks.get("arguments")
        return hook(self) if hook else dict(self.values)

    @property
    def function(self) -> Callable[..., Any]:
        """The function to compile for this node."""
        hook = self.formula.hooks.get("select")
        return hook(self) if hook else self.formula.function

    def visible(self, voxel: float) -> Node:
        """This node without detail that a voxel, in its own units, is too large for; its children as they
        are.
        """
        hook = self.formula.hooks.get("visible")
        return hook(self, voxel) if hook else self

    @property
    def is_identity(self) -> bool:
        hook = self.formula.hooks.get("identity")
        return bool(hook and hook(self))

    @property
    def is_unordered(self) -> bool:
        hook = self.formula.hooks.get("unordered")
        return bool(hook and hook(self))


def _given(node: Node) -> dict[str, Any]:
    return {name: value for name, value in node.values.items() if value is not None}


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
