"""Kernel generation: scene, view and camera to one kernel that calls only the units in use.

The functions of the kernel are those of `units.surface`. What a scene uses is told to them by records, which
are known when they are read: effects that a scene does not use generate no code.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..expr.frontend import kernel_function
from ..expr.graph import Function
from ..fields.linker import Linked, Linker
from ..fields.registry import Fixed, Node
from ..scene.view import Camera, View
from .lighting import LightLinker
from .materials import Drawn, Look, Materials
from .setup import Optics, footprint
from .units import camera as units
from .units import march
from .units.surface import lit_background, lit_surface, shown_surface

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
        self.materials = Materials(self.linker, self.root, self.paths)
        self.lights = LightLinker(
            self.linker, self.drawn, self.root, self.view, self.camera, self.seen, self.materials
        )

    def linked(self) -> Frame:
        """Link everything and return the frame."""
        linker, functions = self.linker, self.linker.functions
        linker.field(self.root)
        self.marching()
        camera_samples = self.cameras()
        far = len(linker.parameters)
        linker.argument((self.seen.far, *self.seen.origin, CIRCLE * self.seen.cone))
        self.bounces = self.view.shading.bounces if self.materials.bounces and self.lit else 0
        functions["background"] = kernel_function(lit_background, (("behind", self.lights.background()),))
        functions["surface"] = self.lit_surface() if self.lit else self.shown_surface()
        linked = linker.linked()
        samples = camera_samples, self.drawn.count
        kind = self.sharp, self.lit, self.view.film.transparent, self.lights.is_weighted
        faintest = 0.0 if self.paths else FAINTEST
        return Frame(linked, *samples, self.bounces, *kind, faintest, far)

    def marching(self) -> None:
        """Bind the units that march rays and cones."""
        linker, seen, steepness = self.linker, self.seen, {"steepness": self.lights.steepness}
        box = self.root.bounds.box
        lo = tuple(max(a, e - seen.far) for a, e in zip(box.lo, self.camera.eye, strict=True))
        hi = tuple(min(a, e + seen.far) for a, e in zip(box.hi, self.camera.eye, strict=True))
        rounded = {"rounding": seen.rounding, "glass": Fixed(self.materials.inside)}
        linker.functions["span_box"] = linker.bind(march.span, {"lo": lo, "hi": hi})
        linker.functions["step_ray"] = linker.bind(
            march.advance, {**steepness, **self.lights.widths(), **rounded}
        )
        linker.functions["step_cone"] = linker.bind(march.widen, steepness)

    def cameras(self) -> int:
        """Bind the camera; return the number of random numbers per camera ray."""
        self.linker.functions["camera_ray"] = self.linker.bind(*camera_unit(self.camera, self.seen.size))
        return 2 if self.sharp else 4

    @property
    def sharp(self) -> bool:
        """True if all rays start at the eye."""
        camera = self.camera
        return not (camera.aperture or camera.stereo or camera.kind == "orthographic")

    def lit_surface(self) -> Function:
        """Link the surface of a picture of light."""
        look = self.materials.look()
        if look.is_traced:
            self.trace()
        known = {"look": look, "lighting": self.lights.lighting(look, self.bounces), "fog": self.lights.fog()}
        return kernel_function(lit_surface, tuple(known.items()))

    def shown_surface(self) -> Function:
        """Link the surface of a picture of a value."""
        mode = self.view.shading.mode
        look = self.materials.coloured() if mode == "albedo" else Look()
        if look.is_traced or mode == "trap":
            self.trace()
        width = self.linker.bind(march.hit_width, self.lights.widths())
        forward = self.linker.argument(self.camera.forward)
        known = {"look": look, "width": width, "mode": mode, "forward": forward}
        return kernel_function(shown_surface, tuple(known.items()))

    def trace(self) -> None:
        """Link the number of the material and the orbit trap."""
        self.linker.functions["traced"] = self.materials.trace(self.root)
