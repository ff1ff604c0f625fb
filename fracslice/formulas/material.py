"""Appearance of an element. It does not change the shape: meshes are the same with and without a material."""

from __future__ import annotations

from .box import Box
from .hooks import always_keeps_sign
from .palettes import OWN, PALETTES
from .parameters import Choice, File, Number, Vector
from .registry import Node, domain_operator

TRAPS = ("point", "axes", "planes", "sphere", "steps", "direction")
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

    Parameters
    ----------
    node : Node
        A `material`.

    Returns
    -------
    tuple of float
        Components in [0, 1].
    """
    colours: tuple[float, ...] = PALETTES.get(node["palette"], node["colour"])
    return colours
