"""Kernel generation: scene and view to one kernel that calls only the units in use.

The generated text is straight-line code. Every calculation is in a unit of `fracslice.rendering.units`, bound
to its parameters under a name. Effects that a scene does not use generate no code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..formulas.registry import Fixed, Node
from ..kernel import functions
from ..kernel.dialects import FieldDialect
from ..kernel.linker import Linked, Linker
from ..kernel.structure import link_tree
from ..scene.view import Camera, Light, View
from .cameras import camera_unit
from .colours import Look, linear, opaque_part
from .optics import Optics
from .units import lights, march, shade
from .units.intrinsics import GIVEN, background, blocker, surface
from .units.normal import normal

PATIENCE = 800
"""Maximum steps of a shadow ray."""


@dataclass(frozen=True)
class Frame:
    """Kernel of one scene, camera and depth. Frames of one scene differ only in their parameters.

    Attributes
    ----------
    linked : Linked
        Kernel source and parameters P.
    camera_samples, bounce_samples : int
        Random numbers per camera ray, and per bounce.
    bounces : int
        Maximum bounces of a ray.
    sharp : bool
        True if all rays start at the eye, so that the cone prepass applies.
    far : int
        Index in P of the far distance.
    block : int
        Side of a block of the cone prepass, pixels; a power of two.
    """

    linked: Linked
    camera_samples: int
    bounce_samples: int
    bounces: int
    sharp: bool
    far: int
    block: int

    @property
    def samples(self) -> int:
        """Random numbers per sample."""
        return self.camera_samples + (self.bounces + 1) * self.bounce_samples

    @property
    def shift(self) -> int:
        """Binary logarithm of `block`."""
        return self.block.bit_length() - 1


def link_frame(root: Node, view: View, camera: Camera, seen: Optics, block: int) -> Frame:
    """Link the kernel of a scene.

    Parameters
    ----------
    root : Node
        Tree with resolved depths.
    view : View
        The view.
    camera : Camera
        The camera.
    seen : Optics
        Lengths of the kernel.
    block : int
        Side of a block of the cone prepass, pixels.

    Returns
    -------
    Frame
        The linked frame.
    """
    return _Frame(root, view, camera, seen, block).linked()


@dataclass
class _Frame:
    """Builder of a frame."""

    root: Node
    view: View
    camera: Camera
    seen: Optics
    block: int
    linker: Linker = field(default_factory=lambda: Linker(given=GIVEN))
    dimensions: int = 0
    bounces: int = 0

    def linked(self) -> Frame:
        """Link everything and return the frame."""
        linker = self.linker
        linker.field(self.root)
        self.marching()
        camera_samples = self.cameras()
        look = Look(linker, self.root)
        far = len(linker.parameters)
        linker.argument(self.seen.far)
        self.bounces = self.view.shading.bounces if look.bounces and self.view.shading.mode == "light" else 0
        linker.functions |= {"surface": self.surface(look), "background": self.background()}
        linked = Linked(linker.text(), np.array(linker.parameters, np.float64))
        samples = camera_samples, self.dimensions
        return Frame(linked, *samples, self.bounces, self.sharp, far, self.block)

    def marching(self) -> None:
        """Bind the units that march rays and cones."""
        seen, steepness = self.seen, 1 / self.root.bounds.lipschitz
        box = self.root.bounds.box
        lo = tuple(max(a, e - seen.far) for a, e in zip(box.lo, self.camera.eye, strict=True))
        hi = tuple(min(a, e + seen.far) for a, e in zip(box.hi, self.camera.eye, strict=True))
        self.linker.bind("span_box", march.span, {"lo": lo, "hi": hi})
        widest = 1.4143 * self.block * seen.cone * 1.02
        width = {"cone": seen.cone, "least": seen.least}
        stepping = {"steepness": steepness, **width, "glass": Fixed(self.inside)}
        self.linker.bind("step_ray", march.advance, stepping)
        self.linker.bind("step_cone", march.widen, {"steepness": steepness, "spread": widest})
        self.linker.bind("width_at", _width, width)

    @property
    def inside(self) -> bool:
        """True if some material is transparent, so that rays pass through the solid."""
        return any(n.formula.name == "material" and n["clear"] > 0 for n in self.root.walk())

    def cameras(self) -> int:
        """Bind the camera; return the number of random numbers per camera ray."""
        function, values = camera_unit(self.camera, self.seen.size)
        self.linker.bind("camera_ray", function, values)
        return 2 if self.sharp else 4

    @property
    def sharp(self) -> bool:
        """True if all rays start at the eye."""
        camera = self.camera
        return not (camera.aperture or camera.stereo or camera.kind == "orthographic")

    def draw(self, count: int) -> list[str]:
        """Reserve random numbers and return their expressions."""
        names = [f"u[{self.dimensions + k}]" for k in range(count)]
        self.dimensions += count
        return names

    def surface(self, look: Look) -> str:
        """Source of `units.intrinsics.surface`."""
        mode = self.view.shading.mode
        lines = ["h = width_at(path + t, P)"]
        if mode in ("light", "normal"):
            self.linker.share(normal)
            lines.append("nx, ny, nz = normal(x, y, z, h, P)")
        if mode == "light":
            lines += look.lines() + self.lit(look) + self.onward(look)
        else:
            lines += self.shown(mode)
        lines += self.fogged()
        onward = "tr, tg, tb, ox, oy, oz, ex, ey, ez, es" if self.bounces else ""
        return text_of(surface, [*lines, f"return (r, g, b), ({onward})"])

    def lit(self, look: Look) -> list[str]:
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
        if look.glows:
            lines.append("ambient = ambient + glow")
        lines += ["r = ambient * cr", "g = ambient * cg", "b = ambient * cb"]
        if any(light.shadows == "yes" for light in self.view.lights):
            steepness = 1 / self.root.bounds.lipschitz
            self.linker.bind("visible_", march.visible, {"steepness": steepness, "patience": PATIENCE})
            self.linker.functions["blocker"] = self.blocker()
            lines += [f"s{a} = {a} + 3.0 * h * n{a}" for a in "xyz"]
        for k, light in enumerate(self.view.lights):
            lines += self.sky(light) if light.kind == "sky" else self.light(k, light)
        return lines

    def blocker(self) -> str:
        """Source of `units.intrinsics.blocker`."""
        opaque = opaque_part(self.root)
        if opaque is self.root:
            return text_of(blocker, ["return field(x, y, z, P)"])
        if opaque is None:
            return text_of(blocker, ["return 0.0 * x + 1.0"])
        return text_of(blocker, [f"return {link_tree(self.linker, opaque, FieldDialect(self.linker))}"])

    def light(self, k: int, light: Light) -> list[str]:
        """Lines for one sun or lamp."""
        self.linker.share(shade.phong)
        u, v = self.draw(2) if light.size else ("t", "t")
        self.bind_light(f"light{k}", light)
        colour = [self.linker.argument(c * light.strength) for c in linear(light.colour)]
        lines = [
            f"lx, ly, lz, far, power = light{k}(x, y, z, {u}, {v}, P)",
            "diffuse, gloss = phong(nx, ny, nz, dx, dy, dz, lx, ly, lz, specular, shininess)",
        ]
        if light.shadows == "yes":
            lines.append(
                "power = power * visible_(sx, sy, sz, lx, ly, lz, where(diffuse > 0.0, far, 0.0), h, P)"
            )
        return lines + [
            f"{c} = {c} + power * {s} * (diffuse * c{c} + gloss)" for c, s in zip("rgb", colour, strict=True)
        ]

    def bind_light(self, name: str, light: Light) -> None:
        """Bind the unit of a sun or lamp."""
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
            u, v = self.draw(2)
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

    def onward(self, look: Look) -> list[str]:
        """Lines for the ray that continues after reflection or refraction."""
        if not self.bounces:
            return []
        (u,) = self.draw(1) if look.inside else ("t",)
        for function in (shade.mirrored, shade.fresnel, shade.bent, shade.goes_on, shade.reflects):
            self.linker.share(function)
        if not look.inside:
            return [
                "tr, ex, ey, ez = reflects(dx, dy, dz, nx, ny, nz, reflect)",
                "tg, tb, es = tr, tr, side",
                *(f"{c} = {c} * (1.0 - t{c})" for c in "rgb"),
                *(f"o{a} = {a} + 3.0 * h * n{a}" for a in "xyz"),
            ]
        return [
            f"share, ex, ey, ez, out = goes_on(dx, dy, dz, nx, ny, nz, side, reflect, clear, index, {u})",
            "es = side * out",
            *(f"t{c} = share * where(side < 0.0, exp(-absorb{c} * t), 1.0 + 0.0 * t)" for c in "rgb"),
            *(f"{c} = {c} * where(side < 0.0, 0.0, 1.0 - share)" for c in "rgb"),
            *(f"o{a} = {a} + 3.0 * h * out * n{a}" for a in "xyz"),
        ]

    def shown(self, mode: str) -> list[str]:
        """Lines for the modes that show a number or a direction."""
        far, near = self.seen.far, math.dist(self.camera.eye, self.camera.target)
        if mode == "normal":
            return [f"{c} = 0.5 + 0.5 * n{a}" for c, a in zip("rgb", "xyz", strict=True)]
        if mode == "steps":
            return ["r = exp(-0.02 * steps)", "g = r", "b = r"]
        reach = "t"
        if mode == "depth":
            reach = " + ".join(
                f"{self.linker.argument(f)} * t * d{a}"
                for f, a in zip(self.camera.forward, "xyz", strict=True)
            )
        scale = self.linker.argument(2.0 / (near + far))
        return [f"r = exp(-{scale} * ({reach}))", "g = r", "b = r"]

    def fogged(self) -> list[str]:
        """Lines for fog."""
        fog = self.view.fog
        if fog is None or fog.density == 0:
            return []
        self.linker.bind("clearness", shade.fog, {"density": fog.density})
        colour = [self.linker.argument(c) for c in linear(fog.colour)]
        lines = [f"{c} = {v} + air * ({c} - {v})" for c, v in zip("rgb", colour, strict=True)]
        return ["air = clearness(t, P)", *lines, *(f"t{c} = air * t{c}" for c in "rgb" if self.bounces)]

    def background(self) -> str:
        """Source of `units.intrinsics.background`."""
        view = self.view
        skies = [light for light in view.lights if light.kind == "sky"]
        if view.fog is None and skies and view.shading.mode == "light":
            return text_of(background, ["return sky_(dx, dy, dz, P)"])
        colour = linear(view.fog.colour if view.fog else view.film.background)
        values = ", ".join(f"{self.linker.argument(c)} + 0.0 * dx" for c in colour)
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


def _width(t, cone, least):  # type: ignore[no-untyped-def]
    """Hit tolerance at distance t."""
    return cone * t + least
