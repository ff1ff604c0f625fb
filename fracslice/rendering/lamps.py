"""Suns, lamps and lights at the camera in a render kernel."""

from __future__ import annotations

import math
from typing import Any

from ..kernel.linker import Linker
from ..scene.view import Light
from .units import lights


def casts_shadows(light: Light) -> bool:
    """Return whether the light may be blocked; the surfaces in view never block a light at the camera."""
    return light.shadows == "yes" and light.kind != "camera"


def bind_light(linker: Linker, name: str, light: Light, eye: tuple[float, float, float], far: float) -> None:
    """Bind the unit of a sun or lamp, or of a light at the camera.

    Parameters
    ----------
    linker : Linker
        Linker of the kernel.
    name : str
        Name of the unit in the kernel.
    light : Light
        The light.
    eye : tuple of float
        Position of the camera.
    far : float
        Distance beyond which the scene is empty.
    """
    if light.kind == "camera":
        linker.bind(name, lights.sharp_lamp, {"position": eye})
        return
    if light.kind == "lamp":
        soft, function = {"radius": light.size}, lights.lamp if light.size else lights.sharp_lamp
        linker.bind(name, function, {"position": light.position, **(soft if light.size else {})})
        return
    length = math.hypot(*light.position)
    values: dict[str, Any] = {"towards": tuple(p / length for p in light.position), "far": far}
    if light.size:
        values["spread"] = math.tan(math.radians(light.size) / 2)
    linker.bind(name, lights.sun if light.size else lights.sharp_sun, values)
