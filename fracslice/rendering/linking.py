"""Kernel generation: scene, view and camera to one kernel that calls only the units in use.

The generated text is straight-line code. Every calculation is in a unit of `fracslice.rendering.units`, bound
to its parameters under a name. Effects that a scene does not use generate no code.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..expr.vocabulary import maximum, minimum
from ..fields.linker import Linked, Linker
from ..fields.registry import Fixed, Node
from ..scene.view import Camera, View
from .lighting import Lighting, onward
from .materials import Drawn, Look, glowing_bodies, wholly_met, write
from .setup import Optics, footprint, ray_bound
from .units import camera as units
from .units import march, shade
from .units.march import background, normal, surface

Unit = tuple[Callable[..., Any], dict[str, Any]]


def camera_unit(camera: Camera, size: tuple[int, int]) -> Unit:
    """Return the unit of a camera.

    `size` in pixels.
    """
    return _KINDS[camera.kind](camera, size)


def _flat(camera: Camera, size: tuple[int, int], pixel: float) -> dict[str, Any]:
    """A plane film at distance 1: its corner and its steps per pixel."""
    width, height = size
    right, up = np.array(camera.right), np.array(camera.above)
    corner = np.array(camera.forward) - right * (pixel * width / 2) + up * (pixel * height / 2)
    return {
        "eye": camera.eye,
        "corner": tuple(corner),
        "across": tuple(right * pixel),
        "down": tuple(-up * pixel),
    }


def _perspective(camera: Camera, size: tuple[int, int]) -> Unit:
    pixel, _ = footprint(camera, size)
    right, up = np.array(camera.right), np.array(camera.above)
    focus = camera.focus or math.dist(camera.eye, camera.target)
    if camera.stereo:
        half = size[0] // 2
        eyes = {"offset": tuple(right * camera.stereo / 2), "half": float(half), "focus": focus}
        return units.stereo, _flat(camera, (half, size[1]), pixel) | eyes
    values = _flat(camera, size, pixel)
    if camera.aperture == 0:
        return units.pinhole, values
    axes = {"right": tuple(right * camera.aperture), "up": tuple(up * camera.aperture), "focus": focus}
    return units.lens, values | axes


def _orthographic(camera: Camera, size: tuple[int, int]) -> Unit:
    _, pixel = footprint(camera, size)
    values = _flat(camera, size, pixel)
    corner = np.array(values["corner"]) - camera.forward + camera.eye
    return units.orthographic, values | {"corner": tuple(corner), "forward": camera.forward}


def _fisheye(camera: Camera, size: tuple[int, int]) -> Unit:
    pixel, _ = footprint(camera, size)
    middle = {"middle": (size[0] / 2, size[1] / 2), "pixel": pixel}
    return units.fisheye, _axes(camera) | middle


def _equirectangular(camera: Camera, size: tuple[int, int]) -> Unit:
    width = size[0] // 2 if camera.stereo else size[0]
    film = {"width": float(width), "height": float(size[1]), "radius": camera.stereo / 2}
    return units.equirectangular, _axes(camera) | film


def _axes(camera: Camera) -> dict[str, Any]:
    axes = {"right": camera.right, "up": camera.above, "forward": camera.forward}
    return {"eye": camera.eye} | axes


_KINDS: dict[str, Callable[[Camera, tuple[int, int]], Unit]] = {
    "perspective": _perspective,
    "orthographic": _orthographic,
    "fisheye": _fisheye,
    "equirectangular": _equirectangular,
}


CIRCLE = 1.4143 * 1.02
"""Radius of the circle around a pixel, half sides, with 2 % for the film's perspective."""


SHARPER = 16.0
"""Ratio of a pixel to the width over which normals of glass are taken: a wider edge is seen as a hairline."""
FAINTEST = 0.002
"""Sum of the throughputs up to which a ray of mirrors and glass ends."""


@dataclass(frozen=True)
class Frame:
    """Kernel of one scene, camera and depth. Frames of one scene differ only in their parameters."""

    linked: Linked  # kernel source and parameters P
    camera_samples: int  # random numbers per camera ray, and per bounce
    bounce_samples: int
    bounces: int  # maximum bounces of a ray
    sharp: bool  # true if all rays start at the eye, so that the cone prepass applies
    lit: bool  # true for a picture of light, False for one of values such as depth
    transparent: bool  # true if the light of camera rays that miss is left out
    weighted: bool  # true if continued rays carry the density of their direction
    faintest: float  # sum of the throughputs up to which a ray ends; 0 on paths, which end at random
    # index in P of the far distance; the upper left pixel of the picture follows, and the half width of a
    # pixel's cone at distance 1
    far: int

    @property
    def samples(self) -> int:
        """Random numbers per sample."""
        return self.camera_samples + (self.bounces + 1) * self.bounce_samples


def link_frame(root: Node, view: View, camera: Camera, seen: Optics) -> Frame:
    """Link the kernel of a scene."""
    return _Frame(root, view, camera, seen).linked()


@dataclass
class _Frame:
    """Builder of a frame."""

    root: Node
    view: View
    camera: Camera
    seen: Optics
    linker: Linker = field(default_factory=Linker)
    drawn: Drawn = field(default_factory=Drawn)
    bounces: int = 0

    def __post_init__(self) -> None:
        self.lit = self.view.shading.mode == "light"
        self.paths = self.view.shading.paths == "yes"
        of = self.root, self.view, self.camera, self.seen
        self.lighting = Lighting(self.linker, self.drawn, *of, self.inside)

    def linked(self) -> Frame:
        """Link everything and return the frame."""
        linker = self.linker
        linker.field(self.root)
        self.marching()
        camera_samples = self.cameras()
        look = Look(linker, self.root, self.paths)
        far = len(linker.parameters)
        for number in (self.seen.far, *self.seen.origin, CIRCLE * self.seen.cone):
            linker.argument(number)
        self.bounces = self.view.shading.bounces if look.bounces and self.lit else 0
        write(linker, background, self.lighting.background())
        write(linker, surface, self.surface(look))
        linked = linker.linked()
        samples = camera_samples, self.drawn.count
        kind = self.sharp, self.lit, self.view.film.transparent, self.lighting.weighted
        faintest = 0.0 if self.paths else FAINTEST
        return Frame(linked, *samples, self.bounces, *kind, faintest, far)

    def marching(self) -> None:
        """Bind the units that march rays and cones."""
        seen, steepness = self.seen, 1 / ray_bound(self.root)
        box = self.root.bounds.box
        lo = tuple(max(a, e - seen.far) for a, e in zip(box.lo, self.camera.eye, strict=True))
        hi = tuple(min(a, e + seen.far) for a, e in zip(box.hi, self.camera.eye, strict=True))
        self.linker.bind("span_box", march.span, {"lo": lo, "hi": hi})
        part = wholly_met(glowing_bodies(self.root), self.camera.eye, seen) if self.paths else 1.0
        width = {"cone": part * seen.cone, "least": max(part * seen.least, seen.rounding)}
        rounded = {"rounding": seen.rounding, "glass": Fixed(self.inside)}
        stepping = {"steepness": steepness, **width, **rounded}
        self.linker.bind("step_ray", march.advance, stepping)
        self.linker.bind("step_cone", march.widen, {"steepness": steepness})
        self.linker.bind("width_at", _width, width)
        if self.inside:
            self.linker.bind("sharp_width", _sharp_width, {"rounding": seen.rounding})

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

    def surface(self, look: Look) -> list[str]:
        """Lines of `units.march.surface`."""
        mode = self.view.shading.mode
        lines = ["h = width_at(path + t, P)"]
        if mode in ("light", "normal") or (mode == "albedo" and look.textured):
            self.linker.share(normal)
            width = "sharp_width(h, P)" if self.inside and mode == "light" else "h"
            lines.append(f"nx, ny, nz = normal(x, y, z, {width}, P)")
        if mode == "light":
            lines += look.lines()
            if look.rough and self.lighting.weighted:
                self.linker.share(shade.dulled)
                lines.append("roughness = dulled(roughness, q)")
            lines += self.lighting.lines(look)
            if self.bounces:
                lines += onward(self.linker, self.drawn, look, self.lighting.weighted)
            if look.coated:
                lines += [f"{c} = {c} + glaze{c}" for c in "rgb"]
            lines += self.lighting.fog(self.bounces > 0)
        else:
            lines += self.shown(mode, look)
        ray = "tr, tg, tb, ox, oy, oz, ex, ey, ez, es, eq" if self.bounces else ""
        return [*lines, f"return (r, g, b), ({ray})"]

    def shown(self, mode: str, look: Look) -> list[str]:
        """Lines for the modes that show a value."""
        if mode == "normal":
            return [f"{c} = n{a}" for c, a in zip("rgb", "xyz", strict=True)]
        if mode == "position":
            return [f"{c} = {a}" for c, a in zip("rgb", "xyz", strict=True)]
        if mode == "albedo":
            return [*look.lines(), *(f"{c} = c{c}" for c in "rgb")]
        if mode == "trap":
            return [*look.trap(), "r, g, b = tone, tone, tone"]
        value = {"steps": "steps", "distance": "t"}.get(mode)
        along = zip(self.camera.forward, "xyz", strict=True)
        value = value or " + ".join(f"{self.linker.argument(f)} * t * d{a}" for f, a in along)
        return [f"r = {value} + 0.0 * t", "g = r", "b = r"]


def _width(t, cone, least):  # type: ignore[no-untyped-def]
    """Hit tolerance at distance t."""
    return cone * t + least


def _sharp_width(h, rounding):  # type: ignore[no-untyped-def]
    """Half width over which a normal is taken where rays are bent, at least that of rounding's noise."""
    return minimum(h, maximum(h / SHARPER, 32.0 * rounding))
