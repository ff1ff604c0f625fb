"""Pictures of the surroundings, and suns that continued rays meet, in a render kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..kernel.linker import Linker
from ..scene.view import Light
from .environments import PIXELS, Environment, environment
from .image_files import load_picture
from .units import environment as units
from .units.pixel import linear
from .units.weights import behind, sun_density, sunshine


def seen_as_disc(light: Light) -> bool:
    """Return whether continued rays meet the light: a sun of some size."""
    return light.kind == "sun" and light.size > 0 and light.shadows == "yes"


def tint(light: Light) -> tuple[float, ...]:
    """Return the linear colour of a light times its strength."""
    return tuple(c * light.strength for c in linear(light.colour))


@dataclass
class Surroundings:
    """Bindings of the lights that rays meet when they miss the scene.

    Attributes
    ----------
    linker : Linker
        Linker of the kernel.
    weighted : bool
        True if lights are sampled by their own distribution and by the surface's; see `units.weights`.
    """

    linker: Linker
    weighted: bool

    def tables(self, light: Light) -> tuple[Environment, dict[str, Any]]:
        """The tables of an environment, and values that its units share."""
        assert light.file
        made = environment(load_picture(light.file, PIXELS, light.fail))
        return made, {"size": made.picture.size, "turn": light.rotation / 360}

    def bind_light(self, light: Light) -> None:
        """Bind the light of an environment in a direction."""
        made, values = self.tables(light)
        width, height = values.pop("size")
        values |= {"width": width, "height": height, "tint": tint(light), "light": made.picture.light}
        self.linker.bind("surroundings_", units.surroundings, values)

    def bind_sampling(self, light: Light) -> None:
        """Bind the sampling of an environment."""
        made, values = self.tables(light)
        rows, columns = made.distribution
        values |= {"rows": rows, "columns": columns}
        steps = {"steps": made.steps, "halves": made.halves}
        self.linker.bind("towards_", units.towards, values | steps)
        if self.weighted:
            self.linker.bind("likelihood_", units.likelihood, values)

    def bind_irradiance(self, name: str, light: Light) -> None:
        """Bind the light of an environment without shadows."""
        made, values = self.tables(light)
        factors = zip(tint(light), made.harmonics(values["turn"]), strict=True)
        harmonics = tuple(tuple(t * f for f in channel) for t, channel in factors)
        self.linker.bind(name, units.irradiance, {"harmonics": harmonics})

    def behind(self, light: Light) -> list[str]:
        """Lines for an environment that a ray meets."""
        self.bind_light(light)
        lines = ["r, g, b = surroundings_(dx, dy, dz, P)"]
        if self.weighted:
            self.bind_sampling(light)
            self.linker.share(behind)
            lines.append("w = behind(q, likelihood_(dx, dy, dz, P))")
            lines += [f"{c} = w * {c}" for c in "rgb"]
        return lines

    def bind_sun(self, k: int, light: Light) -> None:
        """Bind the density of the samples of a sun."""
        towards = tuple(p / math.hypot(*light.position) for p in light.position)
        values = {"towards": towards, "spread": math.tan(math.radians(light.size) / 2)}
        self.linker.bind(f"sun_density{k}", sun_density, values)

    def disc(self, k: int, light: Light) -> list[str]:
        """Lines for a sun that continued rays meet."""
        self.bind_sun(k, light)
        self.linker.share(sunshine)
        lines = [f"w = sunshine(q, sun_density{k}(dx, dy, dz, P))"]
        return lines + [
            f"{c} = {c} + w * {self.linker.argument(t)}" for c, t in zip("rgb", tint(light), strict=True)
        ]
