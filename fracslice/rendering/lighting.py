"""Lights, sky and fog in a render kernel."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ..formulas.registry import Node
from ..kernel import functions
from ..kernel.dialects import FieldDialect
from ..kernel.linker import Linker
from ..kernel.structure import link_tree
from ..scene.view import Camera, Light, View
from .colours import Look, opaque_part
from .drawn import Drawn
from .optics import Optics, ray_bound
from .scattering import divided
from .units import lights, march, shade
from .units.glossy import highlight
from .units.intrinsics import background, blocker
from .units.pixel import linear

PATIENCE = 800
"""Maximum steps of a shadow ray."""


def casts_shadows(light: Light) -> bool:
    """Return whether the light may be blocked; the surfaces in view never block a light at the camera.

    Parameters
    ----------
    light : Light
        The light.

    Returns
    -------
    bool
    """
    return light.shadows == "yes" and light.kind != "camera"


@dataclass
class Lighting:
    """Lights of a view, and the kernel lines for their light at a hit.

    Attributes
    ----------
    linker : Linker
        Linker of the kernel.
    drawn : Drawn
        Random numbers of a bounce.
    root : Node
        Tree with resolved depths.
    view : View
        The view, with its lights.
    camera : Camera
        The camera.
    seen : Optics
        Lengths of the kernel.
    inside : bool
        True if rays pass through the solid.
    """

    linker: Linker
    drawn: Drawn
    root: Node
    view: View
    camera: Camera
    seen: Optics
    inside: bool

    def lines(self, look: Look) -> list[str]:
        """Lines for ambient light and every light."""
        shading = self.view.shading
        lines = ["ambient = 0.0 * t"]
        if self.inside:
            lines += ["nx = nx * side", "ny = ny * side", "nz = nz * side"]
        if shading.ambient:
            lines = [*lines, f"ambient = ambient + {self.linker.argument(shading.ambient)}"]
            if shading.occlusion:
                self.linker.bind(
                    "openness", shade.occlusion, {"strength": shading.occlusion, "reach": shading.reach}
                )
                lines.append("ambient = ambient * openness(x, y, z, nx, ny, nz, P)")
        if look.glossy:
            lines += divided(self.linker)
            lines += [f"{c} = ambient * c{c}" + f" + glow * e{c}" * look.glows for c in "rgb"]
        else:
            lines += ["ambient = ambient + glow"] * look.glows
            lines += [f"{c} = ambient * c{c}" for c in "rgb"]
        if any(map(casts_shadows, self.view.lights)):
            steepness = 1 / ray_bound(self.root)
            self.linker.bind("visible_", march.visible, {"steepness": steepness, "patience": PATIENCE})
            self.linker.functions["blocker"] = self.blocker()
            lines += [f"s{a} = {a} + 3.0 * h * n{a}" for a in "xyz"]
        for k, light in enumerate(self.view.lights):
            if light.kind != "sky":
                lines += self.light(k, light, look.glossy)
            elif not look.paths:  # else rays that continue see it
                lines += self.sky(light)
        return lines

    def blocker(self) -> str:
        """Source of `units.intrinsics.blocker`."""
        opaque = opaque_part(self.root)
        if opaque is self.root:
            return text_of(blocker, ["return field(x, y, z, P)"])
        if opaque is None:
            return text_of(blocker, ["return 0.0 * x + 1.0"])
        return text_of(blocker, [f"return {link_tree(self.linker, opaque, FieldDialect(self.linker))}"])

    def light(self, k: int, light: Light, glossy: bool) -> list[str]:
        """Lines for one sun or lamp, or a light at the camera."""
        self.linker.share(shade.phong)
        soft = light.size and light.kind != "camera"
        u, v = self.drawn.names(2) if soft else ("t", "t")
        self.bind_light(f"light{k}", light)
        strength = light.strength
        if light.kind == "camera":
            strength *= math.dist(self.camera.eye, self.camera.target) ** 2
        colour = [self.linker.argument(c * strength) for c in linear(light.colour)]
        lines = [
            f"lx, ly, lz, far, power = light{k}(x, y, z, {u}, {v}, P)",
            "diffuse, gloss = phong(nx, ny, nz, dx, dy, dz, lx, ly, lz, specular, shininess)",
        ]
        if casts_shadows(light):
            lines.append(
                "power = power * visible_(sx, sy, sz, lx, ly, lz, where(diffuse > 0.0, far, 0.0), h, P)"
            )
        shine = "gloss"
        if glossy:
            self.linker.share(highlight)
            lines.append("spot, half = highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, roughness)")
            shine = "where(roughness > 0.0, spot * tinted(half, k{0}), gloss)"
        return lines + [
            f"{c} = {c} + power * {s} * (diffuse * c{c} + {shine.format(c)})"
            for c, s in zip("rgb", colour, strict=True)
        ]

    def bind_light(self, name: str, light: Light) -> None:
        """Bind the unit of a sun or lamp, or of a light at the camera."""
        if light.kind == "camera":
            self.linker.bind(name, lights.sharp_lamp, {"position": self.camera.eye})
            return
        if light.kind == "lamp":
            soft, function = {"radius": light.size}, lights.lamp if light.size else lights.sharp_lamp
            self.linker.bind(name, function, {"position": light.position, **(soft if light.size else {})})
            return
        length = math.hypot(*light.position)
        values: dict[str, Any] = {"towards": tuple(p / length for p in light.position), "far": self.seen.far}
        if light.size:
            values["spread"] = math.tan(math.radians(light.size) / 2)
        self.linker.bind(name, lights.sun if light.size else lights.sharp_sun, values)

    def sky(self, light: Light) -> list[str]:
        """Lines for light from the sky: one direction per sample, or along the normal without shadows."""
        self.bind_sky(light)
        if light.shadows == "no":
            lines = ["kr, kg, kb = sky_(nx, ny, nz, P)", "open = ambient * 0.0 + 1.0"]
        else:
            u, v = self.drawn.names(2)
            self.linker.share(lights.upward)
            far = self.linker.argument(self.seen.far)
            lines = [
                f"lx, ly, lz = upward(nx, ny, nz, {u}, {v})",
                "kr, kg, kb = sky_(lx, ly, lz, P)",
                f"open = visible_(sx, sy, sz, lx, ly, lz, {far} + 0.0 * t, h, P)",
            ]
        return lines + [f"{c} = {c} + open * k{c} * c{c}" for c in "rgb"]

    def bind_sky(self, light: Light) -> None:
        """Bind the unit of the sky."""
        names = {"zenith": light.colour, "horizon": light.horizon, "ground": light.ground}
        values = {n: tuple(c * light.strength for c in linear(colour)) for n, colour in names.items()}
        self.linker.bind("sky_", lights.sky, values)

    def fog(self, onward: bool) -> list[str]:
        """Lines for fog; without a colour of its own, surfaces fade into what is behind them."""
        fog = self.view.fog
        if fog is None or fog.density == 0:
            return []
        self.linker.bind("clearness", shade.fog, {"density": fog.density})
        lines = ["air = clearness(t, P)"]
        if fog.colour is None:
            lines.append("fr, fg, fb = background(dx, dy, dz, P)")
        else:
            colour = map(self.linker.argument, linear(fog.colour))
            lines += [f"f{c} = {value}" for c, value in zip("rgb", colour, strict=True)]
        if self.inside:
            lines.insert(1, "air = where(side < 0.0, 1.0 + 0.0 * t, air)")
        lines += [f"{c} = f{c} + air * ({c} - f{c})" for c in "rgb"]
        return [*lines, *(f"t{c} = air * t{c}" for c in "rgb" if onward)]

    def background(self) -> str:
        """Source of `units.intrinsics.background`: the sky, else the colour of the fog, else of the film."""
        view = self.view
        for light in view.lights:
            if light.kind == "sky" and view.shading.mode == "light":
                self.bind_sky(light)
                return text_of(background, ["return sky_(dx, dy, dz, P)"])
        own = view.fog and view.fog.colour
        shown = (0.0, 0.0, 0.0) if view.shading.mode != "light" else own or view.film.background
        values = ", ".join(f"{self.linker.argument(c)} + 0.0 * dx" for c in linear(shown))
        return text_of(background, [f"return {values}"])


def text_of(function: Callable[..., Any], lines: Sequence[str]) -> str:
    """Assemble the source of a function.

    Parameters
    ----------
    function : callable
        Function whose name and parameters are used.
    lines : sequence of str
        Body.

    Returns
    -------
    str
        Source text.
    """
    names = ", ".join(functions.parameters(function))
    return "\n    ".join([f"def {function.__name__}({names}):", *lines])
