"""Lights, sky, fog and the continuation of rays at surfaces in a render kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..expr import vocabulary
from ..expr.vocabulary import upward
from ..fields.linker import FieldDialect, Linker, link_tree
from ..fields.registry import Fixed, Node
from ..scene.lights import KINDS, sky
from ..scene.view import Camera, Fog, Light, View
from . import materials
from .environments import PIXELS, Environment, environment, load_picture
from .materials import Drawn, Look, opaque_part, write
from .setup import Optics, ray_bound
from .units import march, shade
from .units import shade as units
from .units.camera import linear
from .units.march import blocker, transparent
from .units.shade import behind, highlight, mixed_weights, sun_density, sunshine, weights

MIDPOINTS = 24
"""Points along each side of the unit square of random numbers."""


@lru_cache(maxsize=1)
def reflected_shares() -> np.ndarray:
    """Return the table of `shade.lost`, by the midpoint rule over the directions that `shade.glossy` takes.

    It is rounded, so that it is the same on any machine.
    """
    grid = np.linspace(0, 1, int(shade.CELLS) + 1)
    points = (np.arange(MIDPOINTS) + 0.5) / MIDPOINTS
    rough, root, u, v = np.meshgrid(grid, grid, points, points, indexing="ij", sparse=True)
    z = np.maximum(root * root, 1e-4)
    none = 0.0 * z
    ray, normal = (np.sqrt(1 - z * z), none, -z), (none, none, 1 + none)
    *_, weight, _ = shade.glossy(*ray, *normal, rough, u, v)  # type: ignore[no-untyped-call]
    return np.asarray(weight.mean((2, 3)).round(5))


def division_lines(linker: Linker, look: Look) -> list[str]:
    """Return the lines that divide a colour into what the surface reflects and what it scatters."""
    for function in (shade.fresnel, shade.tinted):
        linker.share(function)
    lines = ["facing = -(dx * nx + dy * ny + dz * nz)", *(f"e{c} = c{c}" for c in CHANNELS)]
    lines += [f"k{c} = reflect + metallic * (c{c} - reflect)" for c in CHANNELS]
    if look.rough:
        linker.bind("lost_", shade.lost, {"table": reflected_shares()})
        lines.append("lost = lost_(facing, roughness, P)")
        lines += [
            f"again{c} = 1.0 + (k{c} + (1.0 - k{c}) / 21.0) * lost" for c in CHANNELS
        ]  # mean of Schlick's
    lines += [f"c{c} = c{c} * (1.0 - metallic) * (1.0 - tinted(facing, k{c}))" for c in CHANNELS]
    if look.paths:
        lines += [
            "mirrors = tinted(facing, maximum(maximum(kr, kg), kb))",
            "scatters = maximum(maximum(cr, cg), cb)",
            "share = mirrors / maximum(mirrors + scatters, 1e-6)",
        ]
    if look.bodies:
        lines += materials.bind(linker, look.bodies)
    return lines


def onward(linker: Linker, drawn: Drawn, look: Look, weighted: bool) -> list[str]:
    """Return the lines for the ray that continues."""
    for function in (
        shade.mirrored,
        shade.fresnel,
        shade.dielectric,
        shade.bent,
        shade.goes_on,
        shade.reflects,
    ):
        linker.share(function)
    (u,) = drawn.names(1) if look.inside else ("t",)
    lines, out = ["eq = 0.0 * t"], ""
    if look.glossy:
        lines += _reflection_lines(linker, drawn, look)
    elif not look.inside:
        lines.append("tr, ex, ey, ez = reflects(dx, dy, dz, nx, ny, nz, reflect)")
        lines += ["tg, tb, es = tr, tr, side", *(f"{c} = {c} * (1.0 - t{c})" for c in CHANNELS)]
    if look.paths:
        lines += _scatter_choice_lines(linker, drawn, look)
    if weighted and not look.bodies:
        linker.share(shade.density_onward)
        lines.append("eq = density_onward(chosen, nx, ny, nz, dx, dy, dz, ex, ey, ez, roughness, share)")
    if look.coated:
        lines += _lacquer_choice_lines(linker, drawn)
    if look.inside:
        out = "out * "
        lines += _refraction_lines(u, look.glossy)
        lines += ["eq = where(pane, 0.0, eq)"] * weighted
    lines += [f"o{a} = {a} + 3.0 * h * {out}n{a}" for a in "xyz"]
    return [*lines, *_start_lines(linker, look)] if look.bodies else lines


def _start_lines(linker: Linker, look: Look) -> list[str]:
    """Lines for the start of a ray that may meet a body that glows: the ray is that of its point."""
    linker.bind("leave_", march.leave, {"steepness": 1 / ray_bound(look.root)})
    lines = ["fx, fy, fz = leave_(x, y, z, nx, ny, nz, ex, ey, ez, 3.0 * h, P)"]
    kept = "where(pane, o{0}, f{0})" if look.inside else "f{0}"
    return [*lines, *(f"o{a} = {kept.format(a)}" for a in "xyz")]


def _reflection_lines(linker: Linker, drawn: Drawn, look: Look) -> list[str]:
    """Lines for reflection by microfacets."""
    for function in (shade.width, shade.hidden, vocabulary.frame, shade.glossy):
        linker.share(function)
    u, v = drawn.names(2)
    lines = [f"ex, ey, ez, weight, half = glossy(dx, dy, dz, nx, ny, nz, roughness, {u}, {v})", "es = side"]
    return lines + [f"t{c} = weight * {look.facets.format(c)}" for c in CHANNELS]


def lacquer_lines(linker: Linker, colour: list[str]) -> list[str]:
    """Return the lines for the reflection of a light in a lacquer."""
    for function in (shade.dielectric, shade.lacquer):
        linker.share(function)
    lines = [f"spark, slope = highlight(nx, ny, nz, dx, dy, dz, lx, ly, lz, {shade.LACQUER})"]
    return lines + [
        f"glaze{c} = glaze{c} + power * {s} * spark * lacquer(slope, coat)"
        for c, s in zip(CHANNELS, colour, strict=True)
    ]


def _lacquer_choice_lines(linker: Linker, drawn: Drawn) -> list[str]:
    """Lines that choose between the reflection of a lacquer and the ray of the material under it."""
    for function in (shade.dielectric, shade.lacquer):
        linker.share(function)
    (u,) = drawn.names(1)
    lines = [
        "lacquer_ = lacquer(facing, coat)",
        f"glazed = {u} < lacquer_",
        "gx, gy, gz = mirrored(dx, dy, dz, nx, ny, nz)",
        *(f"e{a} = where(glazed, g{a}, e{a})" for a in "xyz"),
        "eq = where(glazed, 0.0, eq)",
    ]
    lines += [f"t{c} = where(glazed, 1.0, t{c})" for c in CHANNELS]
    return lines + [f"{c} = {c} * (1.0 - lacquer_)" for c in CHANNELS]


def _scatter_choice_lines(linker: Linker, drawn: Drawn, look: Look) -> list[str]:
    """Lines that choose between the reflected ray and a scattered one, and end some rays.

    One sample of both (Veach 1997), and Russian roulette with the probability of the throughput (Arvo and
    Kirk 1990).
    """
    for function in (vocabulary.disc, vocabulary.upward):
        linker.share(function)
    u, v, choice, life = drawn.names(4)
    lines = [f"wx, wy, wz = upward(nx, ny, nz, {u}, {v})"]
    if look.bodies:
        lines += materials.scatter_lines(linker, drawn, u, v, choice, look.facets)
    else:
        lines += [
            f"chosen = {choice} < share",
            *(f"e{a} = where(chosen, e{a}, w{a})" for a in "xyz"),
            *(
                f"t{c} = where(chosen, t{c} / maximum(share, 1e-6), c{c} / maximum(1.0 - share, 1e-6))"
                for c in CHANNELS
            ),
            "alive = minimum(maximum(maximum(tr, tg), tb), 1.0)",
        ]
    return lines + [f"t{c} = where({life} < alive, t{c} / maximum(alive, 1e-6), 0.0)" for c in CHANNELS]


def _refraction_lines(u: str, opaque: bool) -> list[str]:
    """Lines for transparent materials; opaque ones keep their ray if they have one."""
    ray = f"goes_on(dx, dy, dz, nx, ny, nz, side, reflect, clear, index, {u})"
    if not opaque:
        return [
            f"share, ex, ey, ez, out = {ray}",
            "es = side * out",
            *(f"t{c} = share * where(side < 0.0, exp(-absorb{c} * t), 1.0 + 0.0 * t)" for c in CHANNELS),
            *(f"{c} = {c} * where(side < 0.0, 0.0, 1.0 - share)" for c in CHANNELS),
        ]
    return [
        f"part, gx, gy, gz, out = {ray}",
        "pane = (clear > 0.0) | (side < 0.0)",
        "out = where(pane, out, 1.0)",
        "es = side * out",
        *(f"e{a} = where(pane, g{a}, e{a})" for a in "xyz"),
        *(f"t{c} = where(pane, part * where(side < 0.0, exp(-absorb{c} * t), 1.0), t{c})" for c in CHANNELS),
        *(f"{c} = {c} * where(pane, where(side < 0.0, 0.0, 1.0 - part), 1.0)" for c in CHANNELS),
    ]


def casts_shadows(light: Light) -> bool:
    """Return whether the light may be blocked; the surfaces in view never block a light at the camera."""
    return light.shadows == "yes" and KINDS[light.kind].is_blocked


def bind_light(linker: Linker, name: str, light: Light, eye: tuple[float, float, float], far: float) -> None:
    """Bind the unit of a light that does not surround the scene."""
    unit = KINDS[light.kind].unit
    assert unit is not None
    linker.bind(name, *unit(light, eye, far))


def seen_as_disc(light: Light) -> bool:
    """Return whether continued rays meet the light: a sun of some size."""
    return KINDS[light.kind].is_disc and light.size > 0 and light.shadows == "yes"


def tint(light: Light) -> tuple[float, ...]:
    """Return the linear colour of a light times its strength."""
    return tuple(c * light.strength for c in linear(light.colour))


@dataclass
class Surroundings:
    """Bindings of the lights that rays meet when they miss the scene."""

    linker: Linker  # linker of the kernel
    # true if lights are sampled by their own distribution and by the surface's; see `units.weights`
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


CHANNELS = "rgb"


def fog_lines(lighting: Lighting, fog: Fog, onward: bool) -> list[str]:
    """Return the lines that cover a surface with fog.

    Without a colour of its own, surfaces fade into what is behind them.
    """
    linker, values = lighting.linker, {"density": fog.density}
    if fog.height is None:
        linker.bind("clearness", shade.fog, values)
        lines = ["air = clearness(t, P)"]
    else:
        values |= {"level": fog.level, "height": fog.height}
        linker.bind("clearness", shade.height_fog, values)
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
        lines += _inscatter_lines(lighting, fog, values)
    return [*lines, *(f"t{c} = air * t{c}" for c in CHANNELS if onward)]


def _inscatter_lines(lighting: Lighting, fog: Fog, values: dict[str, float]) -> list[str]:
    """Lines for light that fog scatters to the eye, the same in all directions.

    One point of the ray, uniform by its length, sees each sun and lamp.
    """
    linker = lighting.linker
    (u,) = lighting.drawn.names(1)
    lines = [f"along = {u} * t", *(f"p{a} = {a} - (t - along) * d{a}" for a in "xyz")]
    if fog.height is None:
        lines.append(f"haze = t * clearness(along, P) * {linker.argument(fog.density)}")
    else:
        linker.bind("thickness_", shade.thickness, values)
        lines.append("haze = t * clearness(along, pz, dz, P) * thickness_(pz, P)")
    if lighting.inside:
        lines.append("haze = where(side < 0.0, 0.0, haze)")
    part = linker.argument(fog.scatter / 4)
    for k, light in enumerate(lighting.view.lights):
        if light.surrounds or not KINDS[light.kind].is_blocked:
            continue
        soft = lighting.drawn.names(2) if KINDS[light.kind].is_soft(light) else ["t", "t"]
        lines.append(f"lx, ly, lz, far, power = light{k}(px, py, pz, {', '.join(soft)}, P)")
        if light.shadows == "yes":
            lines.append("power = power * visible_(px, py, pz, lx, ly, lz, far, h, P)")
        lines += [
            f"{c} = {c} + {part} * haze * power * {linker.argument(s)}"
            for c, s in zip(CHANNELS, tint(light), strict=True)
        ]
    return lines


PATIENCE = 800
"""Maximum steps of a shadow ray."""


@dataclass
class Lighting:
    """Lights of a view, and the kernel lines for their light at a hit."""

    linker: Linker  # linker of the kernel
    drawn: Drawn  # random numbers of a bounce
    root: Node  # tree with resolved depths
    view: View  # the view, with its lights
    camera: Camera  # the camera
    seen: Optics  # lengths of the kernel
    inside: bool  # true if rays pass through the solid

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
            lines += division_lines(self.linker, look)
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
                write(self.linker, transparent, look.transparent())
            write(self.linker, blocker, self.blocker())
            lines += [f"s{a} = {a} + 3.0 * h * n{a}" for a in "xyz"]
        if self.weighted:
            pane = "where((clear > 0.0) | (side < 0.0), 1.0, last)" if look.inside else "last"
            lines.append(f"free = {pane}")
        for k, light in enumerate(self.view.lights):
            if light.is_picture and (look.paths or light.shadows == "yes"):
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
        return paths and any(x.is_picture or seen_as_disc(x) for x in self.view.lights)

    def blocker(self) -> list[str]:
        """Lines of `units.march.blocker`."""
        opaque = opaque_part(self.root)
        if opaque is self.root:
            return ["return field(x, y, z, P)"]
        if opaque is None:
            return ["return 0.0 * x + 1.0"]
        return [f"return {link_tree(self.linker, opaque, FieldDialect(self.linker))}"]

    def light(self, k: int, light: Light, look: Look) -> list[str]:
        """Lines for one sun or lamp, or a light at the camera."""
        self.linker.share(shade.phong)
        kind = KINDS[light.kind]
        u, v = self.drawn.names(2) if kind.is_soft(light) else ("t", "t")
        bind_light(self.linker, f"light{k}", light, self.camera.eye, self.seen.far)
        strength = light.strength * kind.scale(self.camera.eye, self.camera.target)
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
            shine = f"where(roughness > 0.0, spot * {look.facets}, gloss)"
        if self.weighted and seen_as_disc(light):
            self.around.bind_sun(k, light)
            lines += [f"dense = sun_density{k}(lx, ly, lz, P)", *self.weights(look)]
            scattered, reflected = "scattered * ", "reflected * "
        if look.coated:
            lines += lacquer_lines(self.linker, colour)
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
                materials.density("likely", "l"),
                "scattered, reflected = mixed_weights(dense, likely, roughness, free)",
            ]
        self.linker.share(weights)
        vocabulary = ", ".join(f"{v}{a}" for v in "ndl" for a in "xyz")
        return [f"scattered, reflected = weights(dense, diffuse, {vocabulary}, roughness, share, free)"]

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
        shine = f"where(roughness > 0.0, reflected * spot * {look.facets}, 0.0)"
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
            self.linker.share(upward)
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
        if light.is_picture:
            self.around.bind_irradiance("sky_", light)
            return
        names = {"zenith": light.colour, "horizon": light.horizon, "ground": light.ground}
        values = {n: tuple(c * light.strength for c in linear(colour)) for n, colour in names.items()}
        self.linker.bind("sky_", sky.sky, values)

    def fog(self, onward: bool) -> list[str]:
        """Lines for fog; see `fog_lines`."""
        fog = self.view.fog
        return [] if fog is None or fog.density == 0 else fog_lines(self, fog, onward)

    def background(self) -> list[str]:
        """Lines of `units.march.background`: the sky, else the colour of the fog, else of the film."""
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
        return [*lines, "return r, g, b"]
