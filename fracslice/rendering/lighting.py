"""Lights, sky and fog in a render kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..formulas.registry import Fixed, Node
from ..kernel.dialects import FieldDialect
from ..kernel.linker import Linker
from ..kernel.structure import link_tree
from ..scene.view import Camera, Light, View
from . import glow
from .colours import Look, opaque_part
from .drawn import Drawn
from .haze import fogged
from .lamps import bind_light, casts_shadows
from .optics import Optics, ray_bound
from .scattering import divided, lacquered
from .surroundings import Surroundings, seen_as_disc
from .trace_syntax import text_of
from .units import lights, march, shade
from .units.glossy import highlight
from .units.intrinsics import background, blocker, transparent
from .units.pixel import linear
from .units.weights import mixed_weights, weights

PATIENCE = 800
"""Maximum steps of a shadow ray."""


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

    def __post_init__(self) -> None:
        self.around = Surroundings(self.linker, self.weighted)

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
        if look.coated:
            lines += [f"glaze{c} = 0.0 * t" for c in "rgb"]
        if look.glossy:
            lines += divided(self.linker, look)
            lines += [f"{c} = ambient * c{c}" + f" + glow * e{c}" * look.glows for c in "rgb"]
        else:
            lines += ["ambient = ambient + glow"] * look.glows
            lines += [f"{c} = ambient * c{c}" for c in "rgb"]
        if any(map(casts_shadows, self.view.lights)):
            steepness = 1 / ray_bound(self.root)
            marched = {"steepness": steepness, "patience": PATIENCE}
            self.linker.bind("visible_", march.visible, {**marched, "glass": Fixed(False)})
            if look.inside:
                self.linker.bind("unobstructed_", march.visible, {**marched, "glass": Fixed(True)})
                self.linker.bind("tinted_shadow_", march.tinted_shadow, marched)
                self.linker.functions["transparent"] = text_of(transparent, look.transparent())
            self.linker.functions["blocker"] = self.blocker()
            lines += [f"s{a} = {a} + 3.0 * h * n{a}" for a in "xyz"]
        if self.weighted:
            pane = "where((clear > 0.0) | (side < 0.0), 1.0, last)" if look.inside else "last"
            lines.append(f"free = {pane}")
        for k, light in enumerate(self.view.lights):
            if light.kind == "environment" and (look.paths or light.shadows == "yes"):
                lines += self.environment(light, look)
            elif not light.surrounds:
                lines += self.light(k, light, look)
            elif not look.paths:  # else rays that continue see it
                lines += self.sky(light)
        return lines

    @property
    def weighted(self) -> bool:
        """True if lights are sampled by their own distribution and by the surface's; see `units.weights`."""
        paths = self.view.shading.paths == "yes" and self.view.shading.mode == "light"
        return paths and any(x.kind == "environment" or seen_as_disc(x) for x in self.view.lights)

    def blocker(self) -> str:
        """Source of `units.intrinsics.blocker`."""
        opaque = opaque_part(self.root)
        if opaque is self.root:
            return text_of(blocker, ["return field(x, y, z, P)"])
        if opaque is None:
            return text_of(blocker, ["return 0.0 * x + 1.0"])
        return text_of(blocker, [f"return {link_tree(self.linker, opaque, FieldDialect(self.linker))}"])

    def light(self, k: int, light: Light, look: Look) -> list[str]:
        """Lines for one sun or lamp, or a light at the camera."""
        self.linker.share(shade.phong)
        soft = light.size and light.kind != "camera"
        u, v = self.drawn.names(2) if soft else ("t", "t")
        bind_light(self.linker, f"light{k}", light, self.camera.eye, self.seen.far)
        strength = light.strength
        if light.kind == "camera":
            strength *= math.dist(self.camera.eye, self.camera.target) ** 2
        colour = [self.linker.argument(c * strength) for c in linear(light.colour)]
        lines = [
            f"lx, ly, lz, far, power = light{k}(x, y, z, {u}, {v}, P)",
            "diffuse, gloss = phong(nx, ny, nz, dx, dy, dz, lx, ly, lz, specular, shininess)",
        ]
        passed = ""
        if casts_shadows(light):
            lines += [*self.shadow("where(diffuse > 0.0, far, 0.0)"), "power = power * open"]
            passed = self.passed
        shine, scattered, reflected = "gloss", "", ""
        if look.glossy:
            self.linker.share(highlight)
            lines.append("spot, half = highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, roughness)")
            shine = "where(roughness > 0.0, spot * tinted(half, k{0}), gloss)"
        if self.weighted and seen_as_disc(light):
            self.around.bind_sun(k, light)
            lines += [f"dense = sun_density{k}(lx, ly, lz, P)", *self.weights(look)]
            scattered, reflected = "scattered * ", "reflected * "
        if look.coated:
            lines += lacquered(self.linker, colour)
        for c, s in zip("rgb", colour, strict=True):
            sent = f"{scattered}diffuse * c{c} + {reflected}{shine.format(c)}"
            lines.append(f"{c} = {c} + power * {s}{passed.format(c)} * ({sent})")
        return lines

    @property
    def passed(self) -> str:
        """Factor on a light for what transparent parts pass on; the colour is left open."""
        return " * w{0}" if self.inside else ""

    def shadow(self, far: str, bent: bool = False) -> list[str]:
        """Lines for the light that arrives from a direction.

        Rays that are bent carry the light of surroundings through glass, which then blocks straight ones.
        """
        ray = f"(sx, sy, sz, lx, ly, lz, {far}, h, P)"
        if not self.inside:
            return [f"open = visible_{ray}"]
        if bent:
            return [f"open = unobstructed_{ray}"]
        return [f"open = visible_{ray}", f"wr, wg, wb = tinted_shadow_{ray}"]

    def weights(self, look: Look) -> list[str]:
        """Lines for the weights of a light's sample."""
        if look.bodies:
            self.linker.share(mixed_weights)
            return [
                glow.density("likely", "l"),
                "scattered, reflected = mixed_weights(dense, likely, roughness, free)",
            ]
        self.linker.share(weights)
        vectors = ", ".join(f"{v}{a}" for v in "ndl" for a in "xyz")
        return [f"scattered, reflected = weights(dense, diffuse, {vectors}, roughness, share, free)"]

    def environment(self, light: Light, look: Look) -> list[str]:
        """Lines for light from a picture of the surroundings, sampled in proportion to its light."""
        self.around.bind_light(light)
        self.around.bind_sampling(light)
        u, v = self.drawn.names(2)
        far = self.linker.argument(self.seen.far)
        lines = [
            f"lx, ly, lz, dense = towards_({u}, {v}, P)",
            "hr, hg, hb = surroundings_(lx, ly, lz, P)",
            "diffuse = maximum(nx * lx + ny * ly + nz * lz, 0.0)",
            *self.shadow(f"where(diffuse > 0.0, {far}, 0.0)", look.paths),
            f"power = open / maximum({math.pi} * dense, 1e-30)",
        ]
        if not look.paths:
            passed = (self.passed.format(c) for c in "rgb")
            return lines + [
                f"{c} = {c} + power * h{c}{w} * diffuse * c{c}" for c, w in zip("rgb", passed, strict=True)
            ]
        self.linker.share(highlight)
        lines += [
            "spot, half = highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, roughness)",
            *self.weights(look),
        ]
        shine = "where(roughness > 0.0, reflected * spot * tinted(half, k{0}), 0.0)"
        return lines + [
            f"{c} = {c} + power * h{c} * (scattered * diffuse * c{c} + {shine.format(c)})" for c in "rgb"
        ]

    def sky(self, light: Light) -> list[str]:
        """Lines for light from the sky: one direction per sample, or along the normal without shadows."""
        self.bind_sky(light)
        if light.shadows == "no":
            lines = ["hr, hg, hb = sky_(nx, ny, nz, P)", "open = ambient * 0.0 + 1.0"]
        else:
            u, v = self.drawn.names(2)
            self.linker.share(lights.upward)
            far = self.linker.argument(self.seen.far)
            lines = [
                f"lx, ly, lz = upward(nx, ny, nz, {u}, {v})",
                "hr, hg, hb = sky_(lx, ly, lz, P)",
                *self.shadow(f"{far} + 0.0 * t"),
                *(f"h{c} = h{c}{self.passed.format(c)}" for c in "rgb" if self.inside),
            ]
        return lines + [f"{c} = {c} + open * h{c} * c{c}" for c in "rgb"]

    def bind_sky(self, light: Light) -> None:
        """Bind the unit of the sky, or of the light of an environment without shadows."""
        if light.kind == "environment":
            self.around.bind_irradiance("sky_", light)
            return
        names = {"zenith": light.colour, "horizon": light.horizon, "ground": light.ground}
        values = {n: tuple(c * light.strength for c in linear(colour)) for n, colour in names.items()}
        self.linker.bind("sky_", lights.sky, values)

    def fog(self, onward: bool) -> list[str]:
        """Lines for fog; see `haze.fogged`."""
        fog = self.view.fog
        return [] if fog is None or fog.density == 0 else fogged(self, fog, onward)

    def background(self) -> str:
        """Source of `units.intrinsics.background`: the sky, else the colour of the fog, else of the film."""
        view = self.view
        lit = view.shading.mode == "light"
        around = next((light for light in view.lights if lit and light.surrounds), None)
        if around is None:
            own = view.fog and view.fog.colour
            shown = (0.0, 0.0, 0.0) if not lit else own or view.film.background
            values = ", ".join(f"{self.linker.argument(c)} + 0.0 * dx" for c in linear(shown))
            lines = [f"r, g, b = {values}"]
        elif around.kind == "sky":
            self.bind_sky(around)
            lines = ["r, g, b = sky_(dx, dy, dz, P)"]
        else:
            lines = self.around.behind(around)
        for k, light in enumerate(view.lights):
            if self.weighted and seen_as_disc(light):
                lines += self.around.disc(k, light)
        return text_of(background, [*lines, "return r, g, b"])
