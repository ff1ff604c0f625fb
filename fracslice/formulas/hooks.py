"""Functions that supply a node's box, bounds, kernel function and arguments."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .box import Box

if TYPE_CHECKING:
    from .node import Node

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
        """Set the hook that returns the attributes of `kernel.growth.Growth`, where they are known."""
        return self._hook("growth", hook)

    def visible(self, hook: Callable[[Node, float], Node]) -> Callable[[Node, float], Node]:
        """Set the hook that returns the node without detail finer than a voxel size in its own units."""
        return self._hook("visible", hook)

    def check(self, hook: Callable[[Node], None]) -> Callable[[Node], None]:
        """Set the hook that raises `SceneError` for values that are valid alone but not together."""
        return self._hook("check", hook)

    def _hook(self, name: str, hook: Hook) -> Hook:
        self.hooks[name] = hook
        return hook
