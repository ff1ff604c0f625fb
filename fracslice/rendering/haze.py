"""Fog in a render kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..scene.view import Fog
from .surroundings import tint
from .units import fog as units
from .units.pixel import linear

if TYPE_CHECKING:
    from .lighting import Lighting

CHANNELS = "rgb"


def fogged(lighting: Lighting, fog: Fog, onward: bool) -> list[str]:
    """Return the lines that cover a surface with fog.

    Without a colour of its own, surfaces fade into what is behind them.

    Parameters
    ----------
    lighting : Lighting
        Lights of the view.
    fog : Fog
        The fog.
    onward : bool
        True if rays continue.

    Returns
    -------
    list of str
        Kernel source lines.
    """
    linker, values = lighting.linker, {"density": fog.density}
    if fog.height is None:
        linker.bind("clearness", units.fog, values)
        lines = ["air = clearness(t, P)"]
    else:
        values |= {"level": fog.level, "height": fog.height}
        linker.bind("clearness", units.height_fog, values)
        lines = ["air = clearness(t, z, dz, P)"]
    if lighting.inside:
        lines.append("air = where(side < 0.0, 1.0 + 0.0 * t, air)")
    if fog.colour is None:
        lines.append("fr, fg, fb = background(dx, dy, dz, 0.0, P)")
    else:
        colour = map(linker.argument, linear(fog.colour))
        lines += [f"f{c} = {value}" for c, value in zip(CHANNELS, colour, strict=True)]
    lines += [f"{c} = f{c} + air * ({c} - f{c})" for c in CHANNELS]
    if fog.scatter:
        lines += _scattered(lighting, fog, values)
    return [*lines, *(f"t{c} = air * t{c}" for c in CHANNELS if onward)]


def _scattered(lighting: Lighting, fog: Fog, values: dict[str, float]) -> list[str]:
    """Lines for light that fog scatters to the eye, the same in all directions.

    One point of the ray, uniform by its length, sees each sun and lamp.
    """
    linker = lighting.linker
    (u,) = lighting.drawn.names(1)
    lines = [f"along = {u} * t", *(f"p{a} = {a} - (t - along) * d{a}" for a in "xyz")]
    if fog.height is None:
        lines.append(f"haze = t * clearness(along, P) * {linker.argument(fog.density)}")
    else:
        linker.bind("thickness_", units.thickness, values)
        lines.append("haze = t * clearness(along, pz, dz, P) * thickness_(pz, P)")
    if lighting.inside:
        lines.append("haze = where(side < 0.0, 0.0, haze)")
    part = linker.argument(fog.scatter / 4)
    for k, light in enumerate(lighting.view.lights):
        if light.kind not in ("sun", "lamp"):
            continue
        soft = lighting.drawn.names(2) if light.size else ["t", "t"]
        lines.append(f"lx, ly, lz, far, power = light{k}(px, py, pz, {', '.join(soft)}, P)")
        if light.shadows == "yes":
            lines.append("power = power * visible_(px, py, pz, lx, ly, lz, far, h, P)")
        lines += [
            f"{c} = {c} + {part} * haze * power * {linker.argument(s)}"
            for c, s in zip(CHANNELS, tint(light), strict=True)
        ]
    return lines
