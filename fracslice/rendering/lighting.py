"""Lights, sky, fog and rays that continue, linked for the functions of `units.surface`.

The records say what a scene uses: None stands for what it does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..expr.frontend import kernel_function
from ..expr.graph import Entry, Function
from ..fields.linker import FIELD, FieldDialect, Linker, link_tree
from ..fields.registry import Fixed, Node
from ..scene.lights import KINDS, sky
from ..scene.view import Camera, Light, View
from .environments import PIXELS, Environment, environment, load_picture
from .materials import Drawn, Look, Materials, glowing_bodies, opaque_part, transparent_part, wholly_met
from .setup import Optics, ray_bound
from .units import march, shade
from .units.camera import linear
from .units.surface import glass, nothing

PATIENCE = 800
"""Maximum steps of a shadow ray."""
BEYOND = 1e-3
"""Part of the box's longest side by which shadow rays go beyond it."""
SHARPER = 16.0
"""Ratio of a pixel to the width over which normals of glass are taken: a wider edge is seen as a hairline."""

Colour = tuple[Entry, ...]


class Lamp(NamedTuple):
    """A sun, a lamp or a light at the camera."""

    emission: Function
    colour: Colour
    is_soft: bool  # whether it has random numbers
    is_blocked: bool  # whether it casts shadows
    chance: int  # place of its random numbers
    density: Function | None = None  # of the samples of a sun that rays meet, too
    kind: str = "lamp"


class Surroundings(NamedTuple):
    """A picture of the surroundings whose light is sampled."""

    towards: Function
    light: Function
    far: Entry
    chance: int
    kind: str = "surroundings"


class Sky(NamedTuple):
    """A sky, or an environment without shadows."""

    light: Function
    is_blocked: bool
    far: Entry | None
    chance: int
    kind: str = "sky"


class Onward(NamedTuple):
    """Rays that continue: places of their random numbers, and their start if they may meet bodies."""

    glass: int
    facet: int
    scatter: int
    body: int
    lacquer: int
    leave: Function | None


class Lighting(NamedTuple):
    """Light of a surface, and the rays from it."""

    width: Function
    sharp_width: Function | None
    is_weighted: bool  # see `LightLinker.is_weighted`
    ambient: Entry | None
    openness: Function | None
    visible: Function | None
    unobstructed: Function | None
    tinted_shadow: Function | None
    lights: tuple[Lamp | Surroundings | Sky, ...]
    onward: Onward | None


class Haze(NamedTuple):
    """Fog."""

    clearness: Function
    thickness: Function | None  # of fog that thins with the height
    density: Entry
    colour: Colour | None
    scatter: Entry | None
    chance: int
    lamps: tuple[Lamp, ...]  # those whose light it scatters


class Disc(NamedTuple):
    """A sun that rays meet: density of its samples, and its light."""

    density: Function
    colour: Colour


class Behind(NamedTuple):
    """Light of rays that miss the scene."""

    colour: Colour | None
    light: Function | None
    likelihood: Function | None
    suns: tuple[Disc, ...]


def casts_shadows(light: Light) -> bool:
    """Return whether the light may be blocked; the surfaces in view never block a light at the camera."""
    return light.shadows == "yes" and KINDS[light.kind].is_blocked


def seen_as_disc(light: Light) -> bool:
    """Return whether continued rays meet the light: a sun of some size."""
    return KINDS[light.kind].is_disc and light.size > 0 and light.shadows == "yes"


def tint(light: Light) -> tuple[float, ...]:
    """Return the linear colour of a light times its strength."""
    return tuple(c * light.strength for c in linear(light.colour))


@dataclass
class LightLinker:
    """Links the lights and the fog of a view."""

    linker: Linker  # linker of the kernel
    drawn: Drawn  # random numbers of a bounce
    root: Node  # tree with resolved depths
    view: View  # the view, with its lights
    camera: Camera  # the camera
    seen: Optics  # lengths of the kernel
    materials: Materials  # of the scene

    @property
    def is_lit(self) -> bool:
        """True for a picture of light."""
        return self.view.shading.mode == "light"

    @property
    def is_weighted(self) -> bool:
        """True if lights are sampled by their own distribution and by the surface's; see `units.shade`."""
        paths = self.materials.paths and self.is_lit
        return paths and any(x.is_picture or seen_as_disc(x) for x in self.view.lights)

    @property
    def steepness(self) -> float:
        """Reciprocal of the Lipschitz bound of rays."""
        return 1 / ray_bound(self.root)

    def widths(self) -> dict[str, float]:
        """Half width of a pixel at distance 1 and at distance 0, for rays that pass by no body."""
        seen, part = self.seen, 1.0
        if self.materials.paths:
            part = wholly_met(glowing_bodies(self.root), self.camera.eye, seen)
        return {"cone": part * seen.cone, "least": max(part * seen.least, seen.rounding)}

    def lighting(self, look: Look, bounces: int) -> Lighting:
        """Link the lights, and rays that continue if there are bounces."""
        shading, inside = self.view.shading, self.materials.inside
        rounding = {"rounding": self.seen.rounding, "sharper": SHARPER}
        is_open = shading.ambient and shading.occlusion
        occlusion = {"strength": shading.occlusion, "reach": shading.reach}
        lights = tuple(link for link in map(self.light, self.view.lights) if link)
        return Lighting(
            self.linker.bind(march.hit_width, self.widths()),
            self.linker.bind(march.sharp_width, rounding) if inside else None,
            self.is_weighted,
            self.linker.argument(shading.ambient) if shading.ambient else None,
            self.linker.bind(shade.occlusion, occlusion) if is_open else None,
            *self.shadows(look),
            lights,
            self.onward(look) if bounces else None,
        )

    def shadows(self, look: Look) -> tuple[Function | None, Function | None, Function | None]:
        """Link shadow rays: past opaque parts, past all parts, and through transparent ones."""
        blocked = any(map(casts_shadows, self.view.lights))
        if not blocked and not (look.is_path and any(light.is_picture for light in self.view.lights)):
            return None, None, None
        marched = {"steepness": self.steepness, "patience": PATIENCE}
        self.linker.functions["blocker"] = self.blocker()
        box = self.root.bounds.box
        box = box.grown(BEYOND * max(box.size)) if box.finite else box
        ends = marched | {"lo": box.lo, "hi": box.hi}
        visible = self.linker.bind(march.visible, {**ends, "glass": Fixed(False)})
        part = transparent_part(self.root) if self.materials.inside else None
        if not part:
            return visible, None, None
        self.linker.functions["traced_glass"] = self.materials.trace(part)
        self.linker.functions["transparent"] = kernel_function(glass, (("look", look),))
        unobstructed = self.linker.bind(march.visible, {**ends, "glass": Fixed(True)})
        return visible, unobstructed, self.linker.bind(march.tinted_shadow, marched)

    def blocker(self) -> Function:
        """Return the field of the opaque parts."""
        opaque = opaque_part(self.root)
        if opaque is self.root:
            return self.linker.functions[FIELD]
        if opaque is None:
            return kernel_function(nothing)
        return link_tree(self.linker, opaque, FieldDialect())

    def light(self, light: Light) -> Lamp | Surroundings | Sky | None:
        """Link a light; None for one that only rays see that continue."""
        paths = self.materials.paths
        if light.is_picture and (paths or light.shadows == "yes"):
            sampling, far = self.linker.bind(shade.towards, self.sampling(light)), self.far()
            return Surroundings(sampling, self.surroundings(light), far, self.drawn.place(2))
        if not light.surrounds:
            kind = KINDS[light.kind]
            strength = light.strength * kind.scale(self.camera.eye, self.camera.target)
            is_disc = self.is_weighted and seen_as_disc(light)
            return self.lamp(light, strength, self.disc_density(light) if is_disc else None)
        if paths:
            return None
        is_blocked = light.shadows == "yes"
        return Sky(self.sky(light), is_blocked, self.far(), self.drawn.place(2 * is_blocked))

    def lamp(self, light: Light, strength: float, density: Function | None = None) -> Lamp:
        """Link a light that does not surround the scene."""
        kind = KINDS[light.kind]
        assert kind.unit is not None
        emission = self.linker.bind(*kind.unit(light, self.camera.eye, self.seen.far))
        colour = self.linker.argument(tuple(c * strength for c in linear(light.colour)))
        is_soft = kind.is_soft(light)
        return Lamp(emission, colour, is_soft, casts_shadows(light), self.drawn.place(2 * is_soft), density)

    def far(self) -> Entry:
        """Link the distance at which rays end."""
        entry: Entry = self.linker.argument(self.seen.far)
        return entry

    def sky(self, light: Light) -> Function:
        """Bind the unit of the sky, or of the light of an environment without shadows."""
        if light.is_picture:
            made, turn = picture_of(light), light.rotation / 360
            factors = zip(tint(light), made.harmonics(turn), strict=True)
            harmonics = tuple(tuple(t * f for f in channel) for t, channel in factors)
            return self.linker.bind(shade.irradiance, {"harmonics": harmonics})
        names = {"zenith": light.colour, "horizon": light.horizon, "ground": light.ground}
        values = {n: tuple(c * light.strength for c in linear(colour)) for n, colour in names.items()}
        return self.linker.bind(sky.sky, values)

    def surroundings(self, light: Light) -> Function:
        """Bind the light of an environment in a direction."""
        picture = picture_of(light).picture
        width, height = picture.size
        values = {"width": width, "height": height, "tint": tint(light), "light": picture.light}
        return self.linker.bind(shade.surroundings, values | {"turn": light.rotation / 360})

    def sampling(self, light: Light) -> dict[str, Any]:
        """Tables by which an environment is sampled."""
        made = picture_of(light)
        rows, columns = made.distribution
        values = {"size": made.picture.size, "turn": light.rotation / 360, "rows": rows, "columns": columns}
        return values | {"steps": made.steps, "halves": made.halves}

    def disc_density(self, light: Light) -> Function:
        """Bind the density of the samples of a sun."""
        towards = tuple(p / math.hypot(*light.position) for p in light.position)
        values = {"towards": towards, "spread": math.tan(math.radians(light.size) / 2)}
        return self.linker.bind(shade.sun_density, values)

    def onward(self, look: Look) -> Onward:
        """Link rays that continue."""
        place, leave = self.drawn.place, None
        if look.bodies:
            leave = self.linker.bind(march.leave, {"steepness": self.steepness})
        return Onward(
            glass=place(1 * bool(look.clear)),
            facet=place(2 * bool(look.roughness)),
            scatter=place(4 * look.is_path),
            body=place(1 * bool(look.bodies)),
            lacquer=place(1 * bool(look.coat)),
            leave=leave,
        )

    def fog(self) -> Haze | None:
        """Link the fog."""
        fog = self.view.fog
        if fog is None or fog.density == 0:
            return None
        values, thickness = {"density": fog.density}, None
        if fog.height is not None:
            values |= {"level": fog.level, "height": fog.height}
            thickness = self.linker.bind(shade.thickness, values)
        chance = self.drawn.place(1 if fog.scatter else 0)
        blocked = (x for x in self.view.lights if not x.surrounds and KINDS[x.kind].is_blocked)
        return Haze(
            self.linker.bind(shade.fog if fog.height is None else shade.height_fog, values),
            thickness,
            self.linker.argument(fog.density),
            self.linker.argument(linear(fog.colour)) if fog.colour else None,
            self.linker.argument(fog.scatter / 4) if fog.scatter else None,
            chance,
            tuple(self.lamp(light, light.strength) for light in blocked) if fog.scatter else (),
        )

    def background(self) -> Behind:
        """Link what rays meet that miss the scene: the sky, else the colour of the fog, else of the film."""
        view, colour, light, likelihood = self.view, None, None, None
        around = next((x for x in view.lights if self.is_lit and x.surrounds), None)
        if around is None:
            own = view.fog and view.fog.colour
            shown = (0.0, 0.0, 0.0) if not self.is_lit else own or view.film.background
            colour = self.linker.argument(linear(shown))
        elif around.kind == "sky":
            light = self.sky(around)
        else:
            light = self.surroundings(around)
            if self.is_weighted:
                tables = self.sampling(around)
                likelihood = self.linker.bind(shade.likelihood, tables)
        seen = (x for x in view.lights if self.is_weighted and seen_as_disc(x))
        suns = tuple(Disc(self.disc_density(x), self.linker.argument(tint(x))) for x in seen)
        return Behind(colour, light, likelihood, suns)


def picture_of(light: Light) -> Environment:
    """Return the tables of an environment."""
    assert light.file
    return environment(load_picture(light.file, PIXELS, light.fail))
