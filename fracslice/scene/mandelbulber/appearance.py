"""Camera, film, lights, fog and material of Mandelbulber's settings.

The axes are ours: x to the right, y forwards and z up where the camera is not turned. Light is not
computed as there, so that colours, strengths and fog are near theirs, and no more.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from ...errors import SceneError
from ...formulas import Node, get
from ..view import Camera, Film, Fog, Light, Shading, View
from .settings import Settings, SettingsSection, Triple

KINDS = {
    "three_point": "perspective",
    "fish_eye": "fisheye",
    "equirectangular": "equirectangular",
    "fish_eye_cut": "fisheye",
}
"""Projections of Mandelbulber, and ours."""

LARGEST_SIDE = 4096
"""Most pixels along a side of the film."""

DIRECTIONAL = "directional"
LIGHT_TYPES = (DIRECTIONAL, "point", "spot", "projection", "beam")

CYCLE = 2560.0
"""Colour index that runs through a gradient once."""

RATES = {7: 1000.0, 10: 1000.0, 207: 1000.0, 61: 1000.0, 113: 1000.0, 8: 1000.0, 9: 1000.0}
"""Colour index for a distance 1 of the orbit by formula; of others that of `RATE`."""
RATE = 5000.0

GRADIENT = (
    "0 fd6029 1000 698403 2000 fff59b 3000 f5bd22 4000 0b5e87 "
    "5000 c68876 6000 a51c64 7000 3b9fee 8000 d4ffd4 9000 aba53c"
)
"""Gradient of a material where the file has none."""

MOST_COLOURS = 8


def camera(settings: Settings) -> Camera:
    """Camera of a file."""
    main = settings.main
    kind = KINDS[main.one_of("perspective_type", tuple(KINDS))]
    eye, target = main.vector("camera", "3 -6 2"), main.vector("target", "0 0 0")
    up = main.vector("camera_top", "-0.1277753 0.2555506 0.958314")
    try:
        return Camera(kind=kind, eye=eye, target=target, up=up, fov=field_of_view(settings, kind))
    except SceneError as error:
        raise SceneError(f"{main.place('camera')}: camera: {error}") from None


def field_of_view(settings: Settings, kind: str) -> float:
    """Angle from edge to edge, degrees; before version 2.21 it was a ratio, or a part of a turn."""
    main = settings.main
    fov = main.number("fov", "53.13")
    if settings.version < 2.21:
        ratio = 1.0 if fov == 53.13 else fov
        fov = {"perspective": math.degrees(2 * math.atan(ratio / 2)), "fisheye": ratio * 180}.get(
            kind, ratio * 360
        )
    return float(f"{min(max(fov, 0.01), 170.0 if kind == 'perspective' else 360.0):.8g}")


def film(settings: Settings) -> Film:
    """Film of a file: its size, its background and its tone."""
    main = settings.main
    width, height = main.whole("image_width", "800"), main.whole("image_height", "600")
    shrink = max(1.0, max(width, height) / LARGEST_SIDE)
    brightness = main.number("brightness", "1")
    exposure = max(-6.0, min(6.0, math.log2(brightness))) if brightness > 0 else 0.0
    size = [max(round(side / shrink), 1) for side in (width, height)]
    return Film(width=size[0], height=size[1], background=background(main), exposure=round(exposure, 3))


def background(main: SettingsSection) -> Triple:
    """Middle of the colours of the background."""
    names = ("0000 95a2 ffff", "ffff ffff ffff", "0000 2710 01f4")
    colours = [main.colour(f"background_color_{k}", name) for k, name in enumerate(names, 1)]
    used = colours if main.flag("background_3_colors_enable", "true") else colours[:2]
    gain = main.number("background_brightness", "1")
    mean = (sum(c[k] for c in used) / len(used) * gain for k in range(3))
    red, green, blue = (round(min(max(value, 0.0), 1.0), 4) for value in mean)
    return red, green, blue


def sky(main: SettingsSection) -> Light:
    """Sky in the colours of the background."""
    up, middle = (
        main.colour("background_color_1", "0000 95a2 ffff"),
        main.colour("background_color_2", "ffff ffff ffff"),
    )
    down = main.colour("background_color_3", "0000 2710 01f4")
    if not main.flag("background_3_colors_enable", "true"):
        down = middle
    return Light(kind="sky", colour=up, horizon=middle, ground=down, strength=0.35)


def lights(settings: Settings, seen: Camera) -> tuple[Light, ...]:
    """Lights of a file: the first is a sun by default, which turns with the camera."""
    found = [sky(settings.main)]
    for k in range(1, 10):
        made = light(settings, k, seen)
        if made is not None:
            found.append(made)
    return tuple(found)


def light(settings: Settings, k: int, seen: Camera) -> Light | None:
    """One light, or None if it is off."""
    main = settings.main
    defined = main.flag(f"light{k}_is_defined", "true" if k == 1 else "false")
    if not defined or not main.flag(f"light{k}_enabled", "true" if k == 1 else "false"):
        return None
    strength = main.number(
        f"light{k}_intensity", {1: "1", 2: "0.325", 3: "0.25", 4: "0.75", 5: "0.5"}.get(k, "1")
    )
    if settings.version < 2.25 and k > 1 and main.given(f"light{k}_intensity"):
        strength /= 4
    colour = main.colour(f"light{k}_color", "ffff ffff ffff")
    shadows = "yes" if main.flag(f"light{k}_cast_shadows", "true") else "no"
    kind = main.one_of(f"light{k}_type", LIGHT_TYPES) if k == 1 or main.given(f"light{k}_type") else "point"
    strength = min(max(strength, 0.0), 1e6)
    if kind == DIRECTIONAL:
        where = direction(settings, k, seen)
        return Light(kind="sun", position=where, colour=colour, strength=3 * strength, shadows=shadows)
    position = main.vector(f"light{k}_position", "0 0 0")
    if not any(position):
        position = (0.0, 0.0, 1e-6)
    return Light(kind="lamp", position=position, colour=colour, strength=3 * strength, shadows=shadows)


def direction(settings: Settings, k: int, seen: Camera) -> Triple:
    """Direction in which a sun stands: from behind the camera, turned to its side and up."""
    main = settings.main
    alpha, beta, _ = main.vector(f"light{k}_rotation", "-45 45 0" if k == 1 else "0 0 0")
    if settings.version < 2.25:
        alpha, beta = main.number(f"light{k}_alpha", "-45"), main.number(f"light{k}_beta", "45")
    a, b = math.radians(alpha), math.radians(beta)
    x, y, z = -math.sin(-a) * math.cos(b), -math.cos(a) * math.cos(b), math.sin(b)
    if main.flag(f"light{k}_relative_position", "true" if k == 1 else "false"):
        axes = seen.right, seen.forward, seen.above
        x, y, z = (sum(v * axis[n] for v, axis in zip((x, y, z), axes, strict=True)) for n in range(3))
    return round(x, 6), round(y, 6), round(z, 6)


def fog(main: SettingsSection) -> Fog | None:
    """Haze of a file: half of the light is left at the distance of its visibility."""
    if not main.flag("basic_fog_enabled", "false"):
        return None
    distance = max(main.number("basic_fog_visibility", "20"), 1e-6)
    colour = main.colour("basic_fog_color", "eb84 f04d ffff")
    return Fog(colour=colour, density=min(round(math.log(2) / distance, 6), 1e6))


def shading(main: SettingsSection, seen: Camera) -> Shading:
    """Ambient light, which is darker in holes; its strength there is that of the occlusion."""
    strength = (
        main.number("ambient_occlusion", "1") if main.flag("ambient_occlusion_enabled", "false") else 0.25
    )
    reach = float(f"{max(0.5 * math.dist(seen.eye, seen.target), 1e-9):.3g}")
    return Shading(ambient=round(min(max(0.4 * strength, 0.0), 100.0), 4), occlusion=1.0, reach=reach)


def view(settings: Settings) -> View:
    """View of a file."""
    seen = camera(settings)
    return View(
        camera=seen,
        film=film(settings),
        lights=lights(settings, seen),
        fog=fog(settings.main),
        shading=shading(settings.main, seen),
    )


def gradient(section: SettingsSection, name: str) -> list[Triple]:
    """Colours of a gradient at eight places or fewer."""
    words = section.text(name, GRADIENT).split()
    try:
        stops = sorted(
            (float(at) / 10000, tuple(int(rgb[k : k + 2], 16) / 255 for k in (0, 2, 4)))
            for at, rgb in zip(words[::2], words[1::2], strict=True)
        )
    except ValueError:
        raise section.fail(name, "pairs of a place from 0 to 9999 and a colour such as ff8000") from None
    if not stops:
        raise section.fail(name, "at least one colour")
    count = min(len(stops), MOST_COLOURS)
    if len(stops) <= MOST_COLOURS:
        return [rounded(colour) for _, colour in stops]
    return [rounded(at(stops, k / count)) for k in range(count)]


def rounded(colour: tuple[float, ...]) -> Triple:
    red, green, blue = (round(value, 3) for value in colour)
    return red, green, blue


def at(stops: list[tuple[float, tuple[float, ...]]], place: float) -> tuple[float, ...]:
    """Colour of a gradient, which is a circle."""
    around = [(stops[-1][0] - 1, stops[-1][1]), *stops, (stops[0][0] + 1, stops[0][1])]
    for (a, first), (b, second) in pairwise(around):
        if a <= place <= b and b > a:
            share = (place - a) / (b - a)
            return tuple(p + share * (q - p) for p, q in zip(first, second, strict=True))
    return stops[0][1]


def material(node: Node, settings: Settings, number: int, formula: int = 0) -> Node:
    """An element with one of the file's materials."""
    main, prefix = settings.main, f"mat{number}_"
    values: dict[str, Any] = {}
    if main.flag(prefix + "use_colors_from_palette", "true") and main.flag(
        prefix + "surface_gradient_enable", "true"
    ):
        colours = gradient(main, prefix + "surface_color_gradient")
        values["colour"] = tuple(value for colour in colours for value in colour)
        if len(colours) > 1:
            speed = main.number(prefix + "coloring_speed", "1") * RATES.get(formula, RATE) / CYCLE
            values["repeats"] = round(min(max(abs(speed), 0.01), 1000), 4)
            values["shift"] = round(main.number(prefix + "coloring_palette_offset", "0") % 1, 4)
    else:
        values["colour"] = main.colour(prefix + "surface_color", "ffff ffff ffff")
    values["specular"] = round(min(max(main.number(prefix + "specular", "10") / 10, 0), 100) * 0.2, 4)
    values["reflect"] = reflection(main, prefix)
    values["glow"] = round(min(max(main.number(prefix + "luminosity", "0"), 0), 1000), 4)
    clear = round(min(max(main.number(prefix + "transparency_of_surface", "0"), 0), 1), 4)
    if clear:
        index = main.number(prefix + "transparency_index_of_refraction", "1")
        values |= {"clear": clear, "index": round(min(max(index, 1), 4), 4)}
    return get("material")(node, **values)


def reflection(main: SettingsSection, prefix: str) -> float:
    """Part of the light that a material mirrors head on; by Fresnel's law that of its index."""
    share = main.number(prefix + "reflectance", "0")
    if not main.flag("raytraced_reflections", "false"):
        return 0.0
    if main.flag(prefix + "fresnel_reflectance", "false"):
        index = max(main.number(prefix + "transparency_index_of_refraction", "1.5"), 1.0)
        share *= ((index - 1) / (index + 1)) ** 2
    return round(min(max(share, 0), 1), 4)
