"""An element of a scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ..errors import SceneError
from ..providers import provider
from . import signatures
from .box import Box
from .field import Bounds, Cells, Device, Field, Kernel, Loops, Precision
from .operators import Operators

if TYPE_CHECKING:
    from .registry import Formula


@dataclass(frozen=True)
class Node(Operators, Field):
    """A formula with its parameters and children: one element of a scene.

    Attributes
    ----------
    formula : Formula
        The registered formula.
    values : mapping of str to value
        Parameter values by name.
    children : tuple of Node
        The elements inside.
    place : str or None
        "file:line" of the element in its scene file.
    is_conservative : bool
        True for a tree made by `conservative`.
    depth : int
        Levels of nesting, this element included.
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
        """Value of a parameter."""
        return self.values[parameter]

    def __repr__(self) -> str:
        kinds, name = self.formula.parameters, signatures.python_name
        changed = [f"{name(k)}={v!r}" for k, v in self.values.items() if v != kinds[k].default]
        return f"{self.formula.name}({', '.join([*map(repr, self.children), *changed])})"

    def __hash__(self) -> int:
        return hash((self.formula.name, tuple(self.values.items()), self.children))

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.formula, dict(self.values), self.children, self.place, self.is_conservative)

    def walk(self) -> Iterator[Node]:
        """Iterate over this node and all below it, parents first.

        Yields
        ------
        Node
        """
        left = [self]
        while left:
            node = left.pop()
            yield node
            left += reversed(node.children)

    @property
    def fields(self) -> tuple[Node, ...]:
        """Children whose fields this one is made of; those of a hybrid are steps, not fields."""
        return () if self.formula.kind == "shape" else self.children

    def solids(self) -> Iterator[Node]:
        """Iterate over this node and all fields below it, parents first.

        Yields
        ------
        Node
        """
        left = [self]
        while left:
            node = left.pop()
            yield node
            left += reversed(node.fields)

    def changed(self, children: tuple[Node, ...] | None = None, **values: Any) -> Node:
        """Copy with other values or children.

        Parameters
        ----------
        children : tuple of Node, optional
            New children; the present ones by default.
        **values
            New parameter values by name.

        Returns
        -------
        Node

        Raises
        ------
        SceneError
            For an invalid value or number of children.
        """
        kept = self.children if children is None else children
        return self.formula(*kept, place=self.place, **{**_given(self), **values})

    def conservative(self) -> Node:
        """Conservative tree, for skipping empty space where the node's own field exceeds its bound.

        The two differ beside the tears of fractional powers, at seams with an escape-time fractal, and for
        hybrids.

        Returns
        -------
        Node
            Its positive values, divided by its own Lipschitz bound, are lower bounds of the distance to this
            node's surface. Other values bound nothing.
        """
        return replace(
            self, is_conservative=True, children=tuple(child.conservative() for child in self.children)
        )

    def fail(self, message: str) -> SceneError:
        """Error about this node: file, line and element, then the message.

        Parameters
        ----------
        message : str
            The fault, and the expected value.

        Returns
        -------
        SceneError
        """
        return SceneError(f"{self.place + ': ' if self.place else ''}<{self.formula.name}> {message}")

    @cached_property
    def bounds(self) -> Bounds:
        """Box, Lipschitz bound and kind of this field."""
        below = [child.bounds for child in self.fields]
        box = self._hooked("bounds", Box.everywhere())
        slope = self._hooked("slope", max([self.formula.lipschitz, *(b.lipschitz for b in below)]))
        steepening = self._hooked("steepening", max((b.steepening for b in below), default=0.0))
        own = [] if "bounds" in self.formula.hooks else [self.formula.name]
        boxless = dict.fromkeys([*(name for b in below for name in b.boxless), *own])
        exterior_only = self.formula.exterior_only or any(b.exterior_only for b in below)
        is_measured = self.formula.exterior_only and not self._hooked("proves_slope", False)
        names = (name for b in below for name in b.measured)
        measured = dict.fromkeys([*names, *([self.formula.name] if is_measured else [])])
        return Bounds(box, slope, exterior_only, steepening, tuple(boxless), tuple(measured))

    def _hooked(self, name: str, default: Any, *arguments: Any) -> Any:
        """Value of a hook of the formula, or the default of a formula without it."""
        hook = self.formula.hooks.get(name)
        return hook(self, *arguments) if hook else default

    @property
    def tree(self) -> Node:
        return self

    @property
    def escape_time_only(self) -> bool:
        shapes = (node for node in self.solids() if node.formula.kind == "shape")
        return all(shape._hooked("potential", shape.formula.exterior_only) for shape in shapes)

    @property
    def key(self) -> str:
        # all depths must be resolved, as for kernels and loops
        text: str = provider("compiler").key(self)
        return text

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        kernel: Kernel = provider("compiler").kernel(self, device, precision)
        return kernel

    def cells(self, precision: Precision = "float32") -> Cells | None:
        cells: Cells = provider("compiler").cells(self, precision)
        return cells

    def loops(self, loops: Sequence[Any], precision: Precision, device: Device = "cpu") -> Loops:
        linked: Loops = provider("compiler").loops(self, loops, precision, device)
        return linked

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the kernel function by name: numbers, tuples of numbers, or `Fixed`."""
        values: dict[str, Any] = self._hooked("arguments", dict(self.values))
        return values

    @property
    def function(self) -> Callable[..., Any]:
        """Function to compile for this node."""
        function: Callable[..., Any] = self._hooked("select", self.formula.function)
        return function

    def visible(self, voxel: float) -> Node:
        """This node without detail finer than a voxel; its children are unchanged.

        Parameters
        ----------
        voxel : float
            Voxel size in the node's own units.

        Returns
        -------
        Node
        """
        node: Node = self._hooked("visible", self, voxel)
        return node

    def signs(self) -> Node:
        """Tree whose field has the sign of this one's and is enclosed more tightly by intervals.

        Returns
        -------
        Node
        """
        if hooked := self._hooked("sign", None):
            function, values = hooked
            own = {"select": lambda _: function, "arguments": lambda _: values}
            return replace(self, formula=replace(self.formula, hooks={**self.formula.hooks, **own}))
        if self._hooked("keeps_sign", False):
            return replace(self, children=tuple(child.signs() for child in self.children))
        return self

    @property
    def proved_box(self) -> Box:
        return self._boxed().bounds.box

    def _boxed(self) -> Node:
        """Tree with proved boxes."""
        if self.formula.kind != "shape":
            return replace(self, children=tuple(child._boxed() for child in self.children))
        hooks = self.formula.hooks
        if "proved_bounds" not in hooks:
            return self
        return replace(self, formula=replace(self.formula, hooks={**hooks, "bounds": hooks["proved_bounds"]}))

    @property
    def is_identity(self) -> bool:
        """True if the node changes nothing and can be left out."""
        return bool(self._hooked("identity", False))

    @property
    def is_unordered(self) -> bool:
        """True if the elements but the first may be folded in any order, to the same bits."""
        return bool(self._hooked("unordered", False))


def _restored(formula: Formula, values: dict[str, Any], *fields: Any) -> Node:
    """Node from its pickled fields."""
    return Node(formula, MappingProxyType(values), *fields)


def _given(node: Node) -> dict[str, Any]:
    """Parameter values that are not None."""
    return {name: value for name, value in node.values.items() if value is not None}
