"""Kinds of lights: one file each, with `KIND`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..view import Light

Point = tuple[float, float, float]

Unit = tuple[Callable[..., Any], dict[str, Any]]
"""Function ``f(x, y, z, u, v, ...)`` of the language, and the values of its other arguments.

It returns the unit direction from a point to the light, its distance and the fraction of its strength. u and
v are random numbers.
"""


@dataclass(frozen=True)
class Kind:
    """Kind of lights, as render kernels see it."""

    doc: str  # where it is
    # unit of a light, by the eye and the distance at which rays end; None if it surrounds the scene
    unit: Callable[[Light, Point, float], Unit] | None = None
    is_soft: Callable[[Light], bool] = lambda light: light.size > 0  # whether its unit reads u and v
    # false if the surfaces in view never block it; then fog does not scatter it
    is_blocked: bool = True
    is_picture: bool = False  # whether its light is that of a file
    # whether rays that continue meet a light with a size, which has `disc_values`
    is_disc: bool = False
    # factor on its strength, by the eye and the point that it looks at
    scale: Callable[[Point, Point], float] = lambda eye, target: 1.0

    @property
    def surrounds(self) -> bool:
        """True if rays that miss the scene show it."""
        return self.unit is None


KINDS: dict[str, Kind] = {
    module.name: import_module(f".{module.name}", __name__).KIND for module in iter_modules(__path__)
}
