"""Appearance of an element: materials and palettes. It does not change the shape.

Values of the colour maps by Smith and van der Walt 2015 (viridis, plasma, inferno, magma), Nunez, Anderton
and Renslow 2018 (cividis) and Breusch 2018 (twilight), all in the public domain (CC0). A palette is run
through in a circle, so maps that do not end as they begin go there and back.
"""

from __future__ import annotations

from typing import get_args

from ..common.parameters import Choice, File, Number, Vector
from ..fields.box import Box
from ..fields.registry import Node, always_keeps_sign, domain_operator
from ..records import Colour

OWN = "colours"
"""The stops are the material's own colours."""

_STOPS = {
    "viridis": "440154 3b528b 21918c 5ec962 fde725 5ec962 21918c 3b528b",
    "plasma": "0d0887 7e03a8 cc4778 f89540 f0f921 f89540 cc4778 7e03a8",
    "inferno": "000004 57106e bc3754 f98e09 fcffa4 f98e09 bc3754 57106e",
    "magma": "000004 51127c b73779 fc8961 fcfdbf fc8961 b73779 51127c",
    "cividis": "00224e 434e6c 7d7c78 bcae6c fee838 bcae6c 7d7c78 434e6c",
    "twilight": "e2d9e2 95b5c7 6276ba 592a8f 2f1436 741e4f b25652 cca389",
}

PALETTES = {
    name: tuple(int(stop[k : k + 2], 16) / 255 for stop in text.split() for k in (0, 2, 4))
    for name, text in _STOPS.items()
}
"""sRGB components of the stops, in [0, 1], by name."""


TRAPS = get_args(Colour)[1:]
"""Properties of an orbit that a palette shows."""


@domain_operator(
    colour=Vector(
        (0.8, 0.8, 0.8),
        "red, green and blue; several colours, three numbers each, are a palette for the orbit",
        sizes=tuple(range(3, 25, 3)),
        least=0,
        most=1,
    ),
    palette=Choice(OWN, "a palette by name in place of the colours", (OWN, *PALETTES)),
    trap=Choice(
        "point",
        "property of the orbit that the palette shows",
        TRAPS,
    ),
    texture=File(None, "a picture that multiplies the colour, seen along the three axes"),
    tile=Number(1.0, "width of that picture, in scene units", above=0),
    repeats=Number(1.0, "how often the palette is run through", above=0, most=1000),
    shift=Number(0.0, "where in the palette it starts, from 0 to 1", least=0, most=1),
    specular=Number(0.2, "strength of the highlight", least=0, most=100),
    shininess=Number(32.0, "sharpness of the highlight", least=1, most=10000),
    glow=Number(0.0, "light of its own, in its colour", least=0, most=1000),
    reflect=Number(
        0.0, "the part of light that is mirrored head on; more is at grazing angles", least=0, most=1
    ),
    roughness=Number(0.0, "roughness of the reflection: 0 is a mirror, 1 is dull", least=0, most=1),
    vary=Number(0.0, "how much rougher it is in the middle of the palette, by the orbit", least=-1, most=1),
    coat=Number(0.0, "strength of a clear, smooth lacquer over it", least=0, most=1),
    metallic=Number(
        0.0, "1 for a metal, which reflects in its colour and has no other light", least=0, most=1
    ),
    clear=Number(0.0, "the part of light that goes through", least=0, most=1),
    index=Number(1.5, "how strongly that light is bent: 1.33 water, 1.5 glass, 2.4 diamond", least=1, most=4),
    absorb=Vector(
        (0.0, 0.0, 0.0), "how quickly red, green and blue fade inside, per scene unit", least=0, most=1e6
    ),
)
def material(child, x, y, z):  # type: ignore[no-untyped-def]
    """The appearance of the element in pictures. A material nested deeper takes precedence.

    A palette shows the smallest distance of the orbit to the origin (point), to the axes or to the coordinate
    planes, the smallest | |w|^2 - 1 | (sphere), its number of steps, or its last angle about the z axis
    (direction). It is run through once from 0 to 1, and again beyond; shapes without an orbit have 1.

    The field is that of the element: L = the element's.
    """
    return child(x, y, z)


material.keeps_sign(always_keeps_sign)


@material.bounds
def material_bounds(node: Node) -> Box:
    return node.children[0].bounds.box


@material.identity
def material_identity(node: Node) -> bool:
    return True


def stops(node: Node) -> tuple[float, ...]:
    """Return the sRGB colours of a material, three numbers each; several are a palette.

    Returns components in [0, 1].
    """
    colours: tuple[float, ...] = PALETTES.get(node["palette"], node["colour"])
    return colours
