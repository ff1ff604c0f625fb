"""A kernel holds what its scene uses, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from fracslice import render
from fracslice.expr.graph import text
from fracslice.fields.linker import link
from fracslice.fields.registry import Node
from fracslice.formulas import difference, intersection, mandelbulb, material, sphere, union
from fracslice.formulas.material import TRAPS
from fracslice.rendering.linking import Frame, link_frame
from fracslice.rendering.setup import optics
from fracslice.scene.view import Camera, Fog, Light, Shading, View
from tests.examples import stamped

pytestmark = pytest.mark.once

CAMERA = Camera(eye=(2, -2, 1))
PLAIN = (Light(shadows="no"),)
BULB = mandelbulb(iterations=4)


def frame(root: Node = BULB, camera: Camera = CAMERA, **view: object) -> Frame:
    whole = View(camera=camera, **{"lights": PLAIN, **view})  # type: ignore[arg-type]
    return link_frame(root, whole, camera, optics(camera, (32, 32), root, 1e-7))


def functions(seen: Frame) -> set[str]:
    """Names of all functions of a kernel."""
    return set(re.findall(r"(?m)^(\w+)\(.*\):$", text(*seen.linked.program.functions.values())))


EFFECTS = {
    "visible": {"lights": (Light(),)},
    "sun": {"lights": (Light(size=2, shadows="no"),)},
    "lamp": {"lights": (Light(kind="lamp", size=0.1, shadows="no"),)},
    "sharp_lamp": {"lights": (Light(kind="lamp", shadows="no"),)},
    "upward": {"lights": (Light(kind="sky"),)},
    "sky": {"lights": (Light(kind="sky", shadows="no"),)},
    "fog": {"fog": Fog()},
    "occlusion": {"shading": Shading(ambient=0.1, occlusion=1)},
    "lens": {"camera": Camera(eye=(2, -2, 1), aperture=0.1)},
    "palette": {"root": material(BULB, colour=(1, 0, 0, 0, 1, 0))},
    "_nearest_point": {"root": material(BULB, colour=(1, 0, 0, 0, 1, 0))},
    "_steps": {"root": material(BULB, palette="magma", trap="steps")},
    "_direction": {"root": material(BULB, palette="magma", trap="direction")},
    "reflects": {"root": material(BULB, reflect=0.2)},
    "goes_on": {"root": material(BULB, clear=0.9)},
    "glossy": {"root": material(BULB, roughness=0.5, reflect=0.1)},
    "height_fog": {"fog": Fog(height=1)},
    "thickness": {"fog": Fog(height=1, scatter=1), "lights": (Light(),)},
    "lacquer": {"root": material(BULB, coat=1)},
    "varied": {"root": material(BULB, vary=0.5)},
    "tinted_shadow": {"root": material(BULB, clear=0.9), "lights": (Light(),)},
    "sunshine": {"shading": Shading(paths="yes"), "lights": (Light(size=2),)},
    "disc": {"shading": Shading(paths="yes")},
    "body_density": {"root": material(BULB, glow=1), "shading": Shading(paths="yes")},
    "T3": {"root": union(material(BULB), sphere(radius=0.3))},
}


@pytest.mark.parametrize("line", EFFECTS)
def test_an_effect_is_in_the_kernel_of_a_scene_that_uses_it_and_in_no_other(line: str) -> None:
    assert line in functions(frame(**EFFECTS[line]))  # type: ignore[arg-type]
    assert line not in functions(frame())


@pytest.mark.parametrize("mode", ["normal", "position", "depth", "distance", "steps"])
def test_modes_that_show_a_number_light_nothing(mode: str) -> None:
    names = functions(frame(shading=Shading(mode=mode), lights=(Light(),)))
    assert "phong" not in names
    assert ("normal" in names) == (mode == "normal")


def test_numbers_are_no_source() -> None:
    one = frame(lights=(Light(strength=1, position=(1, 2, 3)),))
    other = frame(root=mandelbulb(iterations=9), camera=Camera(eye=(3, 0, 1)), lights=(Light(strength=5),))
    assert one.linked.program == other.linked.program


def test_random_numbers_are_drawn_for_what_needs_them() -> None:
    assert frame().samples == 2
    assert frame(lights=(Light(size=1), Light(kind="sky"))).samples == 6
    assert frame(camera=Camera(eye=(2, -2, 1), aperture=0.1)).samples == 4


def test_materials_change_no_field() -> None:
    assert link(material(BULB, colour=(1, 0, 0, 0, 1, 0), clear=0.5)).program == link(BULB).program


@pytest.mark.parametrize("trap", stamped(TRAPS, ["point", "planes"]))
def test_traps_colour_pictures_differently_and_leave_the_shape(trap: str) -> None:
    """One trap per material: a deeper one takes precedence. The field's code does not know of it."""
    plain, seen = material(BULB, palette="viridis"), material(BULB, palette="viridis", trap=trap)
    pictures = [render(root, size=(24, 24), samples=1) for root in (plain, seen, material(seen, trap="axes"))]
    assert (pictures[0] == pictures[1]).all() == (trap == "point")
    assert (pictures[1] == pictures[2]).all()
    assert link(plain).program == link(seen).program


@pytest.mark.parametrize("operator", [union, intersection, difference])
def test_an_operator_of_one_material_looks_like_that_material(operator: Callable[..., Node]) -> None:
    red = material(sphere(), colour=(1, 0, 0))
    alone, within = (render(root, size=(16, 12), samples=1) for root in (red, operator(red)))
    np.testing.assert_array_equal(within, alone)
    assert (alone[..., 0] > 2.0 * alone[..., 1]).any()
